"""A file appears whole under its name, or not at all."""

from __future__ import annotations

import errno
import os
import stat

import pytest

from gough.errors import GoughError
from gough.files.replace import replacing


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
    [("", "is a folder"), ("none/poses.csv", "make it first"), ("pipe.csv", "a device or a pipe")],
)
def test_targets_that_cannot_be_files(tmp_path, name, words):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(GoughError, match=words), replacing(tmp_path / name):
        pass
    assert os.listdir(tmp_path) == ["pipe.csv"]


def test_a_signal_right_after_the_file_is_made_leaves_nothing(tmp_path, monkeypatch):
    def made_then_interrupted(path):
        path.write_bytes(b"")
        raise KeyboardInterrupt

    monkeypatch.setattr("gough.files.replace._open_new", made_then_interrupted)
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "poses.csv"):
        pass
    assert os.listdir(tmp_path) == []
