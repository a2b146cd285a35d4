"""Folders of files and clusters: same bytes, nothing lost, how fast, how much memory.

    python benchmarks/cluster.py            # half an hour on two cores, 3 GB of disk
    python benchmarks/cluster.py --quick    # under a minute, once the code is compiled
    python benchmarks/cluster.py --only speed,memory

Reference platform, polynomial seed, Parquet; readings of poses drawn from its workspace. Needs
extra `cluster`. Keep the machine otherwise idle: speed and overhead depend on it.
"""

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from solver import peak_memory, processor

import gough
from gough.columns import LEGS
from gough.jobs import Job, make, plan, run_job, run_local
from gough.kernel.threads import cores

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests/jobs"))
PLATFORM = gough.Platform.load("reference")
SEED = "polynomial"


@dataclass(frozen=True)
class Sizes:
    """How much is done."""

    files: int = 200
    rows: int = 100_000  # of a file
    losses: int = 10  # of nodes
    kills: int = 50
    large: int = 20_000_000  # rows of the file for speed and memory


QUICK = Sizes(files=8, rows=5_000, losses=1, kills=3, large=1_000_000)


def main() -> None:
    parser = argparse.ArgumentParser(description="Folders of files and clusters.")
    parser.add_argument("--quick", action="store_true", help="little of everything")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, with commas")
    given = parser.parse_args()
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    size = QUICK if given.quick else Sizes()
    print(f"{processor()}, {cores()} cores")
    print("\n| what | found |\n|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in given.only.split(","):
            for what, found in PARTS[name](Path(folder), size).items():
                print(f"| {what} | {found} |", flush=True)


# ---- inputs and outputs -----------------------------------------------------------------


def write_file(path: Path, rows: int, seed: int) -> None:
    """Write the readings of poses drawn with a seed, a million at a time."""
    schema = pa.schema([(name, pa.float64()) for name in LEGS])
    path.parent.mkdir(parents=True, exist_ok=True)
    with pq.ParquetWriter(path, schema) as writer:
        for first in range(0, rows, 1_000_000):
            count = min(1_000_000, rows - first)
            legs = gough.leg_lengths(PLATFORM, PLATFORM.sample_poses(count, seed=seed + first))
            writer.write_table(pa.table(list(legs.T.copy()), schema=schema))


def logs(folder: Path, size: Sizes) -> Path:
    """The folder of many files, written once."""
    found = folder / "logs"
    for i in range(size.files):
        path = found / f"day={i % 7}/{i:03}.parquet"
        if not path.exists():
            write_file(path, size.rows, seed=i)
    return found


def contents(folder: Path) -> dict[str, str]:
    """SHA-256 of each output by its name."""
    files = [path for path in folder.rglob("*.parquet") if "_gough" not in path.parts]
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(files)
    }


def rows_of(folder: Path) -> int:
    return sum(pq.read_metadata(folder / name).num_rows for name in contents(folder))


def command(source: Path, out: Path) -> list[str]:
    given = [str(source), "-p", "reference", "--seed", SEED, "-o", str(out)]
    return [sys.executable, "-m", "gough.cli", "solve", *given]


# ---- the same bytes ---------------------------------------------------------------------


def identical(folder: Path, size: Sizes) -> dict[str, str]:
    """Outputs of both engines, with one worker and with several."""
    source, found = logs(folder, size), {}
    for engine, workers in (("local", 1), ("local", 2), ("local", 3), ("ray", 1), ("ray", 2)):
        out = folder / f"{engine}-{workers}"
        run_job(Job.of("solve", PLATFORM, out, seed=SEED), [source], engine=engine, workers=workers)
        found[f"{engine}, {workers} workers"] = contents(out)
    first = next(iter(found.values()))
    same = sum(other == first for other in found.values())
    return {
        f"{size.files} files of {size.rows:,} rows with {', '.join(found)}: outputs identical byte "
        "for byte": f"{same} of {len(found)}"
    }  # fmt: skip


# ---- losses -----------------------------------------------------------------------------


def lost_nodes(folder: Path, size: Sizes) -> dict[str, str]:
    """Two Ray nodes with two CPUs each; one is killed when a tenth of the files is there."""
    source, whole = logs(folder, size), 0
    for i in range(size.losses):
        out = folder / f"lost-{i}"
        out.mkdir()
        job = Job.of("solve", PLATFORM, out, seed=SEED)
        units = plan(job, [source])
        with two_nodes() as (cluster, doomed):
            made = loses_a_node(job, units, cluster, doomed)
        once = sorted(made) == sorted(unit.name for unit in units)
        whole += once and rows_of(out) == size.files * size.rows
    return {
        "two Ray nodes on one machine, one killed in the middle: every row once": (
            f"{whole} of {size.losses}"
        )
    }


@contextmanager
def two_nodes():
    import ray
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 2})
    try:
        yield cluster, cluster.add_node(num_cpus=2)
    finally:
        ray.shutdown()
        cluster.shutdown()


def loses_a_node(job, units, cluster, doomed) -> list[str]:
    from gough.jobs.ray_engine import run_ray

    made = []
    with closing(run_ray(job, units, address=cluster.address)) as results:
        for each in results:
            made.append(each.unit.name)
            if len(made) == max(len(units) // 10, 1):
                cluster.remove_node(doomed, allow_graceful=False)
    return made


def killed(folder: Path, size: Sizes) -> dict[str, str]:
    """The local job and all its processes, killed at random moments and started again."""
    from kills import kill_and_go_on

    source, out = logs(folder, size), folder / "killed"
    whole = folder / "whole"
    begin = time.perf_counter()
    subprocess.run(command(source, whole), check=True, capture_output=True)
    longest = time.perf_counter() - begin
    given = command(source, out)[3:]
    facts = kill_and_go_on(given, out, size.kills, longest / 8, seed=1)
    same = contents(out) == contents(whole)
    return {
        f"kill -9 of the local job at {facts['killed']} random moments, then run to the end": (
            f"outputs {'identical to' if same else 'DIFFER from'} those of one run; of "
            f"{facts['kept']:,} finished outputs found, {facts['made_again']} were made again; "
            f"{facts['partial']} unfinished files left"
        )
    }


def store(folder: Path, size: Sizes) -> dict[str, str]:
    """A job from and to an S3 server (moto) behind a proxy where one request in five fails."""
    from s3 import s3_server

    rows, found = size.rows // 10, {}
    with s3_server() as (options, faults, direct):
        for i in range(size.files // 4):
            write_file(folder / "up.parquet", rows, seed=i)
            with direct.open_output_stream(f"bucket/logs/{i:03}.parquet") as stream:
                stream.write((folder / "up.parquet").read_bytes())
        source = f"s3://bucket/logs{options}"
        faults.share = 0.2
        job = Job.of("solve", PLATFORM, f"s3://bucket/poses{options}", seed=SEED)
        summary = run_job(job, [source])
        faults.share = 0.0
        counts = [
            pq.read_metadata(stream).num_rows
            for stream in map(direct.open_input_file, objects(direct, "bucket/poses"))
        ]
        hit = ", ".join(f"{faults.seen.get(kind, 0)} {kind}" for kind in ("503", "500", "cut"))
        found[f"{size.files // 4} files of {rows:,} rows in S3; requests lost: {hit}"] = (
            f"{summary.made} files made, {counts.count(rows)} of them with every row once"
        )
        other = Job.of("solve", PLATFORM, f"s3://bucket/other{options}", seed=SEED)
        units = plan(other, [source])
        faults.down = True
        failed = make(other, units[0]).error
        faults.down = False
        left = len(objects(direct, "bucket/other"))
        found["the same, the store down"] = f"{left} objects visible; it says: {failed}"
    return found


def objects(files, folder: str) -> list[str]:
    """Paths of the Parquet files of a folder of a store."""
    from pyarrow import fs

    listed = files.get_file_info(fs.FileSelector(folder, recursive=True, allow_not_found=True))
    return sorted(one.path for one in listed if one.path.endswith(".parquet"))


# ---- speed and memory -------------------------------------------------------------------


def speed(folder: Path, size: Sizes) -> dict[str, str]:
    """One large file, and the same rows as a folder of files; whole calls, files on disk."""
    from gough.files import solve_file

    source, found = folder / "large.parquet", {}
    if not source.exists():
        write_file(source, size.large, seed=0)
    parts = folder / "parts"
    count = 20
    for i in range(count):
        write_file(parts / f"{i:02}.parquet", size.large // count, seed=i * size.large // count)
    gough.Solver(PLATFORM, SEED).compile(10_000)
    out = folder / "large-out.parquet"

    def one_file() -> None:
        solve_file(source, out, PLATFORM, seed=SEED)

    def one_thread() -> None:
        solve_file(source, out, PLATFORM, seed=SEED, workers=1)

    def many() -> None:
        job = Job.of("solve", PLATFORM, folder / "parts-out", seed=SEED)
        for made in run_local(job, plan(job, [parts])):
            assert not made.error, made.error

    (folder / "parts-out").mkdir()
    alone, one, folder_mode = timed(one_thread), timed(one_file), timed(many)
    found[f"{size.large:,} rows, file to file, one thread"] = f"{size.large / alone:,.0f} rows/s"
    found[f"{size.large:,} rows, file to file"] = f"{size.large / one:,.0f} rows/s"
    more = 100 * (folder_mode / one - 1)
    found[f"the same rows as {count} files, folder mode"] = (
        f"{size.large / folder_mode:,.0f} rows/s, {more:+.0f} % time"
    )
    found["bytes of a row, read and written"] = (
        f"{source.stat().st_size / size.large:.1f} and {out.stat().st_size / size.large:.1f}"
    )
    return found


def timed(work: Callable[[], None], repeats: int = 2) -> float:
    """Shortest of two times [s]."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def modes(folder: Path, size: Sizes) -> dict[str, str]:
    """All assembly modes of each set of readings, on one thread."""
    sets = size.rows // 10
    legs = gough.leg_lengths(PLATFORM, PLATFORM.sample_poses(sets, seed=2))
    gough.assembly_modes(PLATFORM, legs[:100], workers=1)
    seconds = timed(lambda: gough.assembly_modes(PLATFORM, legs, workers=1))
    return {"mode sets a second, one thread": f"{sets / seconds:,.0f}"}


def memory(folder: Path, size: Sizes) -> dict[str, str]:
    """The largest resident memory of the command, for one file of each size."""
    found = {}
    for rows in (size.large // 10, size.large):
        source = folder / f"memory-{rows}.parquet"
        write_file(source, rows, seed=0)
        peak = peak_memory(command(source, folder / "memory-out.parquet"))
        found[f"memory of a process, {rows:,} rows"] = f"{peak / 1e9:.2f} GB"
    return found


PARTS: dict[str, Callable[[Path, Sizes], dict[str, str]]] = {
    "identical": identical,
    "lost_nodes": lost_nodes,
    "killed": killed,
    "store": store,
    "speed": speed,
    "modes": modes,
    "memory": memory,
}

if __name__ == "__main__":
    main()
