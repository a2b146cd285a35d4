"""The errors that a user can cause."""

from __future__ import annotations

from collections.abc import Iterable


class GoughError(ValueError):
    """Something the caller can put right; the text says what, where and how."""


class PlatformError(GoughError):
    """A platform description that cannot be a hexapod; the text names the field."""


class InputError(GoughError):
    """A file or an argument that cannot be read as poses or legs."""


def suggestion(name: str, choices: Iterable[str]) -> str:
    """Text to follow an unknown name: the choice most like it, if there is one."""
    from difflib import get_close_matches

    near = get_close_matches(name, list(choices), n=1)
    return f"; did you mean {near[0]!r}?" if near else ";"
