"""A command run in this process, with its exit code and outputs checked."""

from __future__ import annotations

import contextlib
import io
import os
import re
from pathlib import Path
from unittest import mock

from gough import cli

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def call(arguments: list[str], folder: Path) -> str:
    """Run a command in a folder; return what came of it.

    Raises:
        Exception: what escaped from the command.
    """
    out, err = _Output(), _Output()
    code = 0
    with (
        mock.patch.object(cli.signals, "listen"),
        mock.patch.object(cli.signals, "ignore"),
        mock.patch("sys.stdin", io.TextIOWrapper(io.BytesIO(b""))),
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.dict(os.environ, COLUMNS="80"),
    ):
        try:
            cli.main(arguments)
        except SystemExit as end:
            code = int(end.code or 0)
    text, complaint = out.text, err.text
    if "Traceback" in complaint:
        return f"WRONG: a traceback: {complaint[-300:]!r}"
    if code not in (0, 1, 2):
        return f"WRONG: exit code {code}"
    if code == 2 and not complaint.strip():
        return "WRONG: exit code 2 without a word"
    # tyro repeats options as they were given
    if not CONTROL.search(" ".join(arguments)) and (found := CONTROL.search(text + complaint)):
        return f"WRONG: control character {found[0]!r} printed"
    return "refused" if code == 2 else "accepted"


class _Output(io.TextIOWrapper):
    """Text written, and bytes written to its buffer."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), encoding="utf-8", write_through=True)

    @property
    def text(self) -> str:
        self.flush()
        return self.buffer.getvalue().decode("utf-8", "replace")  # pyright: ignore[reportAttributeAccessIssue]
