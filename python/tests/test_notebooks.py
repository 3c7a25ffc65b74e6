"""The notebooks run from top to bottom, and what they state of the physics is asserted in their cells."""

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
assert NOTEBOOKS, "no notebooks found"


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_valid_and_kept_without_output(path):
    notebook = nbformat.read(path, as_version=nbformat.NO_CONVERT)
    nbformat.validate(notebook)
    for cell in code_cells(notebook):
        assert not cell.outputs and cell.execution_count is None, f"{cell.id} has output: clear it"
        assert not cell.metadata, f"{cell.id} has metadata: {cell.metadata}"


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
