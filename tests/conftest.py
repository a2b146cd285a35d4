"""Settings that all tests share."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

quiet = [HealthCheck.too_slow]
settings.register_profile("dev", deadline=None, suppress_health_check=quiet)
settings.register_profile(
    "ci", deadline=None, suppress_health_check=quiet, derandomize=True, print_blob=True
)
settings.load_profile("ci" if os.environ.get("CI") else "dev")
