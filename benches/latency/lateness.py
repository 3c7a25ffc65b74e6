"""Lateness of a thread that wakes at 1 kHz: cyclictest, and this project's two wait modes, in turn.

    python3 benches/latency/lateness.py [--rounds 10] [--cycles 3000] [--cpu 1] [--priority 80]

The three take turns in each round, in an order that changes, so that a disturbance of the machine
meets all of them. Percentiles are exact, over the cycles of all rounds. On a shared or virtual
machine only the ratios mean something: the time the host took away meanwhile is printed too.

Needs cargo. cyclictest (Debian: apt install rt-tests) is left out with a message if it is missing.
The example also checks that the measured loop makes no allocation.
"""

import argparse
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def steal_seconds() -> float:
    """Processor time the host took from this machine since its start, s."""
    fields = pathlib.Path("/proc/stat").read_text().split("\n", 1)[0].split()
    return int(fields[8]) / os.sysconf("SC_CLK_TCK") if len(fields) > 8 else 0.0


def percentile(ordered: list[int], percent: float) -> int:
    """The smallest value that `percent` of all do not exceed."""
    return ordered[max(math.ceil(percent / 100 * len(ordered)), 1) - 1]


def build() -> str:
    command = ["cargo", "build", "--release", "--package", "clutch-loop", "--example", "lateness"]
    subprocess.run(command, cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return str(ROOT / target / "release/examples/lateness")


def ours(binary: str, mode: str, options: argparse.Namespace) -> list[int]:
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "lateness"
        command = [binary, "--mode", mode, "--spin-us", str(options.spin_us), "--cycles", str(options.cycles)]
        command += ["--priority", str(options.priority), "--cpu", str(options.cpu), "--out", str(out)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
        NOTES.update(line for line in done.stderr.splitlines() if line)
        return [int(line) for line in out.read_text().split()]


def cyclictest(options: argparse.Namespace) -> list[int]:
    # -v prints each cycle, -N in ns; it drops cycles only if its printer falls a whole ring behind.
    command = ["cyclictest", "-v", "-N", "-m", "-t", "1", "-i", "1000", "-l", str(options.cycles)]
    command += ["-p", str(options.priority), "-a", str(options.cpu)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return [int(late) for late in re.findall(r"^\s*0:\s*\d+:\s*(\d+)\s*$", done.stdout, re.MULTILINE)]


NOTES: set[str] = set()


def main() -> None:
    parser = argparse.ArgumentParser(description="Wake-up lateness at 1 kHz against cyclictest")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=3000, help="of each candidate in a round")
    parser.add_argument("--cpu", type=int, default=(os.cpu_count() or 1) - 1)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--spin-us", type=int, default=200)
    parser.add_argument("--binary", help="the built example, instead of building it")
    options = parser.parse_args()

    binary = options.binary or build()
    candidates = {
        "sleep": lambda: ours(binary, "sleep", options),
        "sleep+spin": lambda: ours(binary, "spin", options),
    }
    if shutil.which("cyclictest"):
        candidates = {"cyclictest": lambda: cyclictest(options)} | candidates
    else:
        print("cyclictest is not installed (Debian: apt install rt-tests): no ratios", file=sys.stderr)

    rounds: dict[str, list[list[int]]] = {name: [] for name in candidates}
    names = list(candidates)
    before = steal_seconds()
    for turn in range(options.rounds):
        for k in range(len(names)):
            name = names[(turn + k) % len(names)]
            rounds[name].append(sorted(candidates[name]()))
    stolen = steal_seconds() - before

    for note in sorted(NOTES):
        print(note)
    percents = (50, 99, 99.9, 99.99, 100)
    pooled = {name: sorted(late for block in blocks for late in block) for name, blocks in rounds.items()}
    print(f"lateness at 1 kHz, µs; processor {options.cpu}, SCHED_FIFO {options.priority}, {options.rounds} rounds;")
    print(f"spinning begins {options.spin_us} µs before; the host took {stolen:.2f} s of processor time meanwhile")
    print(f"{'':12}{'cycles':>8}{'p50':>10}{'p99':>10}{'p99.9':>10}{'p99.99':>10}{'max':>10}")
    for name, late in pooled.items():
        values = "".join(f"{percentile(late, percent) / 1000:10.2f}" for percent in percents)
        print(f"{name:12}{len(late):8}{values}")
    if "cyclictest" not in pooled:
        return
    print("ratio to cyclictest: over all cycles, and the median of the rounds' own ratios")
    for name in names[1:]:
        row = ""
        for percent in percents:
            whole = percentile(pooled[name], percent) / max(percentile(pooled["cyclictest"], percent), 1)
            each = sorted(
                percentile(mine, percent) / max(percentile(theirs, percent), 1)
                for mine, theirs in zip(rounds[name], rounds["cyclictest"], strict=True)
            )
            row += f"{whole:10.3f} /{each[len(each) // 2]:7.3f}"
        print(f"{name:12}{row}")


if __name__ == "__main__":
    main()
