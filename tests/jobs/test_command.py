"""`gough solve`, `inverse` and `modes` on folders: what is printed, exit codes, kills."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.dataset as ds
import pytest
import shell

from .conftest import ROWS, write
from .kills import kill_and_go_on


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_folder_is_solved_and_goes_on(logs):
    text, code = shell.run("gough solve logs -p reference -o poses/")
    assert code == 0, text
    assert "files: 6 made, 0 finished before, 0 failed" in text
    assert f"converged   {6 * ROWS}  100.0 %" in text
    assert max(map(len, text.splitlines())) <= 80
    text, code = shell.run("gough solve logs -p reference -o poses")
    assert (code, "0 made, 6 finished before" in text) == (0, True), text
    text, code = shell.run("gough inverse poses/ -p reference -o legs/ --json")
    start = text.index("{")
    assert json.loads(text[start:])["statuses"]["ok"]["rows"] == 6 * ROWS
    text, code = shell.run("gough solve logs -p reference -o poses --tolerance 1e-9")
    assert (code, "pass --force" in text) == (2, True), text


def test_exit_codes_are_those_of_one_file(logs, readings):
    rows = readings[:4].copy()
    rows[2, 0] = np.nan
    write(logs / "hole.csv", rows)
    text, code = shell.run("gough solve logs/hole.csv logs/a.parquet -p reference -o poses")
    assert code == 1, text
    assert "line 4: leg_1" in text
    _, code = shell.run("gough solve logs/hole.csv logs/a.parquet -p reference -o poses")
    assert code == 1  # also when a run before solved it
    _, code = shell.run("gough solve logs/h*.csv -p reference -o poses --allow-failures")
    assert code == 0
    (logs / "bad.parquet").write_bytes(b"nothing")
    text, code = shell.run("gough solve logs -p reference -o poses/")
    assert code == 2
    assert "bad.parquet: is not a Parquet file" in text
    assert "1 failed" in text


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("solve logs -p reference", "written to a folder"),
        ("solve logs -p reference -o -", "written to a folder"),
        ("solve logs -p reference -o all.csv", "all.csv is one file"),
        ("solve nowhere/ -p reference -o poses", "there is no such file"),
        ("solve logs -p reference -o logs", "holds the inputs themselves"),
        ("solve logs -p reference -o logs/notes.txt", "is a file"),
        ("solve logs -p reference -o poses --shard-rows 0", "shard_rows"),
        ("solve logs -p reference -o poses --address auto", "--engine ray"),
        ("modes logs -p reference -o poses --plot all.png", "--plot"),
        ("solve s3://key:secret@bucket/logs -p reference -o poses", "holds credentials"),
        ("solve logs -p reference -o s3://b/x/?sas_token=secret", "holds credentials"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(logs, command, words):
    text, code = shell.run(f"gough {command}")
    assert (code, words in text, "secret" in text) == (2, True, False), text
    assert text.count("\n") == 1 + ("left alone" in text)


@pytest.mark.process
def test_ctrl_c_ends_the_workers_and_leaves_no_unfinished_file(tmp_path, readings):
    write(tmp_path / "big.parquet", np.tile(readings, (800, 1)), group=20_000)
    arguments = ("solve", "big.parquet", "-p", "reference", "-o", "poses/", "--shard-rows", "20000")
    run = subprocess.Popen(
        [sys.executable, "-m", "gough.cli", *arguments, "--workers", "2", "--seed", "home"],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=shell.restore_signals,
    )  # fmt: skip
    until = time.monotonic() + 60
    while not [*tmp_path.glob("poses/big-*.parquet")] and time.monotonic() < until:
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGINT)  # as a terminal does: to all processes
    _, errors = run.communicate(timeout=60)
    assert run.returncode == 130
    assert errors == (
        "gough solve: interrupted; files finished are in poses/; the same command goes on\n"
    )
    assert not [*tmp_path.glob("poses/*.partial")]
    assert is_gone(run.pid)  # with its workers, and what Python starts to watch them


def is_gone(group: int) -> bool:
    """Return whether all processes of a group end within some seconds."""
    until = time.monotonic() + 20
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.process
def test_a_job_killed_at_random_moments_has_every_row_once(tmp_path, readings):
    rows = np.tile(readings, (400, 1))
    write(tmp_path / "big.parquet", rows, group=8_000)
    arguments = ("solve", "big.parquet", "-p", "reference", "-o", "poses/", "--shard-rows", "8000")
    options = ("--seed", "home", "--keep", "id", "--workers", "2")
    facts = kill_and_go_on([*arguments, *options], tmp_path / "poses", kills=2, longest=1.5)
    assert facts["killed"]
    assert (facts["made_again"], facts["partial"], facts["code"]) == (0, 0, 0)
    table = ds.dataset(tmp_path / "poses", format="parquet", exclude_invalid_files=True).to_table()
    assert np.array_equal(np.sort(table["id"].to_numpy()), np.arange(len(rows)))
