"""The wheel, which chooses its code by the processor, against a build for this machine's own processor.

    python -m venv generic && generic/bin/pip install .
    python -m venv native && RUSTFLAGS="-C target-cpu=native" native/bin/pip install .
    python benches/python/native.py generic/bin/python native/bin/python

Shows if a choice of code by the processor at run time could gain more. Processes take turns; each gives
the CPU seconds of 40 runs on one thread, and the least of its turns counts.
"""

import subprocess
import sys

JOB = """
import time
import clutch
from clutch import _clutch
for rate in (20.0, 2.0):
    rows = [[float(kp)] for kp in range(4000, 6000, 50)]
    base = clutch.Scenario.load("pd_2", {"reference.ramp.rate_deg_s": rate, "run.duration_s": 10.0})
    sweep = _clutch.Sweep(base, ["law.pd.kp_v_rad"], rows, ["max_error_rad"], threads=1)
    begin = time.process_time()
    sweep.start()
    while not sweep.wait(10.0):
        pass
    print(time.process_time() - begin, sweep.result()[0]["max_error_rad"].sum().hex())
"""
ROUNDS = 7


def turn(python: str) -> list[tuple[float, str]]:
    """CPU seconds and results, for J20 and J2."""
    done = subprocess.run([python, "-c", JOB], capture_output=True, text=True, check=True)
    return [(float(line.split()[0]), line.split()[1]) for line in done.stdout.splitlines()]


def main(generic: str, native: str) -> None:
    """Print the ratio for each job."""
    turns = [(turn(generic), turn(native)) for _ in range(ROUNDS)]
    for i, job in enumerate(("J20", "J2")):
        ours, theirs = (min(pair[which][i][0] for pair in turns) for which in (0, 1))
        same = "the same bits" if turns[0][0][i][1] == turns[0][1][i][1] else "OTHER BITS"
        print(f"{job}: {theirs / ours:.2f} of the native build's speed (target at least 0.95), {same}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
