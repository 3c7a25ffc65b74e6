"""Runs every notebook and keeps its outputs in it, as ``cargo xtask notebooks`` does.

Run it in any folder, with the package installed: ``python docs/notebooks.py``. Kept are texts, tables and
pictures of few colours; times, counts of other runs and what was written to stderr are not. A checksum of the sources
stands in the notebook's metadata: a test holds it against the cells.
"""

import base64
import hashlib
import json
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient
from PIL import Image

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
#: Forms of an output that are kept; of several forms of one output the richest.
KEPT = ("image/png", "text/html", "text/plain")
WIDEST = 900


def sources(notebook):
    """A checksum of what a notebook computes: its cells of code in their order."""
    cells = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    return hashlib.sha256(json.dumps(cells).encode()).hexdigest()


def small(png):
    """A picture of at most 900 points across and 64 colours, without what its writer says of itself."""
    picture = Image.open(BytesIO(base64.b64decode(png))).convert("RGB")
    if picture.width > WIDEST:
        picture = picture.resize((WIDEST, round(picture.height * WIDEST / picture.width)), Image.Resampling.LANCZOS)
    out = BytesIO()
    picture.quantize(64).save(out, "png", optimize=True)
    return base64.b64encode(out.getvalue()).decode()


def plain(output):
    """An output as it is kept; None for one that is not."""
    if output.output_type == "stream":
        return nbformat.v4.new_output("stream", name="stdout", text=output.text) if output.name == "stdout" else None
    form = next((form for form in KEPT if form in output.data), None)
    if form is None:
        return None
    data = {form: small(output.data[form]) if form == "image/png" else output.data[form]}
    number = {"execution_count": output.execution_count} if output.output_type == "execute_result" else {}
    return nbformat.v4.new_output(output.output_type, data=data, **number)


def execute(path):
    """Run a notebook in a folder of its own, and write it with its outputs."""
    notebook = nbformat.read(path, as_version=4)
    with TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources, record_timing=False).execute()
    for cell in notebook.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs = [kept for kept in map(plain, cell.outputs) if kept is not None]
    notebook.metadata["clutch"] = {"sources": sources(notebook)}
    notebook.metadata["language_info"] = {"name": "python"}  # not the version that ran it
    nbformat.write(notebook, path)


def main():
    for path in sorted(FOLDER.glob("*.ipynb")):
        execute(path)
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
