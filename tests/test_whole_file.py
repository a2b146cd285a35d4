"""A file appears whole under its name, or not at all."""

from __future__ import annotations

import errno
import fcntl
import os
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from gough import Platform
from gough.errors import GoughError
from gough.whole_file import replacing, write_whole


def test_the_new_file_takes_the_place_of_the_old_and_its_permissions(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("old")
    path.chmod(0o640)
    with replacing(path) as file:
        file.write(b"new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["poses.csv"]


def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path):
    before = os.umask(0o027)
    try:
        with replacing(tmp_path / "poses.csv") as file:
            file.write(b"new")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "poses.csv").stat().st_mode) == 0o640


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_after_any_exception_the_old_file_is_untouched(tmp_path, error):
    path = tmp_path / "poses.csv"
    path.write_text("old")
    with pytest.raises(error), replacing(path) as file:  # noqa: PT012
        file.write(b"new")
        raise error
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["poses.csv"]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG, errno.EIO])
def test_errors_of_the_disk_name_the_file(tmp_path, number):
    path = tmp_path / "poses.csv"
    words = "poses.csv: cannot be written: .*nothing was changed"
    with pytest.raises(GoughError, match=words), replacing(path):
        raise OSError(number, os.strerror(number))
    assert os.listdir(tmp_path) == []


def test_a_link_goes_on_pointing_at_the_file(tmp_path):
    real, link = tmp_path / "real.csv", tmp_path / "link.csv"
    real.write_text("old")
    link.symlink_to(real)
    with replacing(link) as file:
        file.write(b"new")
    assert link.is_symlink()
    assert real.read_text() == "new"


@pytest.mark.parametrize(
    ("name", "words"),
    [("", "is a folder"), ("none/poses.csv", "make it first")],
)
def test_targets_that_cannot_be_files(tmp_path, name, words):
    with pytest.raises(GoughError, match=words), replacing(tmp_path / name):
        pass
    assert os.listdir(tmp_path) == []


def test_a_machine_is_saved_through_a_link_and_into_a_pipe_which_both_stay(tmp_path):
    platform = Platform.load("reference")
    link, pipe, real = tmp_path / "link.toml", tmp_path / "pipe.toml", tmp_path / "real.toml"
    link.symlink_to(real)  # its target is yet to be made
    platform.save(link)
    assert link.is_symlink()
    assert Platform.load(real) == platform
    os.mkfifo(pipe)
    with ThreadPoolExecutor(1) as reader:
        text = reader.submit(pipe.read_text)
        platform.save(pipe)
        assert text.result(10) == real.read_text()
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert sorted(os.listdir(tmp_path)) == ["link.toml", "pipe.toml", "real.toml"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_device_is_written_directly_and_its_errors_are_named():
    write_whole(os.devnull, b"text")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    with pytest.raises(GoughError, match="/dev/full: cannot be written: the disk is full"):
        write_whole("/dev/full", b"text")


def test_a_signal_right_after_the_file_is_made_leaves_nothing(tmp_path, monkeypatch):
    def made_then_interrupted(path):
        path.write_bytes(b"")
        raise KeyboardInterrupt

    monkeypatch.setattr("gough.whole_file._open_new", made_then_interrupted)
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "poses.csv"):
        pass
    assert os.listdir(tmp_path) == []


KILLED = """
import os, signal, sys
from gough.whole_file import replacing
with replacing(sys.argv[1]) as file:
    file.write(b"half")
    file.flush()
    if sys.argv[2] == "wait":
        print("ready", flush=True)
        sys.stdin.read()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def start_writing(path, then):
    return subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path), then],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


@pytest.mark.process
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("old")
    with start_writing(path, "die") as killed:
        assert killed.wait() == -9
    assert sorted(os.listdir(tmp_path)) == ["poses.csv", f"poses.csv.{killed.pid}.partial"]
    with replacing(path) as file:
        file.write(b"new")
    assert os.listdir(tmp_path) == ["poses.csv"]
    assert path.read_text() == "new"


@pytest.mark.process
def test_what_a_running_process_writes_stays(tmp_path):
    path = tmp_path / "poses.csv"
    with start_writing(path, "wait") as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "ready\n"
        with replacing(path) as file:
            file.write(b"new")
        assert (tmp_path / f"poses.csv.{running.pid}.partial").read_text() == "half"
        running.kill()


def free_number():
    """The number of a process that is over."""
    with subprocess.Popen([sys.executable, "-c", ""]) as done:
        done.wait()
    return done.pid


def test_a_file_that_is_held_stays_although_no_process_here_has_its_number(tmp_path):
    """As from another machine or container on the same folder."""
    held = tmp_path / f"poses.csv.{free_number()}.partial"
    held.write_text("half")
    with open(held, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with replacing(tmp_path / "poses.csv"):
            pass
        assert held.exists()
    with replacing(tmp_path / "poses.csv"):
        pass
    assert not held.exists()


def test_other_names_folders_and_links_stay(tmp_path):
    number = free_number()
    names = [
        f"legs.csv.{number}.partial", f"xposes.csv.{number}.partial", "poses.csv.partial",
        f"poses_csv.{number}.partial", f"poses.csv.0{number}.partial", f"poses.csv.{number}.part",
        "poses.csv.-1.partial", "poses.csv.0.partial", "poses.csv.abc.partial",
    ]  # fmt: skip
    for name in names:
        (tmp_path / name).write_text("mine")
    (tmp_path / f"poses.csv.{number}.partial").symlink_to(tmp_path / names[0])
    os.mkdir(tmp_path / f"legs.csv.{free_number()}.partial.d")
    before = sorted(os.listdir(tmp_path))
    with replacing(tmp_path / "poses.csv"):
        pass
    assert sorted(os.listdir(tmp_path)) == sorted([*before, "poses.csv"])


def test_a_file_that_nobody_holds_stays_while_its_process_runs(tmp_path):
    """As between making a file and locking it, or where a file system knows no locks."""
    path = tmp_path / f"poses.csv.{os.getppid()}.partial"
    path.write_text("half")
    with replacing(tmp_path / "poses.csv"):
        pass
    assert path.exists()
