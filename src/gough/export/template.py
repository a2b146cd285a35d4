"""Templates of exported files: real C with the prefix `hexapod` and a few marked places."""

from __future__ import annotations

import re
from importlib import resources

from gough.errors import GoughError

PREFIX = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
# names of headers that the exported files include, and of a target that CMake keeps to itself
TAKEN = ("math", "string", "stdio", "stdlib", "stdint", "test", "all", "install", "clean", "help")

LICENCE = """\
MIT No Attribution (MIT-0)

Permission is hereby granted, free of charge, to any person obtaining a copy of this software
and associated documentation files (the "Software"), to deal in the Software without
restriction, including without limitation the rights to use, copy, modify, merge, publish,
distribute, sublicense, and/or sell copies of the Software, and to permit persons to whom the
Software is furnished to do so.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING
BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM,
DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE."""


def as_prefix(name: str) -> str:
    """The prefix of all C names, made from a platform's name."""
    prefix = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")[:60].lower()
    if not re.match(r"[a-z]", prefix):
        prefix = f"hexapod_{prefix}".rstrip("_")
    return f"{prefix}_hexapod" if prefix in TAKEN else prefix


def check_prefix(prefix: str) -> str:
    """The prefix itself.

    Raises:
        GoughError: it is no C name, or taken by a header or by CMake.
    """
    if not PREFIX.fullmatch(prefix):
        raise GoughError(
            f"prefix: expected a C name of letters, digits and _ that begins with a letter, "
            f"found {prefix!r}"
        )
    if prefix.lower() in TAKEN:
        raise GoughError(f"prefix: {prefix!r} is taken by a standard header or by CMake")
    return prefix


def fill(name: str, prefix: str, places: dict[str, str]) -> str:
    """A template with its prefix replaced and its marked places filled.

    Args:
        name: file in `templates`.
        prefix: stands for `hexapod` wherever that begins a name; in capitals for `HEXAPOD`.
        places: text for each `@place@`. Several lines keep the indentation and comment mark that
            stand before the place.
    """
    text = resources.files("gough.export").joinpath("templates", name).read_text("utf-8")
    text = re.sub(r"\bhexapod(?=[_.]|kins\b)", prefix, text)
    text = re.sub(r"\bHEXAPOD_", f"{prefix.upper()}_", text)

    def place(match: re.Match[str]) -> str:
        before, key = match.group(1), match.group(2)
        return "\n".join((before + line).rstrip() for line in places[key].split("\n"))

    text = re.sub(r"^([ #*/]*)@(\w+)@$", place, text, flags=re.MULTILINE)
    return re.sub(r"@(\w+)@", lambda match: places[match.group(1)], text)


def comment_text(text: str) -> str:
    """A name for C comments and strings: printable ASCII without marks that would end them."""
    return re.sub(r'[^ -~]|[*"\\?@]', "_", text)
