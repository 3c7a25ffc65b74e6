"""Cost of the built-in scenarios in two builds of the command: processor time in turns, and instructions.

    python3 benches/before_after.py BEFORE AFTER [--turns 100] [--instructions]

BEFORE and AFTER are binaries of `clutch`, each of `cargo build --release --package clutch-cli` in a clone of its own.
The scenarios are those of this tree that both know. `clutch sim NAME` is timed as it is (the command), and its share
that grows with the run (the run): what it takes more than with a run of one period.

Processor time is user's and system's of the child process. Builds take turns, and the first of a turn changes from turn
to turn, so that a disturbance of the machine meets both. A time is the least of its turns, since others only add to it;
the last column has the median of the ratios within a turn. With --instructions valgrind counts, too, which no
disturbance changes. Prints a table in Markdown.
"""

import argparse
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile

SCENARIOS = pathlib.Path(__file__).resolve().parents[1] / "crates/clutch-sim/scenarios"
#: Of one period: what the command does besides the run.
SHORT = ["--set", "run.duration_s=0.001", "--set", "run.settle_s=0"]

Command = list[str | pathlib.Path]


def run(command: Command) -> None:
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stderr}")


def knows(binary: pathlib.Path, scenario: str) -> bool:
    return subprocess.run([binary, "scenario", "show", scenario], capture_output=True).returncode == 0


def processor_time(command: Command) -> float:
    """Milliseconds, user's and system's."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def instructions(command: Command) -> float:
    """Millions of instructions, as valgrind counts them."""
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "log"
        run(["valgrind", "--tool=callgrind", f"--log-file={log}", "--callgrind-out-file=/dev/null", *command])
        found = re.search(r"Collected : (\d+)", log.read_text())
    if found is None:
        sys.exit("valgrind printed no count")
    return 1e-6 * int(found[1])


def measured(builds: list[pathlib.Path], scenario: str, turns: int) -> list[list[tuple[float, float]]]:
    """Times of each build, for each turn: milliseconds of the command, and of that with one period."""
    found: list[list[tuple[float, float]]] = [[], []]
    for turn in range(turns):
        for which in (0, 1) if turn % 2 == 0 else (1, 0):
            whole = [builds[which], "sim", scenario]
            found[which].append((processor_time(whole), processor_time([*whole, *SHORT])))
    return found


def row(builds: list[pathlib.Path], scenario: str, options: argparse.Namespace) -> list[str]:
    turns = measured(builds, scenario, options.turns)
    whole = [min(t for t, _ in build) for build in turns]
    alone = [least - min(t for _, t in build) for least, build in zip(whole, turns, strict=True)]
    pairs = [(a[0] - a[1], b[0] - b[1]) for a, b in zip(*turns, strict=True)]
    median = statistics.median(b / a for a, b in pairs)
    cells = [f"`{scenario}`"]
    for before, after in (whole, alone):
        cells += [f"{before:.1f}", f"{after:.1f}", f"{after / before:.2f}"]
    cells.append(f"{median:.2f}")
    if options.instructions:
        counts = []
        for build in builds:
            whole = [build, "sim", scenario]
            counts.append(instructions(whole) - instructions([*whole, *SHORT]))
        cells += [f"{counts[0]:.0f}", f"{counts[1]:.0f}", f"{counts[1] / counts[0]:.2f}"]
    return cells


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of the built-in scenarios in two builds of the command")
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("--turns", type=int, default=100)
    parser.add_argument("--instructions", action="store_true", help="count them, with valgrind")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these scenarios alone")
    options = parser.parse_args()
    builds = [options.before.resolve(), options.after.resolve()]
    names = options.only or sorted(path.stem for path in SCENARIOS.glob("*.toml"))
    names = [name for name in names if all(knows(build, name) for build in builds)]

    header = ["scenario", "command: before", "after", "ratio", "run: before", "after", "ratio", "median ratio"]
    header += ["10⁶ instructions of the run: before", "after", "ratio"] if options.instructions else []
    print(f"ms of processor, {options.turns} turns, load {os.getloadavg()[1]:.1f} on {os.cpu_count()} processors\n")
    print(f"| {' | '.join(header)} |\n|{'---|' * len(header)}")
    for name in names:
        print(f"| {' | '.join(row(builds, name, options))} |", flush=True)


if __name__ == "__main__":
    main()
