"""The notebooks run from top to bottom, and what they state of the physics is asserted in their cells."""

import hashlib
import json
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
assert NOTEBOOKS, "no notebooks found"


def printed(cell):
    """Texts of a cell on stdout."""
    return "".join(o.text for o in cell.outputs if o.output_type == "stream" and o.name == "stdout")


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_with_the_outputs_of_its_own_cells_and_nothing_else(path):
    notebook = nbformat.read(path, as_version=nbformat.NO_CONVERT)
    nbformat.validate(notebook)
    cells = [cell.source for cell in code_cells(notebook)]
    made_of = hashlib.sha256(json.dumps(cells).encode()).hexdigest()
    assert notebook.metadata["clutch"] == {"sources": made_of}, "its cells have changed: cargo xtask notebooks"
    assert notebook.metadata["language_info"] == {"name": "python"}
    assert [cell.execution_count for cell in code_cells(notebook)] == list(range(1, len(cells) + 1))
    assert path.stat().st_size < 250_000
    for cell in notebook.cells:
        assert not cell.metadata, f"{cell.id} has metadata: {cell.metadata}"
    for output in (output for cell in code_cells(notebook) for output in cell.outputs):
        assert output.output_type != "error" and output.get("name") != "stderr" and not output.get("metadata")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_its_assertions_hold(path, tmp_path):
    pytest.importorskip("ipykernel")
    pytest.importorskip("matplotlib")
    notebook = nbformat.read(path, as_version=4)
    assert any("assert " in cell.source for cell in code_cells(notebook))
    # The notebook's files go to a temporary folder.
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=60, kernel_name="python3", resources=resources).execute()
    for cell in code_cells(notebook):
        if "plot." in cell.source or ".plot(" in cell.source:
            shown = [output for output in cell.outputs if "image/png" in output.get("data", {})]
            assert shown or "import " in cell.source, f"{cell.id} draws and shows nothing"
    # The notebook's output is what is kept.
    kept = nbformat.read(path, as_version=4)
    for ours, theirs in zip(code_cells(notebook), code_cells(kept), strict=True):
        assert printed(ours) == printed(theirs), ours.id
