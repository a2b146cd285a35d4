"""Write a file that appears whole under its name, or not at all."""

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


def write_whole(path: str | Path, content: bytes) -> None:
    """Write `content` as the file `path`; see `replacing`.

    Raises:
        GoughError: the folder or the disk does not allow it.
    """
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: str | Path, *, tidy: bool = True) -> Iterator[BinaryIO]:
    """Open a binary file that replaces `path` when the block ends without an error.

    It is written as PATH.PID.partial in the same folder, flushed to the disk, given the old
    file's permissions (or the usual ones) and renamed. After any error or interruption it is
    removed, and the file at `path` is unchanged. Only a process that is killed outright leaves
    the .partial file behind; the next one to write `path` removes it. A symbolic link stays: its
    target is replaced. A pipe or a device, which cannot be replaced, is written directly.

    Args:
        path: the file.
        tidy: remove what killed processes left of it, for which the whole folder is listed; see
            `remove_left_behind` for many files.

    Raises:
        GoughError: the folder or the disk does not allow it.

    Example:
        >>> with replacing("poses.csv") as file:
        ...     file.write(b"x,y,z")
    """
    check_target(path)
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        with _written_directly(path) as file:
            yield file
        return
    temporary = target.with_name(f"{target.name}.{os.getpid()}.partial")
    file = None
    try:
        if tidy:
            remove_left_behind(target.parent, re.escape(target.name))
        file = _open_new(temporary)
        _lock(file.fileno())
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
            raise GoughError(f"{path}: {explain(error)}; nothing was changed there") from None
        raise


def check_target(path: str | Path) -> None:
    """Raise if no file can be written at `path`; nothing is touched.

    Raises:
        GoughError: there is no such folder, or `path` is a folder.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise GoughError(f"{path}: is a folder; name a file in it")
    if not target.parent.is_dir():
        raise GoughError(
            f"{path}: cannot be written: there is no folder {target.parent}; make it first"
        )


def explain(error: OSError) -> str:
    """Return what an error of the operating system means for a file to write, and the cure."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "cannot be written: the disk is full; free some space or write elsewhere"
    if error.errno == errno.EFBIG:
        return "cannot be written: larger than files may be here (ulimit -f); write elsewhere"
    return f"cannot be written: {error.strerror or error}"


@contextmanager
def _written_directly(path: str | Path) -> Iterator[BinaryIO]:
    """Open a pipe or a device."""
    try:
        with open(path, "wb", buffering=BUFFER) as file:
            yield file
    except BrokenPipeError:
        raise
    except OSError as error:
        raise GoughError(f"{path}: {explain(error)}") from None


def _open_new(path: Path) -> BinaryIO:
    # O_EXCL: never someone else's file; 0o666 is narrowed by the umask as for any new file
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    try:
        handle = os.open(path, flags, 0o666)
    except FileExistsError:  # left by a killed process that had our process id
        os.unlink(path)
        handle = os.open(path, flags, 0o666)
    return os.fdopen(handle, "wb", buffering=BUFFER)


def remove_left_behind(folder: str | Path, names: str = ".+") -> None:
    """Delete the .partial files in a folder that killed processes left.

    A file is deleted only where no process here has the number in its name, and nobody, not even
    on another machine or in another container, has it locked.

    Args:
        folder: the folder.
        names: pattern of the names of the files that they were to become.
    """
    name = re.compile(rf"(?:{names})\.([1-9][0-9]{{0,9}})\.partial", re.DOTALL)
    with os.scandir(folder) as entries:
        left = [(entry.path, found) for entry in entries if (found := name.fullmatch(entry.name))]
    for path, found in left:
        with suppress(OSError):  # no right to open or delete it, or gone already
            if not _is_running(int(found[1])) and _is_unlocked(path):
                os.unlink(path)


def _is_running(process: int) -> bool:
    """Return whether a process of this number may be running here."""
    if fcntl is None:  # os.kill would end it on Windows
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


def _lock(handle: int) -> None:
    """Lock a file until it is closed, where the file system has locks."""
    if fcntl is not None:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_unlocked(path: str) -> bool:
    """Return whether a plain file is free to be locked; False where there are no locks."""
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
    """Flush the renaming itself to the disk, where the system can do that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
