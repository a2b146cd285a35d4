"""Settings that all tests share: hypothesis profiles, caches of their own, markers."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Nothing is written into the user's caches: fits of polynomials and fonts are kept here.
CACHE = Path(__file__).parents[1] / "build" / "test-cache"
os.environ["GOUGH_CACHE_DIR"] = str(CACHE / "gough")
os.environ["MPLCONFIGDIR"] = str(CACHE / "matplotlib")
# Tests run in as many processes as there are cores; more threads would fight for them.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

quiet = [HealthCheck.too_slow]
settings.register_profile("dev", deadline=None, suppress_health_check=quiet)
settings.register_profile("quick", settings.get_profile("dev"), max_examples=8)
settings.register_profile(
    "ci", deadline=None, suppress_health_check=quiet, derandomize=True, print_blob=True
)
settings.load_profile(
    os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "dev")
)


def pytest_sessionstart() -> None:
    """Let each process of pytest-xdist compile a share of what the tests need.

    Where nothing is compiled yet each would compile all of it otherwise.
    """
    from gough import Platform
    from gough.commands import warmup

    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker:
        share, count = int(worker.removeprefix("gw")), int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
        for work in list(warmup._jobs().values())[share::count]:
            work(Platform.load("rubin_camera"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests by what they need, as far as their fixtures and their folder show it."""
    for item in items:
        names = getattr(item, "fixturenames", ())
        if "browser" in names:
            item.add_marker("browser")
        if "built" in names:  # by a C compiler
            item.add_marker("process")
        if item.path.parent.name in ("learn", "paper"):
            item.add_marker("torch")
