"""Bases of some of the generated classes of a scenario's tables: abilities beyond holding values."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Self, overload

from clutch import _clutch
from clutch._clutch import Table
from clutch._errors import ParamError
from clutch._record import _Params, _Tree

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class Friction(_Params):
    """Friction as a function of the velocity, and under the laboratory's experiments."""

    def _scenario(self) -> _clutch.Scenario:
        """A scenario whose rig has this friction."""
        table = {"name": "friction", "rig": {"base": "paper", "friction": {self._key.split(".")[-1]: self._tables()}}}
        return _clutch.Scenario(table | {"law": {"pd": {}}, "reference": {"ramp": {"rate_deg_s": 2.0}}})

    @overload
    def coefficient(self, velocity_rad_s: float) -> "np.float64": ...

    @overload
    def coefficient(self, velocity_rad_s: "Sequence[Any] | NDArray[Any]") -> "NDArray[np.float64]": ...

    def coefficient(self, velocity_rad_s: "ArrayLike") -> "np.float64 | NDArray[np.float64]":
        """Coefficient of friction `μ(θ̇)` of steady sliding, with its sign; 0 at rest.

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
            message = f"{type(self).__name__}.coefficient: velocity_rad_s: expected real numbers, rad/s ({error})"
            raise ParamError(message, "velocity_rad_s", velocity_rad_s) from None
        # The empty tuple turns an array without dimensions into a number, and leaves others alone.
        flat = np.ascontiguousarray(velocity.reshape(-1))
        return _clutch.steady_friction(self._scenario(), flat).reshape(velocity.shape)[()]

    def examine(self) -> "dict[str, Table]":
        """Do the four experiments of the friction laboratory: ``clutch friction plot`` draws them, too.

        Returns
        -------
        dict of str to Table
            ``steady``: velocity, rad/s, and coefficient of steady sliding. ``pre_sliding``: angle, rad, and coefficient
            of a slow motion to and fro. ``lag``: velocity and coefficient of a velocity that swings. ``break_away``:
            rate at which a torque grows, N m/s, and the largest coefficient of the friction, at which the paper's shaft
            breaks away.

        Examples
        --------
        >>> import clutch
        >>> table = clutch.LugreFriction().examine()["break_away"]
        >>> bool(table["coefficient"][0] > table["coefficient"][-1])  # the faster, the sooner
        True
        """
        first = {"steady": "velocity_rad_s", "pre_sliding": "angle_rad", "lag": "velocity_rad_s"}
        found = _clutch.friction_lab(self._scenario())
        return {
            name: Table({first.get(name, "rate_nm_s"): set_, "coefficient": mu}) for name, (set_, mu) in found.items()
        }


class BrakeGeometry(_Params):
    """The gain that follows from a geometry."""

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


class Rig(_Params):
    """The rigs that have names."""

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
