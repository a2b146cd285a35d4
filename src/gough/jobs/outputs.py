"""The outputs of a job that are there already: finished, of another job, or left behind."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import fs

from gough.errors import GoughError, InputError
from gough.files.formats import file_format
from gough.files.stores import Place, written
from gough.jobs.job import Job, Made, Unit

JOB, UNIT, ROWS = "gough.job", "gough.input", "gough.rows"  # keys of metadata
FOLDER = "_gough"  # what a job notes beside its outputs


class OtherJobError(GoughError):
    """An output of another job stands where this job would write."""


def output_place(job: Job, unit: Unit) -> Place:
    """The place of a unit's output.

    Raises:
        InputError: a name that leads out of the job's folder.
    """
    parts = unit.name.replace("\\", "/").split("/") if os.name == "nt" else unit.name.split("/")
    if any(part in ("", ".", "..") or "\0" in part for part in parts) or (
        os.name == "nt" and any(":" in part for part in parts)
    ):
        raise InputError(f"{unit.source}: its name leads out of {job.out}; rename it")
    place = job.out / unit.name
    if not place.store:
        folder = os.path.realpath(job.out.path)
        if not os.path.realpath(place.path).startswith(folder.rstrip(os.sep) + os.sep):
            raise InputError(f"{place}: a link leads out of {job.out}; remove it")
    return place


def finished(job: Job, unit: Unit) -> Made | None:
    """The finished output of a unit, None where it is still to make.

    Raises:
        OtherJobError: an output of another job, with what differs.
        InputError: the store does not answer.
    """
    place = output_place(job, unit)
    if place.info().type != fs.FileType.File:
        return None
    text = file_format(str(place)) == ".csv"
    found = _record(job, unit) if text else _footer(place)
    if found is None:
        return None
    differ = _differences(found, job, unit)
    if differ:
        raise OtherJobError(f"{place}: {'; '.join(differ)}")
    counts, failures = json.loads(found[ROWS])
    return Made(unit, counts, failures, skipped=True)


def _differences(found: Mapping[str, str], job: Job, unit: Unit) -> list[str]:
    """What differs between an output that is there and the one to make."""
    if not {JOB, UNIT, ROWS} <= {*found}:
        return ["was not made by a job of gough"]
    lines = []
    for old, new in ((json.loads(found[JOB]), job.facts), (json.loads(found[UNIT]), unit.facts)):
        lines += differences(old, new)
    return lines


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """A phrase for each entry that two dictionaries of facts do not share."""
    names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    return [f"{name} was {_shown(old, name)}, is {_shown(new, name)}" for name in sorted(names)]


def _shown(facts: Mapping[str, Any], name: str) -> str:
    return f"{json.dumps(facts[name]):.60}" if name in facts else "not given"


def _footer(place: Place) -> dict[str, str] | None:
    """Metadata of a Parquet file, None where it is cut off."""
    with closing(place.open()) as file:
        try:
            raw = pq.ParquetFile(file).metadata.metadata or {}
            return {key.decode(): value.decode("utf-8", "replace") for key, value in raw.items()}
        except (pa.ArrowException, OSError) as error:
            file.seek(0)
            if file.read(4) in (b"PAR1", b""):
                return None
            raise OtherJobError(f"{place}: is not a Parquet file") from error


def record_place(job: Job, unit: Unit) -> Place:
    """The place of the record that stands for the metadata of a CSV file, which has none."""
    return job.out / f"{FOLDER}/{unit.name}.json"


def write_record(job: Job, unit: Unit, facts: Mapping[str, str]) -> None:
    """Write the record of a CSV file that is finished."""
    write_json(record_place(job, unit), dict(facts))


def _record(job: Job, unit: Unit) -> dict[str, str] | None:
    """The record of a CSV file; None where the job was killed before it wrote one."""
    found = read_json(record_place(job, unit))
    if found is None and read_json(job.out / f"{FOLDER}/job.json") != job.facts:
        return {}
    return found


def write_json(place: Place, facts: Any) -> None:
    """Write a JSON file whole."""
    if not place.store:
        Path(place.path).parent.mkdir(parents=True, exist_ok=True)
    with written(place) as file:
        file.write(json.dumps(facts, indent=2, sort_keys=True).encode())


def read_json(place: Place) -> Any:
    """Read a JSON file; None where there is none, or a damaged one."""
    if place.info().type != fs.FileType.File:
        return None
    with closing(place.open()) as file:
        try:
            return json.loads(file.read())
        except ValueError:
            return None
