"""Tables of a scenario as frozen dataclasses: written by `cargo xtask generate` from the declarations in Rust.

The native module, which holds the physics, checks the ranges.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from clutch import _mixins
from clutch._record import _Params

__all__ = [
    "BeltDrive",
    "BothActuator",
    "Bounds",
    "BrakeActuator",
    "BrakeGeometry",
    "Chirp",
    "ChirpDrive",
    "CoulombFriction",
    "CountsOverTime",
    "Ctc",
    "Dac",
    "DahlFriction",
    "Dob",
    "EdgeTimed",
    "ElastoPlasticFriction",
    "Encoder",
    "FrictionMap",
    "Glide",
    "HandDrive",
    "Hold",
    "HoldLaw",
    "HoldThenRelease",
    "HoldVoltage",
    "JerkLimited",
    "Limits",
    "LugreFriction",
    "MaxwellFriction",
    "MinimumJerk",
    "Model",
    "MotorActuator",
    "Observer",
    "Output",
    "Pd",
    "Pid",
    "Ramp",
    "RampDrive",
    "RampVoltage",
    "Release",
    "Rig",
    "Ripple",
    "RunOptions",
    "Runout",
    "Safety",
    "Sampling",
    "Shell",
    "Sine",
    "SineDrive",
    "Smc",
    "SmcIntegral",
    "SmcSign",
    "SmoothedDerivative",
    "SpringDrive",
    "StribeckFriction",
    "SuperTwisting",
    "TableDrive",
    "TablePath",
    "Trapezoid",
    "Voltage",
    "WeightDrive",
]

#: Units by the endings of keys, metrics and columns.
UNITS = {
    "kg_m2": "kg m²",
    "nm_s_rad": "N m s/rad",
    "nm_rt_s": "N m/√s",
    "nm_rad": "N m/rad",
    "nm_s": "N m/s",
    "nm_v": "N m/V",
    "nm_a": "N m/A",
    "v_s2_rad": "V s²/rad",
    "v_s_rad": "V s/rad",
    "v_rt_s_rad": "V √(s/rad)",
    "v_rad_s": "V/(rad s)",
    "v_rad": "V/rad",
    "rad_s2": "rad/s²",
    "rad_s_rt_s": "rad/s/√s",
    "rad_s": "rad/s",
    "deg_s3": "°/s³",
    "deg_s2": "°/s²",
    "deg_s": "°/s",
    "deg": "°",
    "1_rad": "1/rad",
    "s_rad": "s/rad",
    "1_s2": "1/s²",
    "1_s": "1/s",
    "m_s2": "m/s²",
    "m2": "m²",
    "kg": "kg",
    "nm": "N m",
    "v_s": "V/s",
    "ohm": "Ω",
    "hz": "Hz",
    "us": "µs",
    "percent": "%",
    "turns": "turns",
    "counts": "counts",
    "counts_per_rev": "counts per revolution",
    "waves_per_turn": "waves per turn",
    "cycles_per_s": "cycles/s",
    "cycles": "periods",
    "ticks": "periods",
    "bits": "bits",
    "s_deg": "s, °",
    "deg_factor": "°, 1",
    "s_nm": "s, N m",
    "m": "m",
    "s": "s",
    "v": "V",
    "rad_s3": "rad/s³",
    "rad": "rad",
    "ms": "ms",
    "mrad_s": "mrad/s",
    "mv": "mV",
    "mnm": "mN m",
    "mm": "mm",
}

#: Units of a scenario's keys; empty for what has none.
KEYS = {
    "name": "",
    "rig.base": "",
    "rig.inertia_kg_m2": "kg m²",
    "rig.viscous_damping_nm_s_rad": "N m s/rad",
    "rig.torque_noise_nm": "N m",
    "rig.delay_ticks": "periods",
    "rig.actuator_time_constant_s": "s",
    "rig.speed_limit_deg_s": "°/s",
    "rig.actuator.brake.gain_nm_v": "N m/V",
    "rig.actuator.brake.preload_nm": "N m",
    "rig.actuator.geometry.inner_radius_m": "m",
    "rig.actuator.geometry.torque_constant_nm_a": "N m/A",
    "rig.actuator.geometry.pad_area_m2": "m²",
    "rig.actuator.geometry.lever_area_m2": "m²",
    "rig.actuator.geometry.armature_resistance_ohm": "Ω",
    "rig.actuator.geometry.contact_radius_m": "m",
    "rig.actuator.motor.gain_nm_v": "N m/V",
    "rig.actuator.motor.preload_nm": "N m",
    "rig.actuator.motor.load_share": "",
    "rig.actuator.both.brake_gain_nm_v": "N m/V",
    "rig.actuator.both.motor_gain_nm_v": "N m/V",
    "rig.actuator.both.preload_nm": "N m",
    "rig.friction.stribeck.mu_static": "",
    "rig.friction.stribeck.mu_dynamic": "",
    "rig.friction.stribeck.stribeck_velocity_rad_s": "rad/s",
    "rig.friction.stribeck.stribeck_exponent": "",
    "rig.friction.coulomb.mu_static": "",
    "rig.friction.coulomb.mu_dynamic": "",
    "rig.friction.lugre.mu_static": "",
    "rig.friction.lugre.mu_dynamic": "",
    "rig.friction.lugre.stribeck_velocity_rad_s": "rad/s",
    "rig.friction.lugre.stribeck_exponent": "",
    "rig.friction.lugre.stiffness_1_rad": "1/rad",
    "rig.friction.lugre.damping_s_rad": "s/rad",
    "rig.friction.dahl.mu_dynamic": "",
    "rig.friction.dahl.stiffness_1_rad": "1/rad",
    "rig.friction.elasto_plastic.mu_static": "",
    "rig.friction.elasto_plastic.mu_dynamic": "",
    "rig.friction.elasto_plastic.stribeck_velocity_rad_s": "rad/s",
    "rig.friction.elasto_plastic.stribeck_exponent": "",
    "rig.friction.elasto_plastic.stiffness_1_rad": "1/rad",
    "rig.friction.elasto_plastic.damping_s_rad": "s/rad",
    "rig.friction.elasto_plastic.mu_elastic": "",
    "rig.friction.maxwell.mu_static": "",
    "rig.friction.maxwell.mu_dynamic": "",
    "rig.friction.maxwell.stribeck_velocity_rad_s": "rad/s",
    "rig.friction.maxwell.stribeck_exponent": "",
    "rig.friction.maxwell.stiffness_a_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_b_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_c_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_d_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_e_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_f_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_g_1_rad": "1/rad",
    "rig.friction.maxwell.stiffness_h_1_rad": "1/rad",
    "rig.friction.maxwell.share_a": "",
    "rig.friction.maxwell.share_b": "",
    "rig.friction.maxwell.share_c": "",
    "rig.friction.maxwell.share_e": "",
    "rig.friction.maxwell.share_f": "",
    "rig.friction.maxwell.share_g": "",
    "rig.friction.maxwell.share_h": "",
    "rig.friction.maxwell.attraction_1_s": "1/s",
    "rig.friction.maxwell.damping_s_rad": "s/rad",
    "rig.drive.weight.mass_kg": "kg",
    "rig.drive.weight.gravity_m_s2": "m/s²",
    "rig.drive.weight.pulley_radius_m": "m",
    "rig.drive.weight.side": "",
    "rig.drive.spring.stiffness_nm_rad": "N m/rad",
    "rig.drive.spring.rest_deg": "°",
    "rig.drive.belt.stiffness_nm_rad": "N m/rad",
    "rig.drive.belt.damping_nm_s_rad": "N m s/rad",
    "rig.drive.belt.speed_deg_s": "°/s",
    "rig.drive.table.points_s_nm": "s, N m",
    "rig.drive.ramp.from_nm": "N m",
    "rig.drive.ramp.rate_nm_s": "N m/s",
    "rig.drive.sine.mean_nm": "N m",
    "rig.drive.sine.amplitude_nm": "N m",
    "rig.drive.sine.frequency_hz": "Hz",
    "rig.drive.sine.phase_turns": "turns",
    "rig.drive.chirp.mean_nm": "N m",
    "rig.drive.chirp.amplitude_nm": "N m",
    "rig.drive.chirp.from_hz": "Hz",
    "rig.drive.chirp.to_hz": "Hz",
    "rig.drive.chirp.duration_s": "s",
    "rig.drive.hand.mean_nm": "N m",
    "rig.drive.hand.rms_nm": "N m",
    "rig.drive.hand.lowest_frequency_hz": "Hz",
    "rig.drive.hand.highest_frequency_hz": "Hz",
    "rig.encoder.counts_per_rev": "counts per revolution",
    "rig.encoder.quantised": "",
    "rig.dac.bits": "bits",
    "rig.dac.lowest_v": "V",
    "rig.dac.highest_v": "V",
    "rig.dac.quantised": "",
    "rig.ripple.rms": "",
    "rig.ripple.lowest_waves_per_turn": "waves per turn",
    "rig.ripple.highest_waves_per_turn": "waves per turn",
    "rig.ripple.spacing_waves_per_turn": "waves per turn",
    "rig.runout.amplitude": "",
    "rig.runout.waves_per_turn": "waves per turn",
    "rig.runout.phase_deg": "°",
    "model.inertia_kg_m2": "kg m²",
    "model.drive_torque_nm": "N m",
    "model.viscous_damping_nm_s_rad": "N m s/rad",
    "model.actuator.brake.gain_nm_v": "N m/V",
    "model.actuator.brake.preload_nm": "N m",
    "model.actuator.geometry.inner_radius_m": "m",
    "model.actuator.geometry.torque_constant_nm_a": "N m/A",
    "model.actuator.geometry.pad_area_m2": "m²",
    "model.actuator.geometry.lever_area_m2": "m²",
    "model.actuator.geometry.armature_resistance_ohm": "Ω",
    "model.actuator.geometry.contact_radius_m": "m",
    "model.actuator.motor.gain_nm_v": "N m/V",
    "model.actuator.motor.preload_nm": "N m",
    "model.actuator.motor.load_share": "",
    "model.actuator.both.brake_gain_nm_v": "N m/V",
    "model.actuator.both.motor_gain_nm_v": "N m/V",
    "model.actuator.both.preload_nm": "N m",
    "model.friction.stribeck.mu_static": "",
    "model.friction.stribeck.mu_dynamic": "",
    "model.friction.stribeck.stribeck_velocity_rad_s": "rad/s",
    "model.friction.stribeck.stribeck_exponent": "",
    "model.friction.coulomb.mu_static": "",
    "model.friction.coulomb.mu_dynamic": "",
    "model.friction.lugre.mu_static": "",
    "model.friction.lugre.mu_dynamic": "",
    "model.friction.lugre.stribeck_velocity_rad_s": "rad/s",
    "model.friction.lugre.stribeck_exponent": "",
    "model.friction.lugre.stiffness_1_rad": "1/rad",
    "model.friction.lugre.damping_s_rad": "s/rad",
    "model.friction.dahl.mu_dynamic": "",
    "model.friction.dahl.stiffness_1_rad": "1/rad",
    "model.friction.elasto_plastic.mu_static": "",
    "model.friction.elasto_plastic.mu_dynamic": "",
    "model.friction.elasto_plastic.stribeck_velocity_rad_s": "rad/s",
    "model.friction.elasto_plastic.stribeck_exponent": "",
    "model.friction.elasto_plastic.stiffness_1_rad": "1/rad",
    "model.friction.elasto_plastic.damping_s_rad": "s/rad",
    "model.friction.elasto_plastic.mu_elastic": "",
    "model.friction.maxwell.mu_static": "",
    "model.friction.maxwell.mu_dynamic": "",
    "model.friction.maxwell.stribeck_velocity_rad_s": "rad/s",
    "model.friction.maxwell.stribeck_exponent": "",
    "model.friction.maxwell.stiffness_a_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_b_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_c_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_d_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_e_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_f_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_g_1_rad": "1/rad",
    "model.friction.maxwell.stiffness_h_1_rad": "1/rad",
    "model.friction.maxwell.share_a": "",
    "model.friction.maxwell.share_b": "",
    "model.friction.maxwell.share_c": "",
    "model.friction.maxwell.share_e": "",
    "model.friction.maxwell.share_f": "",
    "model.friction.maxwell.share_g": "",
    "model.friction.maxwell.share_h": "",
    "model.friction.maxwell.attraction_1_s": "1/s",
    "model.friction.maxwell.damping_s_rad": "s/rad",
    "law.pd.kp_v_rad": "V/rad",
    "law.pd.kd_v_s_rad": "V s/rad",
    "law.ctc.outer_gain": "",
    "law.ctc.kp_1_s2": "1/s²",
    "law.ctc.kd_1_s": "1/s",
    "law.smc.kp_v": "V",
    "law.smc.kd_v_s_rad": "V s/rad",
    "law.smc.slope_1_s": "1/s",
    "law.smc.boundary_rad_s": "rad/s",
    "law.smc_sign.kp_v": "V",
    "law.smc_sign.kd_v_s_rad": "V s/rad",
    "law.smc_sign.slope_1_s": "1/s",
    "law.pid.kp_v_rad": "V/rad",
    "law.pid.ki_v_rad_s": "V/(rad s)",
    "law.pid.kd_v_s_rad": "V s/rad",
    "law.pid.derivative_time_s": "s",
    "law.pid.tracking_time_s": "s",
    "law.pid.bias_v": "V",
    "law.pid.coulomb_v": "V",
    "law.pid.velocity_v_s_rad": "V s/rad",
    "law.pid.acceleration_v_s2_rad": "V s²/rad",
    "law.super_twisting.k1_v_rt_s_rad": "V √(s/rad)",
    "law.super_twisting.k2_v_s": "V/s",
    "law.super_twisting.slope_1_s": "1/s",
    "law.super_twisting.boundary_rad_s": "rad/s",
    "law.smc_integral.kp_v": "V",
    "law.smc_integral.kd_v_s_rad": "V s/rad",
    "law.smc_integral.slope_1_s": "1/s",
    "law.smc_integral.integral_1_s2": "1/s²",
    "law.smc_integral.boundary_rad_s": "rad/s",
    "law.dob.kp_1_s2": "1/s²",
    "law.dob.kd_1_s": "1/s",
    "law.dob.bandwidth_rad_s": "rad/s",
    "law.glide.kp_1_s": "1/s",
    "law.glide.kd_1_s": "1/s",
    "law.glide.floor": "",
    "law.glide.cap": "",
    "law.glide.optimism": "",
    "law.glide.micro_below_deg_s": "°/s",
    "law.glide.filter.delay_ticks": "periods",
    "law.glide.filter.lag_s": "s",
    "law.glide.filter.friction_doubt": "",
    "law.glide.filter.ripple_share": "",
    "law.glide.filter.ripple_waves_per_turn": "waves per turn",
    "law.glide.filter.ripple_damping": "",
    "law.glide.filter.walk_rad_s_rt_s": "rad/s/√s",
    "law.glide.filter.gain_doubt": "",
    "law.glide.filter.silence_counts": "counts",
    "law.voltage.start_v": "V",
    "law.voltage.end_v": "V",
    "law.voltage.rate_v_s": "V/s",
    "law.voltage.wait_s": "s",
    "law.voltage.returns": "",
    "law.hold.margin": "",
    "velocity.smoothed_derivative.smoothing": "",
    "velocity.counts_over_time.least_time_s": "s",
    "velocity.edge_timed.delay_ticks": "periods",
    "velocity.edge_timed.lag_s": "s",
    "velocity.edge_timed.friction_doubt": "",
    "velocity.edge_timed.ripple_share": "",
    "velocity.edge_timed.ripple_waves_per_turn": "waves per turn",
    "velocity.edge_timed.ripple_damping": "",
    "velocity.edge_timed.walk_rad_s_rt_s": "rad/s/√s",
    "velocity.edge_timed.gain_doubt": "",
    "velocity.edge_timed.silence_counts": "counts",
    "velocity.observer.disturbance_walk_nm_rt_s": "N m/√s",
    "output.lowest_v": "V",
    "output.highest_v": "V",
    "output.on_invalid_v": "V",
    "output.bumpless_time_s": "s",
    "shell.slope_1_s": "1/s",
    "shell.boundary_rad_s": "rad/s",
    "reference.ramp.rate_deg_s": "°/s",
    "reference.trapezoid.distance_deg": "°",
    "reference.trapezoid.speed_deg_s": "°/s",
    "reference.trapezoid.acceleration_deg_s2": "°/s²",
    "reference.jerk_limited.distance_deg": "°",
    "reference.jerk_limited.speed_deg_s": "°/s",
    "reference.jerk_limited.acceleration_deg_s2": "°/s²",
    "reference.jerk_limited.jerk_deg_s3": "°/s³",
    "reference.minimum_jerk.distance_deg": "°",
    "reference.minimum_jerk.duration_s": "s",
    "reference.sine.rate_deg_s": "°/s",
    "reference.sine.amplitude_deg": "°",
    "reference.sine.frequency_hz": "Hz",
    "reference.sine.phase_turns": "turns",
    "reference.chirp.rate_deg_s": "°/s",
    "reference.chirp.amplitude_deg": "°",
    "reference.chirp.from_hz": "Hz",
    "reference.chirp.to_hz": "Hz",
    "reference.chirp.duration_s": "s",
    "reference.chirp.phase_turns": "turns",
    "reference.table.points_s_deg": "s, °",
    "reference.table.interpolation": "",
    "sampling.period_us": "µs",
    "sampling.scalar": "",
    "bounds.inertia_percent": "%",
    "bounds.drive_torque_percent": "%",
    "bounds.viscous_damping_percent": "%",
    "bounds.brake_gain_percent": "%",
    "bounds.motor_gain_percent": "%",
    "bounds.friction_percent": "%",
    "bounds.reach_rate_rad_s2": "rad/s²",
    "bounds.ripple_percent": "%",
    "run.duration_s": "s",
    "run.settle_s": "s",
    "run.start": "",
    "run.start_counts": "counts",
    "run.seed": "",
    "run.engine": "",
    "friction_map.version": "",
    "friction_map.rig": "",
    "friction_map.points_deg_factor": "°, 1",
    "safety.reason": "",
    "safety.live_gains": "",
    "safety.on_fault.hold.volts_v": "V",
    "safety.on_fault.ramp.rate_v_s": "V/s",
    "safety.on_fault.ramp.volts_v": "V",
    "safety.on_fault.hold_then_release.volts_v": "V",
    "safety.on_fault.hold_then_release.after_s": "s",
    "safety.limits.jump_deg": "°",
    "safety.limits.jumps": "within 128 periods",
    "safety.limits.good_samples": "",
    "safety.limits.following_error_deg": "°",
    "safety.limits.following_time_s": "s",
    "safety.limits.saturation_time_s": "s",
    "safety.limits.edge_counts": "counts",
    "safety.limits.friction_margin": "",
    "safety.limits.grip_margin": "",
    "safety.limits.delay_cycles": "periods",
    "safety.limits.lost": "within 128 periods",
    "safety.limits.late": "within 128 periods",
    "safety.limits.disorder": "within 128 periods",
    "safety.limits.silence_cycles": "periods",
    "safety.limits.deadline_us": "µs",
    "safety.limits.overruns": "within 128 periods",
    "safety.limits.watchdog_cycles": "periods",
    "safety.limits.valid_cycles": "periods",
}


@dataclass(frozen=True, kw_only=True, repr=False)
class BrakeActuator(_Params):
    """A brake: a voltage above 0 V presses a pad on a disc. It resists a motion and makes none.

    Parameters
    ----------
    gain_nm_v : float, default 0.14
        Brake torque per volt and unit of μ, (18). `K_COF`: a finite number above 0 N m/V.
    preload_nm : float, default 0.0
        Normal force without a voltage, as torque per unit of μ: a disc that drags. `N_0`: a finite number of
        at least 0 N m.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Rig(actuator=clutch.BrakeActuator(preload_nm=0.01)).actuator
    BrakeActuator(gain_nm_v=0.14, preload_nm=0.01)
    """

    _key: ClassVar[str] = "rig.actuator.brake"

    gain_nm_v: float = 0.14
    preload_nm: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class BrakeGeometry(_mixins.BrakeGeometry):
    """The linkage from motor voltage to friction torque, as Table 1 lists it: `K_COF = r_i K_t A/(A_lever R_a
    r_c)` (18).

    Parameters
    ----------
    inner_radius_m : float
        Inner radius of the brake disc. `r_i`: a finite number above 0 m.
    torque_constant_nm_a : float
        Torque constant of the motor. Not printed in the paper. `K_t`: a finite number above 0 N m/A.
    pad_area_m2 : float
        Area of contact between pad and disc. `A`: a finite number above 0 m².
    lever_area_m2 : float
        Area of the tip of the lever. `A_lever`: a finite number above 0 m².
    armature_resistance_ohm : float
        Armature resistance. Not printed in the paper. `R_a`: a finite number above 0 Ω.
    contact_radius_m : float
        Distance from the motor's shaft to the contact on the disc. `r_c`: a finite number above 0 m; a
        distance with which K_COF of (18), made of it and of inner_radius_m, torque_constant_nm_a,
        pad_area_m2, lever_area_m2 and armature_resistance_ohm, is a finite number above 0 N m/V.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    The paper's lengths and areas with an assumed motor:

    >>> import clutch
    >>> brake = clutch.BrakeGeometry(
    ...     inner_radius_m=0.045, torque_constant_nm_a=0.0508, pad_area_m2=0.040,
    ...     lever_area_m2=0.032, armature_resistance_ohm=0.6, contact_radius_m=0.034,
    ... )
    >>> rig = clutch.Rig(actuator=brake)
    """

    _key: ClassVar[str] = "rig.actuator.geometry"

    inner_radius_m: float
    torque_constant_nm_a: float
    pad_area_m2: float
    lever_area_m2: float
    armature_resistance_ohm: float
    contact_radius_m: float


@dataclass(frozen=True, kw_only=True, repr=False)
class MotorActuator(_Params):
    """A motor, with the gear and the bearings behind it: a voltage of either sign drives the shaft that way.
    Its friction is that of a constant normal force and of a share of the load.

    Parameters
    ----------
    gain_nm_v : float
        Torque per volt. `k_t`: a finite number above 0 N m/V.
    preload_nm : float
        Normal force, as torque per unit of μ. `N_0`: a finite number of at least 0 N m.
    load_share : float, default 0.0
        Share of the motor's torque that presses, too: friction that grows with the load, as a gear's. `λ`: a
        finite number of at least 0; a share below 1/μ of rig.friction and model.friction: at or above it the
        motor jams in its own friction.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> motor = clutch.MotorActuator(gain_nm_v=0.05, preload_nm=0.25)
    >>> rig = clutch.Rig(actuator=motor)
    >>> model = clutch.Model(actuator=motor, drive_torque_nm=0)
    """

    _key: ClassVar[str] = "rig.actuator.motor"

    gain_nm_v: float
    preload_nm: float
    load_share: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class BothActuator(_Params):
    """A brake and a motor on one signal: a voltage above 0 V presses the pad, one below 0 V drives the shaft
    forwards.

    Parameters
    ----------
    brake_gain_nm_v : float
        Brake torque per volt above 0 V and unit of μ. `K_COF`: a finite number above 0 N m/V.
    motor_gain_nm_v : float
        Torque per volt below 0 V. `k_t`: a finite number above 0 N m/V.
    preload_nm : float, default 0.0
        Normal force without a voltage, as torque per unit of μ. `N_0`: a finite number of at least 0 N m.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.BothActuator(brake_gain_nm_v=0.14, motor_gain_nm_v=0.02).preload_nm
    0.0
    """

    _key: ClassVar[str] = "rig.actuator.both"

    brake_gain_nm_v: float
    motor_gain_nm_v: float
    preload_nm: float = 0.0


Actuator = BrakeActuator | BrakeGeometry | MotorActuator | BothActuator


@dataclass(frozen=True, kw_only=True, repr=False)
class StribeckFriction(_mixins.Friction):
    """Dry friction of pad on disc, Stribeck's curve (2). The defaults are Table 1's.

    `μ(θ̇) = [μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)] sgn(θ̇)`. A static coefficient below the dynamic one is
    taken: such a pair never sticks and slips.

    Parameters
    ----------
    mu_static : float, default 0.2
        Coefficient of friction at rest, in (2). `μ_s`: a finite number of at least 0; a number above 0 in
        model.friction, and with a brake in rig.friction: computed torque and bounds divide by it.
    mu_dynamic : float, default 0.15
        Coefficient of friction of a fast shaft, in (2). `μ_d`: a finite number of at least 0; a number above
        0 in model.friction, and with a brake in rig.friction: computed torque and bounds divide by it.
    stribeck_velocity_rad_s : float, default 0.001
        Stribeck velocity in (2), at which all but 1/e of the drop from `μ_s` to `μ_d` is done. `θ̇_s`: a
        finite number above 0 rad/s whose inverse is finite, too.
    stribeck_exponent : float, default 1.0
        Stribeck exponent in (2). Other than 1 needs the engine `dormand_prince`. `δ`: a finite number above
        0.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.StribeckFriction(mu_static=0.25)
    StribeckFriction(mu_static=0.25, mu_dynamic=0.15, stribeck_velocity_rad_s=0.001, stribeck_exponent=1.0)
    """

    _key: ClassVar[str] = "rig.friction.stribeck"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 1.0


@dataclass(frozen=True, kw_only=True, repr=False)
class CoulombFriction(_mixins.Friction):
    """Coulomb's friction with a level at rest: `μ = μ_d sgn(θ̇)` in motion, up to `μ_s` at rest.

    Parameters
    ----------
    mu_static : float, default 0.2
        Coefficient of friction at rest. `μ_s`: a finite number of at least 0; a number of at least
        mu_dynamic.
    mu_dynamic : float, default 0.15
        Coefficient of friction in motion. `μ_d`: a finite number of at least 0; a number above 0 in
        model.friction, and with a brake in rig.friction: computed torque and bounds divide by it.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.CoulombFriction(mu_static=0.3)
    CoulombFriction(mu_static=0.3, mu_dynamic=0.15)
    """

    _key: ClassVar[str] = "rig.friction.coulomb"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15


@dataclass(frozen=True, kw_only=True, repr=False)
class LugreFriction(_mixins.Friction):
    """LuGre friction: `ż = θ̇ − σ_0 |θ̇| z/g(θ̇)`, `μ = σ_0 z + σ_1 ż`, with Stribeck's curve `g`. It needs
    the engine `bristle`.

    Parameters
    ----------
    mu_static : float, default 0.2
        Coefficient of friction at which the bristles give way from rest. `μ_s`: a finite number above 0.
    mu_dynamic : float, default 0.15
        Coefficient of friction of a fast shaft. `μ_d`: a finite number above 0.
    stribeck_velocity_rad_s : float, default 0.001
        Stribeck velocity of steady sliding. `θ̇_s`: a finite number above 0 rad/s whose inverse is finite,
        too.
    stribeck_exponent : float, default 2.0
        Stribeck exponent of steady sliding. `δ`: a finite number above 0.
    stiffness_1_rad : float, default 2000.0
        Stiffness of the bristles, as a coefficient of friction per angle. `σ_0`: a finite number above 0
        1/rad whose inverse is finite, too.
    damping_s_rad : float, default 5.0
        Damping of the bristles, as a coefficient of friction per velocity of bending. `σ_1`: a finite number
        of at least 0 s/rad.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Rig(friction=clutch.LugreFriction()).friction.stiffness_1_rad
    2000.0
    """

    _key: ClassVar[str] = "rig.friction.lugre"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 2.0
    stiffness_1_rad: float = 2000.0
    damping_s_rad: float = 5.0


@dataclass(frozen=True, kw_only=True, repr=False)
class DahlFriction(_mixins.Friction):
    """Dahl's friction: `ż = θ̇ (1 − σ_0 z sgn(θ̇)/μ_d)`, `μ = σ_0 z`. It needs the engine `bristle`.

    Parameters
    ----------
    mu_dynamic : float, default 0.15
        Coefficient of friction of steady sliding. `μ_d`: a finite number above 0.
    stiffness_1_rad : float, default 2000.0
        Stiffness of the bristles, as a coefficient of friction per angle. `σ_0`: a finite number above 0
        1/rad whose inverse is finite, too.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.DahlFriction()
    DahlFriction(mu_dynamic=0.15, stiffness_1_rad=2000.0)
    """

    _key: ClassVar[str] = "rig.friction.dahl"

    mu_dynamic: float = 0.15
    stiffness_1_rad: float = 2000.0


@dataclass(frozen=True, kw_only=True, repr=False)
class ElastoPlasticFriction(_mixins.Friction):
    """Elasto-plastic friction: LuGre's bristles, which only bend and do not slide below a coefficient `μ_e`.
    It needs the engine `bristle`.

    Parameters
    ----------
    mu_static : float, default 0.2
        Coefficient of friction at which the bristles give way from rest. `μ_s`: a finite number above 0.
    mu_dynamic : float, default 0.15
        Coefficient of friction of a fast shaft. `μ_d`: a finite number above 0.
    stribeck_velocity_rad_s : float, default 0.001
        Stribeck velocity of steady sliding. `θ̇_s`: a finite number above 0 rad/s whose inverse is finite,
        too.
    stribeck_exponent : float, default 2.0
        Stribeck exponent of steady sliding. `δ`: a finite number above 0.
    stiffness_1_rad : float, default 2000.0
        Stiffness of the bristles, as a coefficient of friction per angle. `σ_0`: a finite number above 0
        1/rad whose inverse is finite, too.
    damping_s_rad : float, default 5.0
        Damping of the bristles, as a coefficient of friction per velocity of bending. `σ_1`: a finite number
        of at least 0 s/rad.
    mu_elastic : float, default 0.12
        Coefficient up to which the bristles only bend. `μ_e`: a finite number above 0; a number below
        mu_static and mu_dynamic.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.ElastoPlasticFriction(mu_elastic=0.1).mu_elastic
    0.1
    """

    _key: ClassVar[str] = "rig.friction.elasto_plastic"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 2.0
    stiffness_1_rad: float = 2000.0
    damping_s_rad: float = 5.0
    mu_elastic: float = 0.12


@dataclass(frozen=True, kw_only=True, repr=False)
class MaxwellFriction(_mixins.Friction):
    """Generalised Maxwell slip: up to eight springs side by side that hold up to their shares of the friction
    and then slide. It needs the engine `bristle`.

    Parameters
    ----------
    mu_static : float, default 0.2
        Coefficient of friction at which all elements have given way from rest. `μ_s`: a finite number above
        0.
    mu_dynamic : float, default 0.15
        Coefficient of friction of a fast shaft. `μ_d`: a finite number above 0.
    stribeck_velocity_rad_s : float, default 0.001
        Stribeck velocity of steady sliding. `θ̇_s`: a finite number above 0 rad/s whose inverse is finite,
        too.
    stribeck_exponent : float, default 2.0
        Stribeck exponent of steady sliding. `δ`: a finite number above 0.
    stiffness_a_1_rad : float, default 1600.0
        Stiffness of the first element, as a coefficient of friction per angle. `k_a`: a finite number above 0
        1/rad whose inverse is finite, too.
    stiffness_b_1_rad : float, default 800.0
        Stiffness of the second element. `k_b`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_c_1_rad : float, default 400.0
        Stiffness of the third element. `k_c`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_d_1_rad : float, default 200.0
        Stiffness of the fourth element. `k_d`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_e_1_rad : float, default 100.0
        Stiffness of the fifth element. `k_e`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_f_1_rad : float, default 50.0
        Stiffness of the sixth element. `k_f`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_g_1_rad : float, default 25.0
        Stiffness of the seventh element. `k_g`: a finite number above 0 1/rad whose inverse is finite, too.
    stiffness_h_1_rad : float, default 12.5
        Stiffness of the eighth element. `k_h`: a finite number above 0 1/rad whose inverse is finite, too.
    share_a : float, default 0.25
        Share of the friction that the first element bears. `α_a`: a number from 0 to 1.
    share_b : float, default 0.25
        Share of the second element. `α_b`: a number from 0 to 1.
    share_c : float, default 0.25
        Share of the third element; the fourth bears what all others leave. `α_c`: a number from 0 to 1; a
        share with which share_a, share_b, share_c and share_e to share_h are 1 or below in all.
    share_e : float, default 0.0
        Share of the fifth element. `α_e`: a number from 0 to 1.
    share_f : float, default 0.0
        Share of the sixth element. `α_f`: a number from 0 to 1.
    share_g : float, default 0.0
        Share of the seventh element. `α_g`: a number from 0 to 1.
    share_h : float, default 0.0
        Share of the eighth element. `α_h`: a number from 0 to 1.
    attraction_1_s : float, default 50.0
        Rate at which a sliding element comes to its share. `C`: a finite number of at least 0 1/s.
    damping_s_rad : float, default 1.0
        Damping of held elements, as a coefficient of friction per velocity. `σ`: a finite number of at least
        0 s/rad.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    Three elements, none in the third place; the fourth bears what the others leave:

    >>> import clutch
    >>> clutch.MaxwellFriction(share_a=0.5, share_b=0.3, share_c=0.0).attraction_1_s
    50.0
    """

    _key: ClassVar[str] = "rig.friction.maxwell"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 2.0
    stiffness_a_1_rad: float = 1600.0
    stiffness_b_1_rad: float = 800.0
    stiffness_c_1_rad: float = 400.0
    stiffness_d_1_rad: float = 200.0
    stiffness_e_1_rad: float = 100.0
    stiffness_f_1_rad: float = 50.0
    stiffness_g_1_rad: float = 25.0
    stiffness_h_1_rad: float = 12.5
    share_a: float = 0.25
    share_b: float = 0.25
    share_c: float = 0.25
    share_e: float = 0.0
    share_f: float = 0.0
    share_g: float = 0.0
    share_h: float = 0.0
    attraction_1_s: float = 50.0
    damping_s_rad: float = 1.0


Friction = StribeckFriction | CoulombFriction | LugreFriction | DahlFriction | ElastoPlasticFriction | MaxwellFriction


@dataclass(frozen=True, kw_only=True, repr=False)
class WeightDrive(_Params):
    """A weight on a pulley, as in the paper: the torque is `T_u = M g R_p` in (1).

    Parameters
    ----------
    mass_kg : float, default 0.2
        Mass, in (1). `M`: a finite number above 0 kg.
    gravity_m_s2 : float, default 9.81
        Acceleration of gravity in (1), as the paper rounds it. `g`: a finite number above 0 m/s².
    pulley_radius_m : float, default 0.024
        Radius of the pulley, in (1). `R_p`: a finite number above 0 m.
    side : {"forwards", "backwards"}, default "forwards"
        Side on which it hangs. `forwards`: It drives forwards. `backwards`: It drives backwards.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.WeightDrive().mass_kg
    0.2
    """

    _key: ClassVar[str] = "rig.drive.weight"

    mass_kg: float = 0.2
    gravity_m_s2: float = 9.81
    pulley_radius_m: float = 0.024
    side: Literal["forwards", "backwards"] = "forwards"


@dataclass(frozen=True, kw_only=True, repr=False)
class SpringDrive(_Params):
    """A spring: the torque is `stiffness · (rest − θ)`. It needs the engine `dormand_prince`.

    Parameters
    ----------
    stiffness_nm_rad : float
        Stiffness. A finite number above 0 N m/rad.
    rest_deg : float
        Angle from the start at which it pulls no more. A finite number, °.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SpringDrive(stiffness_nm_rad=0.02, rest_deg=180)
    SpringDrive(stiffness_nm_rad=0.02, rest_deg=180.0)
    """

    _key: ClassVar[str] = "rig.drive.spring"

    stiffness_nm_rad: float
    rest_deg: float


@dataclass(frozen=True, kw_only=True, repr=False)
class BeltDrive(_Params):
    """A belt: spring and damper between the shaft and an end that moves evenly, from where the spring is at
    rest at the start. The torque is `stiffness · (speed t − θ) + damping · (speed − θ̇)`. It needs the engine
    `dormand_prince`.

    Parameters
    ----------
    stiffness_nm_rad : float
        Stiffness. A finite number above 0 N m/rad.
    damping_nm_s_rad : float, default 0.0
        Damping. A finite number of at least 0 N m s/rad.
    speed_deg_s : float
        Speed of the moving end, as an angle of the shaft. A finite number, °/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.BeltDrive(stiffness_nm_rad=0.5, speed_deg_s=2)
    BeltDrive(stiffness_nm_rad=0.5, damping_nm_s_rad=0.0, speed_deg_s=2.0)
    """

    _key: ClassVar[str] = "rig.drive.belt"

    stiffness_nm_rad: float
    damping_nm_s_rad: float = 0.0
    speed_deg_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class TableDrive(_Params):
    """A torque over time: straight lines between points, constant outside. It needs the engine
    `dormand_prince`.

    Parameters
    ----------
    points_s_nm : sequence of (float, float)
        Points of time and torque; times rise. A list of at least one pair [s, N m] of finite numbers, with
        times that rise; at least one point.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.TableDrive(points_s_nm=[(0, 0.045), (2, 0.055)])
    TableDrive(points_s_nm=((0.0, 0.045), (2.0, 0.055)))
    """

    _key: ClassVar[str] = "rig.drive.table"

    points_s_nm: Sequence[tuple[float, float]]


@dataclass(frozen=True, kw_only=True, repr=False)
class RampDrive(_Params):
    """A torque that rises, or falls, evenly with time and without end. It needs the engine `dormand_prince`.

    Parameters
    ----------
    from_nm : float
        Torque at the start of the run. A finite number, N m.
    rate_nm_s : float
        Rise. A finite number, N m/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.RampDrive(from_nm=0, rate_nm_s=0.01)
    RampDrive(from_nm=0.0, rate_nm_s=0.01)
    """

    _key: ClassVar[str] = "rig.drive.ramp"

    from_nm: float
    rate_nm_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class SineDrive(_Params):
    """A sine about a mean torque: `mean + amplitude sin 2π(frequency t + phase)`. It needs the engine
    `dormand_prince`.

    Parameters
    ----------
    mean_nm : float
        Mean torque. A finite number, N m.
    amplitude_nm : float
        Amplitude. A finite number of at least 0 N m.
    frequency_hz : float
        Frequency. A number above 0 and at most 1000 Hz.
    phase_turns : float, default 0.0
        Phase at the start of the run. A number from -1 to 1 turns.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SineDrive(mean_nm=0.047, amplitude_nm=0.01, frequency_hz=2)
    SineDrive(mean_nm=0.047, amplitude_nm=0.01, frequency_hz=2.0, phase_turns=0.0)
    """

    _key: ClassVar[str] = "rig.drive.sine"

    mean_nm: float
    amplitude_nm: float
    frequency_hz: float
    phase_turns: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class ChirpDrive(_Params):
    """A sine about a mean torque whose frequency rises, or falls, evenly with time, and then stays. It needs
    the engine `dormand_prince`.

    Parameters
    ----------
    mean_nm : float
        Mean torque. A finite number, N m.
    amplitude_nm : float
        Amplitude. A finite number of at least 0 N m.
    from_hz : float
        Frequency at the start of the run. A number from 0 to 1000 Hz.
    to_hz : float
        Frequency at the end of `duration_s`, and after it. A number from 0 to 1000 Hz.
    duration_s : float
        Time from the one to the other. A finite number above 0 s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.ChirpDrive(mean_nm=0.047, amplitude_nm=0.01, from_hz=0.1, to_hz=10, duration_s=20)
    ChirpDrive(mean_nm=0.047, amplitude_nm=0.01, from_hz=0.1, to_hz=10.0, duration_s=20.0)
    """

    _key: ClassVar[str] = "rig.drive.chirp"

    mean_nm: float
    amplitude_nm: float
    from_hz: float
    to_hz: float
    duration_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class HandDrive(_Params):
    """A hand: a mean torque and a random part in a band of frequencies.

    The random part is 48 sines, one at random in each slice of the band; the seed of the run decides them. It
    needs the engine `dormand_prince`.

    Parameters
    ----------
    mean_nm : float
        Mean torque. A finite number, N m.
    rms_nm : float
        Root mean square of the random part. A finite number of at least 0 N m.
    lowest_frequency_hz : float
        Lower end of the band. A finite number of at least 0 Hz.
    highest_frequency_hz : float
        Upper end of the band; a hand is no faster than 50 Hz. A number above 0 and at most 50 Hz; a frequency
        above lowest_frequency_hz.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.HandDrive(mean_nm=0.06, rms_nm=0.008, lowest_frequency_hz=0.2, highest_frequency_hz=4)
    HandDrive(mean_nm=0.06, rms_nm=0.008, lowest_frequency_hz=0.2, highest_frequency_hz=4.0)
    """

    _key: ClassVar[str] = "rig.drive.hand"

    mean_nm: float
    rms_nm: float
    lowest_frequency_hz: float
    highest_frequency_hz: float


Drive = WeightDrive | SpringDrive | BeltDrive | TableDrive | RampDrive | SineDrive | ChirpDrive | HandDrive


@dataclass(frozen=True, kw_only=True, repr=False)
class Encoder(_Params):
    """The angle sensor: `counts = ⌊θ N/2π⌋`.

    Parameters
    ----------
    counts_per_rev : int, default 20000
        Counts per revolution, after quadrature. The paper's resolution is 0.018°. `N`: a whole number from 4
        to 16 777 216 counts per revolution.
    quantised : bool, default True
        `true` if it gives whole counts, rounded down; else it resolves 2⁻¹⁶ counts.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Encoder().counts_per_rev
    20000
    """

    _key: ClassVar[str] = "rig.encoder"

    counts_per_rev: int = 20000
    quantised: bool = True


@dataclass(frozen=True, kw_only=True, repr=False)
class Dac(_Params):
    """The converter from codes to volts; the paper's has 12 bit over ±10 V, 4.88 mV a step.

    Parameters
    ----------
    bits : int, default 12
        Resolution. A whole number from 1 to 16 bits.
    lowest_v : float, default -10.0
        Voltage of code 0. A finite number, V.
    highest_v : float, default 10.0
        Voltage one step above that of the highest code, which so is 9.9951 V by default. A finite number, V;
        a voltage above lowest_v; a voltage so far above lowest_v, and no farther, that a step between two
        codes is a finite number above 0 V.
    quantised : bool, default True
        `true` if it rounds to its steps; else the law's voltage goes out as it is.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Dac().bits
    12
    """

    _key: ClassVar[str] = "rig.dac"

    bits: int = 12
    lowest_v: float = -10.0
    highest_v: float = 10.0
    quantised: bool = True


@dataclass(frozen=True, kw_only=True, repr=False)
class Ripple(_Params):
    """Friction that varies along the disc: a band of waves with one amplitude and random phases.

    The factor on friction is `1 + A Σ sin(n θ + φ_n)` over `n = lowest, lowest + spacing, …, highest`; the
    seed of the run decides the phases. A disc is closed, so each wave fits a whole number of times into a
    turn. It needs the engine `dormand_prince`.

    Parameters
    ----------
    rms : float
        Root mean square of the variation, as a share of the friction. A finite number of at least 0; a number
        that, times the root of twice the number of waves (from lowest_waves_per_turn to
        highest_waves_per_turn), stays below 1.
    lowest_waves_per_turn : int
        Longest wave. A whole number from 1 to 4 294 967 295 waves per turn; a multiple of
        spacing_waves_per_turn.
    highest_waves_per_turn : int
        Shortest wave. A whole number from 1 to 4 294 967 295 waves per turn; a multiple of
        spacing_waves_per_turn, not below lowest_waves_per_turn, less than 64 spacings above it and at most
        1000 spacings.
    spacing_waves_per_turn : int
        From one wave to the next: the pattern repeats that often in a turn. A whole number from 1 to 4 294
        967 295 waves per turn.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> ripple = clutch.Ripple(
    ...     rms=0.05, lowest_waves_per_turn=100, highest_waves_per_turn=400, spacing_waves_per_turn=50
    ... )
    >>> clutch.Rig(ripple=ripple).ripple.rms
    0.05
    """

    _key: ClassVar[str] = "rig.ripple"

    rms: float
    lowest_waves_per_turn: int
    highest_waves_per_turn: int
    spacing_waves_per_turn: int


@dataclass(frozen=True, kw_only=True, repr=False)
class Runout(_Params):
    """Friction that varies along the disc: one wave, as a pad makes that runs on a disc which wobbles.

    It adds `A sin(n θ + φ)` to the factor on friction, beside a ripple. It needs the engine `dormand_prince`.

    Parameters
    ----------
    amplitude : float
        Amplitude of the variation, as a share of the friction. `A`: a number of at least 0 and below 1; a
        share that, with the largest sum of the waves of rig.ripple, stays below 1.
    waves_per_turn : int, default 1
        Waves in a turn: 1 for a disc that is not square to its shaft, 2 for one that is bent like a saddle.
        `n`: a whole number from 1 to 1000 waves per turn.
    phase_deg : float, default 0.0
        Phase at the encoder's zero. `φ`: a finite number, °.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Rig(runout=clutch.Runout(amplitude=0.2, phase_deg=90)).runout
    Runout(amplitude=0.2, waves_per_turn=1, phase_deg=90.0)
    """

    _key: ClassVar[str] = "rig.runout"

    amplitude: float
    waves_per_turn: int = 1
    phase_deg: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Rig(_mixins.Rig):
    """The shaft as it is, with its drive, brake, encoder and converter. The defaults are the paper's.

    `J θ̈ = T_u + T(v_a) − μ(θ̇) N(v_a) − C_d θ̇`, which is (1) with the paper's brake, `T = 0` and `N = K_COF
    max(v_a, 0)`. The plant that law and certificate believe in is another thing: the model.

    Parameters
    ----------
    inertia_kg_m2 : float, default 0.0017
        Total moment of inertia, in (1). `J`: a finite number above 0 kg m² whose inverse is finite, too.
    viscous_damping_nm_s_rad : float, default 0.001
        Viscous damping, in (1). `C_d`: a finite number of at least 0 N m s/rad.
    torque_noise_nm : float, default 0.0
        Root mean square of a random torque, normally distributed, held from sample to sample. A finite number
        of at least 0 N m.
    delay_ticks : int, default 0
        Whole sampling periods from sample to voltage. A whole number from 0 to 1000 periods.
    actuator_time_constant_s : float or None, default None
        First-order lag from the voltage to the actuator; absent if there is none. It needs the engine
        `dormand_prince`. A finite number above 0 s.
    speed_limit_deg_s : float, default 360.0
        Highest speed that a path may ask for: a guard against a slip of units. On a board a target that moves
        faster ends control. A finite number above 0 °/s.
    actuator : BrakeActuator, BrakeGeometry, MotorActuator or BothActuator
        Effect of a voltage on the shaft. By default `BrakeActuator()`.
    friction : StribeckFriction, CoulombFriction, LugreFriction, DahlFriction, ElastoPlasticFriction or MaxwellFriction
        Friction of pad on disc. By default `StribeckFriction()`.
    drive : WeightDrive, SpringDrive, BeltDrive, TableDrive, RampDrive, SineDrive, ChirpDrive or HandDrive
        The drive of the shaft. By default `WeightDrive()`.
    encoder : Encoder
        The angle sensor. By default `Encoder()`.
    dac : Dac
        The converter. By default `Dac()`.
    ripple : Ripple or None, default None
        Friction along the disc; absent if it is even.
    runout : Runout or None, default None
        Friction in waves along the disc, beside a ripple; absent if it has none.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> rig = clutch.Rig(delay_ticks=1, friction=clutch.StribeckFriction(mu_static=0.25))
    >>> rig.friction.mu_static
    0.25
    """

    _key: ClassVar[str] = "rig"

    inertia_kg_m2: float = 0.0017
    viscous_damping_nm_s_rad: float = 0.001
    torque_noise_nm: float = 0.0
    delay_ticks: int = 0
    actuator_time_constant_s: float | None = None
    speed_limit_deg_s: float = 360.0
    actuator: Actuator = field(default_factory=BrakeActuator)
    friction: Friction = field(default_factory=StribeckFriction)
    drive: Drive = field(default_factory=WeightDrive)
    encoder: Encoder = field(default_factory=Encoder)
    dac: Dac = field(default_factory=Dac)
    ripple: Ripple | None = None
    runout: Runout | None = None


@dataclass(frozen=True, kw_only=True, repr=False)
class Model(_Params):
    """The shaft (1) as laws, observers and certificates believe it to be; the defaults are Table 1's,
    whatever the rig is.

    Parameters
    ----------
    inertia_kg_m2 : float, default 0.0017
        Total moment of inertia, in (1). `J`: a finite number above 0 kg m² whose inverse is finite, too.
    drive_torque_nm : float, default 0.047088000000000005
        Driving torque `T_u = M g R_p` in (1). Either sign for a plant alone. `T_u`: a finite number, N m; a
        torque above 0 N m with a brake, which moves nothing itself, and at least 0 with a brake and a motor
        (model.actuator): let the drive turn the shaft forwards, or turn the axis round, or take a motor.
    viscous_damping_nm_s_rad : float, default 0.001
        Viscous damping, in (1). `C_d`: a finite number of at least 0 N m s/rad.
    actuator : BrakeActuator, BrakeGeometry, MotorActuator or BothActuator
        Effect of a voltage on the shaft. By default `BrakeActuator()`.
    friction : StribeckFriction, CoulombFriction, LugreFriction, DahlFriction, ElastoPlasticFriction or MaxwellFriction
        Friction of pad on disc. By default `StribeckFriction()`.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Model(drive_torque_nm=0.054).friction.mu_dynamic
    0.15
    """

    _key: ClassVar[str] = "model"

    inertia_kg_m2: float = 0.0017
    drive_torque_nm: float = 0.047088000000000005
    viscous_damping_nm_s_rad: float = 0.001
    actuator: Actuator = field(default_factory=BrakeActuator)
    friction: Friction = field(default_factory=StribeckFriction)


@dataclass(frozen=True, kw_only=True, repr=False)
class Pd(_Params):
    """Proportional–derivative control (4): `u = −(K_p e + K_d ė)`. The gains' defaults are Table 2's.

    Parameters
    ----------
    kp_v_rad : float, default 5000.0
        Proportional gain of (4). `K_p`: a finite number of at least 0 V/rad.
    kd_v_s_rad : float, default 50.0
        Derivative gain of (4). `K_d`: a finite number of at least 0 V s/rad.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Pd().kp_v_rad
    5000.0
    """

    _key: ClassVar[str] = "law.pd"

    kp_v_rad: float = 5000.0
    kd_v_s_rad: float = 50.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Ctc(_Params):
    """Computed-torque control (11): the plant that `Model` describes, solved for the voltage. The gains'
    defaults are Table 2's.

    `τ = −K (K_p e + K_d ė)`, `u = [T_u − J (θ̈_d − τ) − C_d θ̇]/(μ(θ̇) K_COF)`.

    Parameters
    ----------
    outer_gain : float, default 90.0
        Outer gain of (10). `K`: a finite number of at least 0.
    kp_1_s2 : float, default 100.0
        Proportional gain of (10). `K_p`: a finite number of at least 0 1/s².
    kd_1_s : float, default 0.7
        Derivative gain of (10). `K_d`: a finite number of at least 0 1/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Ctc().outer_gain
    90.0
    """

    _key: ClassVar[str] = "law.ctc"

    outer_gain: float = 90.0
    kp_1_s2: float = 100.0
    kd_1_s: float = 0.7


@dataclass(frozen=True, kw_only=True, repr=False)
class Smc(_Params):
    """Sliding-mode control with a boundary layer (31). The gains' defaults are Table 2's.

    `u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}` with `σ = f e + ė`.

    Parameters
    ----------
    kp_v : float, default 3.0
        Switching gain of (31). `K_p`: a finite number of at least 0 V.
    kd_v_s_rad : float, default 400.0
        Damping gain of (31). `K_d`: a finite number of at least 0 V s/rad.
    slope_1_s : float, default 70.0
        Slope of the sliding surface (13). `f`: a finite number above 0 1/s.
    boundary_rad_s : float, default 0.1
        Thickness of the boundary layer (30). `ε`: a finite number above 0 rad/s whose inverse is finite, too.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Smc(kp_v=4)
    Smc(kp_v=4.0, kd_v_s_rad=400.0, slope_1_s=70.0, boundary_rad_s=0.1)
    """

    _key: ClassVar[str] = "law.smc"

    kp_v: float = 3.0
    kd_v_s_rad: float = 400.0
    slope_1_s: float = 70.0
    boundary_rad_s: float = 0.1


@dataclass(frozen=True, kw_only=True, repr=False)
class SmcSign(_Params):
    """Sliding-mode control with the sign function (29), without a boundary layer: it chatters. The gains'
    defaults are Table 2's.

    `u = −{K_p sgn(σ) + K_d sgn(σ ė) ė}` with `σ = f e + ė`.

    Parameters
    ----------
    kp_v : float, default 3.0
        Switching gain of (29). `K_p`: a finite number of at least 0 V.
    kd_v_s_rad : float, default 400.0
        Damping gain of (29). `K_d`: a finite number of at least 0 V s/rad.
    slope_1_s : float, default 70.0
        Slope of the sliding surface (13). `f`: a finite number above 0 1/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SmcSign().kp_v
    3.0
    """

    _key: ClassVar[str] = "law.smc_sign"

    kp_v: float = 3.0
    kd_v_s_rad: float = 400.0
    slope_1_s: float = 70.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Pid(_Params):
    """PID control with feed-forward, a filtered derivative, and an integral that does not wind up at a limit.

    `u = u_0 − (K_p e + K_i ∫ e dt + K_d d + K_c sgn θ̇_d + K_v θ̇_d + K_a θ̈_d)` with a brake, `u_0 + (…)`
    with a motor; `τ ḋ = ė − d`. A start is bumpless where there is an integral. The feed-forward of a
    believed plant is `u_0 = T_u/(μ K_COF)`, `K_v = C_d/(μ K_COF)`, `K_a = J/(μ K_COF)` with a brake; `u_0 =
    −T_u/k_t`, `K_c = μ N_0/k_t`, `K_v = C_d/k_t`, `K_a = J/k_t` with a motor.

    Parameters
    ----------
    kp_v_rad : float, default 1000.0
        Proportional gain. `K_p`: a finite number of at least 0 V/rad.
    ki_v_rad_s : float, default 10000.0
        Integral gain. `K_i`: a finite number of at least 0 V/(rad s).
    kd_v_s_rad : float, default 20.0
        Derivative gain. `K_d`: a finite number of at least 0 V s/rad.
    derivative_time_s : float, default 0.0
        Time constant of the derivative's filter; 0 takes the error rate as it is. `τ`: a finite number of at
        least 0 s.
    tracking_time_s : float, default 0.05
        Time in which the integral follows a limit of the output. `T_t`: a finite number above 0 s; a time of
        at least sampling.period_us, s.
    bias_v : float, default 0.0
        Voltage without error, at rest. `u_0`: a finite number, V.
    coulomb_v : float, default 0.0
        Feed-forward of friction: this voltage the way that the path goes, none where it rests. `K_c`: a
        finite number, V.
    velocity_v_s_rad : float, default 0.0
        Feed-forward of the path's velocity. `K_v`: a finite number, V s/rad.
    acceleration_v_s2_rad : float, default 0.0
        Feed-forward of the path's acceleration. `K_a`: a finite number, V s²/rad.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Pid().kp_v_rad
    1000.0
    """

    _key: ClassVar[str] = "law.pid"

    kp_v_rad: float = 1000.0
    ki_v_rad_s: float = 10000.0
    kd_v_s_rad: float = 20.0
    derivative_time_s: float = 0.0
    tracking_time_s: float = 0.05
    bias_v: float = 0.0
    coulomb_v: float = 0.0
    velocity_v_s_rad: float = 0.0
    acceleration_v_s2_rad: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class SuperTwisting(_Params):
    """Super-twisting, a sliding mode of second order: a root and the integral of a sign, which switches
    behind an integral and not at the output.

    `u = v − K_1 √|σ| sgn σ`, `v̇ = −K_2 sgn σ` with `σ = f e + ė` and a brake; with a motor both terms turn
    round. A start is bumpless where the integral that it takes is within the output's limits, and the
    integral does not wind up at a limit.

    Parameters
    ----------
    k1_v_rt_s_rad : float, default 4.4
        Gain of the root. `K_1`: a finite number above 0 V √(s/rad).
    k2_v_s : float, default 15.0
        Gain of the integral: its rate beyond the layer. `K_2`: a finite number above 0 V/s.
    slope_1_s : float, default 35.0
        Slope of the sliding surface (13). `f`: a finite number above 0 1/s.
    boundary_rad_s : float, default 0.0
        Thickness of a boundary layer in which both terms are linear; 0 has none. `ε`: a finite number of at
        least 0 rad/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SuperTwisting().k1_v_rt_s_rad
    4.4
    """

    _key: ClassVar[str] = "law.super_twisting"

    k1_v_rt_s_rad: float = 4.4
    k2_v_s: float = 15.0
    slope_1_s: float = 35.0
    boundary_rad_s: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class SmcIntegral(_Params):
    """Sliding-mode control with a boundary layer, whose surface has the integral of the error: it keeps no
    offset.

    `u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}` with `σ = ė + f e + g ∫ e dt` and a brake, `{…}` with a motor. A
    start is bumpless up to `K_p`, and the integral does not wind up at a limit.

    Parameters
    ----------
    kp_v : float, default 7.0
        Switching gain. `K_p`: a finite number above 0 V.
    kd_v_s_rad : float, default 0.0
        Damping gain. `K_d`: a finite number of at least 0 V s/rad.
    slope_1_s : float, default 30.0
        Slope of the sliding surface. `f`: a finite number above 0 1/s.
    integral_1_s2 : float, default 3000.0
        Gain of the integral in the surface. `g`: a finite number of at least 0 1/s².
    boundary_rad_s : float, default 0.27
        Thickness of the boundary layer (30). `ε`: a finite number above 0 rad/s whose inverse is finite, too.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SmcIntegral().kp_v
    7.0
    """

    _key: ClassVar[str] = "law.smc_integral"

    kp_v: float = 7.0
    kd_v_s_rad: float = 0.0
    slope_1_s: float = 30.0
    integral_1_s2: float = 3000.0
    boundary_rad_s: float = 0.27


@dataclass(frozen=True, kw_only=True, repr=False)
class Dob(_Params):
    """Proportional–derivative control with a disturbance observer: whatever torque the model does not explain
    is found from voltage and velocity, and given back.

    `T(u) = J (θ̈_d + K_d ė + K_p e) + d̂`, `d̂ = g/(s + g) [T(u) − J θ̈]` with inertia and `T(u)`, friction
    of a sliding shaft included, as `Model` has them. A start is bumpless, and nothing winds up at a limit.

    Parameters
    ----------
    kp_1_s2 : float, default 10000.0
        Gain from position to acceleration. `K_p`: a finite number of at least 0 1/s².
    kd_1_s : float, default 250.0
        Gain from velocity to acceleration. `K_d`: a finite number of at least 0 1/s.
    bandwidth_rad_s : float, default 33.0
        Bandwidth of the observer. Delay and the velocity's filter bound it from above. `g`: a finite number
        above 0 rad/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Dob().kp_1_s2
    10000.0
    """

    _key: ClassVar[str] = "law.dob"

    kp_1_s2: float = 10000.0
    kd_1_s: float = 250.0
    bandwidth_rad_s: float = 33.0


@dataclass(frozen=True, kw_only=True, repr=False)
class EdgeTimed(_Params):
    """A Kalman filter that is corrected where an edge of the encoder is crossed, and by silence between
    edges. It knows the voltage and, from the model, drive torque over inertia; friction it learns.

    Parameters
    ----------
    delay_ticks : int, default 0
        Periods from a voltage to its effect, beyond the one in which it is given: `rig.delay_ticks` as
        believed. A whole number from 0 to 3 periods.
    lag_s : float, default 0.0
        Time constant of the actuator, as believed; 0 for one without a lag. `τ`: a finite number of at least
        0 s; a time below 1000 times sampling.period_us.
    friction_doubt : float, default 0.25
        Standard deviation of friction at the start, as a share of the model's. A number above 0 and at most
        10.
    ripple_share : float, default 0.15
        Root mean square of the ripple along the disc, as a share of friction. A number above 0 and at most 1.
    ripple_waves_per_turn : float, default 340.0
        Waves of the ripple per turn. `k`: a number above 0 and at most 1 000 000 waves per turn; a number
        below a twentieth of rig.encoder.counts_per_rev: an encoder sees no shorter wave.
    ripple_damping : float, default 0.2
        Damping of the ripple's waves: small for a ripple of one wavelength. `ζ`: a number above 0 and at most
        1.
    walk_rad_s_rt_s : float, default 0.015
        Wander of the velocity that no friction explains: by this much (standard deviation) in one second, and
        with the root of the time. A finite number above 0 rad/s/√s.
    gain_doubt : float, default 0.3
        Share of an acceleration that may be wrong, as drive torque and inertia are not known better. A number
        from 0 to 2.
    silence_counts : float, default 3.0
        Counts that the path may go on without an edge before the shaft is taken to rest. A number above 1 and
        at most 1000 counts.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.EdgeTimed().delay_ticks
    0
    """

    _key: ClassVar[str] = "velocity.edge_timed"

    delay_ticks: int = 0
    lag_s: float = 0.0
    friction_doubt: float = 0.25
    ripple_share: float = 0.15
    ripple_waves_per_turn: float = 340.0
    ripple_damping: float = 0.2
    walk_rad_s_rt_s: float = 0.015
    gain_doubt: float = 0.3
    silence_counts: float = 3.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Glide(_Params):
    """Glide: smooth motion far below the rates at which laws on a difference of counts stick. Friction is
    inverted where an edge-timed filter believes it to be, which learns it on the way; one set of gains for
    all rates.

    `ω_c = θ̇_d + K_p ẽ` between `floor` and `cap` times `θ̇_d`; the voltage gives `θ̈ = K_d (ω_c − ω̂) +
    θ̈_d` with the friction of the filter, and drive torque, inertia, damping and actuator of `Model`.

    Parameters
    ----------
    kp_1_s : float, default 40.0
        Gain from position to velocity. `K_p`: a finite number of at least 0 1/s.
    kd_1_s : float, default 150.0
        Gain from velocity to acceleration. `K_d`: a finite number above 0 1/s.
    floor : float, default 0.5
        Least velocity that the law asks for, as a share of the path's. A number from 0 to 1; a share above
        1/filter.silence_counts, so that a shaft at the floor is not taken to rest.
    cap : float, default 3.0
        Highest velocity that the law asks for, as a multiple of the path's. A finite number of at least 1.
    optimism : float, default 1.0
        Standard deviations by which friction is taken to be higher than believed, from a rest to the first
        edge. A number from 0 to 10.
    micro_below_deg_s : float, default 0.0
        Rate of the path below which the shaft goes in micro-steps, between which it rests; 0 takes none. A
        finite number of at least 0 °/s; 0 with a filter.lag_s above 0.0005 s, under which micro-steps are no
        longer small.
    filter : EdgeTimed
        Filter of velocity and friction. By default `EdgeTimed()`.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Glide().kp_1_s
    40.0
    """

    _key: ClassVar[str] = "law.glide"

    kp_1_s: float = 40.0
    kd_1_s: float = 150.0
    floor: float = 0.5
    cap: float = 3.0
    optimism: float = 1.0
    micro_below_deg_s: float = 0.0
    filter: EdgeTimed = field(default_factory=EdgeTimed)


@dataclass(frozen=True, kw_only=True, repr=False)
class Voltage(_Params):
    """An open-loop voltage, whatever the shaft does. It begins at `start_v`, and after a wait goes to `end_v`
    at a rate.

    Parameters
    ----------
    start_v : float, default 0.0
        Voltage at the start. `u_0`: a finite number, V; a voltage from output.lowest_v to output.highest_v.
    end_v : float, default 0.0
        Voltage at the end of the way. `u_1`: a finite number, V; a voltage from output.lowest_v to
        output.highest_v.
    rate_v_s : float, default 0.0
        Rate from the one to the other; 0 stays at the start. `r`: a finite number of at least 0 V/s; a rate
        above 0 where an end_v is given.
    wait_s : float, default 0.0
        Time at the start before it goes, in whole periods. `t_w`: a finite number of at least 0 s; a time of
        at most 1e7 times sampling.period_us.
    returns : bool, default False
        `true` if it goes to and fro between them; else it stays at the end.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Voltage(end_v=2, rate_v_s=0.1)
    Voltage(start_v=0.0, end_v=2.0, rate_v_s=0.1, wait_s=0.0, returns=False)
    """

    _key: ClassVar[str] = "law.voltage"

    start_v: float = 0.0
    end_v: float = 0.0
    rate_v_s: float = 0.0
    wait_s: float = 0.0
    returns: bool = False


@dataclass(frozen=True, kw_only=True, repr=False)
class HoldLaw(_Params):
    """A voltage that holds the resting shaft, whatever the encoder says: with a brake a multiple of the
    lowest that does, with a motor the one that balances the drive.

    Parameters
    ----------
    margin : float, default 1.25
        Multiple of the driving torque that a brake holds; 1 leaves nothing for the converter's rounding. `m`:
        a finite number of at least 1.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.HoldLaw()
    HoldLaw(margin=1.25)
    """

    _key: ClassVar[str] = "law.hold"

    margin: float = 1.25


Law = Pd | Ctc | Smc | SmcSign | Pid | SuperTwisting | SmcIntegral | Dob | Glide | Voltage | HoldLaw


@dataclass(frozen=True, kw_only=True, repr=False)
class SmoothedDerivative(_Params):
    """The smoothed difference (5), which the paper calls a Kalman filter: a first-order low-pass on the
    backward difference of the error.

    `ė_k = (1 − K_Kal) ė_{k−1} + K_Kal (e_k − e_{k−1})/T`.

    Parameters
    ----------
    smoothing : float, default 0.2
        Share of the newest difference in (5); 1 smooths nothing. The paper gives 0.2 to 1, and 0.2 reproduces
        its figures. `K_Kal`: a number above 0 and at most 1.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SmoothedDerivative().smoothing
    0.2
    """

    _key: ClassVar[str] = "velocity.smoothed_derivative"

    smoothing: float = 0.2


@dataclass(frozen=True, kw_only=True, repr=False)
class CountsOverTime(_Params):
    """Counts over the time between edges of the encoder, the M/T method of drives: from edge to edge where
    the shaft is slow, over the counts of some time where it is fast, and no more than a count since the last
    edge in silence.

    Parameters
    ----------
    least_time_s : float, default 0.002
        Least time over which counts are taken. Longer is smoother and later. `t_g`: a number from 0 to 10 s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.CountsOverTime().least_time_s
    0.002
    """

    _key: ClassVar[str] = "velocity.counts_over_time"

    least_time_s: float = 0.002


@dataclass(frozen=True, kw_only=True, repr=False)
class Observer(_Params):
    """A stationary Kalman filter for position, velocity and the torque that nobody measures. It predicts with
    the model.

    Parameters
    ----------
    disturbance_walk_nm_rt_s : float, default 0.1
        Rate at which the disturbance torque wanders: by this much (standard deviation) in one second, and
        with the root of the time. Larger follows friction faster and lets more of the encoder's steps
        through. `q_d`: a finite number above 0 N m/√s; a number in N m/√s for which, with model.inertia_kg_m2
        and sampling.period_us, stable gains exist in sampling.scalar.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Observer().disturbance_walk_nm_rt_s
    0.1
    """

    _key: ClassVar[str] = "velocity.observer"

    disturbance_walk_nm_rt_s: float = 0.1


Velocity = SmoothedDerivative | CountsOverTime | EdgeTimed | Observer


@dataclass(frozen=True, kw_only=True, repr=False)
class Output(_Params):
    """Output stage of a law. The defaults are for a brake: the paper's 0 to 10 V without bumpless start, and
    full braking on an invalid demand.

    Parameters
    ----------
    lowest_v : float, default 0.0
        Lowest voltage. With a brake at least 0, as a pad can only push; above 0 the pad never lifts. A finite
        number, V; a voltage of at least 0 with a brake, whose pad can only push (rig.actuator,
        model.actuator); a voltage below 0, as -10.0, with an actuator that drives (model.actuator); a motor
        needs on_invalid_v = 0, too; a voltage that the converter reaches: not below rig.dac.lowest_v.
    highest_v : float, default 10.0
        Highest voltage. Lower `on_invalid_v` together with it. A finite number, V; a voltage above lowest_v;
        a voltage that the converter reaches: not above rig.dac.highest_v.
    on_invalid_v : float, default 10.0
        Voltage for a demand that is not a number; with a motor 0. A finite number, V; a voltage from lowest_v
        to highest_v (it does not follow them); 0 with a motor, which any other voltage drives, and at least 0
        with a brake and a motor (model.actuator).
    bumpless_time_s : float, default 0.0
        Time constant of a bumpless start, with which the difference between the voltage found at start and
        the law's first demand decays; 0 starts with the law's own demand. A finite number of at least 0 s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Output(highest_v=8, on_invalid_v=8)
    Output(lowest_v=0.0, highest_v=8.0, on_invalid_v=8.0, bumpless_time_s=0.0)
    """

    _key: ClassVar[str] = "output"

    lowest_v: float = 0.0
    highest_v: float = 10.0
    on_invalid_v: float = 10.0
    bumpless_time_s: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Shell(_Params):
    """A shell around the law, which gives the error a bound whatever the law is: with `σ = f e + ė` the brake
    is full where `σ ≤ −S` and off where `σ ≥ S`; with a motor either drives back. Off by default.

    Parameters
    ----------
    slope_1_s : float, default 100.0
        Slope `f` of the shell's surface. The error stays within about `S/f` and a few counts. `f`: a finite
        number above 0 1/s.
    boundary_rad_s : float, default 0.0
        Distance from the surface at which the shell acts; 0 switches the shell off. `S`: a finite number of
        at least 0 rad/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Shell().slope_1_s
    100.0
    """

    _key: ClassVar[str] = "shell"

    slope_1_s: float = 100.0
    boundary_rad_s: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Hold(_Params):
    """Stays at the start.

    Examples
    --------
    >>> import clutch
    >>> clutch.Hold()
    Hold()
    """

    _key: ClassVar[str] = "reference.hold"


@dataclass(frozen=True, kw_only=True, repr=False)
class Ramp(_Params):
    """Constant rate from the first tick: the paper's path.

    Parameters
    ----------
    rate_deg_s : float
        Rate, to which the velocity jumps at the start; with a brake above 0. A finite number, °/s; a finite
        rate below 4e6 counts of rig.encoder.counts_per_rev per sampling.period_us, °/s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Ramp(rate_deg_s=2)
    Ramp(rate_deg_s=2.0)
    """

    _key: ClassVar[str] = "reference.ramp"

    rate_deg_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Trapezoid(_Params):
    """Rest to rest with a trapezoidal velocity; a triangle where the distance is too short.

    Parameters
    ----------
    distance_deg : float
        Distance. Either sign; with a brake above 0. A finite number, °; a finite distance below 1e12 counts
        of rig.encoder.counts_per_rev, °.
    speed_deg_s : float
        Highest speed. A finite number above 0 °/s; a finite speed below 4e6 counts of
        rig.encoder.counts_per_rev per sampling.period_us, °/s; a speed high enough to be through with
        distance_deg within 1e15 periods, °/s.
    acceleration_deg_s2 : float
        Acceleration and deceleration. A finite number above 0 °/s²; an acceleration high enough to be through
        with distance_deg within 1e15 periods, °/s².

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Trapezoid(distance_deg=90, speed_deg_s=20, acceleration_deg_s2=100)
    Trapezoid(distance_deg=90.0, speed_deg_s=20.0, acceleration_deg_s2=100.0)
    """

    _key: ClassVar[str] = "reference.trapezoid"

    distance_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float


@dataclass(frozen=True, kw_only=True, repr=False)
class JerkLimited(_Params):
    """Rest to rest with bounded jerk: seven pieces, fewer where a bound is not reached.

    Parameters
    ----------
    distance_deg : float
        Distance. Either sign; with a brake above 0. A finite number, °; a finite distance below 1e12 counts
        of rig.encoder.counts_per_rev, °.
    speed_deg_s : float
        Highest speed. A finite number above 0 °/s; a finite speed below 4e6 counts of
        rig.encoder.counts_per_rev per sampling.period_us, °/s; a speed high enough to be through with
        distance_deg within 1e15 periods, °/s.
    acceleration_deg_s2 : float
        Highest acceleration and deceleration. A finite number above 0 °/s²; an acceleration high enough to be
        through with distance_deg within 1e15 periods, °/s².
    jerk_deg_s3 : float
        Highest jerk. A finite number above 0 °/s³; a jerk high enough to be through with distance_deg within
        1e15 periods, °/s³.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> path = clutch.JerkLimited(
    ...     distance_deg=90, speed_deg_s=20, acceleration_deg_s2=100, jerk_deg_s3=1000
    ... )
    """

    _key: ClassVar[str] = "reference.jerk_limited"

    distance_deg: float
    speed_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float


@dataclass(frozen=True, kw_only=True, repr=False)
class MinimumJerk(_Params):
    """Rest to rest along `10 s³ − 15 s⁴ + 6 s⁵`, `s = t/duration` (Flash and Hogan 1985).

    Parameters
    ----------
    distance_deg : float
        Distance. Either sign; with a brake above 0. A finite number, °; a finite distance below 1e12 counts
        of rig.encoder.counts_per_rev, °.
    duration_s : float
        Time of the path. A number above 0 and at most 1 000 000 s; a time of at least sampling.period_us, s;
        a time in which the highest speed stays below 4e6 counts of rig.encoder.counts_per_rev per
        sampling.period_us, s.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.MinimumJerk(distance_deg=90, duration_s=6)
    MinimumJerk(distance_deg=90.0, duration_s=6.0)
    """

    _key: ClassVar[str] = "reference.minimum_jerk"

    distance_deg: float
    duration_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Sine(_Params):
    """A sine on a ramp: `rate · t + amplitude · [sin(2π f t + phase) − sin(phase)]`.

    A brake follows it only while the velocity keeps its sign: `2π f · amplitude ≤ rate`.

    Parameters
    ----------
    rate_deg_s : float
        Rate of the ramp below the sine. A finite number, °/s; a finite rate below 4e6 counts of
        rig.encoder.counts_per_rev per sampling.period_us, °/s.
    amplitude_deg : float
        Amplitude of the sine. A finite number, °; a finite amplitude below 1e12 counts of
        rig.encoder.counts_per_rev, °.
    frequency_hz : float
        Frequency. `f`: a finite number of at least 0 Hz; a frequency below half the sampling rate, which
        sampling.period_us gives, Hz.
    phase_turns : float, default -0.25
        Phase at the start; −0.25 starts at the rate of the ramp. A number from -1 to 1 turns.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Sine(rate_deg_s=10, amplitude_deg=1.5, frequency_hz=1)
    Sine(rate_deg_s=10.0, amplitude_deg=1.5, frequency_hz=1.0, phase_turns=-0.25)
    """

    _key: ClassVar[str] = "reference.sine"

    rate_deg_s: float
    amplitude_deg: float
    frequency_hz: float
    phase_turns: float = -0.25


@dataclass(frozen=True, kw_only=True, repr=False)
class Chirp(_Params):
    """A sine on a ramp, whose frequency goes linearly from one value to another and stays there.

    A brake follows it only while the velocity keeps its sign: `2π f · amplitude ≤ rate` for either frequency
    `f`.

    Parameters
    ----------
    rate_deg_s : float
        Rate of the ramp below the sine. A finite number, °/s; a finite rate below 4e6 counts of
        rig.encoder.counts_per_rev per sampling.period_us, °/s.
    amplitude_deg : float
        Amplitude of the sine. A finite number, °; a finite amplitude below 1e12 counts of
        rig.encoder.counts_per_rev, °.
    from_hz : float
        Frequency at the start. A finite number of at least 0 Hz; a frequency below half the sampling rate,
        which sampling.period_us gives, Hz.
    to_hz : float
        Frequency at the end. A finite number of at least 0 Hz; a frequency below half the sampling rate,
        which sampling.period_us gives, Hz.
    duration_s : float
        Time from one to the other. A finite number above 0 s; a time of 1 to 4e9 times sampling.period_us.
    phase_turns : float, default -0.25
        Phase at the start; −0.25 starts at the rate of the ramp. A number from -1 to 1 turns.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Chirp(rate_deg_s=10, amplitude_deg=0.5, from_hz=0.1, to_hz=3, duration_s=10).to_hz
    3.0
    """

    _key: ClassVar[str] = "reference.chirp"

    rate_deg_s: float
    amplitude_deg: float
    from_hz: float
    to_hz: float
    duration_s: float
    phase_turns: float = -0.25


@dataclass(frozen=True, kw_only=True, repr=False)
class TablePath(_Params):
    """Points in time. Before the first point the path rests there, after the last too.

    Parameters
    ----------
    points_s_deg : sequence of (float, float)
        Points of time and angle, from the start; times rise. A brake follows only angles that do not fall. A
        list of at least one pair [s, °] of finite numbers, with times that rise from 0 s on; at least one
        point; times of at least 0 s that rise from point to point; positions below 7e13 counts of
        rig.encoder.counts_per_rev.
    interpolation : {"linear", "cubic"}, default "cubic"
        Curve from point to point. `linear`: Straight lines: the velocity jumps at each point. `cubic`:
        Monotone cubics (Fritsch and Butland 1984): the velocity is continuous and a rising table never runs
        backwards, which a brake could not follow.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.TablePath(points_s_deg=[(0.5, 0), (2, 20)])
    TablePath(points_s_deg=((0.5, 0.0), (2.0, 20.0)), interpolation='cubic')
    """

    _key: ClassVar[str] = "reference.table"

    points_s_deg: Sequence[tuple[float, float]]
    interpolation: Literal["linear", "cubic"] = "cubic"


Reference = Hold | Ramp | Trapezoid | JerkLimited | MinimumJerk | Sine | Chirp | TablePath


@dataclass(frozen=True, kw_only=True, repr=False)
class Sampling(_Params):
    """Times at which the servo is asked, and the scalar that it computes in.

    Parameters
    ----------
    period_us : int, default 1000
        Time from sample to sample, in (5). `T`: a whole number from 1 to 1 000 000 µs.
    scalar : {"f32", "f64"}, default "f64"
        Scalar that path and servo compute in; a board has `f32`. The shaft is always in `f64`. `f32`: Single
        precision, as on a board. `f64`: Double precision.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Sampling().period_us
    1000
    """

    _key: ClassVar[str] = "sampling"

    period_us: int = 1000
    scalar: Literal["f32", "f64"] = "f64"


@dataclass(frozen=True, kw_only=True, repr=False)
class Bounds(_Params):
    """Accuracy to which the believed plant is known, (23), and the reaching rate that the certificate shall
    give: for the certificate and the check of the path.

    Parameters
    ----------
    inertia_percent : float, default 0.0
        ± on the inertia `J`, (23a). A number of at least 0 and below 100 %.
    drive_torque_percent : float, default 0.0
        ± on the driving torque `T_u`, (23b). A number of at least 0 and below 100 %.
    viscous_damping_percent : float, default 0.0
        ± on the viscous damping `C_d`, (23c). A number of at least 0 and below 100 %.
    brake_gain_percent : float, default 0.0
        ± on the brake gain `K_COF`, (23h). A number of at least 0 and below 100 %.
    motor_gain_percent : float, default 0.0
        ± on a motor's gain `k_t`. A number of at least 0 and below 100 %.
    friction_percent : float, default 0.0
        ± on the friction, in motion (23d) and at rest (23e). A number of at least 0 and below 100 %.
    reach_rate_rad_s2 : float, default 0.0
        Rate of reaching the sliding surface that the certificate shall give, in (15); above 0 the reaching
        time gets a bound. `γ`: a finite number of at least 0 rad/s².
    ripple_percent : float or None, default None
        The part of `friction_percent` that changes along the disc and with time; the rest is a mean that is
        off by as much in ratio either way, (1 + friction)/(1 + ripple). Absent: all of it is the mean's, and
        the sampled certificate adds the ripple of the rig. A number of at least 0 and below 100 %; at most
        friction_percent, of which it is a part.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Bounds(friction_percent=20, brake_gain_percent=20).friction_percent
    20.0
    """

    _key: ClassVar[str] = "bounds"

    inertia_percent: float = 0.0
    drive_torque_percent: float = 0.0
    viscous_damping_percent: float = 0.0
    brake_gain_percent: float = 0.0
    motor_gain_percent: float = 0.0
    friction_percent: float = 0.0
    reach_rate_rad_s2: float = 0.0
    ripple_percent: float | None = None


@dataclass(frozen=True, kw_only=True, repr=False)
class RunOptions(_Params):
    """Length, beginning, seed and engine of a run.

    Parameters
    ----------
    duration_s : float, default 5.0
        Length. A finite number above 0 s; a time of 1 to 10 million times sampling.period_us: a run keeps
        every sample.
    settle_s : float, default 1.0
        Time at the start that is left out of the figures. A finite number of at least 0 s; a time that ends
        at least sampling.period_us before run.duration_s does.
    start : {"on_path", "rest"}, default "on_path"
        Motion of the shaft at the beginning. `on_path`: On the path: at its velocity, the brake at the
        voltage that keeps it. (12) and (13) assume a path without jumps. `rest`: Held at rest: by a brake
        with a quarter more than the voltage that this takes, by a motor with the voltage that balances the
        drive.
    start_counts : float or None, default None
        Position at which shaft and path begin; absent: somewhere within the first count, drawn from the seed.
        The place of the path between the encoder's edges decides how often a slow shaft sticks, and nobody
        mounts an encoder to a fraction of a count. A number above -1 000 000 000 and below 1 000 000 000
        counts.
    seed : int, default 1
        Seed of everything random: start, ripple phases, noise, a hand. A whole number from 0 to
        9223372036854775807.
    engine : {"auto", "dormand_prince", "exact_flow", "bristle"}, default "auto"
        Engine that integrates the motion. `auto`: The exact flow where the rig allows it, else
        Dormand–Prince; the engine of bristles for a friction that has some. `dormand_prince`: Dormand and
        Prince's 5(4) pair, the paper's solver, with events: takes every rig whose friction has no bristles.
        `exact_flow`: Closed forms, quadrature and series of the motion between samples: for friction that
        falls exponentially with the speed and is even along the disc, torque and voltage held between
        samples. `bristle`: A Rosenbrock method for stiff motions: for friction with bristles (LuGre, Dahl,
        elasto-plastic, Maxwell).

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.RunOptions(duration_s=10, seed=7).seed
    7
    """

    _key: ClassVar[str] = "run"

    duration_s: float = 5.0
    settle_s: float = 1.0
    start: Literal["on_path", "rest"] = "on_path"
    start_counts: float | None = None
    seed: int = 1
    engine: Literal["auto", "dormand_prince", "exact_flow", "bristle"] = "auto"


@dataclass(frozen=True, kw_only=True, repr=False)
class FrictionMap(_Params):
    """Friction along the disc, as an earlier ride has shown it: `clutch identify --map` writes it. The law
    glide takes it where it shows to be right; other laws have no use for it.

    Parameters
    ----------
    version : int, default 1
        Version of the table: a later one may mean something else. A whole number from 1 to 1.
    rig : str
        The rig, and the ride, that it is of: any text.
    points_deg_factor : sequence of (float, float)
        Points of angle, from the encoder's zero, and friction, over its mean; angles rise. A list of at least
        one pair [°, 1] of finite numbers, with angles that rise from -36000 to 36000 °; a list of 4 to 100
        000 points; factors of 0.1 to 10; an angle less than 1 ° from the one before: the ripple of a disc has
        waves of about 1 °.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.FrictionMap(rig="disc 7", points_deg_factor=[(0.1 * i, 1 + 0.01 * (i % 3)) for i in range(50)]).rig
    'disc 7'
    """

    _key: ClassVar[str] = "friction_map"

    version: int = 1
    rig: str
    points_deg_factor: Sequence[tuple[float, float]]


@dataclass(frozen=True, kw_only=True, repr=False)
class HoldVoltage(_Params):
    """Holds the shaft with a voltage, at once.

    Parameters
    ----------
    volts_v : float
        Voltage that stops and holds the shaft at the worst corner of the bounds. A finite number, V; a
        voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v; a voltage above 0 with
        a brake (rig.actuator), which holds with nothing else.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.HoldVoltage(volts_v=4.5)
    HoldVoltage(volts_v=4.5)
    """

    _key: ClassVar[str] = "safety.on_fault.hold"

    volts_v: float


@dataclass(frozen=True, kw_only=True, repr=False)
class RampVoltage(_Params):
    """Brakes with a rising (or falling) voltage, then holds.

    Parameters
    ----------
    rate_v_s : float
        Rate at which the voltage goes up or down from the present one. A finite number above 0 V/s; a rate
        that is a step of 2⁻¹⁶ to 60 000 codes of rig.dac per sampling.period_us.
    volts_v : float
        Voltage at the end, which stops and holds the shaft at the worst corner of the bounds. A finite
        number, V; a voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v; a voltage
        above 0 with a brake (rig.actuator), which holds with nothing else.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.RampVoltage(rate_v_s=50, volts_v=4.5)
    RampVoltage(rate_v_s=50.0, volts_v=4.5)
    """

    _key: ClassVar[str] = "safety.on_fault.ramp"

    rate_v_s: float
    volts_v: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Release(_Params):
    """Lets go: 0 V, or the converter's lowest voltage above it.

    Examples
    --------
    >>> import clutch
    >>> clutch.Release()
    Release()
    """

    _key: ClassVar[str] = "safety.on_fault.release"


@dataclass(frozen=True, kw_only=True, repr=False)
class HoldThenRelease(_Params):
    """Holds the shaft with a voltage, at once, and after a time lets go.

    Parameters
    ----------
    volts_v : float
        Voltage that stops and holds the shaft at the worst corner of the bounds. A finite number, V; a
        voltage that the converter reaches, from rig.dac.lowest_v to rig.dac.highest_v; a voltage above 0 with
        a brake (rig.actuator), which holds with nothing else.
    after_s : float
        Time of holding, after which it lets go. A finite number above 0 s; a time of 1 to 4e9 times
        sampling.period_us.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.HoldThenRelease(volts_v=4.5, after_s=2)
    HoldThenRelease(volts_v=4.5, after_s=2.0)
    """

    _key: ClassVar[str] = "safety.on_fault.hold_then_release"

    volts_v: float
    after_s: float


SafeState = HoldVoltage | RampVoltage | Release | HoldThenRelease


@dataclass(frozen=True, kw_only=True, repr=False)
class Limits(_Params):
    """Limits that end a run on a board: those of the supervisor, and how long board and codes wait.
    docs/safety.md says why each default is what it is.

    Parameters
    ----------
    jump_deg : float, default 0.15
        Largest departure of a sample from where the last ones lead that a shaft can make in a period. A
        finite number above 0 °; an angle of at least one count of rig.encoder.counts_per_rev and below 2³⁰ of
        them, °.
    jumps : int, default 3
        Samples beyond `jump_deg`, within 128 periods, that end control. One glitch is tolerated. A whole
        number from 1 to 128 within 128 periods.
    good_samples : int, default 1
        Samples in a row that have to pass after one was refused before the law answers again. A whole number
        from 1 to 4 294 967 295; a number below silence_cycles: an unanswered board goes to its safe state.
    following_error_deg : float, default 1.0
        Error at rest that ends control. A finite number above 0 °.
    following_time_s : float, default 0.02
        Growth of `following_error_deg` with the target's speed. A finite number of at least 0 s.
    saturation_time_s : float, default 0.2
        Time at a limit of the voltage that ends control. A finite number above 0 s; a time of 1 to 4e9 times
        sampling.period_us.
    edge_counts : float, default 0.2
        Counts by which an edge of the encoder may lie off its place. A finite number of at least 0 counts.
    friction_margin : float, default 1.8
        Factor by which friction may exceed its upper bound before the counts of a shaft that it would have
        stopped sooner are not believed. A finite number of at least 1.
    grip_margin : float, default 1.2
        Factor by which friction may fall short of its lower bound before a shaft that is faster ends control.
        A finite number of at least 1.
    delay_cycles : int, default 0
        Periods from a code to its effect, beyond the one in which it is sent; above 14 the effect may be that
        of any voltage of the output. No less than `rig.delay_ticks`. A whole number from 0 to 1000 periods.
    lost : int, default 26
        Lost samples within 128 periods that end control. A whole number from 1 to 128 within 128 periods.
    late : int, default 26
        Late samples, and codes that the board refuses as late, within 128 periods that end control. A whole
        number from 1 to 128 within 128 periods.
    disorder : int, default 2
        Duplicated, or reordered, samples within 128 periods that end control. A whole number from 1 to 128
        within 128 periods.
    silence_cycles : int, default 3
        Periods without a sample that end control. A whole number from 2 to 1000 periods.
    deadline_us : int, default 500
        Longest time from a sample's arrival to its answer. A whole number from 1 to 4 294 967 295 µs.
    overruns : int, default 26
        Answers later than `deadline_us`, within 128 periods, that end control. A whole number from 1 to 128
        within 128 periods.
    watchdog_cycles : int, default 3
        Periods without a valid code after which the board goes to its safe state by itself; at most
        `silence_cycles`. A whole number from 2 to 100 periods; at most silence_cycles: no code stays on
        longer than a host without samples goes on.
    valid_cycles : int, default 2
        Periods after its sample during which a code is valid; at most 65.535 ms. A whole number from 1 to
        1000 periods.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Limits(following_error_deg=0.5).following_time_s
    0.02
    """

    _key: ClassVar[str] = "safety.limits"

    jump_deg: float = 0.15
    jumps: int = 3
    good_samples: int = 1
    following_error_deg: float = 1.0
    following_time_s: float = 0.02
    saturation_time_s: float = 0.2
    edge_counts: float = 0.2
    friction_margin: float = 1.8
    grip_margin: float = 1.2
    delay_cycles: int = 0
    lost: int = 26
    late: int = 26
    disorder: int = 2
    silence_cycles: int = 3
    deadline_us: int = 500
    overruns: int = 26
    watchdog_cycles: int = 3
    valid_cycles: int = 2


@dataclass(frozen=True, kw_only=True, repr=False)
class Safety(_Params):
    """The way a run on a board ends, and what ends it. Only what drives a board needs it; there is no default
    safe state.

    Parameters
    ----------
    reason : str
        The reason that this safe state is the right one for this rig, in the operator's words; printed before
        each run.
    live_gains : bool, default False
        Gains may be changed while a loop runs, from its live view.
    on_fault : HoldVoltage, RampVoltage, Release or HoldThenRelease
        Safe state: what the brake does when control has ended.
    limits : Limits
        Limits that end control. By default `Limits()`.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Safety(reason="a weight drives the shaft", on_fault=clutch.HoldVoltage(volts_v=4.5))
    Safety(reason='a weight drives the shaft', live_gains=False, on_fault=HoldVoltage(volts_v=4.5))
    """

    _key: ClassVar[str] = "safety"

    reason: str
    live_gains: bool = False
    on_fault: SafeState
    limits: Limits = field(default_factory=Limits)


@dataclass(frozen=True, kw_only=True, repr=False)
class _Scenario(_Params):
    """A scenario: rig, believed plant, law, path, sampling, bounds, run, safety.

    Parameters
    ----------
    name : str
        Title of the output, any text. By default the law's and the path's name.
    rig : Rig
        The shaft as it is. By default `Rig()`.
    model : Model
        The shaft as law, observer and certificate believe it to be. By default `Model()`.
    law : Pd, Ctc, Smc, SmcSign, Pid, SuperTwisting, SmcIntegral, Dob, Glide, Voltage or HoldLaw
        The law and its gains.
    velocity : SmoothedDerivative, CountsOverTime, EdgeTimed or Observer
        Source of the velocity that the law is given. By default `SmoothedDerivative()`.
    output : Output
        Limits of the voltage, bumpless start. By default `Output()`.
    shell : Shell
        The shell around the law. By default `Shell()`.
    reference : Hold, Ramp, Trapezoid, JerkLimited, MinimumJerk, Sine, Chirp or TablePath
        The path.
    sampling : Sampling
        Sampling period, scalar. By default `Sampling()`.
    bounds : Bounds
        Accuracy to which the believed plant is known. By default `Bounds()`.
    run : RunOptions
        Length, beginning, seed and engine. By default `RunOptions()`.
    friction_map : FrictionMap or None, default None
        Friction along the disc, from an earlier ride.
    safety : Safety or None, default None
        The way a run on a board ends, and what ends it: `clutch loop` and `clutch daq` need it.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Scenario(law=clutch.Smc(kp_v=4), reference=clutch.Ramp(rate_deg_s=2)).name
    'SMC, ramp'
    >>> try:
    ...     clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=-2))
    ... except clutch.ParamError as error:
    ...     print(error.field)
    reference.ramp
    """

    name: str = ""
    rig: Rig = field(default_factory=Rig)
    model: Model = field(default_factory=Model)
    law: Law
    velocity: Velocity = field(default_factory=SmoothedDerivative)
    output: Output = field(default_factory=Output)
    shell: Shell = field(default_factory=Shell)
    reference: Reference
    sampling: Sampling = field(default_factory=Sampling)
    bounds: Bounds = field(default_factory=Bounds)
    run: RunOptions = field(default_factory=RunOptions)
    friction_map: FrictionMap | None = None
    safety: Safety | None = None
