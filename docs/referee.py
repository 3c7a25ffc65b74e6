"""Runs every case of the referee on every engine, into docs/referee.txt, and draws the figures of the page.

Run it in any folder, with the package, SciPy, mujoco, newton and warp-lang installed: ``python docs/referee.py``. An
engine whose package is missing is skipped, and the table says so. It takes about four minutes, most of them Kamino's.
"""

from io import BytesIO
from pathlib import Path

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from clutch import referee

HERE = Path(__file__).parent
CASES = referee.cases()
ENGINES = {engine.name: engine for engine in [*referee.own(), *referee.others()]}


def run(name, engine):
    """A trajectory and its times, s; None if the engine is not here or does not take the case."""
    case, engine = CASES[name], ENGINES[engine]
    if engine.missing() or engine.refuses(case):
        return None
    return np.linspace(0, case.duration, case.samples + 1), engine.run(case)


def keep(figure, name):
    """Save with few colours, and without the version that would change the file."""
    whole = BytesIO()
    figure.savefig(whole, dpi=110)
    plt.close(figure)
    Image.open(whole).convert("RGB").quantize(128).save(HERE / "figures" / f"{name}.png", optimize=True)


def bristles():
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
    loop, lag, away = axes

    _, t = run("L4", "bristled_system")
    loop.plot(1e6 * t.position[0], t.torque[0])
    loop.set(title="Pre-sliding (L4)", xlabel="way (µm)", ylabel="friction (N)")

    for name, rate in (("L6_1", 1), ("L6_2", 10), ("L6_3", 25)):
        _, t = run(name, "bristle")
        last = slice(-401, None)
        lag.plot(1e3 * t.velocity[0][last], t.torque[0][last], label=f"{rate} rad/s")
    lag.set(title="Frictional lag (L6)", xlabel="velocity (mm/s)", ylabel="friction (N)")
    lag.legend()

    rates = [0.1, 1, 10, 50]
    for engine, style in (("bristle", "o-"), ("scipy", "x"), ("mujoco_lugre", "s")):
        found = [(rate, run(f"L5_{i}", engine)) for i, rate in enumerate(rates, 1)]
        peaks = [
            (rate, CASES[f"L5_{i}"].judge(t[1])[0].measured) for i, (rate, t) in enumerate(found, 1) if t is not None
        ]
        if peaks:
            away.semilogx(*zip(*peaks, strict=True), style, label=engine, fillstyle="none")
    away.axhline(1.5, color="grey", linewidth=0.8, linestyle="--")
    away.text(50, 1.505, "without bristles", color="grey", va="bottom", ha="right")
    away.set(title="Break-away (L5)", xlabel="rate of the force (N/s)", ylabel="first peak of friction (N)")
    away.set_ylim(0.95, 1.58)
    away.legend(loc="lower left")
    keep(figure, "referee_bristles")


def motion():
    figure, axes = plt.subplots(2, 2, figsize=(11, 7), layout="constrained")
    belt, hunting, creep, clutches = axes.flat

    for engine in ("system", "mujoco", "karnopp"):
        if (found := run("A5", engine)) is not None:
            belt.plot(found[0], found[1].position[0], label=engine)
    belt.set(title="Mass on a belt (A5)", xlabel="time (s)", ylabel="position (m)", xlim=(0, 40))
    belt.legend(loc="lower right")

    for name, engine, label in (
        ("A7", "system", "F_s > F_k"),
        ("A8", "system", "F_s = F_k"),
        ("L2", "bristled_system", "LuGre"),
    ):
        times, t = run(name, engine)
        hunting.plot(times, t.position[0], label=label)
    hunting.set(title="Under PID (A7, A8, L2)", xlabel="time (s)", ylabel="position (m)", xlim=(0, 100))
    hunting.legend(loc="lower right")

    for engine in ("mujoco", "tanh", "kamino", "system"):
        if (found := run("C1", engine)) is not None:
            way = np.degrees(np.abs(found[1].position[0]))
            # 0 has no place on a logarithmic axis: it is drawn at the lower end, and said to be 0.
            label = f"{engine}: 0" if not way.any() else engine
            creep.semilogy(found[0], np.maximum(way, 1e-9), label=label)
    creep.set(title="Creep at 84 % of what friction bears (C1)", xlabel="time (s)", ylabel="way (°)", ylim=(1e-9, 30))
    creep.legend()

    times, t = run("X1", "system")
    for joint, velocity in enumerate(t.velocity, 1):
        clutches.plot(times, velocity, label=f"joint {joint}")
    clutches.set(title="Coupled clutches (X1)", xlabel="time (s)", ylabel="speed (rad/s)")
    clutches.legend()
    keep(figure, "referee_motion")


def main():
    results = referee.compare(CASES.values(), list(ENGINES.values()))
    text = f"{referee.table(CASES.values(), results)}\n\n{referee.about(list(ENGINES.values()))}\n"
    (HERE / "referee.txt").write_text(text, encoding="utf-8")
    bristles()
    motion()


if __name__ == "__main__":
    main()
