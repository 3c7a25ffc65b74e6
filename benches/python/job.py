"""The job that every candidate does, and the figures it hands back.

A weight drives a braked shaft along a ramp. PD (4) with a brake's sign, its error rate by (5), an encoder
that floors to 20 000 counts per revolution, a voltage within 0 … 10 V that reaches the brake as it is; 1 kHz.
Shaft and path start at 0, the shaft at rest. Figures are of the true error at the samples from 1 s on.

`J20` is a ramp of 20 °/s, which never sticks; `J2` one of 2 °/s, which sticks a hundred times a second. The jobs of
`ACCURACY` are short, and their encoder is as good as none: they tell how exactly a candidate moves the shaft.
"""

import math
from dataclasses import dataclass, replace

# Plant (1), (2).
INERTIA = 0.0017  # J, kg m²
DRIVE = 0.047  # T_u, N m
DAMPING = 0.001  # C_d, N m s/rad
GAIN = 0.14  # K_COF, N m/V
MU_S = 0.2
MU_D = 0.15
V_S = 0.001  # Stribeck velocity, rad/s

# Law (4), error rate (5), sensor, limits.
KP = 5000.0  # V/rad
KD = 50.0  # V s/rad
SMOOTHING = 0.5
COUNTS_PER_TURN = 20_000
IDEAL = 2**24  # counts per revolution of an encoder that does not floor
TURN = 2.0 * math.pi  # rad
LOWEST = 0.0  # V
HIGHEST = 10.0  # V

# Run.
PERIOD = 1e-3  # s
DURATION = 10.0  # s
SETTLE = 1.0  # s


@dataclass(frozen=True)
class Job:
    """A ramp, the gains, and what of the run counts."""

    rate: float  # rad/s
    kp: float = KP
    kd: float = KD
    counts_per_turn: int = COUNTS_PER_TURN
    duration: float = DURATION
    settle: float = SETTLE

    @property
    def ticks(self) -> int:
        return round(self.duration / PERIOD)

    @property
    def settled(self) -> int:
        """Ticks before those that count."""
        return round(self.settle / PERIOD)

    def finely(self) -> "Job":
        """The first half second, all of which counts, with an encoder that is as good as none."""
        return replace(self, counts_per_turn=FINE, duration=0.5, settle=0.0)


JOBS = {"J20": Job(math.radians(20.0)), "J2": Job(math.radians(2.0))}

#: Counts of an encoder that is as good as none, 5.7e-12 rad apart: those in which clutch's ideal one tells a position.
FINE = IDEAL * 2**16

#: Jobs, and the largest difference of a position from the right one that is asked for, rad.
ACCURACY = {
    "20 °/s, never sticks": (JOBS["J20"].finely(), 1e-12),
    "2 °/s, K_d 5 V s/rad": (replace(JOBS["J2"], kd=5.0).finely(), 1e-8),
    "20 °/s, K_p 20 000 V/rad, K_d 5 V s/rad": (replace(JOBS["J20"], kp=20_000.0, kd=5.0).finely(), 1e-9),
}


@dataclass(frozen=True)
class Figures:
    """The figures of one run, or the mean of many."""

    rms: float  # rad
    max: float  # rad
    sticks: float


def gains(n: int) -> list[tuple[float, float]]:
    """`n` pairs (K_p, K_d) around the job's own, all different, for a sweep."""
    side = math.ceil(math.sqrt(n))
    step = 0.4 / side
    factors = [0.8 + step * (i + 0.5) for i in range(side)]
    return [(KP * a, KD * b) for a in factors for b in factors][:n]


def toml(job: Job) -> str:
    """The job as a scenario of clutch.

    One thing differs: `start = "rest"` holds the shaft with a quarter more than the static limit before the
    first sample. The first voltage, 0 V at an error of 0, replaces it at t = 0, before anything has moved.
    """
    ideal = job.counts_per_turn == FINE
    return f"""
name = "PD on a ramp"

[rig]
base = "paper"
inertia_kg_m2 = {INERTIA}
viscous_damping_nm_s_rad = {DAMPING}

[rig.actuator.brake]
gain_nm_v = {GAIN}

[rig.friction.stribeck]
mu_static = {MU_S}
mu_dynamic = {MU_D}
stribeck_velocity_rad_s = {V_S}

[rig.drive.weight]      # M g R_p = {DRIVE} N m
mass_kg = 0.2
gravity_m_s2 = {DRIVE / (0.2 * 0.024)!r}
pulley_radius_m = 0.024

[rig.encoder]
counts_per_rev = {IDEAL if ideal else job.counts_per_turn}
quantised = {"false" if ideal else "true"}

[rig.dac]
quantised = false

[law.pd]
kp_v_rad = {job.kp}
kd_v_s_rad = {job.kd}

[velocity.smoothed_derivative]
smoothing = {SMOOTHING}

[output]
lowest_v = {LOWEST}
highest_v = {HIGHEST}

[reference.ramp]
rate_deg_s = {math.degrees(job.rate)!r}

[run]
duration_s = {job.duration}
settle_s = {job.settle}
start = "rest"
start_counts = 0.0
"""
