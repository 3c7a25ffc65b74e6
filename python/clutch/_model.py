"""A scenario as objects: one frozen dataclass for each table of the scenario file, with the same keys.

Ranges are checked and defaults are tested against the native module, which holds the physics.
"""

import functools
import html
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, overload

from clutch import _clutch
from clutch._certificate import Certificate
from clutch._errors import ParamError
from clutch._record import _Params, _plain, _Record, _slots, _Tree, _written

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

# --- The rig: the shaft as it is ---------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class StribeckFriction(_Params):
    """Dry friction of pad on disc, Stribeck's curve (2).

    ``μ(θ̇) = [μ_d + (μ_s − μ_d) exp(−|θ̇/θ̇_s|^δ)] sgn(θ̇)``

    Parameters
    ----------
    mu_static : float, default 0.2
        `μ_s` in (2): coefficient of friction at rest, no unit. At least 0.
    mu_dynamic : float, default 0.15
        `μ_d` in (2): coefficient of friction of a fast shaft, no unit. At least 0.
    stribeck_velocity_rad_s : float, default 0.001
        `θ̇_s` in (2): velocity at which all but 1/e of the drop from `μ_s` to `μ_d` is done, rad/s.
        Above 0.
    stribeck_exponent : float, default 1.0
        `δ` in (2), no unit. Above 0. Other than 1 needs the engine ``dormand_prince``.

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

    _key: ClassVar[str] = "rig.friction"

    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 1.0

    @overload
    def coefficient(self, velocity_rad_s: float) -> "np.float64": ...

    @overload
    def coefficient(self, velocity_rad_s: "Sequence[Any] | NDArray[Any]") -> "NDArray[np.float64]": ...

    def coefficient(self, velocity_rad_s: "ArrayLike") -> "np.float64 | NDArray[np.float64]":
        """Coefficient of friction `μ(θ̇)` of (2), with its sign; 0 at rest.

        Parameters
        ----------
        velocity_rad_s : array_like of float
            Velocity `θ̇` of the shaft, rad/s; any shape.

        Returns
        -------
        numpy.float64 or numpy.ndarray
            `μ(θ̇)`, no unit, in the shape of the velocity.

        Raises
        ------
        ParamError
            A velocity that is not a real number.

        Examples
        --------
        >>> import clutch
        >>> print(clutch.StribeckFriction().coefficient([-1.0, 0.0, 0.001]).round(4))
        [-0.15    0.      0.1684]
        """
        import numpy as np

        try:
            velocity = np.require(velocity_rad_s, np.float64, ["C", "A"])
        except (TypeError, ValueError, OverflowError) as error:
            message = f"StribeckFriction.coefficient: velocity_rad_s: expected real numbers, rad/s ({error})"
            raise ParamError(message, "velocity_rad_s", velocity_rad_s) from None
        # The empty tuple turns an array without dimensions into a number, and leaves others alone.
        return _clutch.stribeck(self._tables(), velocity.reshape(-1)).reshape(velocity.shape)[()]


@dataclass(frozen=True, kw_only=True, repr=False)
class BrakeGeometry(_Params):
    """The linkage from motor voltage to friction torque, for `Rig.brake_gain_nm_v`.

    ``K_COF = r_i K_t A/(A_lever R_a r_c)`` (18). All parameters are required and above 0.

    Parameters
    ----------
    inner_radius_m : float
        `r_i`: inner radius of the brake disc, m.
    torque_constant_nm_a : float
        `K_t`: torque constant of the motor, N m/A. Not printed in the paper.
    pad_area_m2 : float
        `A`: area of contact between pad and disc, m².
    lever_area_m2 : float
        `A_lever`: area of the tip of the lever, m².
    armature_resistance_ohm : float
        `R_a`: armature resistance, Ω. Not printed in the paper.
    contact_radius_m : float
        `r_c`: distance from the motor's shaft to the contact on the disc, m.

    Raises
    ------
    ParamError
        A value not above 0; its `field` and `value` say which.

    Examples
    --------
    The paper's lengths and areas with an assumed motor:

    >>> import clutch
    >>> brake = clutch.BrakeGeometry(
    ...     inner_radius_m=0.045, torque_constant_nm_a=0.0508, pad_area_m2=0.040,
    ...     lever_area_m2=0.032, armature_resistance_ohm=0.6, contact_radius_m=0.034,
    ... )
    >>> rig = clutch.Rig(brake_gain_nm_v=brake)
    """

    _key: ClassVar[str] = "rig.brake_geometry"

    inner_radius_m: float
    torque_constant_nm_a: float
    pad_area_m2: float
    lever_area_m2: float
    armature_resistance_ohm: float
    contact_radius_m: float

    @property
    def brake_gain_nm_v(self) -> float:
        """The gain `K_COF` of (18) that this geometry gives, N m/V.

        Examples
        --------
        >>> import clutch
        >>> brake = clutch.BrakeGeometry(
        ...     inner_radius_m=0.045, torque_constant_nm_a=0.0508, pad_area_m2=0.040,
        ...     lever_area_m2=0.032, armature_resistance_ohm=0.6, contact_radius_m=0.034,
        ... )
        >>> round(brake.brake_gain_nm_v, 4)
        0.1401
        """
        return _clutch.brake_gain(self._tables())


@dataclass(frozen=True, kw_only=True, repr=False)
class Ripple(_Params):
    """Friction that varies along the disc: a band of waves with one amplitude and random phases.

    The factor on friction is ``1 + A Σ sin(n θ + φ_n)`` over ``n = lowest, lowest + spacing, …, highest``;
    `RunSettings.seed` decides the phases. It needs the engine ``dormand_prince``. All parameters are
    required.

    Parameters
    ----------
    rms : float
        Root mean square of the variation, as a share of the friction. At least 0, and below 1 when
        multiplied by the root of twice the number of waves.
    lowest_waves_per_turn : int
        Longest wave, 1/turn. A multiple of the spacing, above 0.
    highest_waves_per_turn : int
        Shortest wave, 1/turn. A multiple of the spacing, from the lowest to less than 64 spacings above it.
    spacing_waves_per_turn : int
        From wave to wave, 1/turn: the pattern repeats so often in a turn. At least 1.

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
class WeightDrive(_Params):
    """A weight on a pulley drives the shaft, as in the paper: the torque is `T_u = M g R_p` in (1).

    Parameters
    ----------
    mass_kg : float, default 0.2
        `M`, kg. Above 0.
    gravity_m_s2 : float, default 9.81
        `g`, m/s². Above 0.
    pulley_radius_m : float, default 0.024
        `R_p`, m. Above 0.

    Raises
    ------
    ParamError
        A value not above 0; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.WeightDrive(mass_kg=0.22)
    WeightDrive(mass_kg=0.22, gravity_m_s2=9.81, pulley_radius_m=0.024)
    """

    _key: ClassVar[str] = "rig.drive.weight"

    mass_kg: float = 0.2
    gravity_m_s2: float = 9.81
    pulley_radius_m: float = 0.024


@dataclass(frozen=True, kw_only=True, repr=False)
class SpringDrive(_Params):
    """A spring drives the shaft: the torque is ``stiffness · (rest − θ)``.

    It needs the engine ``dormand_prince``.

    Parameters
    ----------
    stiffness_nm_rad : float
        Stiffness, N m/rad. Above 0.
    rest_deg : float
        Angle from the start at which it pulls no more, °. Finite.

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
class TableDrive(_Params):
    """A torque over time drives the shaft: straight lines between points, constant outside.

    It needs the engine ``dormand_prince``.

    Parameters
    ----------
    points_s_nm : sequence of (float, float)
        Pairs of time, s, and torque, N m. At least one; times rise, all are finite.

    Raises
    ------
    ParamError
        Points that are none, not finite, or do not rise.

    Examples
    --------
    >>> import clutch
    >>> clutch.TableDrive(points_s_nm=[(0, 0.045), (2, 0.055)])
    TableDrive(points_s_nm=((0.0, 0.045), (2.0, 0.055)))
    """

    _key: ClassVar[str] = "rig.drive.table"

    points_s_nm: Sequence[tuple[float, float]]


@dataclass(frozen=True, kw_only=True, repr=False)
class HandDrive(_Params):
    """A hand drives the shaft: a mean torque and a random part in a band of frequencies.

    The random part is 48 sines, one at random in each slice of the band; `RunSettings.seed` decides
    them. It needs the engine ``dormand_prince``.

    Parameters
    ----------
    mean_nm : float
        Mean torque, N m. Finite.
    rms_nm : float
        Root mean square of the random part, N m. At least 0.
    lowest_frequency_hz : float
        Lower end of the band, Hz. At least 0.
    highest_frequency_hz : float
        Upper end of the band, Hz. Above the lowest, at most 50.

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


@dataclass(frozen=True, kw_only=True, repr=False)
class Encoder(_Params):
    """The angle sensor: ``counts = ⌊θ N/2π⌋``.

    Parameters
    ----------
    counts_per_rev : int, default 20000
        `N`: counts per revolution, 1/turn. 4 to 16 777 216. The paper's resolution is 0.018°.
    quantised : bool, default True
        Whether it gives whole counts, rounded down; else it resolves 2⁻¹⁶ counts.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Encoder(counts_per_rev=4096)
    Encoder(counts_per_rev=4096, quantised=True)
    """

    _key: ClassVar[str] = "rig.encoder"

    counts_per_rev: int = 20_000
    quantised: bool = True


@dataclass(frozen=True, kw_only=True, repr=False)
class Dac(_Params):
    """The converter from codes to volts; the paper's has 12 bit over ±10 V, 4.88 mV a step.

    Parameters
    ----------
    bits : int, default 12
        Resolution, bit. 1 to 16.
    lowest_v : float, default -10.0
        Voltage of code 0, V. Finite.
    highest_v : float, default 10.0
        One step above the voltage of the top code, V. Above the lowest.
    quantised : bool, default True
        Whether it rounds to its steps; else the law's voltage goes out as it is.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Dac(bits=16, lowest_v=0)
    Dac(bits=16, lowest_v=0.0, highest_v=10.0, quantised=True)
    """

    _key: ClassVar[str] = "rig.dac"

    bits: int = 12
    lowest_v: float = -10.0
    highest_v: float = 10.0
    quantised: bool = True


Drive = WeightDrive | SpringDrive | TableDrive | HandDrive


@dataclass(frozen=True, kw_only=True, repr=False)
class Rig(_Params):
    """The shaft as it is, with its drive, brake, encoder and converter. The defaults are the paper's.

    ``J θ̈ = T_u − μ(θ̇) K_COF max(v_a, 0) − C_d θ̇`` (1). What law and certificate believe of it
    is another thing: `Model`.

    Parameters
    ----------
    inertia_kg_m2 : float, default 0.0017
        `J` in (1), kg m². Above 0.
    viscous_damping_nm_s_rad : float, default 0.001
        `C_d` in (1), N m s/rad. At least 0.
    brake_gain_nm_v : float or BrakeGeometry, default 0.14
        `K_COF` in (18), N m/V, or the geometry that gives it. Above 0.
    torque_noise_nm : float, default 0.0
        Root mean square of a random torque, normal, held from sample to sample, N m. At least 0.
    delay_ticks : int, default 0
        Whole sampling periods from sample to voltage. 0 to 1000.
    actuator_time_constant_s : float or None, default None
        First-order lag from voltage to normal force, s. Above 0; None: none.
    speed_limit_deg_s : float, default 360.0
        A path that asks for more is refused, °/s: a guard against a slip of units. Above 0.
    friction : StribeckFriction
        Dry friction (2).
    ripple : Ripple or None, default None
        Friction along the disc; None: even.
    drive : WeightDrive, SpringDrive, TableDrive or HandDrive
        What drives the shaft; by default the paper's weight.
    encoder : Encoder
        The angle sensor.
    dac : Dac
        The converter.

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
    brake_gain_nm_v: float | BrakeGeometry = 0.14
    torque_noise_nm: float = 0.0
    delay_ticks: int = 0
    actuator_time_constant_s: float | None = None
    speed_limit_deg_s: float = 360.0
    friction: StribeckFriction = field(default_factory=StribeckFriction)
    ripple: Ripple | None = None
    drive: Drive = field(default_factory=WeightDrive)
    encoder: Encoder = field(default_factory=Encoder)
    dac: Dac = field(default_factory=Dac)

    @classmethod
    def paper(cls) -> Self:
        """Return the rig of the paper's simulation: Table 1, 20 000 counts/turn, 12 bit over ±10 V.

        Examples
        --------
        >>> import clutch
        >>> clutch.Rig.paper() == clutch.Rig()
        True
        """
        return cls._build(_clutch.rig("paper"))

    @classmethod
    def ideal(cls) -> Self:
        """Return the paper's shaft with a perfect encoder and a perfect converter.

        Examples
        --------
        >>> import clutch
        >>> clutch.Rig.ideal().encoder
        Encoder(counts_per_rev=16777216, quantised=False)
        """
        return cls._build(_clutch.rig("ideal"))

    @classmethod
    def bench(cls) -> Self:
        """Return the stand-in for the paper's experiment, as docs/bench-rig.md describes it.

        Its friction is other than the laws believe and uneven along the disc, and it has a delay.

        Examples
        --------
        >>> import clutch
        >>> clutch.Rig.bench().friction.mu_dynamic
        0.104
        """
        return cls._build(_clutch.rig("bench"))

    def _tables(self) -> _Tree:
        # Every key is written, and the paper's rig has no optional table that could show through.
        return {"base": "paper", **super()._tables()}


# --- What the computer believes and does ---------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class Model(_Params):
    """What law, observer and certificate believe of the shaft; by default Table 1, whatever the rig is.

    Parameters
    ----------
    inertia_kg_m2 : float, default 0.0017
        `J` in (1), kg m². Above 0.
    drive_torque_nm : float, default 0.047088
        `T_u = M g R_p` in (1), N m. Above 0.
    viscous_damping_nm_s_rad : float, default 0.001
        `C_d` in (1), N m s/rad. At least 0.
    brake_gain_nm_v : float, default 0.14
        `K_COF` in (18), N m/V. Above 0.
    mu_static : float, default 0.2
        `μ_s` in (2), no unit. Above 0.
    mu_dynamic : float, default 0.15
        `μ_d` in (2), no unit. Above 0.
    stribeck_velocity_rad_s : float, default 0.001
        `θ̇_s` in (2), rad/s. Above 0.
    stribeck_exponent : float, default 1.0
        `δ` in (2), no unit. Above 0.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Model(drive_torque_nm=0.054).mu_dynamic
    0.15
    """

    _key: ClassVar[str] = "model"

    inertia_kg_m2: float = 0.0017
    drive_torque_nm: float = 0.2 * 9.81 * 0.024
    viscous_damping_nm_s_rad: float = 0.001
    brake_gain_nm_v: float = 0.14
    mu_static: float = 0.2
    mu_dynamic: float = 0.15
    stribeck_velocity_rad_s: float = 0.001
    stribeck_exponent: float = 1.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Pd(_Params):
    """PD: ``u = −(K_p e + K_d ė)`` (4). Defaults are Table 2.

    Parameters
    ----------
    kp_v_rad : float, default 5000.0
        `K_p` in (4), V/rad. At least 0.
    kd_v_s_rad : float, default 50.0
        `K_d` in (4), V s/rad. At least 0.

    Raises
    ------
    ParamError
        A gain below 0 or not finite.

    Examples
    --------
    >>> import clutch
    >>> clutch.Pd()
    Pd(kp_v_rad=5000.0, kd_v_s_rad=50.0)
    """

    _key: ClassVar[str] = "law.pd"

    kp_v_rad: float = 5000.0
    kd_v_s_rad: float = 50.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Ctc(_Params):
    """Computed torque (11): the voltage for which `Model` promises the wanted acceleration. Table 2.

    ``τ = −K (K_p e + K_d ė)`` (10).

    Parameters
    ----------
    outer_gain : float, default 90.0
        `K` in (10), no unit. At least 0.
    kp_1_s2 : float, default 100.0
        `K_p` in (10), 1/s². At least 0.
    kd_1_s : float, default 0.7
        `K_d` in (10), 1/s. At least 0.

    Raises
    ------
    ParamError
        A gain below 0 or not finite.

    Examples
    --------
    >>> import clutch
    >>> clutch.Ctc()
    Ctc(outer_gain=90.0, kp_1_s2=100.0, kd_1_s=0.7)
    """

    _key: ClassVar[str] = "law.ctc"

    outer_gain: float = 90.0
    kp_1_s2: float = 100.0
    kd_1_s: float = 0.7


@dataclass(frozen=True, kw_only=True, repr=False)
class Smc(_Params):
    """Sliding mode with a boundary layer (31). Defaults are Table 2.

    ``σ = f e + ė`` (13), ``u = −{K_p sat(σ/ε) + K_d sat(σ ė/ε) ė}`` (31).

    Parameters
    ----------
    kp_v : float, default 3.0
        `K_p` in (31), V. At least 0.
    kd_v_s_rad : float, default 400.0
        `K_d` in (31), V s/rad. At least 0.
    slope_1_s : float, default 70.0
        `f` in (13): slope of the sliding surface, 1/s. Above 0.
    boundary_rad_s : float, default 0.1
        `ε` in (30): thickness of the layer, rad/s. Above 0.

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
    """Sliding mode with the sign function (29), without a boundary layer: it chatters.

    ``σ = f e + ė`` (13), ``u = −{K_p sgn(σ) + K_d sgn(σ ė) ė}`` (29).

    Parameters
    ----------
    kp_v : float, default 3.0
        `K_p` in (29), V. At least 0.
    kd_v_s_rad : float, default 400.0
        `K_d` in (29), V s/rad. At least 0.
    slope_1_s : float, default 70.0
        `f` in (13): slope of the sliding surface, 1/s. Above 0.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.SmcSign()
    SmcSign(kp_v=3.0, kd_v_s_rad=400.0, slope_1_s=70.0)
    """

    _key: ClassVar[str] = "law.smc_sign"

    kp_v: float = 3.0
    kd_v_s_rad: float = 400.0
    slope_1_s: float = 70.0


Law = Pd | Ctc | Smc | SmcSign


@dataclass(frozen=True, kw_only=True, repr=False)
class SmoothedDerivative(_Params):
    """The error rate as the smoothed difference (5), which the paper calls a Kalman filter.

    ``ė_k = (1 − K_Kal) ė_{k−1} + K_Kal (e_k − e_{k−1})/T`` (5).

    Parameters
    ----------
    smoothing : float, default 0.2
        `K_Kal` in (5), no unit. Above 0, at most 1, which does not smooth.

    Raises
    ------
    ParamError
        A value out of range.

    Examples
    --------
    >>> import clutch
    >>> clutch.SmoothedDerivative()
    SmoothedDerivative(smoothing=0.2)
    """

    _key: ClassVar[str] = "velocity.smoothed_derivative"

    smoothing: float = 0.2


@dataclass(frozen=True, kw_only=True, repr=False)
class Observer(_Params):
    """The error rate from a stationary Kalman filter for position, velocity and disturbance torque.

    It predicts with `Model`.

    Parameters
    ----------
    disturbance_walk_nm_rt_s : float, default 0.1
        `q_d`: how fast the torque is believed to wander, N m/√s. Above 0. Larger follows friction faster
        and lets more of the encoder's steps through.

    Raises
    ------
    ParamError
        A value out of range.

    Examples
    --------
    >>> import clutch
    >>> clutch.Observer()
    Observer(disturbance_walk_nm_rt_s=0.1)
    """

    _key: ClassVar[str] = "velocity.observer"

    disturbance_walk_nm_rt_s: float = 0.1


Velocity = SmoothedDerivative | Observer


@dataclass(frozen=True, kw_only=True, repr=False)
class Output(_Params):
    """The last stage of every law: limits of the voltage, and the start.

    Parameters
    ----------
    lowest_v : float, default 0.0
        Lowest voltage, V. At least 0: a pad can only push. Above 0 it never lifts.
    highest_v : float, default 10.0
        Highest voltage, V. Above the lowest.
    on_invalid_v : float, default 10.0
        Voltage for a demand that is not a number, V. From the lowest to the highest; lower it together
        with `highest_v`.
    bumpless_time_s : float, default 0.0
        Time constant in which the law takes over from the voltage that it finds, s. At least 0; 0: at once.

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


# --- Paths ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class Hold(_Params):
    """A path that stays where the shaft is.

    Examples
    --------
    >>> import clutch
    >>> clutch.Hold()
    Hold()
    """

    _key: ClassVar[str] = "reference.hold"


@dataclass(frozen=True, kw_only=True, repr=False)
class Ramp(_Params):
    """A path of constant rate: the paper's.

    Parameters
    ----------
    rate_deg_s : float
        Rate, °/s. A brake follows only one of at least 0; below 4e6 counts a sampling period.

    Raises
    ------
    ParamError
        A rate that is not finite.

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
    """A path from rest to rest with bounded velocity and acceleration.

    Parameters
    ----------
    distance_deg : float
        Way, °. A brake follows only one of at least 0; below 1e12 counts.
    speed_deg_s : float
        Highest velocity, °/s. Above 0.
    acceleration_deg_s2 : float
        Acceleration and deceleration, °/s². Above 0.

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
    """A path from rest to rest with bounded velocity, acceleration and jerk.

    Parameters
    ----------
    distance_deg : float
        Way, °. A brake follows only one of at least 0; below 1e12 counts.
    speed_deg_s : float
        Highest velocity, °/s. Above 0.
    acceleration_deg_s2 : float
        Highest acceleration and deceleration, °/s². Above 0.
    jerk_deg_s3 : float
        Highest jerk, °/s³. Above 0.

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
    """A path from rest to rest of the least jerk: ``10 s³ − 15 s⁴ + 6 s⁵``, ``s = t/duration``.

    Parameters
    ----------
    distance_deg : float
        Way, °. A brake follows only one of at least 0; below 1e12 counts.
    duration_s : float
        Time for it, s. A sampling period to 1e6 s.

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
    """A ramp with a sine on it: ``rate · t + amplitude · [sin(2π f t + φ) − sin φ]``.

    Parameters
    ----------
    rate_deg_s : float
        Rate of the ramp, °/s.
    amplitude_deg : float
        Amplitude of the sine, °. Below 1e12 counts. A brake follows only a path that does not run
        backwards: ``2π · frequency · amplitude`` at most the rate.
    frequency_hz : float
        Frequency, Hz. From 0 to below half the sampling rate.
    phase_turns : float, default -0.25
        Phase at the start, turns. -1 to 1; -0.25 starts at the rate of the ramp.

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
    """A ramp with a sine on it whose frequency goes linearly from one to another, then stays.

    Parameters
    ----------
    rate_deg_s : float
        Rate of the ramp, °/s.
    amplitude_deg : float
        Amplitude of the sine, °. Below 1e12 counts. A brake follows only a path that does not run
        backwards: ``2π · frequency · amplitude`` at most the rate.
    from_hz : float
        Frequency at the start, Hz. From 0 to below half the sampling rate.
    to_hz : float
        Frequency at the end, Hz. From 0 to below half the sampling rate.
    duration_s : float
        Time from one to the other, s. 1 to 4e9 sampling periods.
    phase_turns : float, default -0.25
        Phase at the start, turns. -1 to 1; -0.25 starts at the rate of the ramp.

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
    """A path through points; before the first and after the last it rests.

    Parameters
    ----------
    points_s_deg : sequence of (float, float)
        Pairs of time, s, and angle, °. Times begin at 0 or later and rise. A brake follows only angles
        that do not fall.
    interpolation : {"cubic", "linear"}, default "cubic"
        Monotone cubics, or straight lines with jumps of the velocity.

    Raises
    ------
    ParamError
        Points that are none, not finite, or do not rise.

    Examples
    --------
    >>> import clutch
    >>> clutch.TablePath(points_s_deg=[(0.5, 0), (2, 20)])
    TablePath(points_s_deg=((0.5, 0.0), (2.0, 20.0)), interpolation='cubic')
    """

    _key: ClassVar[str] = "reference.table"

    points_s_deg: Sequence[tuple[float, float]]
    interpolation: Literal["cubic", "linear"] = "cubic"


Reference = Hold | Ramp | Trapezoid | JerkLimited | MinimumJerk | Sine | Chirp | TablePath


# --- Run, bounds, safety -------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class Sampling(_Params):
    """How often the law runs, and in which arithmetic.

    Parameters
    ----------
    period_us : int, default 1000
        `T` in (5): sampling period, µs. 1 to 1 000 000.
    scalar : {"f64", "f32"}, default "f64"
        What path and law compute in; a board has ``"f32"``. The shaft is always ``"f64"``.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Sampling(scalar="f32")
    Sampling(period_us=1000, scalar='f32')
    """

    _key: ClassVar[str] = "sampling"

    period_us: int = 1000
    scalar: Literal["f64", "f32"] = "f64"


@dataclass(frozen=True, kw_only=True, repr=False)
class Bounds(_Params):
    """How well `Model` is known, (23): for the certificate and the check of the path.

    Parameters
    ----------
    inertia_percent : float, default 0.0
        ± on `J`, %. 0 to below 100.
    drive_torque_percent : float, default 0.0
        ± on `T_u`, %. 0 to below 100.
    viscous_damping_percent : float, default 0.0
        ± on `C_d`, %. 0 to below 100.
    brake_gain_percent : float, default 0.0
        ± on `K_COF`, %. 0 to below 100.
    friction_percent : float, default 0.0
        ± on `μ_s` and on `μ_d`, %. 0 to below 100.
    reach_rate_rad_s2 : float, default 0.0
        `γ` in (15): rate of reaching the sliding surface to be certified, rad/s². At least 0; above 0
        the reaching time gets a bound.

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
    friction_percent: float = 0.0
    reach_rate_rad_s2: float = 0.0


@dataclass(frozen=True, kw_only=True, repr=False)
class RunSettings(_Params):
    """Length, start, seed and engine of a run.

    Parameters
    ----------
    duration_s : float, default 5.0
        Length, s. A sampling period to 10 million periods.
    settle_s : float, default 1.0
        Left out of the figures at the start, s. 0 to below the duration.
    start : {"on_path", "rest"}, default "on_path"
        At the path's velocity with the brake at the voltage that keeps it, or held at rest.
    start_counts : float or None, default None
        Where shaft and path begin, in counts. Below 1e9 in magnitude; None: somewhere within the first
        count, by the seed.
    seed : int, default 1
        Decides everything that is random. At least 0.
    engine : {"auto", "exact_flow", "dormand_prince"}, default "auto"
        What integrates the shaft; ``"auto"``: the exact flow where the rig allows it.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.RunSettings(duration_s=10, seed=7).seed
    7
    """

    _key: ClassVar[str] = "run"

    duration_s: float = 5.0
    settle_s: float = 1.0
    start: Literal["on_path", "rest"] = "on_path"
    start_counts: float | None = None
    seed: int = 1
    engine: Literal["auto", "exact_flow", "dormand_prince"] = "auto"


@dataclass(frozen=True, kw_only=True, repr=False)
class HoldVoltage(_Params):
    """Safe state: this voltage at once.

    Parameters
    ----------
    volts_v : float
        Voltage, V. Above 0 and within the converter's range; enough to stop the strongest drive with the
        weakest brake of `Bounds`.

    Raises
    ------
    ParamError
        A value out of range.

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
    """Safe state: from the present voltage at a rate, up or down, to another.

    Parameters
    ----------
    rate_v_s : float
        Rate, V/s. Above 0; 2⁻¹⁶ to 60 000 converter steps a sampling period.
    volts_v : float
        Voltage at the end, V. Above 0 and within the converter's range; enough to stop the strongest drive
        with the weakest brake of `Bounds`.

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
    """Safe state: let go, with 0 V or the converter's lowest voltage above it.

    Examples
    --------
    >>> import clutch
    >>> clutch.Release()
    Release()
    """

    _key: ClassVar[str] = "safety.on_fault.release"


@dataclass(frozen=True, kw_only=True, repr=False)
class HoldThenRelease(_Params):
    """Safe state: this voltage at once, and after a time let go.

    Parameters
    ----------
    volts_v : float
        Voltage, V. Above 0 and within the converter's range; enough to stop the strongest drive with the
        weakest brake of `Bounds`.
    after_s : float
        Time after which it lets go, s. 1 to 4e9 sampling periods.

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
    """What ends control on a board; docs/safety.md says why each default is what it is.

    Parameters
    ----------
    jump_deg : float, default 0.15
        How far counts may be from where the last ones lead, °. One count to below 2³⁰ counts.
    jumps : int, default 3
        Samples beyond that within 128 periods that end control. 1 to 128.
    good_samples : int, default 1
        Good samples in a row before the law answers again after a bad one. 1 to below `silence_cycles`.
    following_error_deg : float, default 1.0
        Error at rest that ends control, °. Above 0.
    following_time_s : float, default 0.02
        How much that limit grows with the path's speed, s. At least 0.
    saturation_time_s : float, default 0.2
        Time at a limit of the voltage that ends control, s. 1 to 4e9 periods.
    stand_still_counts : float, default 1.1
        Way that the shaft must have gone without a count, counts. At least 1.
    friction_margin : float, default 1.8
        How many times the highest friction of `Bounds` is believed there, no unit. At least 1.
    lost : int, default 26
        Lost samples within 128 periods that end control. 1 to 128.
    late : int, default 26
        Late samples and refused codes within 128 periods that end control. 1 to 128.
    disorder : int, default 2
        Samples twice, or out of order, within 128 periods that end control. 1 to 128.
    silence_cycles : int, default 3
        Periods without a sample that end control. 2 to 1000.
    watchdog_cycles : int, default 3
        Periods without a code after which the board goes to its safe state. 2 to 1000. Keep it equal to
        `silence_cycles`.
    valid_cycles : int, default 2
        Periods after its sample for which a code is valid. 1 to 1000; at most 65.535 ms.
    deadline_us : int, default 500
        Longest time from a sample's arrival to its answer, µs. At least 1.
    overruns : int, default 26
        Answers later than that within 128 periods that end control. 1 to 128.

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
    stand_still_counts: float = 1.1
    friction_margin: float = 1.8
    lost: int = 26
    late: int = 26
    disorder: int = 2
    silence_cycles: int = 3
    watchdog_cycles: int = 3
    valid_cycles: int = 2
    deadline_us: int = 500
    overruns: int = 26


@dataclass(frozen=True, kw_only=True, repr=False)
class Safety(_Params):
    """How a run on a board ends, and what ends it. There is no default safe state.

    Parameters
    ----------
    reason : str
        Why this safe state is right for this rig; printed before each run. Not empty.
    on_fault : HoldVoltage, RampVoltage, Release or HoldThenRelease
        What the brake does when control ends, wanted or not.
    limits : Limits
        What is watched.

    Raises
    ------
    ParamError
        A value out of range; its `field` and `value` say which.

    Examples
    --------
    >>> import clutch
    >>> clutch.Safety(reason="a weight drives the shaft", on_fault=clutch.HoldVoltage(volts_v=4.5))
    Safety(reason='a weight drives the shaft', on_fault=HoldVoltage(volts_v=4.5))
    """

    _key: ClassVar[str] = "safety"

    reason: str
    on_fault: SafeState
    limits: Limits = field(default_factory=Limits)


# --- The scenario --------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True, repr=False)
class Scenario(_Params):
    """One run: rig, law, path, sampling, run, safety. What docs/scenario.md describes as a file.

    Parameters
    ----------
    name : str
        Title; by default the law's and the path's name.
    rig : Rig
        The shaft as it is; by default the paper's.
    model : Model
        What law, observer and certificate believe of it; by default Table 1.
    law : Pd, Ctc, Smc or SmcSign
        The control law. Required.
    velocity : SmoothedDerivative or Observer
        Where the law's error rate comes from.
    output : Output
        Limits of the voltage, bumpless start.
    reference : Hold, Ramp, Trapezoid, JerkLimited, MinimumJerk, Sine, Chirp or TablePath
        The path. Required.
    sampling : Sampling
        Period and scalar.
    bounds : Bounds
        How well the model is known.
    run : RunSettings
        Length, start, seed, engine.
    safety : Safety or None, default None
        How a run on a board ends; a simulation does not need it.

    Raises
    ------
    ParamError
        Parts that do not go together, or a path that a brake cannot follow; `field` is the dotted key.

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
    reference: Reference
    sampling: Sampling = field(default_factory=Sampling)
    bounds: Bounds = field(default_factory=Bounds)
    run: RunSettings = field(default_factory=RunSettings)
    safety: Safety | None = None

    def __post_init__(self) -> None:
        self._tables()  # checks the parts' classes
        name = _plain(self.name)
        object.__setattr__(self, "name", self._title() if name == "" else name)
        _ = self._native  # checks that the parts go together

    @classmethod
    def _build(cls, table: _Tree) -> Self:
        self = super()._build(table)
        object.__setattr__(self, "name", self.name or self._title())
        return self

    def _title(self) -> str:
        law, path = (self._way(type(part))[-1].replace("_", " ") for part in (self.law, self.reference))
        first, *rest = law.split()
        return f"{' '.join([first.upper(), *rest])}, {path}"

    @functools.cached_property
    def _native(self) -> _clutch.Scenario:
        return _clutch.Scenario(self._tables())

    @classmethod
    def load(cls, path_or_name: str | os.PathLike[str], overrides: Mapping[str, object] | None = None) -> Self:
        """Read a scenario file, or the built-in scenario of that name if there is no such file.

        Parameters
        ----------
        path_or_name : str or os.PathLike
            A TOML file, or a name that `clutch.scenarios` lists.
        overrides : mapping of str to object, optional
            Dotted keys, as ``law.smc.kp_v``, and their values in the keys' units. They come before the rig
            is merged with its base.

        Returns
        -------
        Scenario
            The checked scenario, defaults filled in.

        Raises
        ------
        ParamError
            What is wrong in it; `field` is the dotted key.
        OSError
            The file cannot be read; FileNotFoundError if there is none, and no built-in scenario either.

        Examples
        --------
        >>> import clutch
        >>> clutch.Scenario.load("smc_2", {"law.smc.kp_v": 4}).law
        Smc(kp_v=4.0, kd_v_s_rad=400.0, slope_1_s=70.0, boundary_rad_s=0.1)
        """
        name = os.fspath(path_or_name)
        return cls._build(_clutch.Scenario.load(name, _overrides(name, overrides or {})).tables())

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Read a scenario from the text of a scenario file.

        Parameters
        ----------
        text : str
            TOML, as docs/scenario.md describes it.

        Returns
        -------
        Scenario
            The checked scenario, defaults filled in.

        Raises
        ------
        ParamError
            What is wrong in it; `field` is the dotted key.

        Examples
        --------
        >>> import clutch
        >>> text = '''
        ... name = "slow"
        ... rig.base = "paper"
        ... law.pd = {}
        ... reference.ramp.rate_deg_s = 2.0
        ... '''
        >>> clutch.Scenario.from_toml(text).reference
        Ramp(rate_deg_s=2.0)
        """
        return cls._build(_clutch.Scenario.parse("text", text, {}).tables())

    def to_toml(self) -> str:
        """Return the scenario as the text of a scenario file, every default filled in.

        Returns
        -------
        str
            TOML; `from_toml` gives the same scenario again.

        Examples
        --------
        >>> import clutch
        >>> scenario = clutch.Scenario.load("smc_2")
        >>> "[law.smc]" in scenario.to_toml()
        True
        >>> clutch.Scenario.from_toml(scenario.to_toml()) == scenario
        True
        """
        return self._native.to_toml()

    def override(self, overrides: Mapping[str, object]) -> Self:
        """Return a copy with other values at dotted keys, as ``clutch sim --set`` takes them.

        Parameters
        ----------
        overrides : mapping of str to object
            Dotted keys, as ``law.smc.kp_v``, and their values in the keys' units. To change an alternative
            set its table: ``{"law": {"pd": {}}}``. ``rig.base`` takes that rig instead of the present one;
            other keys of the rig then change it.

        Returns
        -------
        Scenario
            The checked scenario.

        Raises
        ------
        ParamError
            An unknown key, or a value out of range; `field` is the dotted key.

        Examples
        --------
        >>> import clutch
        >>> scenario = clutch.Scenario.load("smc_2")
        >>> scenario.override({"reference.ramp.rate_deg_s": 6}).reference
        Ramp(rate_deg_s=6.0)
        >>> scenario.override({"law": {"pd": {}}}).law
        Pd(kp_v_rad=5000.0, kd_v_s_rad=50.0)
        """
        changes = _overrides(self.name, overrides)
        if "rig.base" in changes:
            # All other keys of the rig are written out, and would hide the base.
            changes = {"rig": {"base": changes.pop("rig.base")}, **changes}
        return self._build(_clutch.Scenario.parse(self.name, self.to_toml(), changes).tables())

    def certificate(self) -> Certificate:
        """Check the gains against every plant within the bounds.

        Returns
        -------
        Certificate
            Whether they are certified, what they would have to be, and how far the shaft strays at most.

        Examples
        --------
        >>> import clutch
        >>> certificate = clutch.Scenario.load("smc_2").override({"law.smc.kp_v": 2}).certificate()
        >>> if not certificate:
        ...     print(f"K_p must be {certificate.ahead.kp_required_v:.4f} V")
        K_p must be 2.2624 V
        """
        return Certificate._build(self._native.certificate())

    def path(self) -> _clutch.Path:
        """Return the planned path, a target for each sampling period.

        Returns
        -------
        Path
            ``path.at(tick)`` is the target of a sample; ``path.table()`` has all of the run.

        Examples
        --------
        >>> import clutch
        >>> path = clutch.Scenario.load("smc_2").path()
        >>> round(path.at(1000).velocity_rad_s, 6)
        0.034907
        """
        return self._native.path()

    def _repr_html_(self) -> str:
        rows = [("name", html.escape(self.name), "")]
        for slot in _slots(type(self))[1:]:
            part = getattr(self, slot.name)
            if part is not None:
                values = ", ".join(f"{key}&nbsp;=&nbsp;{html.escape(value)}" for key, value in _leaves(part))
                rows.append((slot.name, type(part).__name__, values))
        cells = "".join(f"<tr><th>{row[0]}</th><td>{row[1]}</td><td>{row[2]}</td></tr>" for row in rows)
        return f"<table>{cells}</table>"


def _overrides(origin: str, given: Mapping[str, object]) -> _Tree:
    return {key: _written(origin, key, value) for key, value in given.items()}


def _leaves(part: _Record, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Dotted names of an object's values, and the values as text."""
    for slot in _slots(type(part)):
        value = getattr(part, slot.name)
        if isinstance(value, _Record):
            yield from _leaves(value, f"{prefix}{slot.name}.")
        elif value is not None:
            yield f"{prefix}{slot.name}", repr(value)
