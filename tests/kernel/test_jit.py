"""Compiled code on disk: used again, and never after a source of it has changed."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import gough
from gough.kernel import jit as jit_module

INNER = """
from gough.kernel.jit import inner
@inner
def add(x):
    return x + {number}
"""
ENTRY = """
from gough.kernel.jit import jit
from part import add
@jit()
def entry(x):
    return add(x)
print(entry(1.0), sum(entry.stats.cache_hits.values()))
"""


def _run(folder: Path) -> str:
    source = str(Path(gough.__file__).parents[1])
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONPATH": os.pathsep.join([source, str(folder)]),
    }
    command = [sys.executable, "-B", "-m", "entry"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.process
@pytest.mark.slow
def test_a_changed_source_never_runs_old_code(tmp_path):
    """The function that changes stands in another file than the one that is kept on disk."""
    (tmp_path / "entry.py").write_text(ENTRY)
    (tmp_path / "part.py").write_text(INNER.format(number=1))
    assert _run(tmp_path) == "2.0 0"
    assert _run(tmp_path) == "2.0 1"  # from disk
    (tmp_path / "part.py").write_text(INNER.format(number=5))
    assert _run(tmp_path) == "6.0 0"


SECOND = """
import contextlib, sys
from gough import cli, compiling
solve = "solve 152.6 152.6 152.6 152.6 152.6 152.6 -p reachy_mini"
for command in (solve, "modes -p reference", "warmup"):
    heavy = {"scipy.linalg", "cffi", "typeguard", "pyarrow.compute"} & set(sys.modules)
    with contextlib.suppress(SystemExit):
        cli.main(command.split())
print(compiling.seconds(), *heavy)
"""


@pytest.mark.process
@pytest.mark.slow
def test_a_second_process_compiles_nothing_and_loads_little():
    """All compiled functions run from disk, though Numba has not imported what compiling needs."""
    command = [sys.executable, "-c", SECOND]
    outputs = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2)
    ]
    assert "limits: there already" in outputs[1]
    assert outputs[1].splitlines()[-1] == "0.0"


def test_what_compiled_code_depends_on(monkeypatch, tmp_path):
    """The function's folder, the kernel's, the statuses and the steps of `home_mode`, no more."""
    kernel = Path(jit_module.__file__).parent
    sources = [tmp_path, kernel, kernel.parent / "status.py", kernel.parent / "home_mode.py"]
    asked = []
    monkeypatch.setattr(jit_module, "_digest", lambda path: asked.append(path) or str(path))

    file = SimpleNamespace(_source_stamp="own")
    compiled = SimpleNamespace(_cache=SimpleNamespace(_cache_file=file))
    jit_module._expire_with_sources(compiled, tmp_path)
    assert file._source_stamp == ("own", *map(str, sources))
    assert asked == sources


def test_a_digest_is_of_every_source_in_a_folder(tmp_path):
    digests = set()
    for name, text in (("a.py", "1"), ("b.py", "2"), ("a.py", "3")):
        (tmp_path / name).write_text(text)
        digests.add(jit_module._digest.__wrapped__(tmp_path))
    (tmp_path / "notes.txt").write_text("no source")
    digests.add(jit_module._digest.__wrapped__(tmp_path))
    assert len(digests) == 3
