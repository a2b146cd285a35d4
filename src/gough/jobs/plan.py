"""From names of files, folders and globs to units of work."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import pyarrow as pa
from pyarrow import fs

from gough.errors import GoughError, InputError
from gough.files.formats import file_format
from gough.files.stores import Place, reason
from gough.jobs.cut import Parts, parts
from gough.jobs.job import Job, Unit

LISTED = re.compile(r".*\.(parquet|csv|csv\.gz)", re.IGNORECASE)  # what a folder's files are
MAGIC = re.compile(r"[*?[]")
REQUESTS = 16  # to a store at the same time
log = logging.getLogger("gough")


@dataclass(frozen=True)
class Found:
    """A file to read.

    Attributes:
        place: the file.
        name: below the folder that all names of outputs count from.
        size, changed: bytes, and time of the last change [ns since 1970].
    """

    place: Place
    name: str
    size: int
    changed: int


def plan(job: Job, inputs: Sequence[str | Path]) -> list[Unit]:
    """Return the units of a job, sorted by name.

    Args:
        job: what to do.
        inputs: files, folders (with all files below) and globs (*, ?, [abc], ** for any folders),
            all on this machine or in one store. Of a folder the files .parquet, .csv and .csv.gz
            are taken whose names, and whose folders' names, do not begin with "_" or ".".

    Raises:
        GoughError: nothing to read, an output that is an input, two inputs with one output.
    """
    found = find(inputs, job.out)
    with ThreadPoolExecutor(REQUESTS if found[0].place.store else 1) as ahead:
        cuts = ahead.map(lambda file: parts(job, file.place, file.size), found)
        units = [unit for file in found for unit in _units(file, next(cuts), job)]
    names: dict[str, Unit] = {}
    for unit in units:
        other = names.setdefault(unit.name, unit)
        if other is not unit:
            raise GoughError(
                f"{other.source} and {unit.source} would both be written to {unit.name}; give them "
                "in two calls, with two folders to write to"
            )
    return units


def _units(file: Found, cut: Parts, job: Job) -> list[Unit]:
    """Units of a file."""
    ending = job.ending or file_format(file.name, read=True)
    stem = re.sub(r"\.gz$", "", file.name, flags=re.IGNORECASE)
    stem = stem.removesuffix(PurePosixPath(stem).suffix)
    names = [stem + ending]
    if len(cut) > 1:
        names = [f"{stem}-{i:05}-of-{len(cut):05}{ending}" for i in range(1, len(cut) + 1)]
    return [
        Unit(part, name, round(share * file.size), file.changed, file.name, (i, len(cut)))
        for i, ((part, share), name) in enumerate(zip(cut, names, strict=True), 1)
    ]


# ---- names ----------------------------------------------------------------------------


def find(inputs: Sequence[str | Path], out: Place) -> list[Found]:
    """Find the files that names, folders and globs stand for; nothing below `out`."""
    places = [Place.of(name) for name in inputs]
    if len({place.store for place in places}) != 1:
        raise GoughError("inputs: expected files of this machine or of one store, in one call")
    listed = [_listed(place) for place in places]
    base = _common([_absolute(folder) for folder, _ in listed])
    if (base, places[0].store) == (_absolute(out), out.store):
        raise GoughError(f"{out}: holds the inputs themselves; name another folder to write to")
    infos = {info.path: info for _, files in listed for info in files}
    found = []
    for path, info in sorted(infos.items()):
        place = Place(path, places[0].store)
        whole = _absolute(place)
        if place.store == out.store and whole.startswith(_absolute(out) + "/"):
            continue
        found.append(Found(place, whole[len(base) + 1 :], info.size or 0, info.mtime_ns or 0))
    if not found:
        raise InputError(
            f"{', '.join(map(str, places))}: holds no files .parquet, .csv or .csv.gz to read"
        )
    return found


def _listed(place: Place) -> tuple[Place, list[fs.FileInfo]]:
    """The folder that names count from, and the files that a name stands for."""
    info = place.info()
    if info.type == fs.FileType.File:
        return _parent(place), [info]
    if info.type == fs.FileType.Directory:
        files = list(_files_below(place))
        chosen = [one for one in files if LISTED.fullmatch(one.base_name)]
        if len(chosen) < len(files):
            log.warning(
                "%s: files of other kinds are left alone (%d); give a glob to read them",
                place, len(files) - len(chosen),
            )  # fmt: skip
        return place, chosen
    if not MAGIC.search(place.path):
        raise InputError(f"{place}: there is no such file or folder")
    folder = place
    while MAGIC.search(folder.path):
        folder = _parent(folder)
    rest = place.path[len(folder.path) :].lstrip("/") if folder.path != "." else place.path
    wanted = re.compile(_translated(rest))
    deep = "/" in rest
    files = [
        one for one in _files_below(folder, deep) if wanted.fullmatch(_below(folder, one.path))
    ]
    if not files:
        raise InputError(f"{place}: no file has such a name")
    return folder, files


def _files_below(folder: Place, deep: bool = True) -> Iterator[fs.FileInfo]:
    """Files in a folder and its folders, without those that begin with "_" or "."."""
    if folder.store:
        with_all = fs.FileSelector(folder.path, recursive=deep)
        try:
            infos: Iterable[fs.FileInfo] = folder.files.get_file_info(with_all)
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{folder}: cannot be listed: {reason(error)}") from None
    else:  # PyArrow follows links to folders, around and around
        infos = _local_files(folder.path, deep)
    for info in infos:
        names = _below(folder, info.path).split("/")
        if info.type == fs.FileType.File and not any(n.startswith(("_", ".")) for n in names):
            yield info


def _local_files(folder: str, deep: bool) -> Iterator[fs.FileInfo]:
    local = fs.LocalFileSystem()
    for root, folders, names in os.walk(folder):
        folders[:] = [n for n in folders if deep and not n.startswith(("_", "."))]
        yield from local.get_file_info([os.path.join(root, name) for name in names])


def _below(folder: Place, path: str) -> str:
    """A path below a folder, as its name there."""
    if not folder.store:
        return Path(os.path.relpath(path, folder.path)).as_posix()
    return path[len(folder.path.rstrip("/")) + 1 :]


def _parent(place: Place) -> Place:
    if not place.store:
        return Place(os.path.dirname(place.path) or ".")
    return Place(place.path.rpartition("/")[0], place.store)


def _absolute(place: Place) -> str:
    """A path that others can be compared with; a store's as it is."""
    return place.path.rstrip("/") if place.store else Path(os.path.abspath(place.path)).as_posix()


def _common(paths: list[str]) -> str:
    """The deepest folder that holds all paths."""
    shared = []
    for names in zip(*(path.split("/") for path in paths), strict=False):
        if len({*names}) > 1:
            break
        shared.append(names[0])
    return "/".join(shared)


def _translated(pattern: str) -> str:
    """A regular expression for a glob; * and ? stand for no /."""
    out, i = "", 0
    while i < len(pattern):
        if pattern.startswith("**/", i):
            out, i = out + "(?:.*/)?", i + 3
            continue
        end = pattern.find("]", i + 2)
        if pattern[i] == "[" and end > 0:
            inner = pattern[i + 1 : end].replace("\\", "\\\\").replace("[", "\\[")
            inner = "^" + inner[1:] if inner[0] == "!" else inner.replace("^", "\\^")
            out, i = out + f"[{inner}]", end + 1
            continue
        out += {"*": "[^/]*", "?": "[^/]"}.get(pattern[i], re.escape(pattern[i]))
        i += 1
    return out
