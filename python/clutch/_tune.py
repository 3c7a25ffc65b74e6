"""Identification of a rig, and the gains for it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from clutch import _clutch
from clutch._extras import needed
from clutch._model import Scenario
from clutch._run import ScenarioLike, as_scenario, simulate

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A value with the interval that holds it.

    Attributes
    ----------
    value : float
        Best value, in the unit of the parameter's name.
    low : float
        Lower end.
    high : float
        Upper end.

    Examples
    --------
    >>> import clutch
    >>> clutch.Estimate(value=2.0, low=1.9, high=2.2).holds(2.1)
    True
    """

    value: float
    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Say whether a value lies in the interval.

        Parameters
        ----------
        value : float
            The value, in the same unit.

        Returns
        -------
        bool
            True from `low` to `high`, both among them.

        Examples
        --------
        >>> import clutch
        >>> clutch.Estimate(value=2.0, low=1.9, high=2.2).holds(3)
        False
        """
        return self.low <= value <= self.high


@dataclass(frozen=True, kw_only=True)
class Fell:
    """A release of a brake, and the fall that is believed.

    Attributes
    ----------
    recording : str
        The recording.
    tick : int
        Its tick with the first sample.
    period_s : float
        Time between two samples, s.
    seen_rad : tuple of float
        Way of each sample in whole counts, rad: the shaft is there, or less than a count farther.
    believed_rad : tuple of float
        Way as believed, rad.

    Examples
    --------
    >>> import clutch
    >>> fell = clutch.identify("board_smc_2").falls[0]
    >>> max(abs(a - b) for a, b in zip(fell.seen_rad, fell.believed_rad)) < 2 * 3.1416 / 20000
    True
    """

    recording: str
    tick: int
    period_s: float
    seen_rad: tuple[float, ...]
    believed_rad: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Rode:
    """A ride at an even rate, or a pass of a motor axis.

    Attributes
    ----------
    rate_rad_s : float
        Rate, rad/s; backwards below 0.
    seen_v : float
        Voltage that keeps the shaft at that rate, V, in the mean along the disc.
    deviation_v : float
        Its standard deviation, V.
    believed_v : float or None
        The same as believed, V; None where the findings do not say it.

    Examples
    --------
    >>> import clutch
    >>> rode = clutch.identify("board_smc_2").rides[0]
    >>> abs(rode.seen_v - rode.believed_v) < 0.01 * rode.seen_v
    True
    """

    rate_rad_s: float
    seen_v: float
    deviation_v: float
    believed_v: float | None


class Identified:
    """A rig as it was found to be, as :func:`clutch.identify` returns it.

    Attributes
    ----------
    parameters : dict of str to Estimate
        The findings: ``pull_rad_s2`` (T/J), ``delay_s`` (dead time and lag together), ``lag_s``,
        ``hold_v`` (T/(μ_d K)), ``ripple_rms``, ``ratio`` (μ_s/μ_d),
        ``stribeck_velocity_rad_s``, ``damping_1_s`` (C/J). Of a motor axis, torques over its torque per volt:
        ``break_forwards_v``, ``break_backwards_v``, ``slide_forwards_v``, ``slide_backwards_v``, ``load_v``,
        ``viscous_v_s_rad`` (C/K), ``inertia_v_s2_rad`` (J/K), and velocity, delay and ripple as above.
    refused : dict of str to str
        The parameters not found, by name, with the experiment that would find them.
    separate : dict of str to Estimate
        With logs of a known mass added: ``drive_torque_nm`` (T), ``inertia_kg_m2`` (J), ``grip_nm_v`` (μ_d K),
        ``grip_at_rest_nm_v`` (μ_s K), ``viscous_damping_nm_s_rad`` (C); those not found are in `refused`.
    ripple_waves_per_turn : float or None
        The likeliest waves of the ripple; None where rides do not show them.
    unexplained : tuple of str
        Ticks and recordings that the model does not explain.
    map : list of tuple of float
        Friction along the disc: angle in rad, and friction over its mean.
    releases, hops, break_aways : int
        Numbers of each that were found: releases of a brake, hops of a motor.
    rides_rad_s : tuple of float
        Rates of the rides, rad/s; of a motor axis that goes backwards below 0.
    falls : tuple of Fell
        The releases of a brake beside the falls that are believed.
    rides : tuple of Rode
        Even rides, and passes of a motor axis, beside the voltage that is believed to keep the shaft at that rate.

    Examples
    --------
    >>> import clutch
    >>> found = clutch.identify("board_smc_2")
    >>> found.parameters["pull_rad_s2"].holds(0.047088 / 0.0017)
    True
    """

    def __init__(self, base: Scenario, found: tuple[dict[str, Any], str | None, str | None]) -> None:
        told, self._file, self._lacks = found
        self._base = base
        parameters: dict[str, dict[str, Any]] = told["parameters"]
        self.parameters = {key: Estimate(**row) for key, row in parameters.items() if "value" in row}
        self.refused: dict[str, str] = {key: row["refused"] for key, row in parameters.items() if "refused" in row}
        apart: dict[str, dict[str, Any]] = told.get("separate", {})
        self.separate = {key: Estimate(**row) for key, row in apart.items() if "value" in row}
        self.refused |= {key: row["refused"] for key, row in apart.items() if "refused" in row}
        self.ripple_waves_per_turn: float | None = told["ripple_waves_per_turn"]
        self.unexplained: tuple[str, ...] = tuple(told["unexplained"])
        self.map: list[tuple[float, float]] = [(angle, factor) for angle, factor in told["map"]]
        self.releases: int = told["releases"]
        self.hops: int = told["hops"]
        self.break_aways: int = told["break_aways"]
        self.rides_rad_s: tuple[float, ...] = tuple(told["rides_rad_s"])
        seen: dict[str, list[dict[str, Any]]] = told["seen"]
        ways = ("seen_rad", "believed_rad")
        self.falls = tuple(Fell(**row | {way: tuple(row[way]) for way in ways}) for row in seen["falls"])
        self.rides = tuple(Rode(**row) for row in seen["rides"])

    def to_toml(self) -> str:
        """Give the file of ``clutch identify --out``, which ``--identified`` takes.

        Returns
        -------
        str
            ``[model]`` and ``[bounds]`` for scenarios, and the intervals.

        Raises
        ------
        ValueError
            A parameter that the file needs is not found; the message names it.

        Examples
        --------
        >>> import clutch
        >>> "[bounds]" in clutch.identify("board_smc_2").to_toml()
        True
        """
        if self._file is None:
            raise ValueError(self._lacks or "no rig file")
        return self._file

    @property
    def scenario(self) -> Scenario:
        """The scenario as identified: model and bounds as found, and as its rig the one that it believes in.

        Raises
        ------
        ValueError
            As :meth:`to_toml`.
        """
        return Scenario.from_toml(_clutch.as_identified(self._base._native, self.to_toml()))

    def plot(self) -> Figure:
        """Draw what was seen and what is believed: releases, rides, intervals, and friction along the disc.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, in millimetres and with a font size for print.

        Examples
        --------
        >>> import clutch
        >>> figure = clutch.identify("board_smc_2").plot()
        """
        from clutch import plot

        return plot.identified(self)

    def __repr__(self) -> str:
        rows = [f"{key} = {e.value:.5g} [{e.low:.5g}, {e.high:.5g}]" for key, e in self.parameters.items()]
        return "Identified(" + ", ".join(rows) + ")"


def _several(name: str, values: Iterable[Any] | None, what: str) -> list[Any]:
    """Give the values of a list, an empty one for none; one text, path or number in its place is refused."""
    if values is None:
        return []
    if isinstance(values, str | bytes | os.PathLike) or not isinstance(values, Iterable):
        raise TypeError(f"{name} = {values!r}: expected a list of {what}")
    return list(values)


def _heavier(
    loaded: list[str], mass_kg: float | None, radius_m: float | None, *, alone: bool
) -> tuple[list[str], float, float] | None:
    """The second experiment, or none; a part of it is refused."""
    if not loaded and mass_kg is None and radius_m is None:
        return None
    given = {"logs": alone, "loaded": bool(loaded), "mass_kg": mass_kg is not None, "radius_m": radius_m is not None}
    missing = [name for name, there in given.items() if not there]
    if missing or mass_kg is None or radius_m is None:
        raise ValueError(
            f"{', '.join(missing)}: expected beside loaded, mass_kg and radius_m, which go together with logs"
        )
    return loaded, mass_kg, radius_m


def identify(
    scenario: ScenarioLike = "board_smc_2",
    *,
    logs: Iterable[str | os.PathLike[str]] | None = None,
    columns: tuple[str, str] = ("counts", "volts"),
    loaded: Iterable[str | os.PathLike[str]] = (),
    mass_kg: float | None = None,
    radius_m: float | None = None,
    log: str | os.PathLike[str] | None = None,
    travel_deg: float | None = None,
    fastest_deg_s: float | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Identified:
    """Find out what a rig is: T/J, delay, friction, ripple, damping, each with an interval: ``clutch identify``.

    A motor axis goes to and fro, and has parameters of its own.

    Parameters
    ----------
    scenario : Scenario, str or path, default "board_smc_2"
        A scenario with ``[safety]``. Its simulated board is run in virtual time, 57 s of it (70 s with a motor), unless
        there are `logs`.
    logs : iterable of path, optional
        Logs to read instead: MCAP, or CSV with one sample a row.
    columns : tuple of str, default ("counts", "volts")
        Columns of a CSV that hold counts, and volts given after them.
    loaded : iterable of path, optional
        Logs of a second experiment, with a known mass added beside the weight: T, J and friction one by one. They go
        with `logs`, `mass_kg` and `radius_m`.
    mass_kg, radius_m : float, optional
        The mass that was added, and the radius of the pulley that it hangs from.
    log : path, optional
        Folder for a log of each part of the experiment.
    travel_deg : float, optional
        Way that a motor axis goes forwards from where it rests, 10 to 3600°, 20° without it.
    fastest_deg_s : float, optional
        Highest rate, 5 to 60 °/s of a brake and 15 to 3600 °/s of a motor axis; 60 °/s without it.
    overrides : mapping, optional
        Values for dotted keys of the scenario.

    Returns
    -------
    Identified
        Intervals, refusals, and the scenario as identified.

    Raises
    ------
    ParamError
        A scenario without a safe state, or one whose output does not let go.
    LoopError
        A check ended a part of the experiment.
    ValueError
        A log of another plant than a brake or a motor, or of both; a table that cannot be read; a limit out of its
        range, or of a motor axis where there is none; `loaded` without `logs`, mass or radius, or the reverse; a mass
        that is none; `logs` without a log.
    OSError
        A file cannot be read or written.

    Examples
    --------
    >>> import clutch
    >>> found = clutch.identify("board_smc_2")
    >>> 0.99 < found.parameters["hold_v"].value / 2.2423 < 1.01
    True
    """
    checked = as_scenario(scenario, overrides)
    files = [os.fspath(path) for path in _several("logs", logs, "paths")]
    if logs is not None and not files:
        raise ValueError("logs: expected at least one log, or None for an experiment on the simulated board")
    folder = None if log is None else os.fspath(log)
    others = [os.fspath(path) for path in _several("loaded", loaded, "paths")]
    heavier = _heavier(others, mass_kg, radius_m, alone=bool(files))
    told = _clutch.identify(checked._native, files, columns, heavier, folder, travel_deg, fastest_deg_s)
    return Identified(checked, told)


def _rig_file(identified: Identified | str | os.PathLike[str]) -> tuple[str, str]:
    """Name and text of a rig file."""
    if isinstance(identified, Identified):
        return "identified", identified.to_toml()
    try:
        return os.fspath(identified), Path(identified).read_text(encoding="utf-8")
    except UnicodeDecodeError as e:
        raise ValueError(f"{os.fspath(identified)}: expected a text in UTF-8, as of clutch identify --out: {e}") from e


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Gains of a law: its best, or the next behind a rare stick.

    Attributes
    ----------
    name : str
        The law, and if it stands in a shell.
    gains : dict of str to float
        The gains that were varied, by their dotted keys, SI.
    cost : float or None
        On a ramp cycles/s + 30 × RMS error in degrees + longest stick over 20 ms; along another path 30 × RMS error +
        10 × largest error in degrees; and a thousandth of the voltage's V/s. On the worst of all runs; None if it left
        its path.
    cycles_per_s : float
        Stick-slip cycles a second, in the worst run.
    max_error_rad : float
        Largest error, rad.
    longest_stick_s : float
        Longest stick, s.
    control_variation_v_s : float
        Total variation of the voltage, per time, in the worst run, V/s.
    runs, runs_with_sticks : int
        Runs behind these figures, and those in which the shaft stuck.
    error_bound_rad : float or None
        The bound proven on the error, rad; None where none is, or none was looked for.
    outcome : str
        ``"chosen"``, ``"rougher"``, ``"uncertified"``, ``"refused"`` (it sticks on other discs, or from rest),
        ``"strays"``, ``"unstable"``.
    why : str
        The limiting condition, where it is uncertified or refused; else empty.
    scenario : Scenario or None
        The whole scenario; None if no gains are stable.

    Examples
    --------
    >>> import clutch
    >>> tuned = clutch.tune("board_smc_2", candidates=2)
    >>> tuned.winner.outcome
    'chosen'
    """

    name: str
    gains: dict[str, float]
    cost: float | None
    cycles_per_s: float
    max_error_rad: float
    longest_stick_s: float
    control_variation_v_s: float
    runs: int
    runs_with_sticks: int
    error_bound_rad: float | None
    outcome: Literal["chosen", "rougher", "uncertified", "refused", "strays", "unstable"]
    why: str
    scenario: Scenario | None


class Tuned:
    """Laws and gains for a rig, as :func:`clutch.tune` returns them.

    Attributes
    ----------
    candidates : tuple of Candidate
        The best gains of each law, and the next behind a rare stick, the smoothest first.
    winner : Candidate or None
        The one that is given out; None if none is certified, or none starts from rest.
    verdict : str
        The proven property of it, with its scope; or the limiting condition.
    rates_deg_s : tuple of float
        Rates of the ramp that it was tuned for, °/s; none along another path.
    output_v : tuple of float or None
        Lowest and highest voltage that a motor's output was limited to, so that it goes forwards alone, V; None where
        it has the scenario's limits.
    simulated_s : float
        Simulated time, s.

    Examples
    --------
    >>> import clutch
    >>> tuned = clutch.tune("board_smc_2", candidates=2)
    >>> tuned.winner.name, "shell" in tuned.verdict
    ('glide in a shell', True)
    """

    def __init__(self, found: tuple[dict[str, Any], list[str | None], str, str | None]) -> None:
        told, files, self.verdict, self._proof = found
        rows = zip(told["candidates"], files, strict=True)
        self.candidates: tuple[Candidate, ...] = tuple(_candidate(row, file) for row, file in rows)
        chosen: int | None = told["chosen"]
        self.winner: Candidate | None = None if chosen is None else self.candidates[chosen]
        self.rates_deg_s: tuple[float, ...] = tuple(told["rates_deg_s"])
        limits = told["output_v"]
        self.output_v: tuple[float, float] | None = None if limits is None else (limits[0], limits[1])
        self.simulated_s: float = told["simulated_s"]

    @property
    def scenario(self) -> Scenario:
        """The tuned scenario, whole.

        Raises
        ------
        ValueError
            No gains are given out; the message says what limits.
        """
        if self.winner is None or self.winner.scenario is None:
            raise ValueError(self.verdict)
        return self.winner.scenario

    def save_proof(self, path: str | os.PathLike[str]) -> None:
        """Write the proof, which ``clutch loop --certificate`` and ``clutch.loop(certificate=…)`` read.

        Parameters
        ----------
        path : path
            The file, JSON.

        Raises
        ------
        ValueError
            Nothing is proven.
        OSError
            The file cannot be written.

        Examples
        --------
        >>> import clutch
        >>> clutch.tune("board_smc_2", candidates=2).save_proof("proof.json")
        """
        if self._proof is None:
            raise ValueError(f"nothing is proven: {self.verdict}")
        Path(path).write_text(self._proof, encoding="utf-8")

    def to_pandas(self) -> pd.DataFrame:
        """Give the candidates as a table.

        Returns
        -------
        pandas.DataFrame
            A row for each candidate, the smoothest first, by name; columns as the attributes of :class:`Candidate`,
            without gains and scenario.

        Examples
        --------
        >>> import clutch
        >>> clutch.tune("board_smc_2", candidates=2).to_pandas()["outcome"].iloc[0] in ("chosen", "uncertified")
        True
        """
        with needed("pandas", "to_pandas"):
            import pandas as pd

        left_out = ("gains", "scenario")
        rows = [{k: v for k, v in vars(c).items() if k not in left_out} for c in self.candidates]
        return pd.DataFrame(rows).set_index("name")

    def plot(self, *, seed: int = 101, duration_s: float = 5.0) -> Figure:
        """Draw the error of each candidate over time, from rest, on the rig as it is believed to be.

        Parameters
        ----------
        seed : int, default 101
            The disc; 101 to 108 are those that each law's best gains are judged on, and no gain is chosen on them.
        duration_s : float, default 5.0
            Length of the runs, s, above 1.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, in millimetres and with a font size for print.

        Examples
        --------
        >>> import clutch
        >>> figure = clutch.tune("board_smc_2", candidates=2).plot(duration_s=2)
        """
        from clutch import plot

        length = {"run.seed": seed, "run.duration_s": duration_s, "run.settle_s": 1.0}
        runs = {c.name: simulate(c.scenario, overrides=length) for c in self.candidates if c.scenario is not None}
        return plot.candidates(runs, None if self.winner is None else self.winner.name)

    def __repr__(self) -> str:
        return f"Tuned({self.verdict})"


def _candidate(row: dict[str, Any], file: str | None) -> Candidate:
    score, verdict, outcome = row["score"], row["verdict"], row["outcome"]
    return Candidate(
        name=row["name"],
        gains=dict(row["gains"]),
        cost=score["cost"],
        cycles_per_s=score["cycles_per_s"],
        max_error_rad=score["max_error_rad"],
        longest_stick_s=score["longest_stick_s"],
        control_variation_v_s=score["control_variation_v_s"],
        runs=score["runs"],
        runs_with_sticks=score["runs_with_sticks"],
        error_bound_rad=verdict.get("error_rad"),
        outcome=outcome["is"],
        why=outcome.get("why", ""),
        scenario=None if file is None else Scenario.from_toml(file),
    )


def tune(
    scenario: ScenarioLike,
    *,
    identified: Identified | str | os.PathLike[str] | None = None,
    rates_deg_s: Iterable[float] | None = None,
    candidates: int = 32,
    uncertified: bool = False,
    overrides: Mapping[str, object] | None = None,
) -> Tuned:
    """Find the law and the gains that move a rig most smoothly, certified, as ``clutch tune`` does.

    Parameters
    ----------
    scenario : Scenario, str or path
        A scenario of the rig. On a ramp smooth means without sticks, and a certificate is looked for; along another
        path, which may rest and turn round, the error counts, and `uncertified` is needed.
    identified : Identified, str or path, optional
        The findings of :func:`clutch.identify`, or a file of them as ``clutch identify --out`` writes it; default:
        the scenario's model and bounds, with its rig's delay and ripple.
    rates_deg_s : iterable of float, optional
        Rates of the ramp at which it is to be smooth, °/s; default: the scenario's own.
    candidates : int, default 32
        Candidates of each law.
    uncertified : bool, default False
        Give out the smoothest law without a certificate if none with one starts from rest.
    overrides : mapping, optional
        Values for dotted keys of the scenario.

    Returns
    -------
    Tuned
        The table of candidates, the scenario that is given out, and what is proven of it.

    Raises
    ------
    ParamError
        Rates for a path that is no ramp, a rig with brake and motor on one signal, or a value out of range.
    ValueError
        A file that holds no findings, or findings without a parameter that a rig file needs; no rates.
    OSError
        The file cannot be read.

    Examples
    --------
    >>> import clutch
    >>> tuned = clutch.tune("board_smc_2", candidates=2)
    >>> tuned.winner.runs_with_sticks
    0
    """
    checked = as_scenario(scenario, overrides)
    file = None if identified is None else _rig_file(identified)
    rates = [float(rate) for rate in _several("rates_deg_s", rates_deg_s, "rates")]
    if rates_deg_s is not None and not rates:
        raise ValueError("rates_deg_s: expected at least one rate, or None for the scenario's own")
    return Tuned(_clutch.tune(checked._native, file, rates, candidates, uncertified))
