"""README, docs/python and docs/start are true: their code runs and prints what they say; no public name is left out.

On every page, the tests and cases that it cites exist; so do the names in the glossary.
"""

import contextlib
import functools
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
# A block that needs what a test machine has not: the comment says what, and names the file whose tests run it.
ELSEWHERE = re.compile(r"<!-- not run here, [^:]+: (\S+) -->\n\Z")


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


def test_the_code_of_the_page_on_logs_reads_a_log_and_one_that_was_cut(tmp_path, monkeypatch):
    for module in ("mcap", "mcap_protobuf"):
        pytest.importorskip(module)
    import clutch

    monkeypatch.chdir(tmp_path)
    clutch.simulate("smc_2").save("run.mcap")
    whole = Path("run.mcap").read_bytes()
    Path("cut.mcap").write_bytes(whole[: len(whole) // 2])
    (_, read, *_), (_, read_cut, *_) = blocks((DOCS / "log.md").read_text(encoding="utf-8"))
    printed, namespace = io.StringIO(), {}
    with contextlib.redirect_stdout(printed):
        exec(read, namespace)
    command = clutch.read_log("run.mcap").channels["command"]
    rows = [tuple(float(number) for number in line.split()[1:]) for line in printed.getvalue().splitlines()]
    assert rows == list(zip(command["error_rad"].tolist(), command["voltage_v"].tolist(), strict=True))
    exec(read_cut, namespace)
    assert 0 < namespace["decoded"].tick < len(command) - 1


def test_every_public_name_is_in_the_reference():
    import clutch

    reference = (DOCS / "api.md").read_text(encoding="utf-8")
    missing = [name for name in clutch.__all__ if not re.search(rf"\bclutch\.{name}\b", reference)]
    assert not missing, f"docs/api.md does not have {missing}"


# A test is cited by its name, and so is a key or a figure: four words or more. A case of the referee is a file's name.
CITED = re.compile(r"`(?:\w+::|\w+\.)*([a-z][a-z0-9]*(?:_[a-z0-9]+){3,})`")
CASE = re.compile(r"`([A-Z][0-9](?:_[a-z0-9_]+)?)`")
COMMENT = re.compile(r"^\s*(?://|#(?!\[)).*$", re.MULTILINE)


def tracked(*endings):
    """The files of the repository that end so, but not the list of changes: it cites what was."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, encoding="utf-8", check=True)
    names = [name for name in listed.stdout.split("\0") if name.endswith(endings) and name != "CHANGELOG.md"]
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in names if (ROOT / name).is_file()}


def words_of(*endings):
    """The words of the code in these files, without comments."""
    return set(re.findall(r"\w+", "\n".join(COMMENT.sub("", text) for text in tracked(*endings).values())))


def test_the_tests_and_cases_that_a_page_cites_exist():
    words = words_of(".rs", ".py")
    cases = {Path(name).stem for name in tracked(".toml") if name.startswith("crates/clutch-sim/cases/")}
    assert len(cases) >= 40
    cited, missing = 0, []
    for page, text in tracked(".md").items():
        for number, line in enumerate(text.split("\n"), 1):
            for pattern, known in ((CITED, words), (CASE, cases)):
                # The code itself puts `law_` before a term that has a column's name.
                names = [name.removeprefix("law_") for name in pattern.findall(line)]
                cited += len(names)
                missing += [f"{page}:{number}: {name}" for name in names if name not in known]
    assert cited > 100
    assert not missing, "\n".join(missing)


# Code of a page: a block, or within a line.
CODE = re.compile(r"^ *```\w*\n(.*?)^ *```$|`([^`\n]+)`", re.MULTILINE | re.DOTALL)
# A verb of the command, and what follows up to the end of the line.
CALLED = re.compile(r"(?:^|[$;&|(]) *clutch ([a-z]+)((?: [^\n|;#&)]*)?)", re.MULTILINE)
# Built into the released command, and into that of the tests; a user's may lack them.
FEATURES = {"--foxglove", "--scope"}


def test_the_verbs_and_options_of_the_command_that_a_page_names_exist(clutch):
    @functools.cache
    def options(*verb):
        return set(re.findall(r"(?<!\w)--[a-z][a-z-]*", clutch(*verb, "--help").stdout))

    verbs = set(re.findall(r"^  ([a-z]+)  ", clutch("--help").stdout, re.MULTILINE)) - {"help"}
    of_two = {verb for verb in verbs if "Commands:" in clutch(verb, "--help").stdout}
    assert of_two == {"friction", "log", "scenario"}
    called, wrong = 0, []
    for page, text in tracked(".md").items():
        code = "\n".join(block + span for block, span in CODE.findall(text))
        for verb, rest in CALLED.findall(re.sub(r"\\\n\s*", " ", code)):
            if verb not in verbs:
                wrong.append(f"{page}: no verb {verb}")
                continue
            second = [word for word in rest.split()[:1] if verb in of_two and word.isalpha()]
            known = options(verb, *second) | FEATURES
            given = [option.replace("_", "-") for option in re.findall(r"(?<=\s)--[a-z][a-z_-]*", rest)]
            called += 1
            wrong += [f"{page}: clutch {verb} has no {option}" for option in given if option not in known]
    assert called > 200
    assert not wrong, "\n".join(wrong)


def test_the_names_in_the_glossary_are_those_of_the_code():
    rows = [line.split("|") for line in tracked("docs/glossary.md")["docs/glossary.md"].split("\n")]
    names = [name for row in rows if len(row) == 5 for name in re.findall("`([^`]+)`", row[3])]
    assert len(names) > 60
    words = words_of(".rs", ".py", ".toml")
    missing = [name for name in names if not words.issuperset(re.findall(r"\w+", name))]
    assert not missing, missing


def test_the_documentation_builds_without_a_warning(tmp_path):
    for module in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(module)
    options = ["-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    command = [sys.executable, "-m", "sphinx", *options, DOCS, tmp_path / "html"]
    built = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert built.returncode == 0, built.stderr
    if "CLUTCH_PLAYGROUND" in os.environ:
        assert (tmp_path / "html" / Path(os.environ["CLUTCH_PLAYGROUND"]).name).is_file()
