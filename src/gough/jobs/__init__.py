"""Many files, or one too large to begin again: each unit of work makes one output file, once.

    job = Job.of("solve", platform, "poses/", seed="home")
    summary = run_job(job, ["logs/"])

A unit is an input file, or a part of a large one. Its output is the same wherever it is made, so an
engine is any function `(job, units, ...) -> iterator of Made` that calls `make` on each unit.
"""

from __future__ import annotations

from gough.jobs.job import Job, Made, Unit
from gough.jobs.local import run_local
from gough.jobs.outputs import finished
from gough.jobs.plan import plan
from gough.jobs.run import run_job
from gough.jobs.summary import Summary
from gough.jobs.work import make

__all__ = ["Job", "Made", "Summary", "Unit", "finished", "make", "plan", "run_job", "run_local"]
