"""The job done by clutch: one run, and many."""

import os

import numpy as np

import clutch
from clutch import _clutch
from job import Figures, Job, toml

METRICS = ["rms_error_rad", "max_error_rad", "stick_slip_cycles_per_s", "measured_s"]


def scenario(job: Job) -> clutch.Scenario:
    """The job as an object."""
    return clutch.Scenario.from_toml(toml(job))


def run(job: clutch.Scenario, seen: np.ndarray | None = None) -> Figures:
    """One run, of which all samples and events are kept; `seen` gets the positions."""
    done = clutch.simulate(job)
    if seen is not None:
        seen[:] = done.samples["position_rad"]
    m = done.metrics
    return Figures(m.rms_error_rad, m.max_error_rad, round(m.stick_slip_cycles_per_s * m.measured_s))


def run_many(job: clutch.Scenario, pairs: list[tuple[float, float]], threads: int | None = None) -> Figures:
    """A run for each pair of gains, of which only figures are kept; their mean."""
    kp, kd = zip(*pairs, strict=True)
    samples = clutch.samples({"law.pd.kp_v_rad": kp, "law.pd.kd_v_s_rad": kd})
    return mean(clutch.sweep(job, samples, metrics=METRICS, threads=threads, progress=False).table)


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
