"""clutch's Python package against peers, in one run: see README.md.

python benches/python/run.py [--quick] [--before COMMIT] [--page] [--json FILE]
"""

import argparse
import functools
import itertools
import json
import math
import os
import pathlib
import re
import time
from dataclasses import asdict, dataclass, replace

# Waiting threads must not burn the CPU seconds that are being counted. Before anything starts threads.
os.environ["OMP_WAIT_POLICY"] = "passive"

import numpy as np

import before
import c_peer
import call
import diffrax_peer
import imports
import numba_peer
import ours
import reference
import scipy_peer
from job import ACCURACY, JOBS, KD, KP, Figures, gains
from timing import Candidate, interleave

MARGIN = 1.25  # how far the cost per run may be above the best
LOOSE, TIGHT = {}, {"rtol": 1e-6, "atol": 1e-9}  # tolerances of SciPy
PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/speed.md"


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
    means: str = "ratio"  # what `ratio` is, if it is none

    @property
    def bound(self) -> str:
        return "" if self.target is None else f"{'≤' if self.at_most else '≥'} {self.target:g}"

    @property
    def reached(self) -> bool | None:
        if self.target is None:
            return None
        return self.ratio <= self.target if self.at_most else self.ratio >= self.target


def one_run(name: str, quick: bool) -> list[Row]:
    """One run of the job: solvers that a Python user would take, and ours; then those that keep figures alone."""
    job = JOBS[name]
    scenario = ours.scenario(job)
    one = [(KP, KD)]
    slow, fast = (1, 5) if quick else (5, 7)
    targets = {"scipy": 4000.0, "numba": 25.0} if name == "J20" else {"scipy": 1500.0, "numba": 5.0}
    numba = Candidate("numba RK4, 10 steps a sample", lambda: numba_peer.run(job), fast)
    peers = [
        (Candidate("SciPy RK45, its defaults", lambda: scipy_peer.run(job, **LOOSE), slow), targets["scipy"]),
        (numba, targets["numba"]),
    ]
    if diffrax_peer.INSTALLED:
        diffrax_peer.run(job)  # compiles
        peers.append((Candidate("diffrax Tsit5, 1e-6", lambda: diffrax_peer.run(job), fast), None))
    if not quick:
        path = scenario.path().table()["position_rad"]
        peers += [
            (Candidate("SciPy RK45, 1e-6", lambda: scipy_peer.run(job, **TIGHT), slow), targets["scipy"]),
            (Candidate("reference, DOP853 1e-13", lambda: reference.run(job), slow), None),
            (Candidate("reference on clutch's targets", lambda: reference.run(job, path), slow), None),
        ]
    mine = Candidate("clutch.simulate, samples kept", lambda: ours.run(scenario), fast)
    bare = Candidate("clutch.sweep of one", lambda: ours.run_many(scenario, one), fast)
    interleave([*(c for c, _ in peers), mine, bare])

    def rows(section: str, peers: list[tuple[Candidate, float | None]], mine: Candidate) -> list[Row]:
        speed = [Row(section, c.name, c.cpu, job.duration / c.cpu, c.result, c.cpu / mine.cpu, to) for c, to in peers]
        return [*speed, Row(section, mine.name, mine.cpu, job.duration / mine.cpu, mine.result)]

    only_figures = rows(f"one run, {name}, of which only figures are kept", [(numba, targets["numba"])], bare)
    return rows(f"one run, {name}", peers, mine) + only_figures


def accuracy(quick: bool) -> list[Row]:
    """Positions of a run against the reference's: ours, which has targets of its own, against those on these."""
    slow, fast = (1, 3) if quick else (5, 5)
    rows = []
    for name, (job, most) in ACCURACY.items():
        scenario = ours.scenario(job)
        path = scenario.path().table()["position_rad"]
        engines = [
            (of, scenario.override({"run.engine": engine}))
            for of, engine in (("exact flow", "exact_flow"), ("Dormand–Prince", "dormand_prince"))
        ]
        right, right_of_ours = (
            ("reference, DOP853 1e-13", functools.partial(reference.run, job), None, slow),
            ("reference on clutch's targets", functools.partial(reference.run, job, path), None, slow),
        )
        works = [
            ("SciPy RK45, its defaults", functools.partial(scipy_peer.run, job, **LOOSE), right, slow),
            ("SciPy RK45, 1e-6", functools.partial(scipy_peer.run, job, **TIGHT), right, slow),
            ("numba RK4, 10 steps a sample", functools.partial(numba_peer.run, job), right, fast),
            *(
                (f"C in vectors, exact flow, {width}", functools.partial(c_peer.move, job, march), right, fast)
                for width, _, march in c_peer.instructions()[:1]
            ),
            right,
            right_of_ours,
            *((f"clutch.simulate, {of}", functools.partial(ours.run, s), right_of_ours, fast) for of, s in engines),
        ]
        seen = {label: np.empty(job.ticks) for label, *_ in works}
        turns = [Candidate(label, functools.partial(work, seen=seen[label]), n) for label, work, _, n in works]
        interleave(turns)
        for c, (label, _, against, _) in zip(turns, works, strict=True):
            apart = None if against is None else float(abs(seen[label] - seen[against[0]]).max())
            target = most if label.startswith("clutch") else None
            section = f"accuracy, {job.duration:g} s at {name}, an encoder as good as none"
            told = {"at_most": True, "means": "position off by, rad"}
            rows.append(Row(section, label, c.cpu, job.duration / c.cpu, c.result, apart, target, **told))
    return rows


def many_runs(name: str, quick: bool) -> list[Row]:
    """Runs with different gains on all cores; CPU seconds are the sum over the cores."""
    n = 128 if quick else 4096
    job = JOBS[name]
    scenario, pairs = ours.scenario(job), gains(n)
    rounds = 3 if quick else 5
    targets = {"numba": 350.0, "c": 40.0} if name == "J20" else {"numba": 25.0, "c": 4.0}
    numba = Candidate("numba RK4, 10 steps a sample, prange", lambda: numba_peer.run_many(job, n), 1 if quick else 5)
    mine = Candidate("clutch.sweep", lambda: ours.run_many(scenario, pairs), rounds)
    turns = [("", [(numba, targets["numba"])], mine)]
    for i, (width, ours_name, march) in enumerate(c_peer.instructions()):
        peers = []
        for kind, method in c_peer.NAMES.items():
            c_peer.build(kind, march)
            work = functools.partial(c_peer.run_many, kind, job, n, march)
            target = targets["c"] if kind == "brute" else None
            peers.append((Candidate(f"C in vectors, {method}, {width}", work, rounds), target))
        if i == 0:  # the widest, which clutch takes by itself
            turns[0][1].extend(peers)
        else:
            narrow = functools.partial(ours.run_in, ours_name, scenario, pairs)
            turns.append((f", {width} only", peers, Candidate("clutch.sweep", narrow, rounds)))
    rows = []
    for only, peers, our in turns:
        interleave([*(c for c, _ in peers), our])
        section, simulated = f"{n} runs, {name}{only}", n * job.duration
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


def scaling_in_runs(name: str, quick: bool) -> list[Row]:
    """Short runs, which show the cost of each run beside the simulation."""
    scenario = ours.scenario(replace(JOBS[name], duration=1.0, settle=0.0))
    cells = []
    for n in (32, 256) if quick else (32, 1000, 4096, 20_000, 100_000):
        work = Candidate("", functools.partial(ours.run_many, scenario, gains(n)), 3 if quick else 5)
        cells.append((f"{n} runs of 1 s", n, 1.0, work))
    return scaling(f"cost per run, {name}", cells, per_second=False)


def scaling_in_time(name: str, quick: bool) -> list[Row]:
    """Few runs, on one thread whatever their length: for short runs a sweep takes fewer, whose lanes are fuller."""
    pairs = gains(16)
    cells = []
    for duration in (1.0, 10.0) if quick else (1.0, 10.0, 60.0, 600.0, 3600.0):
        scenario = ours.scenario(replace(JOBS[name], duration=duration, settle=0.0))
        work = Candidate("", functools.partial(ours.run_many, scenario, pairs, threads=1), 3 if quick else 5)
        cells.append((f"{len(pairs)} runs of {duration:g} s", len(pairs), duration, work))
    return scaling(f"cost per simulated second, {name}, on one thread", cells, per_second=True)


def hundred_thousand(name: str) -> list[Row]:
    """As long as somebody waits for a table of a hundred thousand runs, on all cores."""
    scenario, pairs = ours.scenario(replace(JOBS[name], duration=1.0, settle=0.0)), gains(100_000)
    waits = []

    def work() -> Figures:
        begin = time.perf_counter()
        figures = ours.run_many(scenario, pairs)
        waits.append(time.perf_counter() - begin)
        return figures

    sweep = Candidate("clutch.sweep", work)
    interleave([sweep])
    section = f"100 000 runs of 1 s, {os.cpu_count()} cores, {name}"
    told = {"at_most": True, "means": "s until the table is there"}
    return [Row(section, sweep.name, sweep.cpu, len(pairs) / sweep.cpu, sweep.result, min(waits), 2.0, **told)]


def on_bench(commit: str) -> list[Row]:
    """Runs on uneven discs: in lanes, one by one, and by the package of an earlier commit."""
    rows = []
    for name, turns in before.measured(commit).items():
        lanes = turns["clutch.sweep"]
        target = {"PD": 40.0, "SMC": 30.0}[name.split()[0]]
        section = f"{before.RUNS} runs of {before.DURATION:g} s on `bench`, {name}"
        for candidate, found in turns.items():
            ratio, to = (None, None) if found is lanes else (found.cpu_s / lanes.cpu_s, target)
            # What the lanes themselves bring has no goal of its own.
            to = to if candidate.startswith("before") else None
            speed = before.RUNS * before.DURATION / found.cpu_s
            rows.append(Row(section, candidate, found.cpu_s, speed, found.figures, ratio, to))
    return rows


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
    """`x` in a form, else to three digits, but whole above 100; empty where there is none."""
    return "" if x is None or math.isnan(x) else format(x, form or (",.0f" if x >= 100.0 else ".3g"))


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
        columns[some[0].means] = [number(r.ratio) for r in some]
        if any(r.target for r in some):
            columns["target"] = [r.bound for r in some]
            columns["reached"] = [{None: "", True: "yes", False: "**no**"}[r.reached] for r in some]
        lines += ["", f"**{section}**", "", f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
        lines += [f"| {' | '.join(cells)} |" for cells in zip(*columns.values(), strict=True)]
    return "\n".join(lines[1:])


def paste(tables: str) -> None:
    """Puts the tables into docs/speed.md; what stands above them is written by hand."""
    text = PAGE.read_text()
    heading = "## The tables\n"
    above, found, _ = text.partition(heading)
    assert found, f"{PAGE}: no heading {heading!r}"
    PAGE.write_text(f"{above}{heading}\n{tables}\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and runs: below a minute")
    parser.add_argument("--before", metavar="COMMIT", help="build this commit's package, and compare runs on `bench`")
    parser.add_argument("--only", metavar="TABLE", help="tables whose names have this in them, a regular expression")
    parser.add_argument("--page", action="store_true", help="put the tables into docs/speed.md")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path, help="write the rows here too")
    options = parser.parse_args()
    quick = options.quick

    parts = {f"one run, {job}": functools.partial(one_run, job, quick) for job in JOBS}
    parts["accuracy"] = functools.partial(accuracy, quick)
    parts |= {f"many runs, {job}": functools.partial(many_runs, job, quick) for job in JOBS}
    if options.before:
        parts["bench"] = functools.partial(on_bench, options.before)
    parts["one call"] = functools.partial(calls, quick)
    parts["import"] = functools.partial(importing, quick)
    parts |= {f"cost per run, {job}": functools.partial(scaling_in_runs, job, quick) for job in JOBS}
    parts |= {f"cost per simulated second, {job}": functools.partial(scaling_in_time, job, quick) for job in JOBS}
    if not quick:
        parts |= {f"100 000 runs, {job}": functools.partial(hundred_thousand, job) for job in JOBS}
    parts = {name: work for name, work in parts.items() if re.search(options.only or "", name)}

    numba_peer.compile_all()
    rows = [row for work in parts.values() for row in work()]
    heavy = imports.brought_along()
    tables = f"{show(rows)}\n\n`import clutch` imports {', '.join(heavy) or 'none'} of {', '.join(imports.HEAVY)}."
    print(tables)
    if options.page:
        paste(tables)
    if options.json:
        found = [asdict(r) | {"reached": r.reached} for r in rows]
        options.json.write_text(json.dumps({"rows": found, "imported": heavy}, indent=1) + "\n")


if __name__ == "__main__":
    main()
