"""Full disks, signals, broken pipes and big files: the real command in its own process."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import shell

from .conftest import EXAMPLE, command, environment, process

pytestmark = pytest.mark.process

SLOW = ("--block-rows", 200)  # many blocks: time to interrupt


def start(*arguments: object, **options) -> subprocess.Popen:
    return subprocess.Popen(
        command(*arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment(), preexec_fn=shell.restore_signals, **options,
    )  # fmt: skip


def unfinished(folder: Path) -> list[str]:
    return [name for name in os.listdir(folder) if name.endswith(".partial")]


def wait_for_unfinished(folder: Path, running: subprocess.Popen) -> None:
    while not unfinished(folder):
        assert running.poll() is None, running.communicate()
        time.sleep(0.005)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_file_too_large_is_one_line_and_the_old_file_stays(many, tmp_path, ending):
    out = tmp_path / f"poses{ending}"
    out.write_text("old")

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))

    result = process("inverse", *poses(many), "-o", out, preexec_fn=limit)
    assert result.code == 2
    assert result.err == (
        f"gough inverse: error: {out}: cannot be written: larger than files may be here "
        "(ulimit -f); write elsewhere; nothing was changed there\n"
    )
    assert out.read_text() == "old"
    assert unfinished(tmp_path) == []


def poses(path: Path) -> tuple[Path, str, str]:
    """`path` as poses: any six columns of numbers will do to fill a disk."""
    text = path.read_text()
    header, rest = text.split("\n", 1)
    assert header.count(",") == 6
    path.write_text("time,x,y,z,rx,ry,rz\n" + rest)
    return path, "-p", "rubin_camera"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["platforms"],
        ["platforms", "reference"],
        ["inverse", "--help"],
        ["solve", EXAMPLE, "-p", "rubin_camera", "-o", "-"],
    ],
)
def test_a_full_disk_behind_standard_output(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            command(*arguments), check=False, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "disk is full" in done.stderr or "No space left" in done.stderr


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("solve - -p rubin_camera >&-", "Bad file descriptor"),
        ("solve - -p rubin_camera -o - >&-", "standard output: cannot be written"),
        ("solve - -p rubin_camera <&-", "standard input: is empty"),
    ],
)
def test_closed_streams(command, words):
    with EXAMPLE.open() as legs:
        done = subprocess.run(
            f"{sys.executable} -m gough.cli {command}", shell=True, check=False, text=True,
            stdin=legs, stderr=subprocess.PIPE,
        )  # fmt: skip
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr


def test_a_reader_that_leaves_is_met_with_silence(many):
    running = start("inverse", *poses(many), "-o", "-", *SLOW)
    assert running.stdout is not None
    assert running.stderr is not None
    assert running.stdout.readline() == "leg_1,leg_2,leg_3,leg_4,leg_5,leg_6,status\n"
    running.stdout.close()
    assert running.wait(60) == 141
    assert running.stderr.read() == ""
    running.stderr.close()


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [
        (signal.SIGINT, 130, "interrupted"),
        (signal.SIGTERM, 143, "terminated"),
        (signal.SIGHUP, 129, "terminated"),
    ],
)
@pytest.mark.parametrize("ending", [".csv", ".parquet"])
@pytest.mark.parametrize("wait", [0.0, 0.3])
def test_a_signal_ends_the_run_and_the_old_file_stays(
    many, tmp_path, number, code, word, ending, wait
):
    out = tmp_path / f"poses{ending}"
    out.write_text("old")
    running = start("inverse", *poses(many), "-o", out, *SLOW)
    wait_for_unfinished(tmp_path, running)
    time.sleep(wait)
    running.send_signal(number)
    text, err = running.communicate(timeout=60)
    assert (running.returncode, text) == (code, "")
    assert err == f"gough inverse: {word}; no file was changed\n"
    assert out.read_text() == "old"
    assert unfinished(tmp_path) == []


def test_ctrl_c_ends_solve_too(many, tmp_path):
    running = start("solve", many, "-p", "rubin_camera", "-o", tmp_path / "poses.csv", *SLOW)
    wait_for_unfinished(tmp_path, running)
    time.sleep(0.4)
    running.send_signal(signal.SIGINT)
    assert running.communicate(timeout=60) == (
        "",
        "gough solve: interrupted; no file was changed\n",
    )
    assert running.returncode == 130
    assert os.listdir(tmp_path) == ["many.csv"]


def test_impatient_ctrl_c_leaves_nothing_behind(many, tmp_path):
    running = start("inverse", *poses(many), "-o", tmp_path / "poses.parquet", *SLOW)
    wait_for_unfinished(tmp_path, running)
    for _ in range(5):
        running.send_signal(signal.SIGINT)
        time.sleep(0.002)
    running.communicate(timeout=60)
    assert running.returncode == 130
    assert unfinished(tmp_path) == []


def test_kill_leaves_the_old_file(many, tmp_path):
    out = tmp_path / "poses.csv"
    out.write_text("old")
    running = start("inverse", *poses(many), "-o", out, *SLOW)
    wait_for_unfinished(tmp_path, running)
    running.kill()
    running.communicate()
    assert out.read_text() == "old"
    assert unfinished(tmp_path) == [f"poses.csv.{running.pid}.partial"]


def test_an_ignored_ctrl_c_stays_ignored(many, tmp_path):
    """nohup and background jobs of a shell."""

    def ignore() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    running = subprocess.Popen(
        command("inverse", *poses(many), "-o", tmp_path / "p.csv"), preexec_fn=ignore,
        stdout=subprocess.DEVNULL,
    )  # fmt: skip
    wait_for_unfinished(tmp_path, running)
    running.send_signal(signal.SIGINT)
    assert running.wait(60) in (0, 1)


# the peak of this process alone; getrusage would count the process that started it
MEASURED = """
import sys, gough.cli, gough.files.parquet
gough.files.parquet.ROW_GROUP = 10_000  # rows held before they are written
try: gough.cli.main(sys.argv[2:])
finally:
    with open("/proc/self/status") as status, open(sys.argv[1], "w") as out:
        out.write(next(line.split()[1] for line in status if line.startswith("VmHWM")))
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="needs /proc")
@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_memory_does_not_grow_with_the_file(many, tmp_path, ending):
    """40,000 and 400,000 rows: the same blocks, so nearly the same peak."""
    header, *rows = poses(many)[0].read_text().splitlines(keepends=True)
    peaks = []
    for count in (40_000, 400_000):
        path, out, peak = (tmp_path / name for name in ("many.csv", f"out{ending}", "peak"))
        path.write_text(header + "".join(rows[: count // 10]) * 10)
        arguments = ("inverse", path, "-p", "rubin_camera", "-o", out, "--block-rows", 10_000)
        done = subprocess.run(
            [sys.executable, "-c", MEASURED, peak, *map(str, arguments)],
            check=False, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        assert done.returncode in (0, 1)
        peaks.append(int(peak.read_text()) / 1024)  # [MB]
    assert peaks[1] - peaks[0] < 0.5e-6 * path.stat().st_size, peaks


@pytest.mark.parametrize(
    ("module", "arguments", "extra"),
    [
        ("torch", ["train", "-p", "reference"], "learn"),
        ("matplotlib", ["modes", "-p", "reference", "--plot", "modes.png"], "plot"),
    ],
)
def test_what_an_extra_brings_is_asked_for(module, arguments, extra, tmp_path):
    program = (
        f"import sys; sys.modules[{module!r}] = None; from gough.cli import main; main({arguments})"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert f"needs {module}, which is not installed" in done.stderr
    assert f"pip install 'gough[{extra}]'" in done.stderr
