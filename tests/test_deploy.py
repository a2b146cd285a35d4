"""The files of deploy/, as far as they can be checked without a cluster."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gough
from gough.columns import LEGS

DEPLOY = Path(__file__).parents[1] / "deploy"


def test_the_image_is_small_without_rights_and_warm():
    text = (DEPLOY / "Dockerfile").read_text("utf-8")
    lines = re.sub(r"\\\n", "", re.sub(r"^#.*\n", "", text, flags=re.M)).splitlines()
    steps = [line.split(None, 1) for line in lines if line.strip()]
    known = {"FROM", "ARG", "ENV", "WORKDIR", "COPY", "RUN", "USER", "ENTRYPOINT", "CMD"}
    assert {name for name, _ in steps} <= known
    bases = [rest for name, rest in steps if name == "FROM"]
    assert all(re.match(r"python:3\.\d+-slim( AS build)?$", base) for base in bases)
    last = steps[max(i for i, (name, _) in enumerate(steps) if name == "FROM") :]
    names = [name for name, _ in last]
    assert last[names.index("USER")][1] not in ("0", "root")
    assert ["RUN", "gough warmup"] in last[names.index("USER") :]  # as the user who will run it
    for path in (
        rest.split()[0] for name, rest in steps if name == "COPY" and "--from" not in rest
    ):
        assert (DEPLOY.parent / path).exists()
    assert "--no-cache-dir" in text


def test_the_job_of_kubernetes_states_what_kuberay_asks_for():
    yaml = pytest.importorskip("yaml")
    job = yaml.safe_load((DEPLOY / "rayjob.yaml").read_text("utf-8"))
    assert (job["apiVersion"], job["kind"]) == ("ray.io/v1", "RayJob")
    cluster = job["spec"]["rayClusterSpec"]
    workers = cluster["workerGroupSpecs"][0]
    assert workers["minReplicas"] <= workers["replicas"] <= workers["maxReplicas"]
    for group in (cluster["headGroupSpec"], workers):
        pod = group["template"]["spec"]
        assert pod["securityContext"]["runAsNonRoot"] is True
        (container,) = pod["containers"]
        assert container["resources"]["requests"] == container["resources"]["limits"]
        assert float(container["resources"]["limits"]["cpu"]) >= 2
        assert {mount["name"] for mount in container["volumeMounts"]} == {
            volume["name"] for volume in pod["volumes"]
        }
        assert {"name": "RAY_USAGE_STATS_ENABLED", "value": "0"} in container["env"]
    words = shlex.split(job["spec"]["entrypoint"])
    assert words[:2] == ["gough", "solve"]
    assert words[-4:] == ["--engine", "ray", "--address", "auto"]


@pytest.mark.process
def test_the_array_of_slurm_makes_every_file_once(tmp_path):
    script = DEPLOY / "slurm.sh"
    subprocess.run(["bash", "-n", script], check=True)
    assert re.findall(r"^#SBATCH --(\S+?)[=\n]", script.read_text("utf-8"), re.M)
    platform = gough.Platform.load("reference")
    legs = gough.leg_lengths(platform, platform.sample_poses(10, seed=1))
    (tmp_path / "logs").mkdir()
    for i in range(3):
        table = pa.table(dict(zip(LEGS, legs.T, strict=True)))
        pq.write_table(table, tmp_path / f"logs/{i}.parquet")
    (tmp_path / "bin").mkdir()
    command = tmp_path / "bin/gough"
    command.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m gough.cli "$@"\n')
    command.chmod(0o755)
    for task in ("1", "2"):
        given = {
            "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "LOGS": str(tmp_path / "logs"),
            "PLATFORM": "reference", "POSES": str(tmp_path / "poses"),
            "SLURM_ARRAY_TASK_ID": task, "SLURM_ARRAY_TASK_COUNT": "2",
        }  # fmt: skip
        done = subprocess.run(["bash", script], env=os.environ | given, check=False,
                              capture_output=True, text=True)  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert f"files: {3 - int(task)} made" in done.stdout
    found = sorted(path.name for path in (tmp_path / "poses").glob("*.parquet"))
    assert found == ["0.parquet", "1.parquet", "2.parquet"]
