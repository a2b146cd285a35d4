"""The real command, in this process where it is quick and in one of its own where it matters."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from gough import cli

EXAMPLE = Path(__file__).parents[2] / "examples" / "rubin_camera_legs.csv"


class Result(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def gough(capsys: pytest.CaptureFixture[str], monkeypatch) -> Callable[..., Result]:
    """Run a command in this process, signals left alone."""
    monkeypatch.setattr(cli.signals, "listen", lambda: None)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: object) -> Result:
        with pytest.raises(SystemExit) as end:
            cli.main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return Result(int(end.value.code or 0), str(out), str(err))

    return run


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "gough.cli", *map(str, arguments)]


def process(*arguments: object, timeout: float = 120, **options) -> Result:
    """Run a command in a process of its own."""
    done = subprocess.run(
        command(*arguments),
        check=False,
        capture_output=True,
        text=True,
        timeout=timeout,
        env=environment(),
        **options,
    )
    return Result(done.returncode, done.stdout, done.stderr)


def environment() -> dict[str, str]:
    return os.environ | {"COLUMNS": "80"}


@pytest.fixture
def many(tmp_path: Path) -> Path:
    """A file of 100,000 rows: the example many times over."""
    lines = EXAMPLE.read_text().splitlines(keepends=True)
    path = tmp_path / "many.csv"
    path.write_text(lines[0] + "".join(lines[1:]) * 100)
    return path
