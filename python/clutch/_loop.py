"""The loop on a board, simulated or real: what ``clutch loop`` runs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from clutch import _clutch
from clutch._metrics import Metrics
from clutch._model import Scenario
from clutch._run import ScenarioLike, as_scenario


@dataclass(frozen=True, kw_only=True)
class LoopResult:
    """A finished session of the loop: what :func:`clutch.loop` returns.

    ``print`` it for the summary of ``clutch loop``.

    Attributes
    ----------
    scenario : Scenario
        The scenario that ran. For a board that closes the loop itself it is one in single precision.
    verdict : str
        ``"done"``: the path is done. ``"stopped"``: stopped from here. ``"fault"``: a fault ended the run, or the port
        was lost. ``"not_armed"``: the board did not take consent.
    state, cause, cause_text : str
        Where control ended, why, and why in words.
    value : float
        The value that the check saw that ended it.
    certified_continuous_time : bool
        True if the gains are certified, in continuous time, for the scenario's bounds.
    sampled : dict
        The verdicts on the sampled loop: on the error ``error_bound_rad``, ``verdict`` in words, with its scope, and
        ``certificate``, the file (without one file and bound are None); on linear stability ``spectral_radius`` with
        the weakest, a middle and the strongest actuator, and ``stable`` (None if not known); ``sticks_excluded``, which
        neither does.
    ticks : int
        Periods in which the law was asked.
    drift : dict
        Friction over load, as counts and voltages show it, as multiples of the model's: ``quantity``, its name;
        ``last``, a dict of ``friction``, the interval ``least`` to ``most`` that is certain, and the bounds ``low`` and
        ``high``, or None if there was too little motion; ``lowest`` and ``highest`` of the run; ``alarms``, the times
        at which it left the bounds; ``first_alarm_s`` and ``first_alarm``, as ``last``; ``windows`` judged, of which
        ``one_sided`` could not exclude a friction below the bounds; ``words``, the same in words.
    ended_by_drift : bool
        True if that ended the run.
    metrics : Metrics
        Figures after the settling time, **from the encoder**: the true position is not known here. The torque at
        break-away is None.
    samples : dict of str to int
        ``received``, ``lost``, ``late``, ``duplicated``, ``reordered``, ``implausible``.
    bad_frames, deadline_misses, untold, log_dropped, cut_writes : int
        Frames with errors; answers that came too late; cycles of a board controller that did not reach this machine;
        records that the log dropped; frames that the line took only in part.
    response, cycle, wake : dict of str to float
        From a sample to its answer, from answer to answer, and by how much a wake-up was late (``count`` is 0 of a
        board whose clock waits for this machine, or that closes the loop itself): ``p50_us``, ``p99_us``, ``p99_9_us``,
        ``max_us``, ``count``.
    tick_clock_cycles : dict of str to float or None
        Clock cycles of a tick, of a board that counts them: ``clock_hz``, ``p50``, ``p99_9``, ``max``.
    board_safe : bool
        True if the board said that it is in its safe state.
    board_waits : int or None
        Number of times that the simulated board's clock waited for this machine.
    port_error : str or None
        The port's error, if it ended the run.
    gains_changed, gains_changed_uncertified : int
        Changes of gains from the live view while it ran, and those of them without a certificate.
    notes : list of str
        Refusals of the system (priority, memory), and what to do about them.
    log : Path or None
        The log's file.
    announcement : str
        The session's announcement, before anything moved.
    version : str
        Version and commit of the build.

    Examples
    --------
    >>> import clutch
    >>> result = clutch.loop(duration=1.2)
    >>> result.verdict, result.ticks, result.samples["lost"]
    ('done', 1200, 0)
    """

    scenario: Scenario
    verdict: Literal["done", "stopped", "fault", "not_armed"]
    state: str
    cause: str
    cause_text: str
    value: float
    certified_continuous_time: bool
    sampled: dict[str, Any]
    drift: dict[str, Any]
    ended_by_drift: bool
    ticks: int
    metrics: Metrics
    samples: dict[str, int]
    bad_frames: int
    deadline_misses: int
    untold: int
    log_dropped: int
    cut_writes: int
    response: dict[str, float]
    cycle: dict[str, float]
    wake: dict[str, float]
    tick_clock_cycles: dict[str, float] | None
    board_safe: bool
    board_waits: int | None
    port_error: str | None
    gains_changed: int
    gains_changed_uncertified: int
    notes: list[str]
    log: Path | None
    announcement: str = field(repr=False)
    version: str
    _text: str = field(repr=False)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        m = self.metrics
        return (
            f"<LoopResult {self.scenario.name!r}: {self.verdict}, {self.ticks} ticks, "
            f"max error {m.max_error_rad:.6f} rad, {m.stick_slip_cycles_per_s:.3g} stick-slip cycles/s>"
        )


def loop(
    scenario: ScenarioLike = "board_smc_2",
    *,
    overrides: Mapping[str, object] | None = None,
    duration: float | None = None,
    port: str | os.PathLike[str] | None = None,
    board: str | os.PathLike[str] | None = None,
    baud: int | None = None,
    log: str | os.PathLike[str] | None = None,
    uncertified: bool = False,
    certificate: str | os.PathLike[str] | None = None,
    release_test: Literal["auto", "always", "never"] = "auto",
    release_deg: float = _clutch.RELEASE_DEG,
    on_drift: Literal["report", "stop"] = "report",
    patient: bool = False,
    strict: bool = False,
    faults: Sequence[str] = (),
    fault_seed: int = 1,
    pace: Literal["sample", "clock"] = "sample",
    wait: Literal["sleep", "spin"] = "sleep",
    spin_us: int = _clutch.SPIN_US,
    thread_priority: int = _clutch.DEFAULT_PRIORITY,
    lock_memory: bool = False,
    cpu_affinity: int | None = None,
    live: bool | int = False,
) -> LoopResult:
    """Close the loop on a board, simulated or real: the session of ``clutch loop``.

    It makes the checks that the command makes, in the same order, and calling it is the consent. The loop runs on a
    thread of its own without Python: other Python threads do not hold it up. Ctrl-C ends the run in the safe state, and
    then raises `KeyboardInterrupt`.

    Parameters
    ----------
    scenario : Scenario, str or path, default "board_smc_2"
        A scenario with a table ``[safety]``, the name of a built-in one, or a TOML file.
    overrides : mapping, optional
        Values for dotted keys of the scenario, as ``{"law.smc.kp_v": 4}``.
    duration : float, optional
        Length of the run instead of ``run.duration_s``, s.
    port : str or path, optional
        The board's port, as ``/dev/ttyACM0`` or ``tcp://127.0.0.1:5000``. Without it a board is simulated, and spoken
        to over a real pseudo-terminal.
    board : str or path, optional
        The port of a board that closes the loop itself: it is set up, armed, and looked at.
    baud : int, optional
        Line rate of the port, baud. No effect on USB, pseudo-terminals and TCP.
    log : str or path, optional
        Write an MCAP log to this new file.
    uncertified : bool, default False
        Run a law that is not certified for the scenario's bounds.
    certificate : str or path, optional
        Certificate of the sampled loop, as ``clutch certify --sampled --save`` writes it: it is checked, and that it is
        this scenario's, before anything starts.
    release_test : {"auto", "always", "never"}
        Before the run, let the brake go for some milliseconds and grip again: the way shows wrong signs and scales of
        encoder and converter. "auto" does so on a serial device, where the scenario allows it.
    release_deg : float, default 0.1
        The longest way in that test of any shaft within the bounds, above 0 and up to 10°: a longer one finds more.
    on_drift : {"report", "stop"}
        Effect of friction over load that leaves the bounds: the result and the log report it, or the run also ends in
        the safe state.
    patient : bool, default False
        The board at the port is a simulated one whose clock waits when this machine stalls, and so does the loop.
    strict : bool, default False
        Keep the simulated board's clock from waiting when this machine stalls: as on hardware.
    faults : sequence of str, optional
        Break something on the simulated board, as ``["freeze:at=2"]``: docs/loop.md has the kinds.
    fault_seed : int, default 1
        Seed of the faults that hit at random.
    pace : {"sample", "clock"}
        Start of a cycle: the board's sample, or this machine's clock.
    wait : {"sleep", "spin"}
        Way of waiting: the kernel wakes the loop, or it wakes early and spins.
    spin_us : int, default 150
        Time before a sample at which it begins to spin, µs.
    thread_priority : int
        Priority of the loop's thread under SCHED_FIFO, 1 to 99; 0 stays with the ordinary scheduler.
    lock_memory : bool, default False
        Keep all memory of this process in RAM, from now on. The command does; a Python process may hold much, and is
        asked first.
    cpu_affinity : int, optional
        The core on which the loop's thread stays.
    live : bool or int, default False
        Show the run in a browser while it goes on, at an address of this machine that is printed: at this port, or with
        True at a free one; False and 0 show nothing. The page's button stops the run; gains are changed there where
        ``safety.live_gains`` allows it.

    Returns
    -------
    LoopResult
        The summary's figures. A fault that ends a run raises nothing: look at ``verdict``.

    Raises
    ------
    ParamError
        A value that the scenario refuses; its ``field`` is the key.
    LoopError
        Gains that are not certified, a port, a board: with the text of the command. Nothing has moved. Or a release
        test that did not end as that of a sound shaft would: the output is in the safe state.
    OSError
        The scenario cannot be read, or the log not be written.

    Examples
    --------
    >>> import clutch
    >>> result = clutch.loop("board_smc_2", duration=1.2)
    >>> print(str(result).splitlines()[-1])
    the path is done; the board is in its safe state

    With a fault of the encoder:

    >>> clutch.loop(duration=2, faults=["loss:at=0.5"]).cause_text
    'the board sees no encoder'
    """
    given = dict(overrides or {})
    if duration is not None:
        given["run.duration_s"] = float(duration)
    checked = as_scenario(scenario, given)
    summary, text, announcement, changed = _clutch.run_loop(
        checked,
        port=_text(port),
        board=_text(board),
        baud=baud,
        log=None if log is None else os.fspath(log),
        uncertified=uncertified,
        certificate=_text(certificate),
        release_test=release_test,
        release_deg=release_deg,
        on_drift=on_drift,
        patient=patient,
        faults=list(faults),
        fault_seed=fault_seed,
        strict=strict,
        pace=pace,
        wait=wait,
        spin_us=spin_us,
        thread_priority=thread_priority,
        lock_memory=lock_memory,
        cpu_affinity=cpu_affinity,
        live=_port(live),
    )
    figures: dict[str, Any] = dict(summary)
    del figures["scenario"]
    if figures["value"] is None:  # JSON has no number that is none
        figures["value"] = float("nan")
    metrics = figures.pop("metrics")
    metrics.update({f"detected_{name}": value for name, value in figures.pop("detected").items()})
    return LoopResult(
        scenario=checked if changed is None else Scenario.from_toml(changed),
        metrics=Metrics(**metrics),
        log=None if log is None else Path(log),
        announcement=announcement.rstrip("\n"),
        _text=text.rstrip("\n"),
        **figures,
    )


def _text(path: str | os.PathLike[str] | None) -> str | None:
    return None if path is None else os.fspath(path)


def _port(live: bool | int) -> int | None:
    if live is True or live is False:
        return 0 if live else None
    if not 0 <= live <= 65535:
        raise ValueError(f"live = {live}: expected True, False, or a port from 1 to 65535")
    return live or None
