"""A file that appears whole under its name, or not at all."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from gough.errors import GoughError

try:
    import fcntl
except ModuleNotFoundError:  # not a Unix
    fcntl = None

BUFFER = 1 << 20  # bytes


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """A binary file to write; on leaving without an error it takes the place of `path`.

    It is written as PATH.PID.partial in the same folder, brought to the disk, given the old
    file's permissions (or the usual ones) and renamed. After any error or interruption it is
    removed, and what was at `path` is untouched. Only a process that is killed outright leaves
    the .partial file behind; the next one to write `path` removes it.

    Raises:
        GoughError: the folder or the disk does not allow it.
    """
    target = Path(os.path.realpath(path))  # a link stays a link to the new file
    check_target(path)
    temporary = target.with_name(f"{target.name}.{os.getpid()}.partial")
    file = None
    try:
        _remove_left_behind(target)
        file = _open_new(temporary)
        _hold(file.fileno())
        yield file
        file.flush()
        os.fsync(file.fileno())
        file.close()
        if target.exists():
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
        os.replace(temporary, target)
        _sync_folder(target.parent)
    except BaseException as error:
        if file is not None:
            with suppress(OSError):  # closing writes what is buffered, which can fail again
                file.close()
        with suppress(OSError):  # also where a signal came between making and naming the file
            os.unlink(temporary)
        if isinstance(error, OSError):
            raise GoughError(f"{path}: {why(error)}; nothing was changed there") from None
        raise


def check_target(path: str | Path) -> None:
    """That a file can be put at `path`, without touching it.

    Raises:
        GoughError: no such folder, or `path` is a folder or a device.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise GoughError(f"{path}: is a folder; name a file in it")
    if target.exists() and not target.is_file():
        raise GoughError(f"{path}: is a device or a pipe, not a file; use -o - and redirect it")
    if not target.parent.is_dir():
        raise GoughError(f"{path}: there is no folder {target.parent}; make it first")


def why(error: OSError) -> str:
    """What an error of the operating system means, and what to do."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "cannot be written: the disk is full; free some space or write elsewhere"
    if error.errno == errno.EFBIG:
        return "cannot be written: larger than files may be here (ulimit -f); write elsewhere"
    return f"cannot be written: {error.strerror or error}"


def _open_new(path: Path) -> BinaryIO:
    # O_EXCL: never someone else's file; 0o666 is narrowed by the umask as for any new file
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    try:
        handle = os.open(path, flags, 0o666)
    except FileExistsError:  # left by a killed process that had our process id
        os.unlink(path)
        handle = os.open(path, flags, 0o666)
    return os.fdopen(handle, "wb", buffering=BUFFER)


def _remove_left_behind(target: Path) -> None:
    """Delete what killed processes left of earlier attempts at the same file.

    Only where both are certain: no process here has the number in the name, and nobody holds
    the file, be it from another machine or container.
    """
    name = re.compile(re.escape(target.name) + r"\.([1-9][0-9]{0,9})\.partial")
    with os.scandir(target.parent) as entries:
        left = [(entry.path, found) for entry in entries if (found := name.fullmatch(entry.name))]
    for path, found in left:
        with suppress(OSError):  # not ours to open or delete, or gone already
            if not _is_running(int(found[1])) and _is_free(path):
                os.unlink(path)


def _is_running(process: int) -> bool:
    """Whether a process of this number may be running here."""
    if fcntl is None:  # os.kill would end it on Windows
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def _hold(handle: int) -> None:
    """Lock a file until it is closed, where the file system can do that."""
    if fcntl is not None:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_free(path: str) -> bool:
    """Whether nobody holds a plain file; not on file systems that cannot tell."""
    if fcntl is None or not stat.S_ISREG(os.lstat(path).st_mode):
        return False
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


def _sync_folder(folder: Path) -> None:
    """Bring the renaming itself to the disk, where the system can do that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
