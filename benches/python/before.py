"""Sweeps on uneven discs: by this package in lanes, one by one, and by the package of an earlier commit, built here.

The rig is the built-in `bench`, whose friction differs along the disc, and each run has a disc of its own; a tick of
delay, an encoder and a converter that round. On one thread. A candidate has a process of its own in each turn, which
does all jobs; candidates take turns, and the least of the turns counts.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass

from job import Figures

RUNS = 256
DURATION = 3.0  # s, the last two of which count
TURNS = 5
ROOT = pathlib.Path(__file__).resolve().parents[2]

#: What each candidate does; `alone`: one run after the other.
WORK = """
import json, sys, time
import clutch
from clutch import _clutch
runs, duration, alone = json.loads(sys.argv[1])
metrics = ["rms_error_rad", "max_error_rad", "stick_slip_cycles_per_s", "measured_s"]
seeds = list(range(1, runs + 1))
clutch.sweep("bench_pd_2", {"run.seed": [1]}, metrics=metrics, progress=False)  # what is imported when it is needed
found = {}
for law in ("pd", "smc"):
    for rate in (2.0, 20.0):
        overrides = {"reference.ramp.rate_deg_s": rate, "run.duration_s": duration, "run.settle_s": 1.0}
        scenario = clutch.Scenario.load(f"bench_{law}_2", overrides)
        before = time.process_time()
        if alone:
            rows = [[seed] for seed in seeds]
            sweep = _clutch.Sweep(scenario, ["run.seed"], rows, metrics, threads=1, instructions="alone")
            sweep.start()
            while not sweep.wait(10.0):
                pass
            table = sweep.result()[0]
        else:
            table = clutch.sweep(scenario, {"run.seed": seeds}, metrics=metrics, threads=1, progress=False).table
        took = time.process_time() - before
        rms, most, cycles, measured = (table[name] for name in metrics)
        figures = [float(x.mean()) for x in (rms, most, cycles * measured)]
        found[f"{law.upper()} at {rate:g} °/s"] = [took, *figures]
print(json.dumps(found))
"""


@dataclass
class Turn:
    """A job of a package, or the least of its turns."""

    cpu_s: float
    figures: Figures


def built(commit: str) -> pathlib.Path:
    """The folder with the package of a commit, as pip makes it of that commit; it stays in target/before."""
    git = ["git", "-C", str(ROOT)]
    name = subprocess.run([*git, "rev-parse", "--short", commit], capture_output=True, text=True, check=True).stdout
    folder = ROOT / "target/before" / name.strip()
    if not (folder / "clutch").exists():
        with tempfile.TemporaryDirectory() as place:
            tree = pathlib.Path(place) / "tree"
            subprocess.run([*git, "worktree", "add", "--quiet", "--detach", str(tree), commit], check=True)
            try:
                install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(folder)]
                environment = {**os.environ, "CARGO_TARGET_DIR": str(folder.parent / "target")}
                subprocess.run([*install, str(tree)], check=True, env=environment)
            finally:
                subprocess.run([*git, "worktree", "remove", "--force", str(tree)], check=True)
    return folder


def turn(folder: pathlib.Path | None, alone: bool) -> dict[str, Turn]:
    """All jobs, by the package in a folder, or by this one."""
    path = {} if folder is None else {"PYTHONPATH": str(folder)}
    command = [sys.executable, "-c", WORK, json.dumps([RUNS, DURATION, alone])]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **path}, check=True)
    return {name: Turn(took, Figures(*figures)) for name, (took, *figures) in json.loads(done.stdout).items()}


def measured(commit: str) -> dict[str, dict[str, Turn]]:
    """For each job what each candidate took at least."""
    candidates = {
        f"before, {commit}": (built(commit), False),
        "one by one": (None, True),
        "clutch.sweep": (None, False),
    }
    turns = []
    for i in range(TURNS):
        order = list(candidates.items())[:: 1 if i % 2 == 0 else -1]
        turns.append({name: turn(*how) for name, how in order})
    return {
        job: {name: min((t[name][job] for t in turns), key=lambda found: found.cpu_s) for name in candidates}
        for job in turns[0]["clutch.sweep"]
    }
