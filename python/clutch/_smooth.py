"""The lowest rate at which a scenario moves without a stick."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, Self

from clutch import _clutch
from clutch._run import ScenarioLike, as_scenario

Cause = Literal["sampled_loop", "stribeck_edge", "encoder_edge", "edge_jolt", "ripple"]


@dataclass(frozen=True, kw_only=True)
class SmoothSpeed:
    """The lowest rate of those tried at which no disc sticks, and why a slower one does.

    Attributes
    ----------
    rate_deg_s : float or None
        The rate, °/s; None if a disc sticks at every rate.
    cause : str or None
        Why the next lower rate sticks: ``"sampled_loop"``, the linear sampled loop is unstable; ``"stribeck_edge"``,
        friction falls faster with the speed than the law brakes; ``"encoder_edge"``, what is unstable grows too much
        between two edges of the encoder; ``"edge_jolt"``, such an edge, by the gain on its rate, stops the shaft;
        ``"ripple"``, the run is smooth if friction is even along the disc, which is asked if none of the others
        holds.
        None if it is none of these, or no lower rate was tried. If several hold, the first; `evidence` has them all.
    below : SmoothSpeed.Failure or None
        The run that stuck at the next lower rate; None if the lowest rate is smooth.
    holes : tuple of SmoothSpeed.Failure
        Higher rates at which a disc sticks all the same.
    evidence : SmoothSpeed.Evidence
        The figures from which the cause follows, at the rate of `below`.
    rates_deg_s : tuple of float
        The rates that were tried, rising, °/s.
    discs : int
        Number of discs that each of them was tried on: the seeds from 1 on.
    runs : int
        Number of runs, but for one on an even disc. A rate is left at the first disc that sticks, and a run at its
        first stick.

    Examples
    --------
    >>> import clutch
    >>> clutch.lowest_smooth_speed("bench_pd_2", rates_deg_s=[10, 20], discs=2).cause
    'sampled_loop'
    """

    @dataclass(frozen=True, kw_only=True)
    class Failure:
        """A run that is not smooth.

        Attributes
        ----------
        rate_deg_s : float
            Its rate, °/s.
        seed : int
            Its seed.
        time_s : float
            The time at which it showed, s.
        failing : str
            ``"sticks"``: the shaft came to rest; ``"strays"``: it moves, but not with the path.

        Examples
        --------
        >>> import clutch
        >>> clutch.lowest_smooth_speed("bench_pd_2", rates_deg_s=[2, 20], discs=2).below.failing
        'sticks'
        """

        rate_deg_s: float
        seed: int
        time_s: float
        failing: Literal["sticks", "strays"]

    @dataclass(frozen=True, kw_only=True)
    class Evidence:
        """The ground from which the causes follow, at a rate. The theory is in docs/theory.md, section 15.

        Attributes
        ----------
        rate_deg_s : float
            The rate, °/s.
        causes : tuple of str
            The causes that hold.
        spectral_radius : float or None
            Of the linear sampled loop with the rig's mean friction; above 1 it is unstable. None if it is not known.
        not_covered : str or None
            Why it is not known.
        stribeck_edge_deg_s : float or None
            Rate below which friction falls faster with the speed than the law brakes, °/s; None if it is not known.
        stribeck_growth_1_s : float or None
            Rate at which a departure from the speed grows as friction falls with the speed, 1/s; None if not known.
        ripple_growth_1_s : float
            Rate at which it grows as friction falls along the disc, 1/s.
        edge_time_s : float or None
            Time from one edge of the encoder to the next, s; None for an ideal sensor.
        growth_between_edges : float or None
            Both growths times that time: above 2 the encoder is a cause. None if one is not known.
        edge_jolt_deg_s : float or None
            Speed that the law's answer to an edge takes from the shaft, °/s: more than the rate is a cause. None if the
            velocity is no difference of counts, or the law's damping is not known.
        even_disc_smooth : bool or None
            True if the run `below` is smooth on an even disc; None where another cause holds.

        Examples
        --------
        >>> import clutch
        >>> found = clutch.lowest_smooth_speed("bench_glide_2", rates_deg_s=[0.5], discs=1)
        >>> found.evidence.causes
        ('encoder_edge',)
        """

        rate_deg_s: float
        causes: tuple[Cause, ...]
        spectral_radius: float | None
        not_covered: str | None
        stribeck_edge_deg_s: float | None
        stribeck_growth_1_s: float | None
        ripple_growth_1_s: float
        edge_time_s: float | None
        growth_between_edges: float | None
        edge_jolt_deg_s: float | None
        even_disc_smooth: bool | None

    rate_deg_s: float | None
    cause: Cause | None
    below: Failure | None
    holes: tuple[Failure, ...]
    evidence: Evidence
    rates_deg_s: tuple[float, ...]
    discs: int
    runs: int

    @classmethod
    def _build(cls, found: dict[str, Any]) -> Self:
        evidence = found["evidence"]
        below = found["below"]
        parts = {
            "below": None if below is None else cls.Failure(**below),
            "holes": tuple(cls.Failure(**hole) for hole in found["holes"]),
            "evidence": cls.Evidence(**evidence | {"causes": tuple(evidence["causes"])}),
            "rates_deg_s": tuple(found["rates_deg_s"]),
        }
        return cls(**{field.name: found[field.name] for field in fields(cls)} | parts)


def lowest_smooth_speed(
    scenario: ScenarioLike,
    *,
    rates_deg_s: Iterable[float] | None = None,
    discs: int = 10,
    overrides: Mapping[str, object] | None = None,
) -> SmoothSpeed:
    """Find the lowest rate at which a scenario moves without a stick, and the reason why slower does not.

    Parameters
    ----------
    scenario : Scenario, str or path
        A scenario whose path is a ramp, the name of a built-in one, or a TOML file. Its rate and seed do not matter.
    rates_deg_s : iterable of float, optional
        Rates to try, °/s; default: twelve from 0.5 to 20 °/s.
    discs : int, default 10
        Number of discs, which differ in the phases of their ripple and in the place of the path between two edges:
        the seeds 1 to `discs`.
    overrides : mapping, optional
        Values for dotted keys of the scenario.

    Returns
    -------
    SmoothSpeed
        The rate, the cause, and the evidence for it.

    Raises
    ------
    ParamError
        A path that is no ramp, a law that follows no path, or a value that the scenario refuses.
    OSError
        The file cannot be read.

    Examples
    --------
    >>> import clutch
    >>> found = clutch.lowest_smooth_speed("bench_glide_2", rates_deg_s=[0.5, 2], discs=3)
    >>> found.rate_deg_s, found.cause
    (2.0, 'encoder_edge')
    """
    checked = as_scenario(scenario, overrides)
    rates = None if rates_deg_s is None else [float(rate) for rate in rates_deg_s]
    return SmoothSpeed._build(_clutch.lowest_smooth_speed(checked, rates, discs))
