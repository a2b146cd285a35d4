"""Exported files, into a folder: none where one of them would be lost."""

from __future__ import annotations

from pathlib import Path

from gough.errors import GoughError
from gough.whole_file import write_whole


def write_folder(folder: str | Path, files: dict[str, str], force: bool = False) -> list[Path]:
    """Write texts by file name into a folder, which is made if it is missing.

    Args:
        force: replace files that exist.

    Returns:
        The files' paths.

    Raises:
        GoughError: a file exists and `force` is not given, or the folder cannot be made or written.
    """
    target = Path(folder)
    paths = [target / name for name in files]
    there = [path.name for path in paths if path.exists()]
    if there and not force:
        raise GoughError(f"{folder}: has {', '.join(there)} already; pass --force to replace them")
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GoughError(f"{folder}: cannot be made: {error.strerror}") from None
    for path, text in zip(paths, files.values(), strict=True):
        write_whole(path, text.encode())
    return paths


def write_file(path: str | Path, text: str, force: bool = False) -> Path:
    """Write one text to a file, in a folder that exists.

    Args:
        force: replace the file if it exists.

    Returns:
        The file's path.

    Raises:
        GoughError: the file exists and `force` is not given, or it cannot be written.
    """
    target = Path(path)
    if target.exists() and not force:
        raise GoughError(f"{path}: exists already; pass --force to replace it")
    write_whole(target, text.encode())
    return target
