"""The real command, in this process; scripts under tools/ are tested here too."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from gough import cli

TOOLS = Path(__file__).parents[2] / "tools"
if str(TOOLS) not in sys.path:
    sys.path.insert(0, str(TOOLS))


@pytest.fixture
def gough_command(capsys, monkeypatch):
    """Run a command; (exit code, standard output, standard error)."""
    monkeypatch.setattr(cli.stopping, "listen", lambda: None)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            cli.main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return int(end.value.code or 0), out, err

    return run
