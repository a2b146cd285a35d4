"""A process that compiles calculates the same bits as those that load its code from disk."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

CODE = """
import gough
platform = gough.Platform.load("reference")
legs = gough.leg_lengths(platform, platform.sample_poses(1000, seed=0))
print(gough.solve(platform, legs, seed="polynomial").pose.position.tobytes().hex())
"""


@pytest.mark.process
@pytest.mark.slow
def test_compiling_changes_no_bit(tmp_path):
    settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", CODE], env=settings, check=True, capture_output=True, text=True
        ).stdout
        for _ in range(2)
    )
    assert first == second
