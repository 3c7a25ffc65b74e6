"""The job that every candidate does, and the figures it hands back.

A weight drives a braked shaft along a ramp. PD (4) with a brake's sign, its error rate by (5), an encoder
that floors to 20 000 counts per revolution, a voltage within 0 … 10 V that reaches the brake as it is; 1 kHz.
Shaft and path start at 0, the shaft at rest. Figures are of the true error at the samples from 1 s on.

`J20` is a ramp of 20 °/s, which never sticks; `J2` one of 2 °/s, which sticks a hundred times a second.
"""

import math
from dataclasses import dataclass

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
TURN = 2.0 * math.pi  # rad
LOWEST = 0.0  # V
HIGHEST = 10.0  # V

# Run.
PERIOD = 1e-3  # s
DURATION = 10.0  # s
SETTLE = 1.0  # s

RATES = {"J20": math.radians(20.0), "J2": math.radians(2.0)}  # rad/s


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


def toml(job: str, *, duration: float = DURATION, settle: float = SETTLE) -> str:
    """The job as a scenario of clutch.

    One thing differs: `start = "rest"` holds the shaft with a quarter more than the static limit before the
    first sample. The first voltage, 0 V at an error of 0, replaces it at t = 0, before anything has moved.
    """
    return f"""
name = "{job}"

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
counts_per_rev = {COUNTS_PER_TURN}

[rig.dac]
quantised = false

[law.pd]
kp_v_rad = {KP}
kd_v_s_rad = {KD}

[velocity.smoothed_derivative]
smoothing = {SMOOTHING}

[output]
lowest_v = {LOWEST}
highest_v = {HIGHEST}

[reference.ramp]
rate_deg_s = {math.degrees(RATES[job])!r}

[run]
duration_s = {duration}
settle_s = {settle}
start = "rest"
start_counts = 0.0
"""
