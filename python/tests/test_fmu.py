"""Rig and law as FMI 3.0 units, in the hands of FMPy, which shares no code with them."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clutch

if os.environ.get("CI"):
    import fmpy
else:
    fmpy = pytest.importorskip("fmpy")
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu


@pytest.fixture(scope="module")
def units() -> Path:
    """The folder of the packed units; `cargo xtask fmu` packs them."""
    folder = os.environ.get("CLUTCH_FMU")
    if folder is None:
        if os.environ.get("CI"):
            pytest.fail("CLUTCH_FMU names no folder: CI must not skip this test")
        pytest.skip("CLUTCH_FMU names no folder with the units")
    return Path(folder)


class Unit:
    """An instance of a unit, its variables by name."""

    def __init__(self, path: Path, **parameters: str) -> None:
        description = fmpy.read_model_description(str(path))
        self.variables = {v.name: v for v in description.modelVariables}
        self.told: list[str] = []
        # Gone with this instance.
        folder = tempfile.mkdtemp()
        weakref.finalize(self, shutil.rmtree, folder)
        self.slave = FMU3Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(str(path), unzipdir=folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self.slave.instantiate(
            logMessage=lambda _environment, _status, _category, text: self.told.append(text.decode())
        )
        for name, value in parameters.items():
            self.slave.setString([self.reference(name)], [value])

    def begin(self) -> Unit:
        """Initialises it."""
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()
        return self

    def reference(self, name: str) -> int:
        """The number of a variable."""
        return int(self.variables[name].valueReference)

    def get(self, name: str) -> Any:
        """The value of a variable."""
        kind = self.variables[name].type
        return getattr(self.slave, f"get{kind}")([self.reference(name)])[0]

    def set(self, name: str, value: float) -> None:
        """Sets an input."""
        kind = self.variables[name].type
        getattr(self.slave, f"set{kind}")([self.reference(name)], [value])

    def step(self, now: float, step: float = 1e-3) -> None:
        """One step."""
        self.slave.doStep(now, step)


def closed_loop(units: Path, ticks: int, **parameters: str) -> tuple[Unit, Unit, dict[str, np.ndarray]]:
    """The law first, then the rig, once a period."""
    rig = Unit(units / "clutch_rig.fmu", **parameters).begin()
    law = Unit(units / "clutch_law.fmu", **parameters).begin()
    seen: dict[str, list[Any]] = {"counts": [], "position_rad": [], "voltage_v": [], "code": [], "error_rad": []}
    for tick in range(ticks):
        law.set("counts", rig.get("counts"))
        seen["counts"].append(rig.get("counts"))
        seen["position_rad"].append(rig.get("position_rad"))
        law.step(tick * 1e-3)
        for name in ("voltage_v", "code", "error_rad"):
            seen[name].append(law.get(name))
        rig.set("voltage_v", law.get("voltage_v"))
        rig.step(tick * 1e-3)
    return rig, law, {name: np.array(values) for name, values in seen.items()}


@pytest.mark.parametrize("part", ["rig", "law"])
def test_a_unit_is_what_the_standard_asks_for(units: Path, part: str) -> None:
    assert validate_fmu(str(units / f"clutch_{part}.fmu")) == []


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("smc_2", {}),
        ("bench_pd_2", {"run.seed": 3}),
        ("smc_2", {"sampling.scalar": "f32", "law.smc.kp_v": 4.0, "rig.delay_ticks": 1}),
    ],
)
def test_a_master_of_both_units_computes_what_simulate_does(
    units: Path, scenario: str, changes: dict[str, Any]
) -> None:
    ticks = 1500
    run = clutch.simulate(clutch.Scenario.load(scenario).override({**changes, "run.duration_s": ticks * 1e-3}))
    keys = "; ".join(f"{key}={value}" for key, value in changes.items())
    _, _, seen = closed_loop(units, ticks, scenario=scenario, set=keys)
    for name, column in {
        "counts": "counts",
        "position_rad": "position_rad",
        "voltage_v": "voltage_v",
        "error_rad": "measured_error_rad",
    }.items():
        assert seen[name].tolist() == run.samples[column].tolist(), name


def test_a_unit_has_a_scenario_within_it_that_needs_no_parameter(units: Path) -> None:
    _, _, seen = closed_loop(units, 300)
    run = clutch.simulate(clutch.Scenario.load("smc_2").override({"run.duration_s": 1.5}))
    assert seen["voltage_v"].tolist() == run.samples["voltage_v"].tolist()[:300]


def test_a_rig_under_a_constant_voltage_goes_the_same_way_in_steps_of_any_length(units: Path) -> None:
    ways = []
    for steps in ([0.1] * 5, [1e-3] * 500, [0.0137, 0.2, 0.0363, 0.25]):
        rig = Unit(units / "clutch_rig.fmu")
        rig.set("voltage_v", 2.0)
        rig.begin()
        now = 0.0
        for step in steps:
            rig.step(now, step)
            now += step
        ways.append(rig.get("position_rad"))
    assert ways[0] == ways[1]
    assert ways[2] == pytest.approx(ways[0], rel=1e-9)


def test_a_state_that_was_saved_is_gone_on_from_bit_for_bit(units: Path) -> None:
    rig, law, _ = closed_loop(units, 200)
    kept = [unit.slave.getFMUState() for unit in (rig, law)]

    def go_on() -> list[float]:
        out = []
        for tick in range(200, 260):
            law.set("counts", rig.get("counts"))
            law.step(tick * 1e-3)
            rig.set("voltage_v", law.get("voltage_v"))
            rig.step(tick * 1e-3)
            out.append(rig.get("position_rad"))
        return out

    first = go_on()
    for unit, state in zip((rig, law), kept, strict=True):
        unit.slave.setFMUState(state)
        unit.slave.freeFMUState(state)
    assert go_on() == first


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"set": "law.smc.kp=4"}, "law.smc.kp"),
        ({"set": "law.smc.kp_v"}, "expected KEY=VALUE"),
        ({"set": "law.smc.kp_v=-1"}, "law.smc.kp_v"),
        ({"scenario": "no_such_scenario"}, "no_such_scenario"),
        ({"set": "rig.encoder.quantised=false"}, "whole counts"),
    ],
)
def test_a_scenario_that_is_none_is_refused_with_its_reason(units: Path, parameters: dict[str, str], said: str) -> None:
    law = Unit(units / "clutch_law.fmu", **parameters)
    with pytest.raises(FMICallException):
        law.begin()
    assert any(said in text for text in law.told), law.told


def test_a_wrong_step_a_wrong_value_and_a_wrong_variable_are_refused_with_their_reason(units: Path) -> None:
    law, rig = Unit(units / "clutch_law.fmu").begin(), Unit(units / "clutch_rig.fmu").begin()
    for act, unit, said in (
        (lambda: law.step(0.0, 0.002), law, "expected 0.001 s, the sampling period"),
        (lambda: law.step(0.5), law, "expected one from 0 s"),
        (lambda: rig.step(0.0, -1.0), rig, "expected one above 0"),
        (lambda: rig.set("voltage_v", float("nan")), rig, "expected a finite voltage"),
        (lambda: rig.set("position_rad", 1.0), rig, "position_rad: expected an input"),
        (lambda: rig.slave.getFloat64([99]), rig, "no variable 99"),
    ):
        with pytest.raises(FMICallException):
            act()
        assert said in unit.told[-1], unit.told
    # And both go on.
    law.step(0.0)
    rig.set("voltage_v", law.get("voltage_v"))
    rig.step(0.0)
