"""Exported machines, compiled once for all tests; without a compiler these tests skip."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import pytest
from exported import Machine, build, compilers

from gough import Platform
from gough.export.precision import RealName

Build = Callable[..., Machine]


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Compile a platform, or a machine of the catalog by name: built(platform, "float")."""
    if "gcc" not in compilers():
        pytest.skip("gcc is not installed: exported C cannot be compiled")

    @lru_cache
    def compiled(platform: Platform, real: RealName) -> Machine:
        folder = tmp_path_factory.mktemp("machine")
        return build(platform, folder, real=real, flags=("-O0",))

    def make(platform: Platform | str, real: RealName = "double") -> Machine:
        machine = Platform.load(platform) if isinstance(platform, str) else platform
        return compiled(machine, real)

    return make
