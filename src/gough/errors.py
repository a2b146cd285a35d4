"""The errors that a user can cause."""

from __future__ import annotations

import re
from collections.abc import Iterable

# control characters, line separators, marks that change the direction of text, lone surrogates
CONTROL = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


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


def printable(text: str) -> str:
    """Text with escapes instead of control characters, which files may have put into it."""
    return CONTROL.sub(lambda found: ascii(found[0])[1:-1], text)
