"""Pages for those who begin, and the README's list of commands: every command runs, in its order.

Where a page has lines that a command prints, it prints them.
"""

import os
import re
import subprocess

import pytest

from test_docs_python import DOCS, ELSEWHERE, FENCE, ROOT

PAGES = sorted((DOCS / "start").glob("*.md"))


def steps(page):
    """A page's commands in order: line of the page, script, lines that it prints."""
    text = page.read_text(encoding="utf-8")
    found, end_of_last = [], None
    for fence in FENCE.finditer(text):
        language, body = fence.groups()
        if language == "sh":
            elsewhere = ELSEWHERE.search(text[: fence.start()])
            if elsewhere:
                # The tests there read the page, and run what it says.
                read = page.relative_to(ROOT).as_posix()
                assert read in (ROOT / elsewhere[1]).read_text(encoding="utf-8"), f"{elsewhere[1]} lacks {read}"
                end_of_last = None
                continue
            found.append([text[: fence.start()].count("\n") + 1, body, []])
            end_of_last = fence.end()
        elif language == "text" and end_of_last and not text[end_of_last : fence.start()].strip():
            found[-1][2] = body.splitlines()
    return found


def plain(text):
    """A text without what depends on the width of a terminal."""
    return re.sub(r"\s+", " ", text)


@pytest.fixture
def shell(clutch, tmp_path):
    """Runs a script in a folder of its own, in which `clutch` is the command: what it says."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "clutch").symlink_to(clutch.binary)
    environment = {**os.environ, "PATH": f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"}

    def run(script, place, code=0):
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", script],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            encoding="utf-8",
            timeout=180,
        )
        assert done.returncode == code, f"{place}: exit {done.returncode}: {done.stdout}{done.stderr}"
        return done.stdout + done.stderr

    return run


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_page_run_and_print_what_the_page_says(page, shell):
    for line, script, prints in steps(page):
        rest = plain(shell(script, f"{page.name}:{line}"))
        for expected in map(plain, prints):
            assert expected in rest, f"{page.name}:{line}: no {expected!r} in {rest}"
            rest = rest.split(expected, 1)[1]


# Lines of the README that these tests do not run, by how they begin, with the reason.
NOT_HERE = {
    "cargo install ": "it compiles the command that the tests have",
    "clutch daq ": "it goes on until it is stopped; tests/loop stops it",
    "clutch hil ": "it needs an emulator and an image for it; tests/hil has both",
}


def test_the_commands_of_the_readme_run_in_its_order(shell, tmp_path):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = next(body for _, body in FENCE.findall(readme) if "clutch scenario new " in body).splitlines()
    left_out = {begin for begin in NOT_HERE for line in lines if line.startswith(begin)}
    assert left_out == NOT_HERE.keys()
    run = [line for line in lines if not line.startswith(tuple(NOT_HERE))]
    assert len(run) >= 18 and all(line.startswith("clutch ") for line in run)
    for line in run:
        shell(line, line)
    made = "mine.svg laws.svg rows.csv rig.toml map.toml run.mcap run.csv reproduce/report.html"
    for file in made.split():
        assert (tmp_path / file).stat().st_size > 0, file


# A picture that leads to a page: its words, its file, the page.
LINKED = re.compile(r"\[!\[([^\]]+)\]\(([^)]+)\)\]\(([^)#]+)(?:#[^)]*)?\)")


def test_the_start_page_shows_pictures_that_lead_to_their_pages():
    found = LINKED.findall((DOCS / "index.md").read_text(encoding="utf-8"))
    assert len({picture for _, picture, _ in found}) >= 6
    for words, picture, page in found:
        assert (DOCS / picture).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", picture
        assert (DOCS / page).is_file() and len(words.split()) > 4, page


def test_each_reader_of_the_start_page_has_a_page():
    start = (DOCS / "index.md").read_text(encoding="utf-8")
    assert len(PAGES) == 5
    assert all(f"start/{page.stem}" in start for page in PAGES)
