"""README, docs/python and docs/start are true: their code runs and prints what they say; no public name is left out."""

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FOLDERS = [DOCS / "python", DOCS / "start"]
PAGES = [ROOT / "README.md", DOCS / "index.md", DOCS / "referee.md"]
PAGES += [page for folder in FOLDERS for page in sorted(folder.glob("*.md"))]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# A block that needs what a test machine has not: the comment names the file whose tests run it.
ELSEWHERE = re.compile(r"<!-- not run here: (\S+) -->\n\Z")


def blocks(text):
    """A page's code in order: line of the page, code, what it prints or None, file that tests it or None."""
    found, end_of_last = [], None
    for fence in FENCE.finditer(text):
        language, body = fence.groups()
        if language == "python":
            elsewhere = ELSEWHERE.search(text[: fence.start()])
            found.append([text[: fence.start()].count("\n") + 1, body, None, elsewhere and elsewhere[1]])
            end_of_last = fence.end()
        elif language == "text" and end_of_last and not text[end_of_last : fence.start()].strip():
            found[-1][2] = body  # a block of text right after code is what the code prints
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs_and_prints_what_the_page_says(page, tmp_path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__main__"}
    for line, code, prints, elsewhere in blocks(page.read_text(encoding="utf-8")):
        if elsewhere:
            assert (ROOT / elsewhere).is_file(), f"{page.name}:{line}: no file {elsewhere}"
            compile(code, page.name, "exec")
            continue
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            # The empty lines make a traceback show the line of the page.
            exec(compile("\n" * line + code, str(page), "exec"), namespace)
        if prints is not None or printed.getvalue():
            assert printed.getvalue().split("\n") == (prints or "").split("\n"), f"{page.name}:{line}"
    pyplot.close("all")


def test_every_public_name_is_in_the_reference():
    import clutch

    reference = (DOCS / "api.md").read_text(encoding="utf-8")
    missing = [name for name in clutch.__all__ if not re.search(rf"\bclutch\.{name}\b", reference)]
    assert not missing, f"docs/api.md does not have {missing}"


def test_the_documentation_builds_without_a_warning(tmp_path):
    for module in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(module)
    options = ["-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    command = [sys.executable, "-m", "sphinx", *options, DOCS, tmp_path / "html"]
    built = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert built.returncode == 0, built.stderr
    if "CLUTCH_PLAYGROUND" in os.environ:
        assert (tmp_path / "html" / Path(os.environ["CLUTCH_PLAYGROUND"]).name).is_file()
