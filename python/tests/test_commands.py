"""The pages on the command are true: every line of theirs that begins with `clutch` runs, and prints what follows it.

The pages for those who begin, and the README, are in test_start.py; the options of any page in test_docs_python.py.
"""

import re
import shutil
import textwrap

import pytest

from test_docs_python import DOCS
from test_start import plain, shell

__all__ = ["shell"]

BLOCK = re.compile(r"^( *)```sh\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
PRINTS = re.compile(r"\A\s*```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Commands that are not run here, by what they have, with the reason.
NOT_HERE = {
    " --port ": "it needs a board, or another terminal",
    " --board ": "it needs a board that closes the loop",
    " --scope": "it needs a terminal; crates/clutch-cli/tests/views.rs has one",
    " --foxglove": "it is in the released command alone; crates/clutch-cli/tests/views.rs has it",
    "clutch daq": "it goes on until it is stopped; tests/loop stops it",
    "clutch hil": "it needs an emulator and an image for it; tests/hil has both",
    " --loaded ": "it needs experiments on two rigs; crates/clutch-cli/tests/cli.rs has it",
    "=R ": "it has letters in place of numbers",
}


def commands(text):
    """A page's commands in order: line of the page, command, lines that it prints, its exit code."""
    for block in BLOCK.finditer(text):
        line = text[: block.start()].count("\n") + 2
        body = textwrap.dedent(block[2])
        prints = PRINTS.match(text[block.end() :])
        whole = re.sub(r"\\\n\s*", " ", body)
        # A loop is one command.
        parts = [whole] if whole.startswith("for ") else whole.splitlines()
        own = [part for part in parts if part.startswith(("clutch ", "for "))]
        for part in own:
            code = re.search(r"# exit code (\d+)", part)
            told = prints[1].splitlines() if prints and len(own) == 1 else []
            yield line, part, told, int(code[1]) if code else 0


def left_out(command):
    """True if a command is not run here."""
    return any(part in f"{command.split('#')[0]} " for part in NOT_HERE)


COMMANDS = {page.stem: list(commands(page.read_text(encoding="utf-8"))) for page in sorted(DOCS.glob("*.md"))}
RUN = [page for page, found in COMMANDS.items() if any(not left_out(command) for _, command, _, _ in found)]


@pytest.fixture(scope="module")
def begun(clutch, tmp_path_factory):
    """The files that the pages take to be there: a scenario of one's own, logs of its rig, and the log of a run."""
    folder = tmp_path_factory.mktemp("begun")
    mine = folder / "mine.toml"
    clutch("scenario", "new", mine, "--from", "board_smc_2")
    clutch("identify", mine, "--log", folder / "logs", "--out", folder / "rig.toml")
    shutil.copy(folder / "logs" / "ride_5.mcap", folder / "ride.mcap")
    clutch("sim", mine, "--log", folder / "run.mcap")
    return folder


@pytest.mark.parametrize("page", RUN)
def test_the_commands_of_a_page_run(page, begun, shell, tmp_path):
    shutil.copytree(begun, tmp_path, dirs_exist_ok=True)
    for line, command, prints, code in COMMANDS[page]:
        if left_out(command):
            continue
        # A page that writes a file that is there means a reader's own.
        for name in re.findall(r"--(?:out|plot|csv|log|save|html) ([\w.]+)", command):
            (tmp_path / name).unlink(missing_ok=True)
        said = plain(shell(command, f"{page}.md:{line}", code))
        for expected in map(plain, prints):
            assert expected in said, f"{page}.md:{line}: no {expected!r} in {said}"


def test_each_reason_for_leaving_a_command_out_is_needed():
    found = [command.split("#")[0] for page in COMMANDS.values() for _, command, _, _ in page]
    assert len(found) > 50
    for part in NOT_HERE:
        assert any(part in f"{command} " for command in found), f"no command has {part!r} any more"
