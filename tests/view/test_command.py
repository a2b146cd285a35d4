"""gough view on the command line: one line for each mistake, and a quiet end."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
import shell

from gough import GoughError, cli
from gough.view import server

EXAMPLE = Path(__file__).parents[2] / "examples" / "rubin_camera_legs.csv"


@pytest.fixture
def view(capsys: pytest.CaptureFixture[str], monkeypatch):
    """Run `gough view` in this process; exit code, output, errors."""
    monkeypatch.setattr(cli.signals, "listen", lambda: None)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            cli.main(["view", *map(str, arguments)])
        out, err = capsys.readouterr()
        return int(end.value.code or 0), str(out), str(err)

    return run


def test_help_fits_a_narrow_terminal(view):
    code, out, _ = view("--help")
    assert code == 0
    assert "--html" in out
    assert max(map(len, out.splitlines())) <= 80


def test_a_page_is_written_whole_and_needs_nothing_else(view, tmp_path):
    path = tmp_path / "page.html"
    code, out, err = view("-p", "rubin_camera", "--html", path)
    assert (code, err) == (0, "")
    assert out.startswith(f"{path}: ")
    text = path.read_text("utf-8")
    assert "<title>rubin_camera · gough</title>" in text
    assert not re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=[\"']https?:", text)
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]


def test_rows_without_a_pose_are_counted(view, tmp_path):
    rows = tmp_path / "poses.csv"
    rows.write_text("x,y,z,rx,ry,rz\n0,0,0.177,0,0,0\n0,0,9,0,0,0\n")
    code, out, _ = view(rows, "-p", "reachy_mini", "--html", tmp_path / "page.html")
    assert code == 1
    assert out.startswith("poses.csv: 2 rows of poses; 1 of the shown rows have no pose.")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing.csv", "-p", "reference"], "nothing.csv: cannot be read"),
        (["legs.doc", "-p", "reference"], "legs.doc: the name must end in .csv or .parquet"),
        (["-p", "refrence"], "no platform is called 'refrence'"),
        ([EXAMPLE, "-p", "rubin_camera", "--rows", "0"], "--rows 0: expected 2 or more"),
        ([EXAMPLE, "-p", "rubin_camera", "--time", "when"], "no column 'when'"),
        (["-p", "reference", "--html", "no/such/folder.html"], "there is no folder"),
        (["-p", "reference", "--port", "70000"], "--port 70000: expected a number from 0 to"),
        (["-p", "reference", "--host", "no host"], "--host no host: "),
    ],
)
def test_a_mistake_is_one_line(view, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, _, err = view(*arguments)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_without_viser_it_says_how_to_get_it(view, monkeypatch):
    monkeypatch.delitem(sys.modules, "gough.view.panel", raising=False)
    monkeypatch.delitem(sys.modules, "gough.view.viewer", raising=False)
    monkeypatch.delitem(sys.modules, "gough.view.export", raising=False)
    monkeypatch.setitem(sys.modules, "viser", None)
    code, _, err = view("-p", "reference")
    assert code == 2
    assert "pip install 'gough[view]'" in err


def test_a_port_that_is_taken_is_not_shared():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(GoughError, match=r"already in use at 127\.0\.0\.1; pass another"):
            server.open_server("localhost", other.getsockname()[1], "test")


def test_it_takes_the_next_port_that_is_free(monkeypatch):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        first = other.getsockname()[1]
        monkeypatch.setattr(server, "FIRST_PORT", first)
        found = server.open_server("localhost", None, "test")
        try:
            assert first < found.get_port() < first + server.PORTS_TRIED
        finally:
            server.close_server(found)


@pytest.mark.process
def test_ctrl_c_ends_it_quietly():
    command = [sys.executable, "-m", "gough.cli", "view", "-p", "reference", "--port", "0"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=shell.restore_signals,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        where = process.stdout.readline()
        tunnel = process.stdout.readline()
        url = re.search(r"http://localhost:\d+", where)
        assert url, where
        assert re.match(r"from another computer: ssh -N -L (\d+):localhost:\1 ", tunnel)
        with urllib.request.urlopen(url[0]) as page:
            assert b"<title>Viser</title>" in page.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert process.returncode == 130
    assert err == "gough view: interrupted; no file was changed\n"
    assert "viser" not in out
    assert "Traceback" not in out + err
