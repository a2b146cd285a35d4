"""The notebook runs from top to bottom, and is stored as its author wrote it."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import documents
import nbformat
import pytest
from nbclient import NotebookClient

import gough

EXAMPLES = documents.ROOT / "examples"
TOUR = EXAMPLES / "tour.ipynb"
SOURCE = str(Path(gough.__file__).resolve().parent.parent)


def notebook() -> nbformat.NotebookNode:
    return nbformat.read(TOUR, as_version=4)


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> nbformat.NotebookNode:
    """The notebook after it has run with this Python, beside the examples it reads."""
    folder = tmp_path_factory.mktemp("tour")
    shutil.copytree(EXAMPLES, folder, dirs_exist_ok=True)
    found = notebook()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([SOURCE, os.environ.get("PYTHONPATH", "")]))
        patch.setenv("PYTHONWARNINGS", "default")
        client = NotebookClient(
            found, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
        )
        client.execute()
    return found


@pytest.mark.slow
def test_every_cell_runs_without_a_word_on_standard_error(executed: nbformat.NotebookNode) -> None:
    for cell in executed.cells:
        for output in cell.get("outputs", []):
            assert output["output_type"] != "error"
            assert output.get("name") != "stderr", f"{cell.source}\n{output.get('text')}"


@pytest.mark.slow
def test_it_shows_tables_and_pictures(executed: nbformat.NotebookNode) -> None:
    data = [o.get("data", {}) for cell in executed.cells for o in cell.get("outputs", [])]
    shown = "".join(part.get("text/html", "") for part in data)
    for words in ("Platform(&#x27;reference&#x27;", "invalid_input", "AssemblyModes(", "JUMPED"):
        assert words in shown
    assert sum("image/png" in part for part in data) >= 4


def test_it_is_stored_without_outputs_and_without_paths() -> None:
    found = notebook()
    nbformat.validate(found)
    for cell in found.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None
    assert not re.search(r"(/home/|/root/|/tmp/|/Users/|[A-Z]:\\\\)", TOUR.read_text("utf-8"))
    assert set(found.metadata) == {"kernelspec", "language_info"}
