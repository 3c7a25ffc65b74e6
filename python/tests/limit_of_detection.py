"""The earliest time at which counts can show that a converter stands at 0 V.

A detector that ends no sound run has to wait until no shaft of the bounds could have given the counts. Here the set of
those shafts is followed: a polygon of positions and velocities, moved by every torque of the bounds and cut by every
sample. A torque stays the same for a period, and no shaft of the set stops; so each point of the polygon is a shaft
that the bounds hold, and until the polygon is empty nobody can know. The paper's rig on a ramp of 20 °/s without
delay, PD (4) or sliding mode, (31) or (29), the encoder's filter of the paper. Nothing is shared with the product.

    python python/tests/limit_of_detection.py [RUNS]

prints a table.
"""

import math
import random
import sys
from dataclasses import dataclass

from lying_board import COUNTS, DAMPING, DRIVE, GAIN, INERTIA, KINETIC, PERIOD, RATE_DEG_S, STATIC, Shaft

COUNT = 2.0 * math.pi / COUNTS
FILTER = 0.2
HIGHEST_V = 9.995
#: Periods after the onset in which a run is given up.
PATIENCE = 200


@dataclass(frozen=True)
class Known:
    """Knowledge of a rig: how far friction may leave its two values, and an edge its place, in counts."""

    name: str
    grip: float
    friction: float
    edge: float
    #: False if the code in force may be the last one or the one before.
    code: bool

    def accelerations(self, volts):
        """The least and the most without damping, in counts per period², under any of these voltages."""
        least = DRIVE - STATIC * self.friction * GAIN * max(volts)
        most = DRIVE - KINETIC / self.grip * GAIN * min(volts)
        return tuple(torque / INERTIA * PERIOD * PERIOD / COUNT for torque in (least, most))


#: The product's margins; the same with the code in force known; bounds that are the rig itself, but for what the
#: shaft's integration leaves.
KNOWLEDGE = (
    Known("margins of `[safety.limits]`", grip=1.2, friction=1.8, edge=0.2, code=False),
    Known("the same, the code in force known", grip=1.2, friction=1.8, edge=0.2, code=True),
    Known("exact bounds, the code in force known", grip=1.0, friction=1.0, edge=0.01, code=True),
)


def pd(error, rate):
    return -(5000.0 * error + 50.0 * rate)


def sliding_mode(error, rate):
    surface = 70.0 * error + rate
    saturated = max(-1.0, min(1.0, surface / 0.1))
    damped = max(-1.0, min(1.0, surface * rate / 0.1))
    return -(3.0 * saturated + 400.0 * damped * rate)


def switching(error, rate):
    """With the sign function, (29)."""
    surface = 70.0 * error + rate
    return -(3.0 * math.copysign(1.0, surface) + 400.0 * math.copysign(1.0, surface * rate) * rate)


LAWS = {"PD": pd, "SMC": sliding_mode, "SMC, sign": switching}


def hull(points):
    """The convex hull, counterclockwise."""

    def chain(ordered):
        kept = []
        for point in ordered:
            while len(kept) > 1:
                (x0, y0), (x1, y1) = kept[-2:]
                if (x1 - x0) * (point[1] - y0) - (y1 - y0) * (point[0] - x0) > 0.0:
                    break
                kept.pop()
            kept.append(point)
        return kept[:-1]

    ordered = sorted(set(points))
    return ordered if len(ordered) < 3 else chain(ordered) + chain(ordered[::-1])


def cut(polygon, inside):
    """The part of a convex polygon where a linear function is not negative."""
    kept = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        at_a, at_b = inside(a), inside(b)
        if at_a >= 0.0:
            kept.append(a)
        if at_a * at_b < 0.0:
            share = at_a / (at_a - at_b)
            kept.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
    return kept


def moved(polygon, least, most):
    """Where the shafts of a polygon are a period later, of those that have not stopped."""
    gained = [(x, v, a - DAMPING * PERIOD / INERTIA * v) for x, v in polygon for a in (least, most)]
    ends = [(x + v + a / 2.0, v + a) for x, v, a in gained]
    return cut(hull(ends), lambda p: p[1])


def seen(polygon, count, edge):
    """The shafts of a polygon that give this count."""
    polygon = cut(polygon, lambda p: p[0] - (count - edge))
    return cut(polygon, lambda p: count + 1.0 + edge - p[0])


def at_0_v(_volts):
    return 0.0


def periods_until_known(law, known, seed, converter=at_0_v):
    """Periods from the onset of a converter's lie until no sound shaft gives these counts; none if that takes too long.

    0 or less if the set lost a sound shaft before.
    """
    draw = random.Random(seed)
    onset = int(draw.uniform(0.25, 0.5) / PERIOD)
    rate = math.radians(RATE_DEG_S)
    shaft = Shaft(draw.random() * COUNT, rate)
    filtered, volts, polygon, bounds = None, DRIVE / (KINETIC * GAIN), None, None
    for tick in range(onset + PATIENCE):
        count = math.floor(shaft.position / COUNT)
        if polygon is None:
            polygon = [(count, 0.0), (count + 1.0, 0.0), (count + 1.0, 5.0), (count, 5.0)]
        else:
            polygon = seen(moved(polygon, *bounds), count, known.edge)
        if not polygon:
            return tick - onset
        error = rate * tick * PERIOD - count * COUNT
        change = 0.0 if filtered is None else FILTER * (error - filtered)
        filtered = error if filtered is None else filtered + change
        last, volts = volts, min(max(law(error, change / PERIOD), 0.0), HIGHEST_V)
        bounds = known.accelerations([volts] if known.code else [last, volts])
        shaft.move(converter(volts) if tick >= onset else volts, PERIOD, steps=100)
    return None


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    print("| law | what is known | earliest, ms: median | most | above 10 ms |\n|---|---|---|---|---|")
    for name, law in LAWS.items():
        for known in KNOWLEDGE:
            periods = [periods_until_known(law, known, seed) for seed in range(1, runs + 1)]
            if not all(periods) or min(periods) < 1:
                wrong = [seed for seed, p in enumerate(periods, 1) if p is None or p < 1]
                sys.exit(f"{name}, {known.name}: seeds {wrong}: a sound shaft was lost, or a broken one not found")
            late = sum(p > 10 for p in periods)
            print(f"| {name} | {known.name} | {sorted(periods)[runs // 2]} | {max(periods)} | {late} of {runs} |")


if __name__ == "__main__":
    main()
