"""The engine of a Ray cluster, and the functions for Ray Data: two nodes on this machine."""

from __future__ import annotations

import os
from contextlib import closing
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gough
from gough.columns import LEGS
from gough.jobs import Job, Made, plan, run_job

from .conftest import ROWS, write

pytest.importorskip("ray", reason="needs extra cluster")
pytestmark = [
    pytest.mark.process,
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore"),  # Ray's own
]


@pytest.fixture(scope="module")
def cluster():
    """Two nodes with two CPUs each; nothing of them is left in the end."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    import ray
    from ray.cluster_utils import Cluster

    # a node is given up after six seconds without an answer, not after half a minute
    soon = {"health_check_period_ms": 1000, "health_check_failure_threshold": 3}
    head = {"num_cpus": 2, "_system_config": soon | {"health_check_timeout_ms": 2000}}
    nodes = Cluster(initialize_head=True, head_node_args=head)
    nodes.add_node(num_cpus=2)
    yield nodes
    ray.shutdown()
    nodes.shutdown()


def contents(folder: Path) -> dict[str, bytes]:
    files = [path for path in folder.rglob("*") if path.is_file() and "_gough" not in path.parts]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_outputs_are_those_of_this_machine_byte_for_byte(cluster, logs, platform, tmp_path):
    here = run_job(Job.of("solve", platform, tmp_path / "here"), [logs])
    there = run_job(
        Job.of("solve", platform, tmp_path / "there"), [logs], engine="ray",
        address=cluster.address,
    )  # fmt: skip
    assert there.counts == here.counts
    assert there.made == 6
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def test_a_node_that_dies_loses_no_row_and_doubles_none(cluster, readings, platform, tmp_path):
    from gough.jobs.ray_engine import run_ray

    for i in range(12):
        write(tmp_path / f"logs/{i:02}.parquet", np.tile(readings, (50, 1)))
    job = Job.of("solve", platform, tmp_path / "out", seed="home")
    units = plan(job, [tmp_path / "logs"])
    doomed = cluster.add_node(num_cpus=2)
    made: list[Made] = []
    (tmp_path / "out").mkdir()
    with closing(run_ray(job, units, address=cluster.address)) as results:
        for each in results:
            made.append(each)
            if len(made) == 3:
                cluster.remove_node(doomed, allow_graceful=False)
    assert sorted(each.unit.name for each in made) == [unit.name for unit in units]
    assert [each.error for each in made if each.error] == []
    rows = [pq.read_metadata(tmp_path / "out" / unit.name).num_rows for unit in units]
    assert rows == [50 * len(readings)] * 12


def test_ray_data_maps_batches(cluster, platform, readings):
    import ray

    ray.init(address=cluster.address, log_to_driver=False, ignore_reinit_error=True)
    table = pa.table(dict(zip(LEGS, readings[:ROWS].T, strict=True)) | {"id": range(ROWS)})
    solver = gough.cluster.Solver(platform, seed="home", keep=["id"])
    found = ray.data.from_arrow(table).map_batches(solver, batch_format="pyarrow")
    result = found.to_pandas().sort_values("id")
    expected = gough.Solver(platform, seed="home")(readings[:ROWS])
    assert result["x"].tolist() == expected.pose.position[:, 0].tolist()
    assert result["status"].tolist() == ["converged"] * ROWS
