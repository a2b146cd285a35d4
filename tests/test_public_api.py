"""Every public name resolves and stands in the documents, and importing stays light."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
import tomllib
from pathlib import Path

import documents
import pytest

import gough

HEAVY = ("torch", "numba", "pyarrow", "viser", "matplotlib", "pandas", "scipy", "onnxruntime",
         "mujoco", "rich", "tyro", "sympy")  # fmt: skip


def fresh_python(code: str) -> str:
    """What a new interpreter prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout


# ---- names ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", gough.__all__)
def test_every_public_name_resolves(name: str) -> None:
    value = getattr(gough, name)
    assert value is not None
    assert name in dir(gough) or name == "__version__"  # `dir` lists what loads when used
    if name != "__version__":
        assert value.__doc__, f"{name} has no docstring"


@pytest.mark.parametrize("package", ["gough", "gough.learn"])
def test_public_names_are_those_that_type_checkers_see(package: str) -> None:
    """Each import of the stub, run here, gives the very object that users get."""
    home = importlib.import_module(package)
    stub = ast.parse(Path(str(home.__file__)).with_suffix(".pyi").read_text("utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    homes = {node: f"{package}.{node.module}" if node.module else package for node in imports}
    names = {alias.name: homes[node] for node in imports for alias in node.names}
    assert names.keys() == set(home.__all__) - {"__version__"}
    for name, module in names.items():
        assert getattr(home, name) is getattr(importlib.import_module(module), name)


def test_every_public_name_is_in_the_documents() -> None:
    page = (documents.ROOT / "docs" / "api.md").read_text("utf-8")
    missing = [n for n in gough.__all__ if f":: gough.{n}\n" not in page and n != "__version__"]
    assert not missing, "docs/api.md lacks an entry for each of these"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="No gough attribute sovle"):
        gough.sovle  # noqa: B018 # pyright: ignore[reportAttributeAccessIssue]


def test_star_import_gives_the_public_names() -> None:
    names: dict = {}
    exec("from gough import *", names)
    assert set(gough.__all__) <= names.keys()


# ---- weight ---------------------------------------------------------------------------


@pytest.mark.process
@pytest.mark.parametrize(
    "code",
    [
        "import gough",
        "import gough; p = gough.Platform.load('reference'); gough.leg_lengths(p, p.home)",
        "import gough as g; p = g.Platform.load('reachy_mini'); g.jacobian(p, p.sample_poses(3))",
    ],
)
def test_light_work_loads_no_heavy_library(code: str) -> None:
    loaded = fresh_python(f"{code}\nimport sys; print(*sys.modules)").split()
    assert "gough" in loaded
    assert not set(HEAVY) & set(loaded)


@pytest.mark.process
def test_import_alone_loads_no_numpy() -> None:
    assert "numpy" not in fresh_python("import gough, sys; print(*sys.modules)").split()


# ---- the project's own word -----------------------------------------------------------


def test_the_package_says_that_it_is_typed() -> None:
    assert (Path(gough.__file__).parent / "py.typed").is_file()


def test_the_changelog_tells_of_this_version() -> None:
    assert f"## {gough.__version__}" in (documents.ROOT / "CHANGELOG.md").read_text("utf-8")


def test_the_core_does_not_ask_for_torch() -> None:
    project = tomllib.loads((documents.ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert not any(need.startswith("torch") for need in project["dependencies"])
    assert "torch==2.13.0" in project["optional-dependencies"]["dev"]
