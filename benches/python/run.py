"""clutch's Python package against peers, in one run: see README.md.

python benches/python/run.py [--quick] [--json FILE]
"""

import argparse
import functools
import itertools
import json
import math
import os
import pathlib
import time
from dataclasses import asdict, dataclass

# Waiting threads must not burn the CPU seconds that are being counted. Before anything starts threads.
os.environ["OMP_WAIT_POLICY"] = "passive"

import c_peer
import call
import diffrax_peer
import imports
import numba_peer
import ours
import reference
import scipy_peer
from job import DURATION, KD, KP, RATES, Figures, gains
from timing import Candidate, interleave

MARGIN = 1.25  # how far the cost per run may be above the best


@dataclass
class Row:
    """A line of the report. `ratio` is clutch's speed over the candidate's, unless the section says otherwise."""

    section: str
    candidate: str
    cpu_s: float
    simulated_per_cpu: float | None = None
    figures: Figures | None = None
    ratio: float | None = None
    target: float | None = None
    at_most: bool = False  # the target is a ceiling

    @property
    def bound(self) -> str:
        return "" if self.target is None else f"{'≤' if self.at_most else '≥'} {self.target:g}"

    @property
    def reached(self) -> bool | None:
        if self.target is None:
            return None
        return self.ratio <= self.target if self.at_most else self.ratio >= self.target


def one_run(job: str, quick: bool) -> list[Row]:
    """One run of the job: solvers that a Python user would take, and ours."""
    scenario = ours.scenario(job)
    one = [(KP, KD)]
    slow, fast = (1, 5) if quick else (2, 7)
    targets = {"scipy": 4000.0, "numba": 25.0} if job == "J20" else {"scipy": 1500.0, "numba": 5.0}
    tight = {"rtol": 1e-6, "atol": 1e-9}
    peers = [
        (Candidate("SciPy RK45, its defaults", lambda: scipy_peer.run(job), slow), targets["scipy"]),
        (Candidate("numba RK4, 10 steps a sample", lambda: numba_peer.run(job), fast), targets["numba"]),
    ]
    if diffrax_peer.INSTALLED:
        diffrax_peer.run(job)  # compiles
        peers.append((Candidate("diffrax Tsit5, 1e-6", lambda: diffrax_peer.run(job), fast), None))
    if not quick:
        path = scenario.path().table()["position_rad"]
        peers += [
            (Candidate("SciPy RK45, 1e-6", lambda: scipy_peer.run(job, **tight), slow), targets["scipy"]),
            (Candidate("reference, DOP853 1e-12", lambda: reference.run(job), 1), None),
            (Candidate("reference on clutch's targets", lambda: reference.run(job, path), 1), None),
        ]
    mine = Candidate("clutch.simulate, samples kept", lambda: ours.run(scenario), fast)
    bare = Candidate("clutch.sweep of one, figures only", lambda: ours.run_many(scenario, one), fast)
    interleave([*(c for c, _ in peers), mine, bare])

    section = f"one run, {job}"
    rows = [Row(section, c.name, c.cpu, DURATION / c.cpu, c.result, c.cpu / mine.cpu, target) for c, target in peers]
    rows += [Row(section, c.name, c.cpu, DURATION / c.cpu, c.result) for c in (mine, bare)]
    return rows


def many_runs(job: str, quick: bool) -> list[Row]:
    """Runs with different gains on all cores; CPU seconds are the sum over the cores."""
    n = 128 if quick else 4096
    scenario, pairs = ours.scenario(job), gains(n)
    rounds = 3 if quick else 5
    targets = {"numba": 350.0, "c": 40.0} if job == "J20" else {"numba": 25.0, "c": 4.0}
    numba = Candidate("numba RK4, 10 steps a sample, prange", lambda: numba_peer.run_many(job, n), 1)
    mine = Candidate("clutch.sweep", lambda: ours.run_many(scenario, pairs), rounds)
    turns = [("", [(numba, targets["numba"])], mine)]
    for i, (name, ours_name, march) in enumerate(c_peer.instructions()):
        peers = []
        for kind, method in c_peer.NAMES.items():
            c_peer.build(kind, march)
            work = functools.partial(c_peer.run_many, kind, job, n, march)
            target = targets["c"] if kind == "brute" else None
            peers.append((Candidate(f"C in vectors, {method}, {name}", work, rounds), target))
        if i == 0:  # the widest, which clutch takes by itself
            turns[0][1].extend(peers)
        else:
            narrow = functools.partial(ours.run_in, ours_name, scenario, pairs)
            turns.append((f", {name} only", peers, Candidate("clutch.sweep", narrow, rounds)))
    rows = []
    for only, peers, our in turns:
        interleave([*(c for c, _ in peers), our])
        section, simulated = f"{n} runs, {job}{only}", n * DURATION
        rows += [Row(section, c.name, c.cpu, simulated / c.cpu, c.result, c.cpu / our.cpu, to) for c, to in peers]
        rows.append(Row(section, our.name, our.cpu, simulated / our.cpu, our.result))
    return rows


def scaling(section: str, cells: list[tuple[str, int, float, Candidate]], per_second: bool) -> list[Row]:
    """Cost per run, or per simulated second of a run, over the lowest of the section."""
    interleave([c for _, _, _, c in cells])
    cost = [c.cpu / (n * duration if per_second else n) for _, n, duration, c in cells]
    return [
        Row(section, name, c.cpu, n * duration / c.cpu, c.result, own / min(cost), MARGIN, at_most=True)
        for (name, n, duration, c), own in zip(cells, cost, strict=True)
    ]


def scaling_in_runs(job: str, quick: bool) -> list[Row]:
    """Short runs, which show the cost of each run beside the simulation."""
    scenario = ours.scenario(job, duration=1.0, settle=0.0)
    cells = []
    for n in (32, 256) if quick else (32, 1000, 4096, 20000):
        work = Candidate("", functools.partial(ours.run_many, scenario, gains(n)), 3 if quick else 5)
        cells.append((f"{n} runs of 1 s", n, 1.0, work))
    return scaling(f"cost per run, {job}", cells, per_second=False)


def scaling_in_time(job: str, quick: bool) -> list[Row]:
    pairs = gains(16)
    cells = []
    for duration in (1.0, 10.0) if quick else (1.0, 10.0, 60.0, 600.0):
        scenario = ours.scenario(job, duration=duration, settle=0.0)
        work = Candidate("", functools.partial(ours.run_many, scenario, pairs), 3 if quick else 5)
        cells.append((f"{len(pairs)} runs of {duration:g} s", len(pairs), duration, work))
    return scaling(f"cost per simulated second, {job}", cells, per_second=True)


def hundred_thousand(job: str) -> list[Row]:
    """As long as somebody waits for a table of a hundred thousand runs, on all cores: the least of three."""
    scenario, pairs = ours.scenario(job, duration=1.0, settle=0.0), gains(100_000)
    waits = []
    for _ in range(3):
        begin, before = time.perf_counter(), time.process_time()
        figures = ours.run_many(scenario, pairs)
        waits.append((time.perf_counter() - begin, time.process_time() - before))
    wall, cpu = min(waits)
    section = f"100 000 runs of 1 s, {os.cpu_count()} cores, {job}; ratio: seconds until the table is there"
    return [Row(section, "clutch.sweep", cpu, len(pairs) / cpu, figures, wall, 2.0, at_most=True)]


def calls(quick: bool) -> list[Row]:
    """Cost of one step of the law; the loop around it is subtracted."""
    mine, law, servo, checked, empty = call.candidates(5 if quick else 15)
    interleave([mine, law, servo, checked, empty])
    net = {c.name: (c.cpu - empty.cpu) / call.CALLS for c in (mine, law, servo, checked)}
    section = "one call, without the loop around it; ratios: ours over a floor's"
    rows = [Row(section, mine.name, net[mine.name])]
    return rows + [
        Row(section, c.name, net[c.name], ratio=net[mine.name] / net[c.name], target=target, at_most=True)
        for c, target in ((law, 1.25), (servo, 1.5), (checked, None))
    ]


def importing(quick: bool) -> list[Row]:
    seconds = imports.seconds(5 if quick else 15)
    section = "import, in json's"
    return [Row(section, f"import {name}", took, ratio=took / seconds["json"]) for name, took in seconds.items()]


def number(x: float | None, form: str = "") -> str:
    """`x` in a form, else to three digits, but whole above 100."""
    return "" if x is None else format(x, form or (",.0f" if x >= 100.0 else ".3g"))


def show(rows: list[Row]) -> str:
    """The report, a table in Markdown for each section."""
    lines = []
    for section, group in itertools.groupby(rows, key=lambda r: r.section):
        some = list(group)
        columns = {"candidate": [r.candidate for r in some], "CPU s": [number(r.cpu_s) for r in some]}
        if some[0].figures:
            columns["simulated s per CPU s"] = [number(r.simulated_per_cpu) for r in some]
            columns["rms error °"] = [number(math.degrees(r.figures.rms), ".6f") for r in some]
            columns["max error °"] = [number(math.degrees(r.figures.max), ".6f") for r in some]
            columns["sticks"] = [number(r.figures.sticks) for r in some]
        columns["ratio"] = [number(r.ratio) for r in some]
        if any(r.target for r in some):
            columns["target"] = [r.bound for r in some]
            columns["reached"] = [{None: "", True: "yes", False: "**no**"}[r.reached] for r in some]
        lines += ["", f"**{section}**", "", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
        lines += [f"| {' | '.join(cells)} |" for cells in zip(*columns.values(), strict=True)]
    return "\n".join(lines[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and runs: below 40 s")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path, help="write the rows here too")
    options = parser.parse_args()
    quick = options.quick

    numba_peer.compile_all()
    rows = []
    for job in RATES:
        rows += one_run(job, quick)
    for job in RATES:
        rows += many_runs(job, quick)
    rows += calls(quick)
    rows += importing(quick)
    for job in RATES:
        rows += scaling_in_runs(job, quick)
    for job in RATES:
        rows += scaling_in_time(job, quick)
    if not quick:
        rows += hundred_thousand("J20")

    print(show(rows))
    heavy = imports.brought_along()
    print(f"\n`import clutch` imports {', '.join(heavy) or 'none'} of {', '.join(imports.HEAVY)}.")
    if options.json:
        found = [asdict(r) | {"reached": r.reached} for r in rows]
        options.json.write_text(json.dumps({"rows": found, "imported": heavy}, indent=1) + "\n")


if __name__ == "__main__":
    main()
