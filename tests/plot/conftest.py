"""The real command, in this process."""

from __future__ import annotations

import pytest

from gough import cli


@pytest.fixture
def gough_command(capsys, monkeypatch):
    """Run a command; (exit code, standard output, standard error)."""
    monkeypatch.setattr(cli.signals, "listen", lambda: None)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            cli.main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return int(end.value.code or 0), out, err

    return run
