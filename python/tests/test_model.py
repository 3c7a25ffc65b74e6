"""The objects of a scenario: defaults, ranges, and that nothing is lost on the way."""

import copy
import dataclasses
import doctest
import inspect
import json
import math
import pickle
import re
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clutch
from clutch import _clutch, _errors, _mixins, _model, _record, _tables
from conftest import ROOT

GEOMETRY = {
    "inner_radius_m": 0.045,
    "torque_constant_nm_a": 0.0508,
    "pad_area_m2": 0.040,
    "lever_area_m2": 0.032,
    "armature_resistance_ohm": 0.6,
    "contact_radius_m": 0.034,
}
RIPPLE = {
    "rms": 0.05,
    "lowest_waves_per_turn": 100,
    "highest_waves_per_turn": 400,
    "spacing_waves_per_turn": 50,
}
TORQUE = {"mean_nm": 0.04, "amplitude_nm": 0.01}
HAND = {"mean_nm": 0.06, "rms_nm": 0.008, "lowest_frequency_hz": 0.2, "highest_frequency_hz": 4.0}
MOVE = {"distance_deg": 90.0, "speed_deg_s": 20.0, "acceleration_deg_s2": 100.0}
SINE = {"rate_deg_s": 10.0, "amplitude_deg": 0.5, "frequency_hz": 1.0}
CHIRP = {"rate_deg_s": 10.0, "amplitude_deg": 0.5, "from_hz": 0.1, "to_hz": 3.0, "duration_s": 10.0}

# Required arguments; none where every field has a default.
REQUIRED = {
    clutch.StribeckFriction: {},
    clutch.CoulombFriction: {},
    clutch.LugreFriction: {},
    clutch.DahlFriction: {},
    clutch.ElastoPlasticFriction: {},
    clutch.MaxwellFriction: {},
    clutch.BrakeActuator: {},
    clutch.BrakeGeometry: GEOMETRY,
    clutch.MotorActuator: {"gain_nm_v": 0.05, "preload_nm": 0.25},
    clutch.BothActuator: {"brake_gain_nm_v": 0.14, "motor_gain_nm_v": 0.02},
    clutch.Ripple: RIPPLE,
    clutch.Runout: {"amplitude": 0.2},
    clutch.WeightDrive: {},
    clutch.SpringDrive: {"stiffness_nm_rad": 0.02, "rest_deg": 180.0},
    clutch.BeltDrive: {"stiffness_nm_rad": 0.5, "speed_deg_s": 2.0},
    clutch.RampDrive: {"from_nm": 0.0, "rate_nm_s": 0.01},
    clutch.TableDrive: {"points_s_nm": ((0.0, 0.045), (2.0, 0.055))},
    clutch.SineDrive: TORQUE | {"frequency_hz": 2.0},
    clutch.ChirpDrive: TORQUE | {"from_hz": 0.1, "to_hz": 3.0, "duration_s": 10.0},
    clutch.HandDrive: HAND,
    clutch.Encoder: {},
    clutch.Dac: {},
    clutch.Rig: {},
    clutch.Model: {},
    clutch.Pd: {},
    clutch.Ctc: {},
    clutch.Smc: {},
    clutch.SmcSign: {},
    clutch.Pid: {},
    clutch.SuperTwisting: {},
    clutch.SmcIntegral: {},
    clutch.Dob: {},
    clutch.Glide: {},
    clutch.EdgeTimed: {},
    clutch.Shell: {},
    clutch.Voltage: {},
    clutch.HoldLaw: {},
    clutch.SmoothedDerivative: {},
    clutch.CountsOverTime: {},
    clutch.Observer: {},
    clutch.Output: {},
    clutch.Hold: {},
    clutch.Ramp: {"rate_deg_s": 2.0},
    clutch.Trapezoid: MOVE,
    clutch.JerkLimited: MOVE | {"jerk_deg_s3": 1000.0},
    clutch.MinimumJerk: {"distance_deg": 90.0, "duration_s": 6.0},
    clutch.Sine: SINE,
    clutch.Chirp: CHIRP,
    clutch.TablePath: {"points_s_deg": ((0.5, 0.0), (2.0, 20.0))},
    clutch.FrictionMap: {
        "rig": "disc 7",
        "points_deg_factor": ((0.0, 1.0), (0.3, 1.1), (0.6, 0.9), (0.9, 1.0)),
    },
    clutch.Sampling: {},
    clutch.Bounds: {},
    clutch.RunOptions: {},
    clutch.HoldVoltage: {"volts_v": 4.5},
    clutch.RampVoltage: {"rate_v_s": 50.0, "volts_v": 4.5},
    clutch.Release: {},
    clutch.HoldThenRelease: {"volts_v": 4.5, "after_s": 2.0},
    clutch.Limits: {},
    clutch.Safety: {"reason": "a weight", "on_fault": clutch.HoldVoltage(volts_v=4.5)},
}
CLASSES = list(REQUIRED)


def named(cls):
    """A test's name for a class."""
    return cls.__name__


def same(a, b):
    """Equal, or both not a number."""
    return a == b or (isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b))


def text_of(thing):
    """The result of ``repr``, evaluated with the public names only."""
    return eval(repr(thing), {name: getattr(clutch, name) for name in dir(clutch)})


# --- Defaults ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("cls", CLASSES, ids=named)
def test_defaults_are_those_of_the_native_module(cls):
    made = cls(**REQUIRED[cls])
    given = {
        f.name: getattr(made, f.name)
        for f in dataclasses.fields(cls)
        if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    }
    table = {k: v for k, v in made._tables().items() if k in given or k == "on_fault"}
    canonical = _clutch.check(cls._key, cls.__name__, table)
    assert cls._build(canonical) == made
    assert made._tables() == json.loads(json.dumps(canonical))


@pytest.mark.parametrize("name", ["paper", "ideal", "bench"])
def test_rigs_are_those_of_the_native_module(name):
    rig = getattr(clutch.Rig, name)()
    native = _clutch.rig(name)
    assert rig._tables() | {"base": name} == native


def test_the_default_rig_is_the_papers():
    assert clutch.Rig() == clutch.Rig.paper()
    assert clutch.Rig._tables(clutch.Rig()) == _clutch.rig("paper")


def test_a_scenario_of_defaults_is_the_file_with_nothing_but_law_and_path():
    text = 'name = "SMC, ramp"\nrig.base = "paper"\nlaw.smc = {}\nreference.ramp.rate_deg_s = 2.0'
    made = clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=2))
    assert made == clutch.Scenario.from_toml(text)


def test_a_scenario_without_a_name_is_named_after_its_law_and_path():
    path = clutch.MinimumJerk(distance_deg=10, duration_s=5)
    assert clutch.Scenario(law=clutch.SmcSign(), reference=path).name == "SMC sign, minimum jerk"
    assert clutch.Scenario(name="mine", law=clutch.Pd(), reference=path).name == "mine"


def test_every_class_of_the_scenario_is_tested_here():
    classes = {
        c
        for c in vars(_model).values()
        if inspect.isclass(c) and issubclass(c, _record._Params) and not c.__name__.startswith("_")
    }
    assert classes == {*CLASSES, clutch.Scenario}


# --- Nothing is lost on the way ----------------------------------------------------------------------


def assert_nothing_is_lost(thing):
    assert text_of(thing) == thing
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        assert pickle.loads(pickle.dumps(thing, protocol)) == thing
    assert copy.copy(thing) == thing == copy.deepcopy(thing)
    assert thing.replace() == thing
    assert hash(thing.replace()) == hash(thing)


@pytest.mark.parametrize("cls", CLASSES, ids=named)
def test_repr_pickle_copy_and_hash_keep_an_object(cls):
    assert_nothing_is_lost(cls(**REQUIRED[cls]))


@pytest.mark.parametrize("name", clutch.scenarios())
def test_repr_pickle_copy_hash_and_toml_keep_every_built_in_scenario(name):
    scenario = clutch.Scenario.load(name)
    assert_nothing_is_lost(scenario)
    again = clutch.Scenario.from_toml(scenario.to_toml())
    assert again == scenario
    assert again.to_toml() == scenario.to_toml()
    for f in dataclasses.fields(scenario):
        if f.name not in ("name", "safety", "friction_map"):
            assert_nothing_is_lost(getattr(scenario, f.name))


def test_equal_scenarios_have_the_same_text_whatever_they_came_from():
    loaded = clutch.Scenario.load("bench_smc_2")
    made = clutch.Scenario(
        name=loaded.name, rig=clutch.Rig.bench(), law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=2)
    )
    assert made == loaded
    assert made.to_toml() == loaded.to_toml()


def test_the_text_has_every_key_of_the_objects():
    scenario = clutch.Scenario.load("board_smc_2")
    table = tomllib.loads(scenario.to_toml())
    assert table == scenario._tables()
    assert set(table) == {f.name for f in dataclasses.fields(scenario)} - {"friction_map"}
    assert table["law"] == {"smc": dataclasses.asdict(scenario.law)}
    assert table["safety"]["limits"] == dataclasses.asdict(clutch.Limits())


def test_a_scenario_keeps_nothing_native_in_its_fields_repr_or_pickle():
    scenario = clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=2))
    assert "_native" not in repr(scenario)
    assert b"_native" not in pickle.dumps(scenario)
    assert {f.name for f in dataclasses.fields(scenario)} == set(dataclasses.asdict(scenario))


def test_a_file_is_read_like_its_text(tmp_path):
    scenario = clutch.Scenario.load("minimum_jerk")
    file = tmp_path / "mine.toml"
    file.write_text(scenario.to_toml(), encoding="utf-8")
    assert clutch.Scenario.load(file) == clutch.Scenario.load(str(file)) == scenario


def test_a_repr_shows_numbers_always_and_parts_where_they_differ():
    assert repr(clutch.Smc()) == "Smc(kp_v=3.0, kd_v_s_rad=400.0, slope_1_s=70.0, boundary_rad_s=0.1)"
    rig = clutch.Rig(encoder=clutch.Encoder(quantised=False))
    assert "encoder=Encoder(" in repr(rig)
    assert "dac" not in repr(rig)
    assert "inertia_kg_m2=0.0017" in repr(rig)
    scenario = clutch.Scenario(name="x", law=clutch.Pd(), reference=clutch.Hold())
    assert repr(scenario) == "Scenario(name='x', law=Pd(kp_v_rad=5000.0, kd_v_s_rad=50.0), reference=Hold())"


# --- Types -------------------------------------------------------------------------------------------


def test_whole_numbers_become_floats_and_numpys_numbers_pythons():
    law = clutch.Smc(kp_v=np.float32(4), kd_v_s_rad=np.int64(300), slope_1_s=np.array(60), boundary_rad_s=1)
    assert law == clutch.Smc(kp_v=4.0, kd_v_s_rad=300.0, slope_1_s=60.0, boundary_rad_s=1.0)
    assert {type(v) for v in dataclasses.asdict(law).values()} == {float}
    encoder = clutch.Encoder(counts_per_rev=np.uint16(4096), quantised=np.bool_(False))
    assert type(encoder.counts_per_rev) is int
    assert encoder.quantised is False
    assert type(clutch.Sampling(scalar=np.str_("f32")).scalar) is str


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (1, 2)],
        [[0.0, 0.0], [1.0, 2.0]],
        np.array([[0, 0], [1, 2]]),
        [np.array([0.0, 0.0]), (np.float32(1), np.int32(2))],
    ],
    ids=["tuples", "lists", "array", "mixed"],
)
def test_points_become_tuples_of_floats(points):
    path = clutch.TablePath(points_s_deg=points)
    assert path.points_s_deg == ((0.0, 0.0), (1.0, 2.0))
    assert {type(x) for point in path.points_s_deg for x in point} == {float}
    assert clutch.TableDrive(points_s_nm=points).points_s_nm == path.points_s_deg


@pytest.mark.parametrize("scalar", ["f32", "f64"])
def test_a_scenario_runs_in_either_scalar(scalar):
    sampling = clutch.Sampling(scalar=scalar)
    scenario = clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=2), sampling=sampling)
    assert tomllib.loads(scenario.to_toml())["sampling"]["scalar"] == scalar


@pytest.mark.parametrize("cls", [*CLASSES, clutch.Scenario, clutch.Certificate], ids=named)
def test_objects_are_frozen_and_take_keywords_only(cls):
    required = REQUIRED.get(cls)
    if cls is clutch.Scenario:
        thing = clutch.Scenario.load("smc_2")
    else:
        thing = clutch.Scenario.load("smc_2").certificate() if required is None else cls(**required)
    for f in dataclasses.fields(thing):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(thing, f.name, 1)
        with pytest.raises(dataclasses.FrozenInstanceError):
            delattr(thing, f.name)
    with pytest.raises(TypeError):
        cls(1)
    with pytest.raises(TypeError):
        cls(**(required or {}), no_such_key=1)


def test_a_part_of_the_wrong_class_is_named():
    path = clutch.Ramp(rate_deg_s=2)
    for make, name, value in [
        (lambda v: clutch.Scenario(law=v, reference=path), "law", path),
        (lambda v: clutch.Scenario(law=v, reference=path), "law", {"smc": {}}),
        (lambda v: clutch.Scenario(law=v, reference=path), "law", None),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=v), "reference", "ramp"),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=path, rig=v), "rig", "bench"),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=path, safety=v), "safety", clutch.Release()),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=path, name=v), "name", None),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=path, name=v), "name", 0),
        (lambda v: clutch.Scenario(law=clutch.Pd(), reference=path, name=v), "name", clutch.Pd()),
        (lambda v: clutch.Rig(drive=v), "drive", clutch.HoldVoltage(volts_v=1)),
        (lambda v: clutch.Rig(ripple=v), "ripple", 0.1),
        (lambda v: clutch.Rig(actuator=v), "actuator", clutch.Encoder()),
        (lambda v: clutch.Model(actuator=v), "actuator", GEOMETRY),
        (lambda v: clutch.Safety(reason="r", on_fault=v), "on_fault", None),
    ]:
        with pytest.raises(clutch.ParamError, match=name) as caught:
            make(value)
        assert (caught.value.field, caught.value.value) == (name, value)


# --- Ranges ------------------------------------------------------------------------------------------

NOT_A_NUMBER = [math.nan, math.inf, -math.inf, "fast", None, object(), [1.0], {}, 1j, b"1", 10**400, True]
NOT_A_COUNT = [-1, 1.5, math.nan, "many", None, object(), [1], 2**32, 10**400, True]

SCHEMA = json.loads((ROOT / "docs/scenario.schema.json").read_text(encoding="utf-8"))


def declared(cls):
    """The schema's entries for the fields of a class; none for parts."""
    schema = SCHEMA
    for part in cls._key.split("."):
        schema = schema["properties"][part]
    return {key: row for key, row in schema["properties"].items() if row["type"] != "object"}


def beyond(row):
    """Numbers at the ends that a range leaves out, and beyond those that it takes."""
    whole = row["type"] == "integer"
    step = 1 if whole else 1e-9
    values = [row[end] for end in ("exclusiveMinimum", "exclusiveMaximum") if end in row]
    for end, sign in (("minimum", -1), ("maximum", 1), ("exclusiveMinimum", -1), ("exclusiveMaximum", 1)):
        if end in row:
            values.append(row[end] + sign * step * max(1, abs(row[end])) if not whole else row[end] + sign)
    return values if whole else [*values, math.nan, math.inf, -math.inf]


# Errors that a range cannot say: values that do not fit the object's other ones, lists, texts.
DEPENDENT = {
    clutch.Ripple: {
        "rms": [0.3],
        "lowest_waves_per_turn": [99],
        "highest_waves_per_turn": [50, 401, 100 + 64 * 50],
    },
    clutch.TableDrive: {
        "points_s_nm": [[], [(0.0, math.nan)], [(math.inf, 1.0)], [(1.0, 1.0), (1.0, 2.0)], [(1.0, 1.0, 1.0)]]
    },
    clutch.HandDrive: {"highest_frequency_hz": [0.2, 0.1]},
    clutch.Dac: {"highest_v": [-10.0, -11.0]},
    clutch.Output: {"highest_v": [0.0, -1.0], "on_invalid_v": [-1.0, 10.1]},
    clutch.TablePath: {
        "points_s_deg": [[], [(-1.0, 0.0)], [(0.0, math.nan)], [(1.0, 1.0), (1.0, 2.0)], [(1.0,)]],
        "interpolation": ["Cubic", ""],
    },
    clutch.FrictionMap: {
        "rig": [3, "one\nas sampled: certified", "\x1b[2J"],
        "points_deg_factor": [[], [(0.0, 1.0)], [(0.0, math.nan)], [(1.0, 1.0), (1.0, 2.0)], [(1.0,)]],
    },
    clutch.Sampling: {"scalar": ["f16", "", 64]},
    clutch.RunOptions: {"start": ["stop", 1], "engine": ["euler", 4]},
    clutch.Limits: {"good_samples": [3]},
    clutch.Safety: {"reason": [3, b"why", "", " "]},
}
NUMBERS = [
    (cls, name, value, row.get("x-unit", ""))
    for cls in CLASSES
    for name, row in declared(cls).items()
    if row["type"] in ("number", "integer") and name in {f.name for f in dataclasses.fields(cls)}
    for value in beyond(row)
]


@pytest.mark.parametrize(
    ("cls", "name", "value", "unit"), NUMBERS, ids=[f"{c.__name__}-{n}-{v}" for c, n, v, _ in NUMBERS]
)
def test_a_number_out_of_its_range_is_refused_with_its_key_its_value_and_its_unit(cls, name, value, unit):
    with pytest.raises(clutch.ParamError) as caught:
        cls(**REQUIRED[cls] | {name: value})
    assert caught.value.field == name
    assert same(caught.value.value, value)
    assert str(caught.value).startswith(f"{cls.__name__}: {name} = ")
    assert unit in str(caught.value)


@pytest.mark.parametrize("cls", CLASSES, ids=named)
def test_each_key_has_the_unit_of_its_row(cls):
    for name, row in declared(cls).items():
        assert _tables.KEYS[f"{cls._key}.{name}"] == row.get("x-unit", "")


def wrong_types(cls, name):
    """Values that are none of the field's type."""
    kind = {f.name: f.type for f in dataclasses.fields(cls)}[name]
    if name.startswith("points"):
        return ["fast", 1.0, None, object(), [1.0], [("a", "b")], [(object(), 1.0)], {0.0: 1.0}]
    if kind is bool:
        return [0, 1.0, "yes", None, object()]
    if kind is int:
        return [x for x in NOT_A_COUNT if name != "seed" or x != 2**32]
    if kind is float:
        return NOT_A_NUMBER
    if name in ("actuator_time_constant_s", "start_counts", "ripple_percent"):
        return [x for x in NOT_A_NUMBER if x is not None]
    return ["", None, object(), math.nan, "\ud800"]


BAD = [
    (cls, slot.name, value)
    for cls in CLASSES
    for slot in _model._slots(cls)
    if slot.plain
    for value in [*DEPENDENT.get(cls, {}).get(slot.name, []), *wrong_types(cls, slot.name)]
]


@pytest.mark.parametrize(
    ("cls", "name", "value"), BAD, ids=[f"{c.__name__}-{n}-{i}" for i, (c, n, _) in enumerate(BAD)]
)
def test_each_bad_value_is_named(cls, name, value):
    with pytest.raises(clutch.ParamError) as caught:
        cls(**REQUIRED[cls] | {name: value})
    assert caught.value.field == name
    found = caught.value.value
    assert same(found, value) or np.array_equal(np.asarray(found), np.asarray(value), equal_nan=True)
    assert name in str(caught.value)
    # By replace as well.
    with pytest.raises(clutch.ParamError):
        cls(**REQUIRED[cls]).replace(**{name: value})


def test_every_number_of_every_class_is_tried_out_of_its_range():
    tried = {(cls, name) for cls, name, _, _ in NUMBERS}
    for cls in CLASSES:
        for field in dataclasses.fields(cls):
            if field.type in (int, float, float | None):
                assert (cls, field.name) in tried


@pytest.mark.parametrize(
    ("change", "key", "value"),
    [
        ({"model": clutch.Model(drive_torque_nm=0)}, "model.drive_torque_nm", 0.0),
        (
            {"model": clutch.Model(friction=clutch.StribeckFriction(mu_static=0))},
            "model.friction.stribeck.mu_static",
            0.0,
        ),
        ({"reference": clutch.Ramp(rate_deg_s=1e30)}, "reference.ramp.rate_deg_s", 1e30),
        (
            {"reference": clutch.Trapezoid(distance_deg=1e30, speed_deg_s=1, acceleration_deg_s2=1)},
            "reference.trapezoid.distance_deg",
            1e30,
        ),
        (
            {"reference": clutch.Sine(rate_deg_s=10, amplitude_deg=0.5, frequency_hz=500)},
            "reference.sine.frequency_hz",
            500.0,
        ),
        ({"run": clutch.RunOptions(duration_s=5, settle_s=5)}, "run.settle_s", 5.0),
        ({"run": clutch.RunOptions(duration_s=1e5)}, "run.duration_s", 1e5),
        ({"law": clutch.Pid(tracking_time_s=1e-4)}, "law.pid.tracking_time_s", 1e-4),
        ({"output": clutch.Output(highest_v=12)}, "output.highest_v", 12.0),
        (
            {"rig": clutch.Rig(actuator=clutch.BrakeGeometry(**GEOMETRY | {"contact_radius_m": 1e-312}))},
            "rig.actuator.geometry.contact_radius_m",
            1e-312,
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_depends_on_other_parts_the_scenario_refuses_with_key_and_value(change, key, value):
    with pytest.raises(clutch.ParamError) as caught:
        clutch.Scenario.load("board_smc_2").replace(**change)
    assert (caught.value.field, caught.value.value) == (key, value)


def test_a_scenarios_error_has_the_dotted_key():
    scenario = clutch.Scenario.load("board_smc_2")
    for change, key in [
        ({"reference": clutch.Ramp(rate_deg_s=-2)}, "reference.ramp"),
        ({"reference": clutch.Ramp(rate_deg_s=400)}, "reference.ramp"),
        ({"rig": clutch.Rig(friction=clutch.StribeckFriction(stribeck_exponent=2)),
          "run": clutch.RunOptions(engine="exact_flow")}, "run.engine"),
        ({"safety": clutch.Safety(reason="r", on_fault=clutch.HoldVoltage(volts_v=1))}, "safety.on_fault"),
    ]:  # fmt: skip
        with pytest.raises(clutch.ParamError) as caught:
            scenario.replace(**change)
        assert caught.value.field == key


@pytest.mark.parametrize(
    "overrides",
    [
        {
            "sampling.period_us": 100,
            "reference": {"sine": SINE | {"amplitude_deg": 1e-6, "frequency_hz": 2000}},
        },
        {"sampling.period_us": 100, "run.duration_s": 0.0005, "run.settle_s": 0.0},
        {"sampling.period_us": 100, "run.duration_s": 0.0015, "run.settle_s": 0.0012},
        {"sampling.period_us": 10_000, "run.duration_s": 20_000.0},
        {"sampling.period_us": 100, "reference": {"chirp": CHIRP | {"amplitude_deg": 1e-6, "to_hz": 2000.0}}},
        {"rig.dac.lowest_v": 0.0, "rig.dac.highest_v": 24.0, "safety.on_fault.hold.volts_v": 12.0},
        {"rig.encoder.counts_per_rev": 2**20, "safety.limits.jump_deg": 0.001},
        {"rig.encoder.counts_per_rev": 2**10, "safety.limits.jump_deg": 1.0},
        {"sampling.period_us": 100, "safety.limits.saturation_time_s": 0.0005},
        {
            "sampling.period_us": 100,
            "safety.on_fault": {"hold_then_release": {"volts_v": 4.5, "after_s": 2e-4}},
        },
        {"rig.dac.bits": 8, "safety.on_fault": {"ramp": {"volts_v": 4.5, "rate_v_s": 4e6}}},
        {"model.drive_torque_nm": 1.0, "model.actuator.brake.gain_nm_v": 2.0, "safety.on_fault.hold.volts_v": 4.5},
    ],
    ids=lambda overrides: ", ".join(overrides),
)
def test_what_a_scenario_takes_its_parts_take(overrides):
    # Ranges that depend on period, encoder or converter are the scenario's to check.
    assert_nothing_is_lost(clutch.Scenario.load("board_smc_2", overrides))


# --- Random values -----------------------------------------------------------------------------------


def number(low, high):
    """Floats, or the whole numbers among them."""
    return st.floats(low, high) | st.integers(math.ceil(low), math.floor(high))


POSITIVE = st.floats(1e-3, 1e3)
GAIN = number(0, 1e6)
PERCENT = number(0, 99)
IN_128 = st.integers(1, 128)


@st.composite
def ripples(draw):
    spacing = draw(st.integers(1, 50))
    lowest = draw(st.integers(1, 100))
    waves = draw(st.integers(1, 64))
    rms = draw(st.floats(0, 0.6)) / math.sqrt(2 * waves)
    highest = spacing * (lowest + waves - 1)
    return {
        "rms": rms,
        "lowest_waves_per_turn": spacing * lowest,
        "highest_waves_per_turn": highest,
        "spacing_waves_per_turn": spacing,
    }


@st.composite
def hands(draw):
    low, high = sorted(draw(st.lists(st.floats(0, 50), min_size=2, max_size=2, unique=True)))
    return {
        "mean_nm": draw(st.floats(-1, 1)),
        "rms_nm": draw(number(0, 1)),
        "lowest_frequency_hz": low,
        "highest_frequency_hz": high,
    }


@st.composite
def converters(draw):
    low = draw(number(-100, 99))
    return {
        "bits": draw(st.integers(1, 16)),
        "lowest_v": low,
        "highest_v": low + draw(st.floats(0.1, 100)),
        "quantised": draw(st.booleans()),
    }


@st.composite
def outputs(draw):
    low, middle, high = sorted(draw(st.lists(st.floats(0, 100), min_size=3, max_size=3, unique=True)))
    return {
        "lowest_v": low,
        "on_invalid_v": middle,
        "highest_v": high,
        "bumpless_time_s": draw(number(0, 10)),
    }


@st.composite
def runs(draw):
    duration = draw(st.floats(0.1, 1e3))
    return {
        "duration_s": duration,
        "settle_s": draw(st.floats(0, 0.9)) * duration,
        "start": draw(st.sampled_from(["on_path", "rest"])),
        "start_counts": draw(st.none() | number(-1e8, 1e8)),
        "seed": draw(st.integers(0, 2**63 - 1)),
        "engine": draw(st.sampled_from(["auto", "exact_flow", "dormand_prince"])),
    }


@st.composite
def limits(draw):
    silence = draw(st.integers(2, 1000))
    return {
        "jump_deg": draw(st.floats(0.02, 1e3)),
        "good_samples": draw(st.integers(1, silence - 1)),
        "following_error_deg": draw(POSITIVE),
        "following_time_s": draw(number(0, 10)),
        "saturation_time_s": draw(st.floats(0.01, 1e3)),
        "edge_counts": draw(number(0, 100)),
        "grip_margin": draw(number(1, 100)),
        "delay_cycles": draw(st.integers(0, 1000)),
        "friction_margin": draw(number(1, 10)),
        **{name: draw(IN_128) for name in ["jumps", "lost", "late", "disorder", "overruns"]},
        "silence_cycles": silence,
        "watchdog_cycles": draw(st.integers(2, min(silence, 100))),
        "valid_cycles": draw(st.integers(1, 60)),
        "deadline_us": draw(st.integers(1, 10**6)),
    }


def points(value, least):
    """Points with rising times."""
    times = st.lists(st.integers(0, 10**6), min_size=least, max_size=6, unique=True).map(sorted)
    return times.flatmap(
        lambda t: st.lists(value, min_size=len(t), max_size=len(t)).map(
            lambda v: tuple((x / 1000, y) for x, y in zip(t, v, strict=True))
        )
    )


def each(**fields):
    """Keyword arguments of which each is drawn by itself."""
    return st.fixed_dictionaries(fields)


#: The keys of LuGre's and elasto-plastic bristles.
BRISTLES = {
    "mu_static": st.floats(0.1, 2),
    "mu_dynamic": st.floats(0.1, 2),
    "stribeck_velocity_rad_s": POSITIVE,
    "stribeck_exponent": POSITIVE,
    "stiffness_1_rad": POSITIVE,
    "damping_s_rad": number(0, 100),
}

FRICTION = each(
    mu_static=number(0, 2),
    mu_dynamic=number(0, 2),
    stribeck_velocity_rad_s=st.floats(1e-6, 10),
    stribeck_exponent=st.floats(0.1, 4),
).map(lambda d: d | {"mu_static": max(d["mu_static"], d["mu_dynamic"])})
VALID = {
    clutch.StribeckFriction: FRICTION,
    clutch.CoulombFriction: each(mu_static=st.floats(0.5, 2), mu_dynamic=st.floats(0, 0.5)),
    clutch.LugreFriction: each(**BRISTLES),
    clutch.DahlFriction: each(mu_dynamic=POSITIVE, stiffness_1_rad=POSITIVE),
    clutch.ElastoPlasticFriction: each(**BRISTLES, mu_elastic=st.floats(0.01, 0.09)),
    clutch.MaxwellFriction: each(
        **{key: strategy for key, strategy in BRISTLES.items() if key != "stiffness_1_rad"},
        **{f"stiffness_{element}_1_rad": POSITIVE for element in "abcdefgh"},
        **{f"share_{element}": st.floats(0, 0.14) for element in "abcefgh"},
        attraction_1_s=number(0, 1000),
    ),
    clutch.BrakeActuator: each(gain_nm_v=POSITIVE, preload_nm=number(0, 10)),
    clutch.BrakeGeometry: each(**dict.fromkeys(GEOMETRY, POSITIVE)),
    clutch.MotorActuator: each(gain_nm_v=POSITIVE, preload_nm=number(0, 10), load_share=number(0, 1)),
    clutch.BothActuator: each(brake_gain_nm_v=POSITIVE, motor_gain_nm_v=POSITIVE, preload_nm=number(0, 10)),
    clutch.Ripple: ripples(),
    clutch.Runout: each(amplitude=st.floats(0, 0.39), waves_per_turn=st.integers(1, 1000), phase_deg=number(-720, 720)),
    clutch.WeightDrive: each(
        mass_kg=POSITIVE,
        gravity_m_s2=POSITIVE,
        pulley_radius_m=POSITIVE,
        side=st.sampled_from(["forwards", "backwards"]),
    ),
    clutch.SpringDrive: each(stiffness_nm_rad=POSITIVE, rest_deg=number(-1e4, 1e4)),
    clutch.BeltDrive: each(stiffness_nm_rad=POSITIVE, damping_nm_s_rad=number(0, 10), speed_deg_s=number(-1e4, 1e4)),
    clutch.RampDrive: each(from_nm=number(-10, 10), rate_nm_s=number(-10, 10)),
    clutch.TableDrive: each(points_s_nm=points(st.floats(-10, 10), 1)),
    clutch.SineDrive: each(
        mean_nm=number(-1, 1), amplitude_nm=number(0, 1), frequency_hz=st.floats(1e-3, 1000), phase_turns=number(-1, 1)
    ),
    clutch.ChirpDrive: each(
        mean_nm=number(-1, 1),
        amplitude_nm=number(0, 1),
        from_hz=number(0, 1000),
        to_hz=number(0, 1000),
        duration_s=POSITIVE,
    ),
    clutch.HandDrive: hands(),
    clutch.Encoder: each(counts_per_rev=st.integers(4, 2**24), quantised=st.booleans()),
    clutch.Dac: converters(),
    clutch.Pd: each(kp_v_rad=GAIN, kd_v_s_rad=GAIN),
    clutch.Ctc: each(outer_gain=GAIN, kp_1_s2=GAIN, kd_1_s=GAIN),
    clutch.Smc: each(kp_v=GAIN, kd_v_s_rad=GAIN, slope_1_s=POSITIVE, boundary_rad_s=POSITIVE),
    clutch.SmcSign: each(kp_v=GAIN, kd_v_s_rad=GAIN, slope_1_s=POSITIVE),
    clutch.Voltage: each(
        start_v=number(-10, 10), end_v=number(-10, 10), rate_v_s=st.floats(0.1, 100), returns=st.booleans()
    ),
    clutch.HoldLaw: each(margin=st.floats(1, 10)),
    clutch.Pid: each(
        kp_v_rad=GAIN,
        ki_v_rad_s=GAIN,
        kd_v_s_rad=GAIN,
        derivative_time_s=number(0, 10),
        tracking_time_s=POSITIVE,
        bias_v=number(-10, 10),
        coulomb_v=number(-10, 10),
        velocity_v_s_rad=number(-10, 10),
        acceleration_v_s2_rad=number(-10, 10),
    ),
    clutch.SuperTwisting: each(
        k1_v_rt_s_rad=POSITIVE, k2_v_s=POSITIVE, slope_1_s=POSITIVE, boundary_rad_s=number(0, 10)
    ),
    clutch.SmcIntegral: each(
        kp_v=POSITIVE, kd_v_s_rad=GAIN, slope_1_s=POSITIVE, integral_1_s2=GAIN, boundary_rad_s=POSITIVE
    ),
    clutch.Dob: each(kp_1_s2=GAIN, kd_1_s=GAIN, bandwidth_rad_s=POSITIVE),
    clutch.Glide: each(
        kp_1_s=GAIN,
        kd_1_s=POSITIVE,
        floor=st.floats(0.34, 1),
        cap=st.floats(1, 100),
        optimism=st.floats(0, 10),
    ),
    clutch.EdgeTimed: each(
        delay_ticks=st.integers(0, 3),
        lag_s=number(0, 0.5),
        friction_doubt=st.floats(1e-3, 10),
        ripple_share=st.floats(1e-3, 1),
        ripple_waves_per_turn=st.floats(1, 900),
        ripple_damping=st.floats(1e-3, 1),
        walk_rad_s_rt_s=POSITIVE,
        gain_doubt=st.floats(0, 2),
        silence_counts=st.floats(1.5, 1000),
    ),
    clutch.Shell: each(slope_1_s=POSITIVE, boundary_rad_s=number(0, 10)),
    clutch.SmoothedDerivative: each(smoothing=st.floats(1e-6, 1)),
    clutch.CountsOverTime: each(least_time_s=st.floats(0, 10)),
    clutch.Observer: each(disturbance_walk_nm_rt_s=st.floats(1e-3, 10)),
    clutch.Output: outputs(),
    clutch.Hold: each(),
    clutch.Ramp: each(rate_deg_s=number(-360, 360)),
    clutch.Trapezoid: each(distance_deg=number(0, 1e4), speed_deg_s=POSITIVE, acceleration_deg_s2=POSITIVE),
    clutch.JerkLimited: each(
        distance_deg=number(0, 1e4),
        speed_deg_s=POSITIVE,
        acceleration_deg_s2=POSITIVE,
        jerk_deg_s3=POSITIVE,
    ),
    clutch.MinimumJerk: each(distance_deg=number(0, 1e4), duration_s=st.floats(0.1, 1e3)),
    clutch.Sine: each(
        rate_deg_s=number(-360, 360),
        amplitude_deg=number(0, 1e3),
        frequency_hz=number(0, 100),
        phase_turns=number(-1, 1),
    ),
    clutch.Chirp: each(
        rate_deg_s=number(-360, 360),
        amplitude_deg=number(0, 1e3),
        from_hz=number(0, 100),
        to_hz=number(0, 100),
        duration_s=st.floats(0.1, 1e3),
        phase_turns=number(-1, 1),
    ),
    clutch.TablePath: each(
        points_s_deg=points(st.floats(-1e4, 1e4), 2), interpolation=st.sampled_from(["cubic", "linear"])
    ),
    clutch.FrictionMap: each(
        rig=st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20).map(lambda text: f"disc {text}"),
        points_deg_factor=st.lists(number(0.2, 5), min_size=4, max_size=40).map(
            lambda factors: tuple((0.5 * i, factor) for i, factor in enumerate(factors))
        ),
    ),
    clutch.Sampling: each(period_us=st.integers(1, 10**6), scalar=st.sampled_from(["f32", "f64"])),
    clutch.Bounds: each(
        inertia_percent=PERCENT,
        drive_torque_percent=PERCENT,
        viscous_damping_percent=PERCENT,
        brake_gain_percent=PERCENT,
        motor_gain_percent=PERCENT,
        friction_percent=PERCENT,
        reach_rate_rad_s2=number(0, 100),
    ),
    clutch.RunOptions: runs(),
    clutch.HoldVoltage: each(volts_v=st.floats(0.1, 9) | st.integers(1, 9)),
    clutch.RampVoltage: each(rate_v_s=st.floats(1, 1e3), volts_v=st.floats(0.1, 9) | st.integers(1, 9)),
    clutch.Release: each(),
    clutch.HoldThenRelease: each(volts_v=st.floats(0.1, 9) | st.integers(1, 9), after_s=st.floats(0.1, 1e3)),
    clutch.Limits: limits(),
}


def objects(*classes):
    """Objects of one of these classes with random valid parameters."""
    return st.one_of(*(VALID[c].map(lambda values, c=c: c(**values)) for c in classes))


FRICTIONS = [
    clutch.StribeckFriction,
    clutch.CoulombFriction,
    clutch.LugreFriction,
    clutch.DahlFriction,
    clutch.ElastoPlasticFriction,
    clutch.MaxwellFriction,
]

VALID[clutch.Rig] = each(
    inertia_kg_m2=POSITIVE,
    viscous_damping_nm_s_rad=number(0, 10),
    actuator=objects(clutch.BrakeActuator, clutch.BrakeGeometry, clutch.MotorActuator, clutch.BothActuator),
    torque_noise_nm=number(0, 1),
    delay_ticks=st.integers(0, 1000),
    actuator_time_constant_s=st.none() | POSITIVE,
    speed_limit_deg_s=POSITIVE,
    friction=objects(*FRICTIONS),
    ripple=st.none() | objects(clutch.Ripple),
    runout=st.none() | objects(clutch.Runout),
    drive=objects(
        clutch.WeightDrive,
        clutch.SpringDrive,
        clutch.BeltDrive,
        clutch.TableDrive,
        clutch.RampDrive,
        clutch.SineDrive,
        clutch.ChirpDrive,
        clutch.HandDrive,
    ),
    encoder=objects(clutch.Encoder),
    dac=objects(clutch.Dac),
)
VALID[clutch.Model] = each(
    inertia_kg_m2=POSITIVE,
    drive_torque_nm=POSITIVE,
    viscous_damping_nm_s_rad=number(0, 10),
    actuator=objects(clutch.BrakeActuator, clutch.BrakeGeometry, clutch.MotorActuator, clutch.BothActuator),
    friction=objects(*FRICTIONS),
)
VALID[clutch.Safety] = each(
    reason=st.text(st.characters(exclude_categories=["Cs", "Cc", "Z"]), min_size=1),
    on_fault=objects(clutch.HoldVoltage, clutch.RampVoltage, clutch.Release, clutch.HoldThenRelease),
    limits=objects(clutch.Limits),
)


@pytest.mark.parametrize("cls", CLASSES, ids=named)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(data=st.data())
def test_random_parameters_come_back_from_repr_pickle_and_tables(cls, data):
    values = data.draw(VALID[cls])
    made = cls(**values)
    for name, value in values.items():
        assert getattr(made, name) == value
    assert_nothing_is_lost(made)
    checked = _clutch.check(cls._key, cls.__name__, made._tables())
    assert cls._build(checked) == made


ANYTHING = st.one_of(
    st.floats(),
    st.integers(),
    st.integers(-(10**30), 10**30),
    st.text(max_size=5),
    st.text(st.characters(categories=["Cs"]), min_size=1, max_size=2),
    st.booleans(),
    st.none(),
    st.binary(max_size=3),
    st.complex_numbers(),
    st.lists(st.floats() | st.text(max_size=2) | st.none(), max_size=3),
    st.lists(st.tuples(st.floats(), st.floats()), max_size=3),
    st.dictionaries(st.text(max_size=3), st.floats(), max_size=2),
    st.builds(object),
    st.just(clutch.Pd()),
    st.floats().map(np.float64),
    st.integers(-(2**31), 2**31 - 1).map(np.int32),
    st.just(np.datetime64("2020-01-01")),
    st.just(np.zeros((2, 2, 2))),
    st.just(np.array([object()])),
    st.just(np.float64),
    st.just(clutch.Smc),
)


@pytest.mark.parametrize("cls", [c for c in CLASSES if dataclasses.fields(c)], ids=named)
@settings(max_examples=100, deadline=None, derandomize=True)
@given(data=st.data())
def test_random_values_are_taken_or_refused_by_name_and_nothing_else(cls, data):
    names = [f.name for f in dataclasses.fields(cls)]
    name = data.draw(st.sampled_from(names))
    value = data.draw(ANYTHING)
    try:
        made = cls(**REQUIRED[cls] | {name: value})
    except clutch.ParamError as error:
        # A bound may be what does not fit its neighbour: then the neighbour is named.
        assert error.field in names
        assert error.field in str(error)
    else:
        assert_nothing_is_lost(made)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    kp=st.floats(0, 100),
    kd=st.floats(0, 1e4),
    rate=st.floats(0.5, 100),
    percent=st.floats(0, 50),
    seed=st.integers(0, 2**63 - 1),
)
def test_random_scenarios_come_back_from_their_text(kp, kd, rate, percent, seed):
    scenario = clutch.Scenario(
        law=clutch.Smc(kp_v=kp, kd_v_s_rad=kd),
        reference=clutch.Ramp(rate_deg_s=rate),
        bounds=clutch.Bounds(friction_percent=percent),
        run=clutch.RunOptions(seed=seed),
    )
    assert clutch.Scenario.from_toml(scenario.to_toml()) == scenario
    keys = {
        "law.smc.kp_v": kp,
        "law.smc.kd_v_s_rad": kd,
        "reference.ramp.rate_deg_s": rate,
        "bounds.friction_percent": percent,
        "run.seed": seed,
    }
    base = clutch.Scenario(law=clutch.Smc(), reference=clutch.Ramp(rate_deg_s=1))
    assert base.override(keys) == scenario


# --- Override, replace, errors -----------------------------------------------------------------------


@pytest.mark.parametrize("name", clutch.scenarios())
def test_every_built_in_scenario_takes_overrides(name):
    scenario = clutch.Scenario.load(name)
    other = scenario.override({"run.seed": 7, "name": "other"})
    assert other == scenario.replace(run=scenario.run.replace(seed=7), name="other")
    assert clutch.Scenario.load(name, {"run.seed": 7, "name": "other"}) == other
    assert scenario.override({}) == scenario


def test_an_override_may_change_an_alternative_and_the_rig_below_all():
    scenario = clutch.Scenario.load("smc_2")
    assert scenario.override({"law": {"pd": {"kp_v_rad": 4000}}}).law == clutch.Pd(kp_v_rad=4000)
    assert scenario.override({"rig.base": "bench"}).rig == clutch.Rig.bench()
    back = scenario.override({"rig.base": "bench"}).override({"rig.base": "paper"})
    assert back == scenario
    mixed = scenario.override({"rig.delay_ticks": 3, "rig.base": "bench"})
    assert mixed.rig == clutch.Rig.bench().replace(delay_ticks=3)
    assert clutch.Scenario.load("smc_2", {"rig.delay_ticks": 3, "rig.base": "bench"}) == mixed


def test_a_motor_that_is_too_weak_is_told_what_takes_most_of_it():
    motor = clutch.Scenario.load("motor_pid")
    preload = {"rig.actuator.motor.preload_nm": 20, "model.actuator.motor.preload_nm": 20}
    with pytest.raises(clutch.ParamError) as dragged:
        motor.override(preload)
    assert "lower rig.actuator.motor.preload_nm and model.actuator.motor.preload_nm, raise" in str(dragged.value)
    assert "hang" not in str(dragged.value) and "accelerate" not in str(dragged.value)
    hung = {"rig.drive": {"weight": {"mass_kg": 5}}, "model.drive_torque_nm": 1.177}
    with pytest.raises(clutch.ParamError) as loaded:
        motor.override(hung)
    assert "hang less on it" in str(loaded.value) and "preload" not in str(loaded.value)
    # The most that it needs on its way suffices.
    most = float(
        re.search(r"up to (-[0-9.]+) V later, .* lower output.lowest_v and rig.dac.lowest_v", str(loaded.value))[1]
    )
    motor.override(hung | {"output.lowest_v": most - 0.001, "rig.dac.lowest_v": most - 0.001})
    with pytest.raises(clutch.ParamError):
        motor.override(hung | {"output.lowest_v": most + 0.001, "rig.dac.lowest_v": most - 0.001})


def test_overrides_that_are_no_mapping_are_refused():
    with pytest.raises(TypeError, match=r"overrides = 'smc_2': expected a mapping of dotted keys to values"):
        clutch.Scenario.load("smc_2").override("smc_2")


def test_overrides_take_numpys_values():
    scenario = clutch.Scenario.load("smc_2").override({"law.smc.kp_v": np.float64(4), "run.seed": np.int64(3)})
    assert (scenario.law.kp_v, scenario.run.seed) == (4.0, 3)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("law.smc.kp_v", -1.0),
        ("law.smc.kp_v", "high"),
        ("law.smc.kp_v", math.nan),
        ("law.smc.kp_v", None),
        ("law.smc.kp_v", object()),
        ("law.smc.kp", 4.0),
        ("law.smd.kp_v", 4.0),
        ("lav.smc.kp_v", 4.0),
        ("rig.base", "papper"),
        ("run.seed", 2**63),
        ("run.seed", -1),
    ],
)
def test_a_bad_override_is_a_param_error_that_names_it(key, value):
    scenario = clutch.Scenario.load("smc_2")
    for make in (
        lambda: scenario.override({key: value}),
        lambda: clutch.Scenario.load("smc_2", {key: value}),
    ):
        with pytest.raises(clutch.ParamError) as caught:
            make()
        assert caught.value.field
        assert key.startswith(caught.value.field)


def test_text_that_is_no_scenario_is_a_param_error():
    for text in ["", "[rig", "name = 3", 'name = "x"\n[rig]\nbase = "paper"']:
        with pytest.raises(clutch.ParamError):
            clutch.Scenario.from_toml(text)


def test_a_missing_file_is_a_file_not_found_error(tmp_path):
    with pytest.raises(FileNotFoundError, match="no built-in scenario"):
        clutch.Scenario.load("nosuch")
    with pytest.raises(OSError, match=str(tmp_path)):
        clutch.Scenario.load(tmp_path)


def test_replace_checks():
    scenario = clutch.Scenario.load("smc_2")
    assert scenario.replace(law=clutch.Pd()).law == clutch.Pd()
    with pytest.raises(clutch.ParamError):
        scenario.replace(law=None)
    with pytest.raises(TypeError):
        scenario.replace(lav=clutch.Pd())
    with pytest.raises(clutch.ParamError) as caught:
        clutch.Smc().replace(boundary_rad_s=0)
    assert (caught.value.field, caught.value.value) == ("boundary_rad_s", 0)


def test_a_param_error_is_a_value_error_that_pickles():
    error = clutch.ParamError("kp_v = -1: expected at least 0", "kp_v", -1.0)
    assert isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.field, again.value) == (
        clutch.ParamError,
        str(error),
        "kp_v",
        -1.0,
    )
    plain = clutch.ParamError("something")
    assert (plain.field, plain.value) == ("", None)


# --- Physics that is asked of an object --------------------------------------------------------------


def test_friction_is_stribecks_curve_in_any_shape():
    friction = clutch.StribeckFriction(mu_static=0.3, mu_dynamic=0.1, stribeck_velocity_rad_s=0.01, stribeck_exponent=2)
    velocity = np.linspace(-0.05, 0.05, 24).reshape(2, 3, 4)
    curve = (0.1 + 0.2 * np.exp(-((velocity / 0.01) ** 2))) * np.sign(velocity)
    assert friction.coefficient(velocity).shape == (2, 3, 4)
    np.testing.assert_allclose(friction.coefficient(velocity), curve, rtol=1e-14)
    # Neither order, type nor stride of the array matters.
    np.testing.assert_array_equal(friction.coefficient(velocity.T), friction.coefficient(velocity).T)
    np.testing.assert_array_equal(friction.coefficient(velocity[:, ::2]), friction.coefficient(velocity)[:, ::2])
    np.testing.assert_array_equal(friction.coefficient([1, 0, -1]), [0.1, 0.0, -0.1])
    assert friction.coefficient([]).shape == (0,)
    assert isinstance(friction.coefficient(0.01), float)
    assert friction.coefficient(0.01) == pytest.approx(0.1 + 0.2 / math.e, rel=1e-14)
    velocity.setflags(write=False)
    friction.coefficient(velocity)
    for bad in ["fast", object(), [[1.0], [1.0, 2.0]]]:
        with pytest.raises(clutch.ParamError) as caught:
            friction.coefficient(bad)
        assert caught.value.field == "velocity_rad_s"


def test_a_geometry_has_the_gain_of_18_and_a_rig_takes_it():
    brake = clutch.BrakeGeometry(**GEOMETRY)
    g = GEOMETRY
    gain = g["inner_radius_m"] * g["torque_constant_nm_a"] * g["pad_area_m2"]
    gain /= g["lever_area_m2"] * g["armature_resistance_ohm"] * g["contact_radius_m"]
    assert brake.brake_gain_nm_v == pytest.approx(gain, rel=1e-14)
    rig = clutch.Rig(actuator=brake)
    assert rig.actuator == brake
    assert rig._tables()["actuator"] == {"geometry": GEOMETRY}
    scenario = clutch.Scenario(law=clutch.Pd(), reference=clutch.Ramp(rate_deg_s=20), rig=rig)
    assert clutch.Scenario.from_toml(scenario.to_toml()).rig.actuator == brake


# --- Certificate and path ----------------------------------------------------------------------------


def test_a_certificate_says_what_the_command_prints(request):
    command = request.getfixturevalue("clutch")
    for name in clutch.scenarios():
        done = command("certify", name, "--json", code=None)
        printed = json.loads(done.stdout)
        certificate = clutch.Scenario.load(name).certificate()
        assert json.loads(json.dumps(dataclasses.asdict(certificate))) == printed, name
        assert bool(certificate) == (done.returncode == 0)
        assert certificate.certified_continuous_time or not certificate


def test_a_certificate_comes_back_from_repr_pickle_and_replace():
    for name in ["smc_2", "ctc_2", "bench_smc_2"]:
        certificate = clutch.Scenario.load(name).certificate()
        assert_nothing_is_lost(certificate)
        assert not certificate.replace(certified_continuous_time=False)
        assert certificate.replace(law="mine") != certificate


def test_the_error_of_the_sampled_loop_is_bounded_as_by_the_command(request, tmp_path):
    command = request.getfixturevalue("clutch")
    scenario, saved = clutch.Scenario.load("pd_2"), tmp_path / "pd.json"
    printed = json.loads(command("certify", "pd_2", "--sampled", "--json").stdout)
    certificate = scenario.certificate(sampled=True, save=saved)
    assert json.loads(json.dumps(dataclasses.asdict(certificate))) == printed
    assert certificate
    assert certificate.sampled.looked_for
    assert 0 < certificate.sampled.error_bound_rad < math.radians(0.1)
    assert scenario.certificate(check=saved) == certificate
    assert_nothing_is_lost(certificate)
    # Not looked for, there is none.
    assert scenario.certificate().sampled.error_bound_rad is None
    # The proof is of these gains alone.
    with pytest.raises(ValueError, match="another loop's"):
        scenario.override({"law.pd.kp_v_rad": 4000}).certificate(check=saved)
    # Certified in continuous time, and unstable as sampled.
    unstable = clutch.Scenario.load("bench_pd_2").certificate(sampled=True, save=tmp_path / "none.json")
    assert unstable.certified_continuous_time
    assert not unstable
    assert "unstable" in unstable.sampled.reason
    assert not (tmp_path / "none.json").exists()


def test_a_file_of_a_proof_that_cannot_be_is_refused(tmp_path):
    scenario = clutch.Scenario.load("pd_2")
    with pytest.raises(ValueError, match="sampled=True"):
        scenario.certificate(save=tmp_path / "pd.json")
    with pytest.raises(ValueError, match="without sampled=True"):
        scenario.certificate(sampled=True, check=tmp_path / "pd.json")
    with pytest.raises(FileNotFoundError, match=r"pd\.json"):
        scenario.certificate(check=tmp_path / "pd.json")
    with pytest.raises(ValueError, match="its folder does not exist"):
        scenario.certificate(sampled=True, save=tmp_path / "no" / "pd.json")
    (tmp_path / "pd.json").write_text("{}")
    with pytest.raises(ValueError, match=r"pd\.json: no certificate"):
        scenario.certificate(check=tmp_path / "pd.json")


def test_a_gain_too_small_is_not_certified_and_the_one_asked_for_is():
    bounds = clutch.Bounds(friction_percent=20, brake_gain_percent=20, drive_torque_percent=10)
    scenario = clutch.Scenario.load("smc_2").replace(bounds=bounds)
    refused = scenario.certificate()
    assert not refused
    assert "K_p" in refused.reason
    # (A1) + (A2) at the worst corner.
    brake = 0.8 * 0.15 * 0.8 * 0.14
    c = 0.0017 * 70 / brake
    assert refused.ahead.kp_required_v == pytest.approx(1.1 * 0.047088 / brake + c * c / 1600, rel=1e-12)
    enough = scenario.override({"law.smc.kp_v": refused.ahead.kp_required_v})
    assert enough.certificate()
    assert enough.certificate().reason is None
    assert clutch.Scenario.load("pd_2").certificate().paper is None


def test_a_path_is_the_planned_one():
    path = clutch.Scenario.load("smc_2").path()
    target = path.at(1000)
    assert target.velocity_rad_s == pytest.approx(math.radians(2), rel=1e-9)
    way = target.position_counts - path.at(0).position_counts
    assert way == pytest.approx(2 / 360 * 20_000, abs=1e-3)
    assert len(path) >= 5000


def test_a_notebook_shows_every_part_and_escapes_texts():
    scenario = clutch.Scenario.load("board_smc_2").replace(name="<b>&")
    shown = scenario._repr_html_()
    assert "&lt;b&gt;&amp;" in shown
    assert "<b>" not in shown
    for text in ["Smc", "kp_v", "3.0", "friction.mu_static", "on_fault.volts_v", "a weight drives the shaft"]:
        assert text in shown
    assert "safety" not in clutch.Scenario.load("smc_2")._repr_html_()


# --- Documentation -----------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [_errors, _mixins, _model, _tables], ids=lambda m: m.__name__)
def test_examples_in_the_documentation_are_true(module):
    found = doctest.testmod(module)
    assert found.attempted > 0
    assert found.failed == 0


def test_every_class_method_and_field_is_documented():
    nested = [c for c in vars(clutch.Certificate).values() if inspect.isclass(c)]
    for cls in [*CLASSES, clutch.Scenario, clutch.Certificate, *nested]:
        # A value that must be given cannot be made up: an example shows it where there is one.
        assert ">>>" in cls.__doc__ or REQUIRED.get(cls), cls
        for f in dataclasses.fields(cls):
            assert f"\n{f.name} : " in inspect.getdoc(cls), (cls, f.name)
        for name, member in vars(cls).items():
            if not name.startswith("_") and isinstance(member, classmethod | property | type(named)):
                assert ">>>" in inspect.getdoc(getattr(cls, name) if callable(member) else member), name
