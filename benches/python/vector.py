"""Cost of a step of many environments, and the part of rigs and laws in it: CPU time on one thread.

    python benches/python/vector.py [--repeats 5]

A row is a scenario and a number of shafts: a step of `TrackingVectorEnv` under the scenario's own law; the part of it
in the native module, rig and law; and as much motion by `clutch.sweep`, law and figures included. The
smallest of the repeats. Prints a table in Markdown.
"""

import argparse
import os
import time

os.environ["RAYON_NUM_THREADS"] = "1"  # before the module makes its threads

import clutch
import clutch.gym

SHAFTS = [64, 512]
SCENARIOS = ["smc_2", "bench_smc_2"]
#: Steps that are timed at once, far from the end of the path.
STEPS = 100


def seconds(work, repeats: int) -> float:
    """CPU time of some work, s: the smallest of the repeats."""

    def once() -> float:
        begin = time.process_time()
        work()
        return time.process_time() - begin

    return min(once() for _ in range(repeats))


def step(name: str, shafts: int, repeats: int) -> tuple[float, float]:
    """CPU time of a step, and of its part in the native module, s."""
    envs = clutch.gym.TrackingVectorEnv(shafts, name)
    _, infos = envs.reset(seed=1)

    def steps() -> None:
        nonlocal infos
        for _ in range(STEPS):
            *_, infos = envs.step(envs.scales.action(infos["law_voltage_v"])[:, None])

    whole = seconds(steps, repeats)
    native = envs._shafts
    law = native.QUANTITIES.index("law_voltage_v")
    seen = native.seen()

    def native_steps() -> None:
        nonlocal seen
        for _ in range(STEPS):
            seen = native.step(seen[law].copy())

    return whole / STEPS, seconds(native_steps, repeats) / STEPS


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of a step of many environments")
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print("| scenario | shafts | a step, µs | of it rig and law | the same by a sweep |")
    print("|---|---|---|---|---|")
    for name in SCENARIOS:
        scenario = clutch.Scenario.load(name)
        ticks = len(scenario.path())
        for shafts in SHAFTS:
            whole, native = step(name, shafts, repeats)
            seeds = list(range(1, shafts + 1))
            swept = seconds(lambda: clutch.sweep(scenario, {"run.seed": seeds}), repeats) / ticks  # noqa: B023
            print(f"| `{name}` | {shafts} | {whole * 1e6:.0f} | {native * 1e6:.0f} | {swept * 1e6:.0f} |")


if __name__ == "__main__":
    main()
