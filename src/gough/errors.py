"""The errors that a user can cause."""


class GoughError(ValueError):
    """Something the caller can put right; the text says what, where and how."""


class PlatformError(GoughError):
    """A platform description that cannot be a hexapod; the text names the field."""


class InputError(GoughError):
    """A file or an argument that cannot be read as poses or legs."""
