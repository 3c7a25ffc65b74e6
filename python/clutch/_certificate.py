"""The guarantees for a scenario's gains."""

from dataclasses import dataclass
from typing import ClassVar

from clutch._record import _Record


@dataclass(frozen=True, kw_only=True, repr=False)
class Certificate(_Record):
    """The check that gains hold every plant within the bounds to the sliding surface, and the largest distance from it.

    A certificate is true as a condition: ``if scenario.certificate(): …``. In it, time is continuous and the sensor
    exact; sampling, encoder steps and delay come on top: `sampled` has what is said of them. With
    ``scenario.certificate(sampled=True)`` it is true if the error of the sampled loop has a proven bound.
    docs/theory.md, section 8, derives both.

    Parameters
    ----------
    scenario : str
        Title of the scenario.
    version : str
        Version of clutch.
    law : str
        The law.
    certified_continuous_time : bool
        True if the gains are certified in continuous time, with an exact sensor.
    reason : str or None
        The missing part; None if certified.
    rig_outside_bounds : tuple of str
        A line for each property of the rig that the certificate in continuous time does not cover: outside the bounds,
        torque noise included; delay; lag.
    bounds : Certificate.Bounds
        The plant as it is believed to be.
    demand : Certificate.Demand
        The demands of path, bounds and start.
    ahead : Certificate.Ahead
        The shaft ahead of the path: the brake stops it.
    behind : Certificate.Behind
        The shaft behind the path: the brake lets go.
    layer : Certificate.Layer
        The layer around the sliding surface, and the bound of the error.
    paper : Certificate.Paper or None
        The paper's own conditions, as printed; None for PD and CTC.
    sampled : Certificate.Sampled
        The verdicts on the loop as it is sampled.

    Examples
    --------
    >>> import clutch
    >>> certificate = clutch.Scenario.load("smc_2").certificate()
    >>> bool(certificate), round(certificate.ahead.kp_required_v, 4)
    (True, 2.2624)
    """

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Bounds(_Record):
        """The plant as it is believed to be (23): pairs of lowest and highest value, and what is known exactly.

        Parameters
        ----------
        inertia_kg_m2 : tuple of float
            `J`, kg m².
        drive_torque_nm : tuple of float
            `T_u`, N m.
        viscous_damping_nm_s_rad : tuple of float
            `C_d`, N m s/rad.
        actuator : str
            Kind of the actuator: `brake`, `motor` or `both`.
        brake_gain_nm_v : tuple of float
            `K_COF`, N m/V; 0 of a motor.
        motor_gain_nm_v : tuple of float
            `k_t`, N m/V; 0 of a brake.
        preload_nm : float
            Normal force without a voltage, as torque per unit of μ, `N_0`, N m.
        load_share : float
            Share of a motor's torque that presses, too, `λ`, no unit.
        friction_at_rest : tuple of float
            Friction of a resting shaft, of `μ_s` (23e), no unit.
        friction_sliding : tuple of float
            Friction of a fast shaft, of `μ_d` (23d), no unit.
        friction : tuple of float
            All that friction can be at any speed, (23f), no unit.

        Examples
        --------
        >>> import clutch
        >>> scenario = clutch.Scenario.load("smc_2").override({"bounds.friction_percent": 50})
        >>> scenario.certificate().bounds.friction_at_rest
        (0.1, 0.30000000000000004)
        """

        _key: ClassVar[str] = "bounds"

        inertia_kg_m2: tuple[float, float]
        drive_torque_nm: tuple[float, float]
        viscous_damping_nm_s_rad: tuple[float, float]
        actuator: str
        brake_gain_nm_v: tuple[float, float]
        motor_gain_nm_v: tuple[float, float]
        preload_nm: float
        load_share: float
        friction_at_rest: tuple[float, float]
        friction_sliding: tuple[float, float]
        friction: tuple[float, float]

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Demand(_Record):
        """The demands of path, bounds and start.

        Parameters
        ----------
        velocity_rad_s : float
            `v_d`: highest velocity of the path, rad/s.
        acceleration_rad_s2 : float
            `a_d`: highest acceleration or deceleration of the path, rad/s².
        reach_rate_rad_s2 : float
            `γ` in (15), rad/s².
        start_error_rate_rad_s : float
            Error rate at the start, rad/s.
        velocity_jump_rad_s : float
            Largest jump of the path's velocity on the way, rad/s.

        Examples
        --------
        >>> import clutch
        >>> clutch.Scenario.load("smc_2").certificate().demand.acceleration_rad_s2
        0.0
        """

        _key: ClassVar[str] = "demand"

        velocity_rad_s: float
        acceleration_rad_s2: float
        reach_rate_rad_s2: float
        start_error_rate_rad_s: float
        velocity_jump_rad_s: float

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Ahead(_Record):
        """The shaft ahead of the path at its worst corner: strongest drive, weakest brake.

        Parameters
        ----------
        torque_nm : float
            Driving torque of the corner, N m.
        inertia_kg_m2 : float
            Inertia of the corner, kg m².
        brake_nm_v : float
            Weakest brake `μ K_COF`, N m/V.
        kp_required_v : float
            `K_p` required (for PD and CTC: the voltage), V.
        kp_for_boundary_v : float
            Part of it for the boundary layer, V.
        kp_given_v : float
            `K_p` given (for PD and CTC: the highest voltage), V.
        kd_required_v_s_rad : float
            `K_d` required, V s/rad; 0 for PD and CTC.
        kd_given_v_s_rad : float
            `K_d` given, V s/rad; 0 for PD and CTC.
        reach_rate_possible_rad_s2 : float
            Largest `γ` that the brake allows, rad/s².
        error_rate_limit_rad_s : float
            Error rate up to which this side holds, rad/s.

        Examples
        --------
        >>> import clutch
        >>> round(clutch.Scenario.load("smc_2").certificate().ahead.kd_required_v_s_rad, 4)
        5.6667
        """

        _key: ClassVar[str] = "ahead"

        torque_nm: float
        inertia_kg_m2: float
        brake_nm_v: float
        kp_required_v: float
        kp_for_boundary_v: float
        kp_given_v: float
        kd_required_v_s_rad: float
        kd_given_v_s_rad: float
        reach_rate_possible_rad_s2: float
        error_rate_limit_rad_s: float

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Behind(_Record):
        """The shaft behind the path at its worst corner: weakest drive.

        Parameters
        ----------
        torque_nm : float
            Driving torque of the corner, N m.
        error_rate_limit_rad_s : float
            Error rate up to which this side holds, rad/s.

        Examples
        --------
        >>> import clutch
        >>> round(clutch.Scenario.load("smc_2").certificate().behind.error_rate_limit_rad_s, 4)
        0.3954
        """

        _key: ClassVar[str] = "behind"

        torque_nm: float
        error_rate_limit_rad_s: float

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Layer(_Record):
        """The layer around the sliding surface, for which nothing is claimed, and the bound of the error.

        Parameters
        ----------
        slope_1_s : float
            `f` in (13), 1/s.
        thickness_rad_s : float
            Thickness of the layer, rad/s.
        error_bound_rad : float
            Bound of the error if certified, rad.

        Examples
        --------
        >>> import clutch
        >>> clutch.Scenario.load("smc_2").certificate().layer.slope_1_s
        70.0
        """

        _key: ClassVar[str] = "layer"

        slope_1_s: float
        thickness_rad_s: float
        error_bound_rad: float

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Paper(_Record):
        """The paper's own conditions, as printed. They are not sound: docs/theory.md, section 9.

        Parameters
        ----------
        kp_26_v : float
            (26): `K_p` above, V.
        kd_27_v_s_rad : float
            (27): `K_d` above, V s/rad.
        gamma_28_rad_s2 : float
            (28): reaching rate `γ`, rad/s².

        Examples
        --------
        >>> import clutch
        >>> round(clutch.Scenario.load("smc_2").certificate().paper.kp_26_v, 4)
        -0.9603
        """

        _key: ClassVar[str] = "paper"

        kp_26_v: float
        kd_27_v_s_rad: float
        gamma_28_rad_s2: float

    @dataclass(frozen=True, kw_only=True, repr=False)
    class Sampled(_Record):
        """The verdicts on the loop as it is sampled, kept apart: error bound, linear stability, sticks.

        A bound is looked for by ``scenario.certificate(sampled=True)``.

        Parameters
        ----------
        not_covered : str or None
            The part of the scenario that these verdicts do not cover; None if they cover it.
        scope : str or None
            The loop and the plants that they speak of.
        any_law : bool
            True if the bound is one with any inner law, by a shell.
        looked_for : bool
            True if a proof of a bound was asked for.
        error_bound_rad : float or None
            Proven bound of the error, rad; None if there is none, or none was looked for.
        limiting_friction_sliding : tuple of float or None
            The part of `μ_d` that has this bound.
        cells : int or None
            Number of parts of `μ_d` that were proven.
        reason : str or None
            Why there is no bound.
        slower_fall : str or None
            The fall of the rig's friction from rest, if it is slower than the model's, of which a bound speaks.
        spectral_radius : tuple of float or None
            Spectral radius with the weakest, a middle and the strongest brake.
        stable : bool or None
            True if small deviations die out while nothing saturates or sticks.
        sticks_excluded : bool
            False: neither verdict excludes sticks.

        Examples
        --------
        >>> import clutch
        >>> clutch.Scenario.load("pd_2").certificate().sampled.stable
        True
        """

        _key: ClassVar[str] = "sampled"

        not_covered: str | None
        scope: str | None
        any_law: bool
        looked_for: bool
        error_bound_rad: float | None
        limiting_friction_sliding: tuple[float, ...] | None
        cells: int | None
        reason: str | None
        slower_fall: str | None
        spectral_radius: tuple[float, ...] | None
        stable: bool | None
        sticks_excluded: bool

    scenario: str
    version: str
    law: str
    certified_continuous_time: bool
    reason: str | None
    rig_outside_bounds: tuple[str, ...]
    bounds: Bounds
    demand: Demand
    ahead: Ahead
    behind: Behind
    layer: Layer
    paper: Paper | None
    sampled: Sampled

    def __bool__(self) -> bool:
        """True if the gains are certified as it was asked.

        In continuous time, and the sampled loop is not known to be unstable; with ``sampled=True`` or ``check`` a bound
        of the sampled loop is proven, and it is linearly stable or within a shell.
        """
        sampled = self.sampled
        if sampled.looked_for:
            return sampled.error_bound_rad is not None and (sampled.stable is True or sampled.any_law)
        return self.certified_continuous_time and (sampled.stable is not False or sampled.any_law)
