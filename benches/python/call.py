"""A law's step called from Python, against the least possible cost of such a call through CPython's C API."""

import importlib.util
import pathlib
import subprocess
import sysconfig
import tempfile
from types import ModuleType

import clutch
from job import COUNTS_PER_TURN, HIGHEST, JOBS, KD, KP, LOWEST, PERIOD, SMOOTHING, TURN, toml
from timing import Candidate

CALLS = 20_000


def build(name: str) -> ModuleType:
    """Compiles a floor of the folder `floor` with the C compiler of the system and imports it."""
    source = pathlib.Path(__file__).parent / "floor" / f"{name}.c"
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / (name + sysconfig.get_config_var("EXT_SUFFIX"))
        include = sysconfig.get_paths()["include"]
        command = ["cc", "-O3", "-Wall", "-Werror", "-shared", "-fPIC", f"-I{include}", str(source)]
        subprocess.run([*command, "-o", str(library)], check=True)
        spec = importlib.util.spec_from_file_location(name, library)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module


def candidates(rounds: int) -> list[Candidate]:
    """Ours, the floors, and the loop around them, which is subtracted."""
    floor, stable = build("floor"), build("stable")
    job = JOBS["J2"]
    per_tick = job.rate * PERIOD * COUNTS_PER_TURN / TURN
    ticks = range(CALLS)
    # The shaft a few counts ahead of the path, as on a ramp; and the numbers a caller would have at hand.
    counts = [int(per_tick * k) + k % 3 for k in ticks]
    positions = [per_tick * k for k in ticks]

    ours = clutch.Servo(clutch.Scenario.from_toml(toml(job)))
    our_targets = [clutch.Target(p, job.rate, 0.0) for p in positions]
    ours.start(0, our_targets[0], 0.0)
    numbers = (KP, KD, SMOOTHING, PERIOD, TURN / COUNTS_PER_TURN, LOWEST, HIGHEST)
    law, servo, checked = floor.Law(*numbers), floor.Servo(*numbers), stable.Servo(*numbers)
    floor_targets, stable_targets = ([of.Target(p, job.rate, 0.0) for p in positions] for of in (floor, stable))
    floors = ((law, floor_targets), (servo, floor_targets), (checked, stable_targets))

    # Before anything is timed: all are the same law. Ours and the servo take targets in whole 2^-16 counts, up to 24 µV
    # of the proportional term and 120 µV of the derivative's.
    ours_volts = [ours.step(c, t) for c, t in zip(counts, our_targets, strict=True)]
    for least, targets in floors:
        floor_volts = [least.step(c, t) for c, t in zip(counts, targets, strict=True)]
        worst = max(abs(a - b) for a, b in zip(ours_volts, floor_volts, strict=True))
        assert worst < 1e-3, f"ours and the {type(least).__name__} in C differ by {worst} V"
    assert max(ours_volts) - min(ours_volts) > 1.0, "the law is at its limits all the time"

    def loop_of(servo, targets):
        def loop():
            step = servo.step
            for c, t in zip(counts, targets, strict=True):
                step(c, t)

        return loop

    def loop_empty():
        for _c, _t in zip(counts, our_targets, strict=True):
            pass

    works = {
        "clutch.Servo.step": loop_of(ours, our_targets),
        "C-API floor, the law": loop_of(*floors[0]),
        "C-API floor, the servo": loop_of(*floors[1]),
        "stable ABI floor, the servo with our checks": loop_of(*floors[2]),
        "empty loop": loop_empty,
    }
    return [Candidate(name, work, rounds) for name, work in works.items()]
