"""The `clutch` binary as the tests see it.

Run with ``pytest python/tests``. The binary is ``CLUTCH_BIN``, else ``target/release/clutch``.
"""

import itertools
import json
import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

import browser

ROOT = Path(__file__).resolve().parents[2]

# A shell that starts the tests in the background makes them ignore Ctrl-C; some wait for one.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def toml(table, prefix=""):
    """A nested dict as TOML: values first, then tables."""
    values = [f"{k} = {json.dumps(v)}" for k, v in table.items() if not isinstance(v, dict)]
    parts = ["\n".join(values)] if values else []
    for key, inner in table.items():
        if isinstance(inner, dict):
            parts += [f"[{prefix}{key}]", toml(inner, f"{prefix}{key}.")]
    return "\n".join(parts)


class Clutch:
    """Runs the command; scenario files and CSVs go to a folder of their own."""

    def __init__(self, binary, folder):
        self.binary, self.folder, self.number = binary, folder, itertools.count()

    def __call__(self, *args, code=0):
        """Run a verb; anything but the expected exit code fails the test."""
        done = subprocess.run([self.binary, *map(str, args)], capture_output=True, encoding="utf-8", timeout=120)
        if code is not None:
            assert done.returncode == code, f"clutch {args}: exit {done.returncode}\n{done.stderr}"
        return done

    def simulate(self, scenario, *settings):
        """`clutch sim` on a dict or a built-in name: the JSON summary and the CSV's columns."""
        stem = self.folder / f"{next(self.number)}"
        if isinstance(scenario, dict):
            file = stem.with_suffix(".toml")
            file.write_text(toml(scenario), encoding="utf-8")
            scenario = file
        options = [x for s in settings for x in ("--set", s)]
        done = self("sim", scenario, "--json", "--csv", stem.with_suffix(".csv"), *options)
        columns = np.genfromtxt(stem.with_suffix(".csv"), delimiter=",", names=True)
        return json.loads(done.stdout), columns


@pytest.fixture(scope="session")
def clutch(tmp_path_factory):
    """The command."""
    chosen = os.environ.get("CLUTCH_BIN")
    binary = Path(chosen) if chosen else ROOT / "target" / "release" / "clutch"
    if not binary.is_file():
        pytest.exit(
            f"{binary} does not exist: run `cargo build --release -p clutch-cli` or set CLUTCH_BIN",
            returncode=2,
        )
    return Clutch(binary.resolve(), tmp_path_factory.mktemp("clutch"))


@pytest.fixture(scope="session")
def clutch_with_parquet(clutch, tmp_path_factory):
    """The command, if it was built to write Parquet, as the released one is."""
    folder = tmp_path_factory.mktemp("parquet")
    done = clutch("log", "export", folder / "none.mcap", "--out", folder / "none.parquet", code=1)
    if "expected a name that ends with .csv;" in done.stderr:
        pytest.skip("the command is built without Parquet")
    return clutch


@pytest.fixture(scope="module")
def page():
    """A page in a browser."""
    if not browser.program():
        pytest.skip("needs Chromium")
    with browser.page() as opened:
        yield opened
