"""The cost of the live view to the loop: runs in pairs, with the view and without it, and a sign test.

    python3 benches/latency/live.py [--pairs 20] [--seconds 5] [--binary target/release/clutch]

Board and loop are two processes on this machine, under SCHED_FIFO, over a pseudo-terminal; the board's clock goes on as
on hardware. With the view a client reads its stream to the end. Which of a pair is first changes from pair to pair, so
that a disturbance of the machine meets both. Limits of lateness are as wide as they can be, so that a machine that
stands still for some milliseconds now and then does not end a run; one that a fault has ended all the same is counted,
and its pair left out. Prints a table in Markdown.

Needs cargo, or --binary; chrt (Debian: util-linux), and the right to real-time priority.
"""

import argparse
import contextlib
import json
import math
import os
import pathlib
import re
import socket
import statistics
import subprocess
import sys
import threading
import urllib.parse

#: A shared machine is late now and then, with the view and without it.
PATIENT = {
    "safety.limits.silence_cycles": 1000,
    "safety.limits.watchdog_cycles": 100,
    "safety.limits.valid_cycles": 60,
    "safety.limits.late": 128,
    "safety.limits.lost": 128,
    "safety.limits.overruns": 128,
    "safety.limits.following_error_deg": 30,
    "safety.limits.jump_deg": 30,
}
ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Rows of the table: name, and the figure in the loop's summary.
ROWS = [
    ("answer after, median, µs", ("response", "p50_us")),
    ("answer after, 99 %, µs", ("response", "p99_us")),
    ("answer after, longest, µs", ("response", "max_us")),
    ("from wake-up to wake-up, 99 %, µs", ("cycle", "p99_us")),
    ("from wake-up to wake-up, longest, µs", ("cycle", "max_us")),
    # The clock of a board that was held up is behind from then on: the lateness has that, too.
    ("wake-up late by, median, µs", ("wake", "p50_us")),
    ("wake-up late by, 99 %, µs", ("wake", "p99_us")),
    ("wake-up late by, longest, µs", ("wake", "max_us")),
    ("deadline misses", ("deadline_misses",)),
    ("samples lost", ("samples", "lost")),
]


def build() -> pathlib.Path:
    subprocess.run(["cargo", "build", "--release", "--package", "clutch-cli"], cwd=ROOT, check=True)
    return pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/clutch"


def settings() -> list[str]:
    return [word for key, value in PATIENT.items() for word in ("--set", f"{key}={value}")]


@contextlib.contextmanager
def board(binary: pathlib.Path, priority: int):
    """The path of a simulated board, which has a process of its own."""
    command = ["chrt", "-f", str(priority), binary, "daq", "board_smc_2", *settings()]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            path = next(found[0] for line in process.stdout if (found := re.search(r"/dev/pts/\d+", line)))
            threading.Thread(target=process.stdout.read, daemon=True).start()
            yield path
        finally:
            process.terminate()


def read_stream(address: str) -> None:
    """Reads the view's stream until it ends."""
    url = urllib.parse.urlparse(address)
    with socket.create_connection((url.hostname, url.port)) as client:
        client.sendall(f"GET /events?{url.query} HTTP/1.1\r\nHost: {url.netloc}\r\n\r\n".encode())
        while client.recv(1 << 16):
            pass


def run(binary: pathlib.Path, port: str, viewed: bool, options: argparse.Namespace) -> dict | None:
    """The summary of a run; none if a fault ended it."""
    command = [binary, "loop", "board_smc_2", "--port", port, "--duration", str(options.seconds), "--json"]
    command += ["--release-test", "never", "--thread-priority", str(options.priority)]
    command += [*settings(), *(["--live"] if viewed else [])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        for line in process.stderr:
            if "http://" in line:
                threading.Thread(target=read_stream, args=(line.split()[-1],), daemon=True).start()
        told = process.stdout.read()
    if process.returncode not in (0, 3):
        sys.exit(f"{' '.join(map(str, command))}: exit {process.returncode}")
    return json.loads(told) if process.returncode == 0 else None


def sign_test(more: int, less: int) -> float:
    """The chance that signs lie as far apart as this, either way, if both are equally likely."""
    n, least = more + less, min(more, less)
    return min(1.0, 2.0 * sum(math.comb(n, k) for k in range(least + 1)) / 2.0**n)


def row(name: str, without: list[float], with_view: list[float]) -> str:
    differences = [b - a for a, b in zip(without, with_view, strict=True)]
    more, less = sum(d > 0 for d in differences), sum(d < 0 for d in differences)
    chance = f"{sign_test(more, less):.2g}" if more + less else "–"
    medians = " | ".join(f"{statistics.median(values):.4g}" for values in (without, with_view))
    return f"| {name} | {medians} | {statistics.median(differences):+.3g} | {more} of {more + less} | {chance} |"


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of the live view to the loop")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=5.0, help="of each run")
    parser.add_argument("--priority", type=int, default=49, help="of the control thread")
    parser.add_argument("--board-priority", type=int, default=60)
    parser.add_argument("--binary", type=pathlib.Path, help="the built command, instead of building it")
    options = parser.parse_args()
    binary = (options.binary or build()).resolve()

    pairs, faults = [], {False: 0, True: 0}
    for turn in range(options.pairs):
        pair = {}
        for viewed in [False, True] if turn % 2 else [True, False]:
            # A board of its own: one that a fault has ended is armed anew.
            with board(binary, options.board_priority) as port:
                pair[viewed] = run(binary, port, viewed, options)
            faults[viewed] += pair[viewed] is None
        if all(pair.values()):
            pairs.append((pair[False], pair[True]))
        print(f"{turn + 1} of {options.pairs} pairs", file=sys.stderr)

    print(
        f"{len(pairs)} pairs of {options.seconds:g} s, SCHED_FIFO {options.priority}; load of the machine "
        f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} processors; ended by a fault and left out with their pairs: "
        f"{faults[False]} without the view, {faults[True]} with it\n"
    )
    if not pairs:
        sys.exit("no pair is left")
    print("| median of the runs' | without | with | difference in a pair | larger with it | sign test |")
    print("|---|---|---|---|---|---|")
    for name, keys in ROWS:
        figures = []
        for which in (0, 1):
            values = [pair[which] for pair in pairs]
            for key in keys:
                values = [value[key] for value in values]
            figures.append([float(value) for value in values])
        print(row(name, *figures))


if __name__ == "__main__":
    main()
