"""From names of files, folders and globs to units of work."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import fs

from gough.errors import GoughError, InputError
from gough.files.formats import FilePart, file_format
from gough.files.stores import Place, reason
from gough.jobs.job import Job, Unit

LISTED = re.compile(r".*\.(parquet|csv|csv\.gz)", re.IGNORECASE)  # what a folder's files are
MAGIC = re.compile(r"[*?[]")
SMALL = 8  # bytes a row: smaller files than this have no more rows than a unit
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
    ahead = ThreadPoolExecutor(REQUESTS if found[0].place.store else 1)
    with ahead:
        parts = ahead.map(partial(_parts, job), found)
        units = [
            unit for file, cut in zip(found, parts, strict=True) for unit in _units(file, cut, job)
        ]
    names: dict[str, Unit] = {}
    for unit in units:
        other = names.setdefault(unit.name, unit)
        if other is not unit:
            raise GoughError(
                f"{other.source} and {unit.source} would both be written to {unit.name}; give them "
                "in two calls, with two folders to write to"
            )
    return units


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
                "%s: %d other files are left alone; give them as a glob to read them",
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


# ---- parts ----------------------------------------------------------------------------


def _units(file: Found, parts: list[tuple[FilePart, float]], job: Job) -> list[Unit]:
    """Units of a file, whose parts come with their shares of its bytes."""
    ending = job.ending or file_format(file.name, read=True)
    path = PurePosixPath(file.name)
    if path.suffix.lower() == ".gz":
        path = path.with_suffix("")
    stem = file.name[: len(str(path)) - len(path.suffix)] if path.suffix else str(path)
    count = len(parts)
    return [
        Unit(
            part, f"{stem}-{i:05}-of-{count:05}{ending}" if count > 1 else stem + ending,
            round(share * file.size), file.changed, file.name, (i, count),
        )
        for i, (part, share) in enumerate(parts, 1)
    ]  # fmt: skip


def _parts(job: Job, file: Found) -> list[tuple[FilePart, float]]:
    """Cut a file into parts of at most `job.shard_rows` rows, as far as its row groups allow.

    A damaged file is one part, whose unit will say so. Rows that are followed one after another
    are not cut.
    """
    whole = [(FilePart(file.place), 1.0)]
    if job.options.get("follow") is not None or file.size <= SMALL * job.shard_rows:
        return whole
    try:
        if file_format(file.place.path, read=True) == ".parquet":
            return _parquet_parts(job, file)
    except GoughError:
        pass
    return whole


def _parquet_parts(job: Job, file: Found) -> list[tuple[FilePart, float]]:
    with closing(file.place.open()) as opened:
        try:
            facts = pq.ParquetFile(opened).metadata
        except (pa.ArrowException, OSError):
            return [(FilePart(file.place), 1.0)]
    rows = [facts.row_group(i).num_rows for i in range(facts.num_row_groups)]
    cuts, held = [0], 0
    for i, count in enumerate(rows):
        if held and held + count > job.shard_rows:
            cuts.append(i)
            held = 0
        held += count
    ends = [*cuts[1:], len(rows)]
    if len(cuts) == 1:
        return [(FilePart(file.place), 1.0)]
    return [
        (FilePart(file.place, start, stop, sum(rows[:start])), sum(rows[start:stop]) / sum(rows))
        for start, stop in zip(cuts, ends, strict=True)
    ]
