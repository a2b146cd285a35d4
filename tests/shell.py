"""Commands of a page: `gough` in this process, where it need not start anew, the rest by bash."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from unittest import mock

from gough import cli

WIDTH = "80"
# printed by whichever command of a test run happens to be the first
COMPILED = re.compile(r"^\(besides [\d.]+ s to compile the solver, once\)\n", re.MULTILINE)


def run(command: str, last: int = 0) -> tuple[str, int]:
    """What a command prints on both outputs, and its exit code.

    Args:
        last: exit code of the command before it, which `echo $?` prints.
    """
    if command.strip() == "echo $?":
        return f"{last}\n", 0
    if needs_bash(command):
        return _bash(command)
    _, *arguments = _words(command)
    target = arguments[-1] if arguments[-2:-1] == [">"] else None
    return _here(arguments[:-2] if target else arguments, target)


def needs_bash(command: str) -> bool:
    """True for all but `echo $?` and a single `gough`, whose output may go to a file."""
    words = _words(command)
    plain = words[:-2] if words[-2:-1] == [">"] else words
    alone = plain[:1] == ["gough"] and not {"-", "|", "&&", ";", "<", ">", ">>"} & set(plain)
    return not alone and command.strip() != "echo $?"


def _words(command: str) -> list[str]:
    lexer = shlex.shlex(command.replace("\\\n", " "), posix=True, punctuation_chars="|&;<>")
    lexer.whitespace_split = True
    return list(lexer)


def _here(arguments: list[str], target: str | None) -> tuple[str, int]:
    out = io.StringIO()
    told = io.StringIO() if target else out
    with (
        mock.patch.object(cli.signals, "listen"),  # signals belong to the tests
        mock.patch.object(cli.signals, "ignore"),
        mock.patch.dict(os.environ, {"COLUMNS": WIDTH}),
        contextlib.redirect_stdout(told),
        contextlib.redirect_stderr(out),
    ):
        code = _exit_code(arguments)
    if target:
        Path(target).write_text(told.getvalue(), "utf-8")
    return COMPILED.sub("", out.getvalue()), code


def _exit_code(arguments: list[str]) -> int:
    try:
        cli.main(arguments)
    except SystemExit as end:
        return int(end.code or 0)
    raise AssertionError("gough returned without an exit code")


def _bash(command: str) -> tuple[str, int]:
    """By bash, with the `gough` and the `python` under test, whatever the path holds."""
    with tempfile.TemporaryDirectory() as folder:
        for name, words in {"gough": "-m gough.cli", "python": ""}.items():
            script = Path(folder, name)
            script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n', "utf-8")
            script.chmod(0o755)
        sources = str(Path(cli.__file__).parents[1])
        done = subprocess.run(
            ["bash", "-c", "set -o pipefail; " + command],
            check=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ
            | {
                "COLUMNS": WIDTH,
                "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}",
                "PYTHONPATH": os.pathsep.join(
                    filter(None, [sources, os.environ.get("PYTHONPATH")])
                ),
            },
        )
    return COMPILED.sub("", done.stdout), done.returncode


def restore_signals() -> None:
    """Give a new process, as `preexec_fn`, the signals of one that a terminal starts.

    What started the tests may ignore signals (a shell SIGINT, nohup SIGHUP, pytest-xdist SIGTERM),
    and children would inherit that.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
