"""Jobs over folders: what is made, what is left, what goes on."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from unittest import mock

import numpy as np
import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gough
from gough.errors import GoughError
from gough.files import Reading, solve_file
from gough.files.stores import Place
from gough.jobs import Job, Made, Summary, Unit, finished, make, plan, run_job
from gough.jobs.cut import line_ends
from gough.jobs.outputs import output_place
from gough.jobs.work import compile_for

from .conftest import ROWS, write

KEEP = Reading(keep=("id",))


def solved(platform: gough.Platform, out: Path, logs: Path) -> Summary:
    return run_job(Job.of("solve", platform, out, reading=KEEP, seed="home"), [logs])


def outputs(folder: Path) -> dict[str, bytes]:
    found = [p for p in folder.rglob("*") if p.is_file() and "_gough" not in p.parts]
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in found}


def test_each_input_has_an_output_of_the_same_name_and_the_rows_of_solve_file(
    tmp_path, platform, logs
):
    summary = solved(platform, tmp_path / "poses", logs)
    names = {"a", "b", "day=1/c", "day=2/c", "deep/er/d"}
    assert {*outputs(tmp_path / "poses")} == {f"{n}.parquet" for n in names} | {"text.csv"}
    assert (summary.made, summary.rows, summary.unusable) == (6, 6 * ROWS, 0)
    for name in names:
        solve_file(
            logs / f"{name}.parquet", tmp_path / "one.parquet", platform, reading=KEEP, seed="home"
        )
        one = pq.read_table(tmp_path / "one.parquet").replace_schema_metadata()
        assert pq.ParquetFile(tmp_path / f"poses/{name}.parquet").read().equals(one)
    solve_file(logs / "text.csv", tmp_path / "one.csv", platform, reading=KEEP, seed="home")
    assert (tmp_path / "poses/text.csv").read_bytes() == (tmp_path / "one.csv").read_bytes()
    stated = json.loads((tmp_path / "poses/_gough/report.json").read_text())
    assert stated["outputs"] == {"total": 6, "made": 6, "skipped": 0, "failed": 0}


def test_partitions_are_those_of_the_input(tmp_path, platform, logs):
    run_job(
        Job.of("solve", platform, tmp_path / "poses", ending=".parquet"), [logs / "day=*/*.parquet"]
    )
    table = ds.dataset(tmp_path / "poses", partitioning="hive", format="parquet").to_table()
    assert np.bincount(table["day"].to_numpy()).tolist() == [0, ROWS, ROWS]


@pytest.mark.parametrize("ending", ["parquet", "csv"])
def test_parts_of_a_large_file_are_the_whole(tmp_path, platform, readings, ending):
    write(tmp_path / f"big.{ending}", readings, group=30)
    out = tmp_path / "poses"
    summary = run_job(
        Job.of("solve", platform, out, reading=KEEP, shard_rows=70), [tmp_path / f"big.{ending}"]
    )
    found = sorted(outputs(out))
    count = 7 if ending == "parquet" else 6  # two groups of 30 rows, or 70 lines
    assert found == [f"big-{i:05}-of-{count:05}.{ending}" for i in range(1, count + 1)]
    assert summary.rows == len(readings)
    solve_file(tmp_path / f"big.{ending}", tmp_path / f"one.{ending}", platform, reading=KEEP)
    read = ds.dataset([out / name for name in found], format=ending).to_table()
    assert read.equals(ds.dataset(tmp_path / f"one.{ending}", format=ending).to_table())


def test_rows_of_parts_are_named_as_in_the_whole_file(tmp_path, platform, readings):
    rows = readings.copy()
    rows[350, 2] = np.nan
    for ending, place in (("parquet", "row 351"), ("csv", "line 352")):
        write(tmp_path / f"big.{ending}", rows, group=30)
        job = Job.of("solve", platform, tmp_path / "poses", shard_rows=70)
        made = [make(job, unit) for unit in plan(job, [tmp_path / f"big.{ending}"])]
        notes = [note for one in made for note in one.notes]
        assert [note for note in notes if note.startswith(f"big.{ending}: {place}: leg_3")]
        assert sum(one.failures for one in made) == 1


def test_a_job_goes_on_and_makes_nothing_twice(tmp_path, platform, logs):
    out = tmp_path / "poses"
    solved(platform, out, logs)
    before = outputs(out)
    stamps = {name: (out / name).stat().st_mtime_ns for name in before}
    (out / "a.parquet").unlink()
    (out / "text.csv").unlink()
    (out / "_gough/day=1").mkdir()  # a CSV without record was cut off before it was noted
    left = out / "b.parquet.999999999.partial"
    left.write_bytes(b"PAR1")
    summary = solved(platform, out, logs)
    assert (summary.made, summary.skipped, summary.rows) == (2, 4, 6 * ROWS)
    assert not left.exists()
    assert outputs(out) == before
    same = {n for n, t in stamps.items() if (out / n).stat().st_mtime_ns == t}
    assert same == {*before} - {"a.parquet", "text.csv"}


def test_a_csv_whose_record_was_not_written_any_more_is_made_again(tmp_path, platform, logs):
    out = tmp_path / "poses"
    solved(platform, out, logs)
    (out / "_gough/text.csv.json").unlink()
    assert solved(platform, out, logs).made == 1
    (out / "a.parquet").write_bytes((out / "a.parquet").read_bytes()[:-9])
    assert solved(platform, out, logs).made == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tolerance": 1e-9}, "tolerance was not given, is 1e-09"),
        ({"seed": "polynomial-3"}, 'seed was "home", is "polynomial-3"'),
        ({"platform": "tilted"}, "platform was"),
        ({"reading": Reading()}, "keep was"),
    ],
)
def test_outputs_of_another_job_are_never_mixed_in(tmp_path, platform, logs, change, words):
    out = tmp_path / "poses"
    solved(platform, out, logs)
    before = outputs(out)
    machine = platform
    if "platform" in change:
        change, machine = {}, platform.with_workspace(40, 20)
    settings = {"seed": "home", "reading": KEEP} | change
    job = Job.of("solve", machine, out, **settings)
    with pytest.raises(GoughError, match="another job") as error:
        run_job(job, [logs])
    assert words in str(error.value)
    assert outputs(out) == before
    assert run_job(job, [logs], force=True).made == 6
    assert run_job(job, [logs]).skipped == 6


def test_another_input_or_version_is_never_mixed_in(
    tmp_path, platform, logs, readings, monkeypatch
):
    out = tmp_path / "poses"
    solved(platform, out, logs)
    before = outputs(out)
    write(logs / "a.parquet", readings[300:340])
    with pytest.raises(GoughError, match=r"a\.parquet: changed was"):
        solved(platform, out, logs)
    monkeypatch.setattr(gough, "__version__", "99")
    with pytest.raises(GoughError, match=r'gough was ".*", is "99"'):
        solved(platform, out, logs)
    assert outputs(out) == before


def test_a_file_of_the_user_is_not_replaced(tmp_path, platform, logs):
    out = tmp_path / "poses"
    for name in ("a.parquet", "text.csv"):
        write(out / name, np.ones((2, 6)))
        old = (out / name).read_bytes()
        with pytest.raises(GoughError, match="was not made by a job"):
            solved(platform, out, logs)
        assert (out / name).read_bytes() == old
        (out / name).unlink()


def test_one_bad_file_does_not_end_the_job(tmp_path, platform, logs):
    (logs / "bad.parquet").write_bytes(b"PAR1 and no more")
    (logs / "bad.csv").write_text("leg_1\n1\n", "utf-8")
    out = tmp_path / "poses"
    summary = solved(platform, out, logs)
    assert summary.made == 6
    assert {name for name, _ in summary.failed} == {"bad.parquet", "bad.csv"}
    assert "bad.parquet" not in outputs(out)
    job = Job.of("solve", platform, tmp_path / "other")
    with pytest.raises(GoughError, match=r"bad\.csv"):
        run_job(job, [logs / "bad.csv", logs / "text.csv"], stop_at_first_error=True)


def test_inverse_and_modes_are_jobs_too(tmp_path, platform, logs):
    solved(platform, tmp_path / "poses", logs)
    back = run_job(Job.of("inverse", platform, tmp_path / "legs"), [tmp_path / "poses"])
    assert (back.made, back.counts) == (6, {"ok": 6 * ROWS})
    modes = run_job(
        Job.of("modes", platform, tmp_path / "modes", shard_rows=10), [logs / "a.parquet"]
    )
    assert modes.counts == {"complete": ROWS}


def test_names_cannot_leave_the_folder(tmp_path, platform, logs):
    job = Job.of("solve", platform, tmp_path / "poses")
    unit = plan(job, [logs / "a.parquet"])[0]
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "poses").mkdir()
    (tmp_path / "poses/linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "poses/file.parquet").symlink_to(tmp_path / "elsewhere/file.parquet")
    for name in (
        "../out.parquet", "a/../../out.parquet", "/etc/out.parquet", "a//out.parquet",
        "./a.parquet", "linked/out.parquet", "file.parquet", "nul\0.parquet", "",
    ):  # fmt: skip
        made = make(job, Unit(unit.source, name, 1, 1, name))
        assert made.error, name
        with pytest.raises(GoughError):
            finished(job, Unit(unit.source, name, 1, 1, name))
        if "link" not in name and name != "file.parquet":
            stored = dataclasses.replace(job, out=Place("bucket/poses", "s3://bucket/"))
            with pytest.raises(GoughError, match="leads out of"):
                output_place(stored, Unit(unit.source, name, 1, 1, name))
    assert not [*(tmp_path / "elsewhere").iterdir()]
    assert {p.name for p in tmp_path.iterdir()} == {"elsewhere", "logs", "poses"}


def test_links_do_not_lead_a_listing_around(tmp_path, platform, logs):
    (logs / "deep/loop").symlink_to(logs)
    (logs / "dead.parquet").symlink_to(tmp_path / "nothing")
    job = Job.of("solve", platform, tmp_path / "poses")
    assert len(plan(job, [logs])) == 6


def test_what_is_given_names_what_is_written(tmp_path, platform, logs):
    job = Job.of("solve", platform, tmp_path / "poses")

    def names(*inputs: str) -> list[str]:
        return [unit.name for unit in plan(job, [logs / name for name in inputs])]

    assert names("*.parquet") == ["a.parquet", "b.parquet"]
    assert names("**/c.parquet") == ["day=1/c.parquet", "day=2/c.parquet"]
    assert names("[!a].parquet", "d*/*/d.parquet") == ["b.parquet", "deep/er/d.parquet"]
    assert names("a.parquet", "day=1") == ["a.parquet", "day=1/c.parquet"]
    assert names("day=1/c.parquet", "day=2/c.parquet") == ["day=1/c.parquet", "day=2/c.parquet"]
    with pytest.raises(GoughError, match="no such file"):
        names("z.parquet")
    with pytest.raises(GoughError, match="no file has such a name"):
        names("z*.parquet")
    with pytest.raises(GoughError, match="name another folder"):
        plan(Job.of("solve", platform, logs), [logs])
    write(logs / "a.csv", np.ones((2, 6)))
    with pytest.raises(GoughError, match="would both be written"):
        plan(Job.of("solve", platform, tmp_path / "p", ending=".parquet"), [logs])


def test_outputs_below_the_inputs_are_not_inputs(tmp_path, platform, logs):
    assert solved(platform, logs / "poses", logs).made == 6
    assert solved(platform, logs / "poses", logs).skipped == 6


@pytest.mark.process
def test_processes_write_the_same_bytes_and_one_that_dies_loses_nothing(tmp_path, platform, logs):
    usual = {"tolerance": 1e-12, "max_iterations": 60}  # which the command states
    job = Job.of("solve", platform, tmp_path / "two", reading=KEEP, seed="home", **usual)
    compile_for(job)  # what this process compiles itself may differ in the last digit
    arguments = (logs, "-p", "reference", "-o", tmp_path / "one", "--seed", "home", "--keep", "id")
    command = [sys.executable, "-m", "gough.cli", "solve", *map(str, arguments), "--workers", "1"]
    subprocess.run(command, check=True, capture_output=True)
    names = []

    def tick(summary: Summary, made: Made, units: list[Unit]) -> None:
        if not names:
            os.kill(multiprocessing.active_children()[0].pid or 0, signal.SIGKILL)
        names.append(made.unit.name)

    summary = run_job(job, [logs], workers=2, tick=tick)
    assert (summary.made, summary.failed) == (6, [])
    assert sorted(names) == sorted(outputs(tmp_path / "one"))
    one, two = outputs(tmp_path / "one"), outputs(tmp_path / "two")
    assert {*one} == {*two}
    assert not [name for name in one if one[name] != two[name]]
    assert not multiprocessing.active_children()


@settings(max_examples=60)
@given(
    fields=st.lists(st.text(st.sampled_from('a,"\n ;1'), max_size=6), min_size=1, max_size=40),
    rows=st.integers(1, 7),
    chunk=st.integers(1, 50),
)
def test_text_is_cut_where_rows_end(fields, rows, chunk):
    """Against Python's own reader of CSV: each part holds `rows` of its rows."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([number, field] for number, field in enumerate(fields))
    data = text.getvalue().encode()
    with mock.patch("gough.jobs.cut.CHUNK", chunk):
        cuts = [(0, 0), *line_ends(io.BytesIO(data), rows)]
    for (start, lines), (stop, _) in pairwise([*cuts, (len(data), 0)]):
        part = data[start:stop].decode()
        assert lines == data[:start].count(b"\n")
        found = [int(row[0]) for row in csv.reader(io.StringIO(part, newline=""))]
        first = rows * cuts.index((start, lines))
        assert found == [*range(first, min(first + rows, len(fields)))]


def test_a_job_can_be_sent_and_its_platform_is_the_same(platform):
    job = Job.of("solve", platform, "poses", reading=KEEP, seed="home", follow={"max_turn": 0.1})
    sent = pickle.loads(pickle.dumps(job))
    assert (sent, sent.facts, sent.machine) == (job, job.facts, platform)
    assert job.machine.digest == platform.digest
    assert Job.of("solve", platform, "poses", max_iterations=0).facts["max_iterations"] == 0
    assert "limits" not in Job.of("solve", platform, "poses", limits=None).facts


def test_a_network_that_changed_is_another_job(tmp_path, platform, monkeypatch):
    from importlib.resources import files

    network = files("gough").joinpath("weights", "reference-disgnet.onnx")
    monkeypatch.chdir(tmp_path)
    Path("mine.onnx").write_bytes(network.read_bytes())
    job = Job.of("solve", platform, "poses", seed="mine.onnx")
    assert job.facts["seed"].startswith("network ")
    assert job.options["seed"] == str(tmp_path / "mine.onnx")
