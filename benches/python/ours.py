"""The job done by clutch: one run, and many."""

import os

import clutch
from clutch import _clutch
from job import Figures, toml

METRICS = ["rms_error_rad", "max_error_rad", "stick_slip_cycles_per_s", "measured_s"]


def scenario(job: str, **times: float) -> clutch.Scenario:
    """The job as an object; `times` are `duration` and `settle`, s."""
    return clutch.Scenario.from_toml(toml(job, **times))


def run(job: clutch.Scenario) -> Figures:
    """One run, of which all samples and events are kept."""
    m = clutch.simulate(job).metrics
    return Figures(m.rms_error_rad, m.max_error_rad, round(m.stick_slip_cycles_per_s * m.measured_s))


def run_many(job: clutch.Scenario, pairs: list[tuple[float, float]]) -> Figures:
    """A run for each pair of gains, of which only figures are kept; their mean."""
    kp, kd = zip(*pairs, strict=True)
    samples = clutch.samples({"law.pd.kp_v_rad": kp, "law.pd.kd_v_s_rad": kd})
    return mean(clutch.sweep(job, samples, metrics=METRICS, progress=False).table)


def run_in(instructions: str, job: clutch.Scenario, pairs: list[tuple[float, float]]) -> Figures:
    """As `run_many`, in lanes of these instructions. A shaft that stops goes on alone, by the widest that there are."""
    keys, rows = ["law.pd.kp_v_rad", "law.pd.kd_v_s_rad"], [list(pair) for pair in pairs]
    sweep = _clutch.Sweep(job, keys, rows, METRICS, threads=os.cpu_count(), instructions=instructions)
    sweep.start()
    while not sweep.wait(10.0):
        pass
    return mean(sweep.result()[0])


def mean(table: clutch.Table) -> Figures:
    """Of all rows."""
    rms, most, rate, measured = (table[name] for name in METRICS)
    return Figures(float(rms.mean()), float(most.mean()), float((rate * measured).mean()))
