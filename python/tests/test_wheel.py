"""The package is the Rust code: the same bits as the command, whatever way they are asked for."""

import ast
import copy
import importlib
import inspect
import json
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clutch as package

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = package.scenarios()
# The command that comes with the package.
COMMAND = Path(sys.executable).with_name("clutch")


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_run_is_that_of_the_command_bit_for_bit(clutch, name):
    summary, csv = clutch.simulate(name)
    run = package.simulate(name)
    for column in csv.dtype.names:
        ours = run.samples[column]
        # The CSV has all digits: equal numbers are equal bits, but for the sign of zero.
        assert np.array_equal(csv[column], ours.astype(float)), f"{name}: {column} differs"
    figures = {**summary["metrics"], **{f"detected_{k}": v for k, v in summary["detected"].items()}}
    assert figures == {k: getattr(run.metrics, k) for k in figures}
    assert run.engine == summary["engine"]


@pytest.mark.parametrize("name", SCENARIOS)
def test_law_and_plant_stepped_by_hand_are_the_simulation_bit_for_bit(name):
    scenario = package.Scenario.load(name).override({"run.duration_s": 2.0, "run.settle_s": 0.5})
    run = package.simulate(scenario)
    law, plant, path = package.Servo(scenario), package.Plant(scenario), scenario.path()
    columns = ("counts", "voltage_v", "demand_v", "limit", "position_rad", "velocity_rad_s", "stuck", "code")
    seen = {column: [] for column in columns}
    for tick in range(len(path)):
        seen["counts"].append(plant.counts)
        seen["position_rad"].append(plant.position)
        seen["velocity_rad_s"].append(plant.velocity)
        seen["stuck"].append(plant.stuck)
        voltage = law.step(plant.counts, path.at(tick))
        seen["voltage_v"].append(voltage)
        seen["code"].append(law.code)
        seen["demand_v"].append(law.demand)
        seen["limit"].append(law.limit)
        plant.step(voltage)
    for column, values in seen.items():
        assert run.samples[column].tolist() == values, f"{name}: {column} differs"
    assert plant.events() == run.events


# Parameters of functions with the same option of the command.
DEFAULTS = [
    (package.loop, "release_test", "loop", "--release-test"),
    (package.loop, "release_deg", "loop", "--release-deg"),
    (package.loop, "on_drift", "loop", "--on-drift"),
    (package.loop, "pace", "loop", "--pace"),
    (package.loop, "wait", "loop", "--wait"),
    (package.loop, "spin_us", "loop", "--spin-us"),
    (package.loop, "thread_priority", "loop", "--thread-priority"),
    (package.loop, "fault_seed", "loop", "--fault-seed"),
    (package.tune, "candidates", "tune", "--candidates"),
    (package.lowest_smooth_speed, "discs", "map", "--discs"),
]


@pytest.mark.parametrize(
    ("function", "parameter", "verb", "option"), DEFAULTS, ids=[f"{row[2]} {row[3]}" for row in DEFAULTS]
)
def test_a_default_and_the_words_of_a_choice_are_those_of_the_command(clutch, function, parameter, verb, option):
    text = clutch(verb, "--help").stdout
    text = re.split(rf"^ +{option} <", text, flags=re.MULTILINE)[1]
    text = re.split(r"^ +(?:-\w, )?--\w", text, flags=re.MULTILINE)[0]
    default = inspect.signature(function).parameters[parameter].default
    assert re.search(r"\[default: (\S+)\]", text)[1] == str(default)
    words = re.findall(r"^ +- (\w+):", text, re.MULTILINE)
    if words:
        assert re.findall(r"['\"](\w+)['\"]", function.__annotations__[parameter]) == words


def test_the_meter_tells_none_where_counts_and_voltage_cannot_tell():
    few = {"reference.ramp.rate_deg_s": 0.5, "rig.encoder.counts_per_rev": 2000}
    blind = package.simulate("bench_pd_2", overrides=few).metrics
    assert blind.stick_slip_cycles_per_s > 1.0 and blind.detected_stick_slip_cycles_per_s == 0.0
    assert blind.detected_told_cycles_per_s is None
    assert blind.detected_least_cycles_per_s == 0.0 < blind.detected_most_cycles_per_s
    smooth = package.simulate("bench_glide_2").metrics
    assert smooth.detected_told_cycles_per_s == smooth.detected_most_cycles_per_s == 0.0


@pytest.mark.parametrize("name", ["pd_2", "bench_smc_2"])
def test_stick_slip_detected_by_hand_is_that_of_the_simulation(name):
    scenario = package.Scenario.load(name).override({"run.duration_s": 2.0, "run.settle_s": 0.0})
    run = package.simulate(scenario)
    sticks = package.StickSlip(scenario)
    begun = 0
    for counts, velocity in zip(run.samples["counts"], run.samples["target_velocity_rad_s"], strict=True):
        begun += sticks.update(counts, velocity)
    assert begun == sticks.cycles > 5
    assert sticks.cycles / 2.0 == pytest.approx(run.metrics.detected_stick_slip_cycles_per_s, rel=1e-12)
    assert sticks.stuck_ticks / 2000 == pytest.approx(run.metrics.detected_stick_time_fraction, rel=1e-12)
    with pytest.raises(ValueError, match=r"counts = 0.5: expected a whole number"):
        sticks.update(0.5, 0.1)


@pytest.mark.parametrize("rig", ["paper", "ideal"])
def test_an_ideal_sensor_and_converter_are_stepped_by_hand_as_simulated(rig):
    scenario = package.Scenario.load("smc_2", {"rig.base": rig, "run.duration_s": 1.5, "run.engine": "dormand_prince"})
    law, plant, path = package.Servo(scenario), package.Plant(scenario), scenario.path()
    volts = []
    for tick in range(len(path)):
        volts.append(law.step(plant.counts, path.at(tick)))
        plant.step(volts[-1])
    assert package.simulate(scenario).samples["voltage_v"].tolist() == volts


def test_our_own_law_written_in_python_gives_the_same_run():
    scenario = package.Scenario.load("pd_2")
    gains = scenario.law

    def law(tick):
        # (4) with the brake's sign: ahead of the target (e < 0) it brakes.
        return -(gains.kp_v_rad * tick.error + gains.kd_v_s_rad * tick.error_rate)

    ours, theirs = package.simulate(scenario), package.simulate(scenario, law=law)
    assert ours.samples["voltage_v"].tolist() == theirs.samples["voltage_v"].tolist()
    assert ours.events == theirs.events


def test_an_exception_in_a_python_law_ends_the_run_with_it():
    asked = []

    def broken_at_once(tick):
        asked.append(tick.time)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        package.simulate("pd_2", law=broken_at_once, overrides={"run.duration_s": 3600})
    assert asked == [0.0]

    def broken(tick):
        if tick.time > 0.5:
            raise LookupError("no such gain")
        return 2.0

    with pytest.raises(LookupError, match="no such gain"):
        package.simulate("pd_2", law=broken)
    with pytest.raises(TypeError, match=r"answered None at t = 0 s: expected a voltage"):
        package.simulate("pd_2", law=lambda tick: None)


def test_what_a_python_law_asks_for_is_limited_as_the_scenario_says():
    run = package.simulate("pd_2", law=lambda tick: 1e9 if tick.time < 2 else float("nan"))
    assert set(run.samples["voltage_v"]) <= {run.samples["voltage_v"].max()}
    assert run.samples["voltage_v"].max() <= 10.0
    assert set(run.samples["limit"][:1000]) == {2} and set(run.samples["limit"][-1000:]) == {3}


# --- Single and double precision ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["pd_2", "smc_2", "bench_smc_2", "minimum_jerk"])
def test_single_precision_follows_double_within_an_encoder_count(name):
    """The law rounds to 24 bits; the loop is chaotic in the counts, so figures are compared, and errors in counts."""
    in_double = package.Scenario.load(name).override({"sampling.scalar": "f64"})
    in_single = in_double.override({"sampling.scalar": "f32"})

    def rms_error(scenario):
        seeds = package.sweep(scenario, {"run.seed": range(1, 17)})
        return np.mean(seeds.table["rms_error_rad"])

    count = 2 * np.pi / 20_000
    apart = abs(rms_error(in_double) - rms_error(in_single))
    assert apart < 0.5 * count, f"RMS errors {apart / count:.2f} counts apart"
    # Until the first count that is read otherwise: one unit of the converter at most.
    double, single = package.simulate(in_double), package.simulate(in_single)
    same = double.samples["counts"] == single.samples["counts"]
    until = len(same) if same.all() else int(np.argmin(same))
    codes = double.samples["code"][:until].astype(int) - single.samples["code"][:until].astype(int)
    assert until >= 100
    assert np.abs(codes).max() <= 1, "a code differs by more than one step before the counts do"


# --- Tables ---------------------------------------------------------------------------------------


def test_a_column_is_the_runs_own_memory_and_read_only():
    samples = package.simulate("smc_2").samples
    first, again = samples["position_rad"], samples["position_rad"]
    assert first.__array_interface__["data"] == again.__array_interface__["data"]
    assert not first.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        first[0] = 1.0


def test_arrow_polars_and_pandas_see_the_same_memory():
    import polars as pl
    import pyarrow as pa

    samples = package.simulate("smc_2").samples
    where = samples["position_rad"].__array_interface__["data"][0]
    table = pa.table(samples)
    assert table.num_rows == len(samples) and table.column_names == samples.columns
    assert table["position_rad"].chunk(0).buffers()[1].address == where
    series = pl.DataFrame(samples)["position_rad"]
    assert series.to_numpy(allow_copy=False).__array_interface__["data"][0] == where
    frame = samples.to_pandas()
    assert frame["position_rad"].to_numpy().__array_interface__["data"][0] == where
    assert samples.to_xarray("time_s")["position_rad"].to_numpy().__array_interface__["data"][0] == where


def test_a_column_outlives_its_run():
    column = package.simulate("smc_2").samples["error_rad"]
    total = column.sum()
    for _ in range(20):
        package.simulate("pd_2")
    assert column.sum() == total


def test_a_table_takes_any_array_and_names_what_it_cannot_take():
    plain = np.arange(6, dtype=np.float64)
    raw = np.zeros(6 * 8 + 1, dtype=np.uint8)[1:].view(np.float64)  # misaligned
    raw[:] = plain
    locked = plain.copy()
    locked.flags.writeable = False
    table = package.Table(
        {
            "stride": np.repeat(plain, 2)[::2],
            "reversed": plain[::-1],
            "single": plain.astype(np.float32),
            "swapped": plain.astype(">f8"),
            "misaligned": raw,
            "locked": locked,
            "list": [0, 1, 2, 3, 4, 5],
            "flag": plain > 2,
            "word": ["a", "b", "c", "d", "e", "f"],
        }
    )
    for name in ("stride", "single", "swapped", "misaligned", "locked", "list"):
        assert table[name].tolist() == plain.tolist(), name
    assert table["reversed"].tolist() == plain[::-1].tolist()
    assert table["word"] == ["a", "b", "c", "d", "e", "f"]
    pandas = pytest.importorskip("pandas")
    series = package.Table({"x": pandas.Series(plain), "word": pandas.Series(["a"] * 6)})
    assert (series["x"].tolist(), series["word"]) == (plain.tolist(), ["a"] * 6)
    for bad, match in (
        ({"x": np.zeros((2, 2))}, r'column "x" has the shape \(2, 2\): expected one dimension'),
        ({"x": np.zeros(2), "y": np.zeros(3)}, r'column "y" has 3 rows: expected 2, as many as column "x"'),
        ({"x": np.zeros(2, dtype=complex)}, r'column "x" has the dtype complex128: expected numbers'),
        ({"x": np.array([2**64 - 1], dtype=np.uint64)}, r'column "x" has numbers above 2\^63'),
        ({"x": np.ma.masked_array([1.0, 2.0], mask=[True, False])}, r'column "x" has a mask'),
        ({"x": [1, "a"]}, r'column "x" mixes texts with other values'),
        ({"x": np.array([None, 1])}, r'column "x" mixes texts with other values'),
    ):
        with pytest.raises(ValueError, match=match):
            package.Table(bad)
    assert package.Table({"x": ["a\0", ""]})["x"] == ["a\0", ""]
    assert 5 not in table and "flag" in table
    with pytest.raises(KeyError, match="nothing: expected one of the columns stride"):
        table["nothing"]


@pytest.mark.parametrize("clone", [copy.copy, copy.deepcopy, lambda t: pickle.loads(pickle.dumps(t))])
def test_a_table_comes_back_from_a_copy_with_its_types(clone):
    samples = package.simulate("smc_2").samples
    there = clone(samples)
    assert there == samples
    assert [there[c].dtype for c in there.columns] == [samples[c].dtype for c in samples.columns]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(), max_size=20))
def test_a_table_keeps_every_float_bit_for_bit(values):
    table = package.Table({"x": np.array(values, dtype=float)})
    assert table["x"].tobytes() == np.array(values, dtype=float).tobytes()
    assert pickle.loads(pickle.dumps(table)) == table


# --- Logs -----------------------------------------------------------------------------------------


def test_a_saved_run_is_the_log_that_the_command_writes_and_replays_identically(clutch, tmp_path):
    package.simulate("smc_2").save(tmp_path / "ours.mcap")
    clutch("sim", "smc_2", "--log", tmp_path / "theirs.mcap")
    ours, theirs = package.read_log(tmp_path / "ours.mcap"), package.read_log(tmp_path / "theirs.mcap")
    assert ours.channels == theirs.channels and ours.complete
    assert ours.metadata["law_hash"] == theirs.metadata["law_hash"]
    replayed = package.replay(ours)
    assert replayed.identical and replayed.ticks == 5000
    assert replayed.commands == ours.channels["command"]
    changed = package.replay(ours, {"law.smc.kp_v": 4})
    assert not changed.identical and changed.first.tick >= 0
    assert clutch("replay", tmp_path / "ours.mcap").stdout.endswith("\nidentical over 5000 ticks\n")


def test_the_columns_of_a_log_are_those_that_any_mcap_reader_finds(clutch, tmp_path):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    log = tmp_path / "loop.mcap"
    clutch("loop", "--duration", "2", "--log", log)
    ours = package.read_log(log)
    with log.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        messages = {}
        for _, channel, _, message in reader.iter_decoded_messages():
            messages.setdefault(channel.topic.strip("/"), []).append(message)
    assert set(ours.channels) == set(messages) - {"parameters"}
    for name, table in ours.channels.items():
        fields = messages[name][0].DESCRIPTOR.fields
        assert table.columns == ["time_s", *(f.name for f in fields)], name
        assert len(table) == len(messages[name])
        terms = {"surface_rad_s", "switching_v", "damping_v"} if name == "command" else set()
        assert {f.name for f in fields if f.has_presence} == terms
        for field in fields:
            # A busy machine wakes the loop too late: a command that a newer sample superseded has no terms.
            has = [not field.has_presence or m.HasField(field.name) for m in messages[name]]
            theirs = [getattr(m, field.name) if there else np.nan for m, there in zip(messages[name], has, strict=True)]
            if field.enum_type is not None:
                theirs = [field.enum_type.values_by_number[x].name for x in theirs]
            np.testing.assert_array_equal(table[field.name], theirs, f"{name}.{field.name}")


def test_a_log_is_never_written_over(tmp_path):
    run = package.simulate("smc_2")
    run.save(tmp_path / "run.mcap")
    with pytest.raises(FileExistsError, match="never overwritten"):
        run.save(tmp_path / "run.mcap")
    with pytest.raises(OSError, match=r"nowhere"):
        run.save(tmp_path / "nowhere" / "run.mcap")


def test_what_is_no_log_is_told(tmp_path):
    with pytest.raises(FileNotFoundError):
        package.read_log(tmp_path / "nothing.mcap")
    with pytest.raises(OSError):
        package.read_log(tmp_path)
    (tmp_path / "text.mcap").write_text("no log")
    with pytest.raises(ValueError, match="not a log of clutch"):
        package.read_log(tmp_path / "text.mcap")


# --- Errors ---------------------------------------------------------------------------------------


def test_errors_name_field_and_value():
    with pytest.raises(package.ParamError) as caught:
        package.simulate("smc_2", overrides={"law.smc.kp_v": -1})
    assert (caught.value.field, caught.value.value) == ("law.smc.kp_v", -1)
    with pytest.raises(package.ParamError, match="did you mean kp_v") as caught:
        package.simulate("smc_2", overrides={"law.smc.kp": 1})
    assert caught.value.field == "law.smc.kp"
    with pytest.raises(FileNotFoundError, match="no built-in scenario of that name") as missing:
        package.simulate("nosuch")
    assert missing.value.filename == "nosuch"
    with pytest.raises(TypeError, match=r"expected a clutch\.Scenario"):
        package.simulate(3)
    with pytest.raises(TypeError, match=r"expected a clutch\.Scenario"):
        package.Plant(3)


def test_a_file_without_permission_or_text_is_an_error_of_the_system_or_of_the_value(tmp_path):
    with pytest.raises(IsADirectoryError):
        package.Scenario.load(tmp_path)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="not a text file"):
        package.Scenario.load(tmp_path / "bytes.toml")
    (tmp_path / "bad.toml").write_text("[rig")
    with pytest.raises(package.ParamError, match="this is not TOML"):
        package.Scenario.load(tmp_path / "bad.toml")


VALUES = st.one_of(
    st.floats(), st.integers(-(2**70), 2**70), st.text(max_size=5), st.booleans(), st.just([]), st.just({})
)


def dotted():
    """Every key of a scenario with a safe state."""
    tables, here = [], ""
    for line in package.Scenario.load("board_smc_2").to_toml().splitlines():
        if line.startswith("["):
            here = line.strip("[]") + "."
        elif "=" in line:
            tables.append(here + line.split(" = ")[0])
    return tables


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(dotted()), VALUES)
def test_no_value_of_any_key_is_anything_but_taken_or_named(key, value):
    """Above all no panic: the native module would raise a BaseException."""
    overrides = {"run.duration_s": 0.05, "run.settle_s": 0.0, key: value}
    try:
        scenario = package.Scenario.load("board_smc_2", overrides)
        if len(scenario.path()) <= 2000:
            package.simulate(scenario)
    except (package.ParamError, TypeError, ValueError) as e:
        assert str(e)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 0.5, 2**31])
def test_counts_that_no_encoder_has_are_refused(bad):
    scenario = package.Scenario.load("smc_2")
    law, target = package.Servo(scenario), scenario.path().at(0)
    with pytest.raises((ValueError, OverflowError), match=r"counts = .*: expected a whole number of counts"):
        law.step(bad, target)
    with pytest.raises(TypeError):
        law.step("3", target)
    with pytest.raises(TypeError):
        law.step(3, (0.0, 0.0, 0.0))


def test_a_snapshot_of_a_law_goes_on_by_itself():
    scenario = package.Scenario.load("smc_2")
    law, path = package.Servo(scenario), scenario.path()
    for tick in range(100):
        law.step(tick // 9, path.at(tick))
    twin = law.copy()
    after = [law.step(tick // 9, path.at(tick)) for tick in range(100, 200)]
    assert [twin.step(tick // 9, path.at(tick)) for tick in range(100, 200)] == after


def test_a_value_that_holds_itself_or_is_nested_without_end_is_refused():
    cyclic, deep = [], [1.0]
    cyclic.append(cyclic)
    for _ in range(100_000):
        deep = [deep]
    for bad in (cyclic, deep):
        with pytest.raises(ValueError, match="nested more than 32 deep"):
            package.simulate("smc_2", overrides={"law.smc.kp_v": bad})
        with pytest.raises(ValueError, match="nested more than 32 deep"):
            package.sweep("smc_2", {"law.smc.kp_v": [bad]})
    with pytest.raises(package.ParamError, match="more than 32 parts"):
        package.simulate("smc_2", overrides={".".join(["a"] * 200_000): 1})


@pytest.mark.parametrize(
    ("overrides", "field", "value"),
    [
        ({"law": {"smc": {"kp_v": -1.0}}}, "law.smc.kp_v", -1.0),
        ({"run.duration_s": 0.5}, "run.settle_s", 1.0),
        ({"law.smc.kp_v": 4, "law": {"smc": {"kp_v": -2}}}, "law.smc.kp_v", -2),
    ],
)
def test_the_value_of_an_error_is_the_one_that_was_refused(overrides, field, value):
    with pytest.raises(package.ParamError) as caught:
        package.simulate("smc_2", overrides=overrides)
    assert (caught.value.field, caught.value.value) == (field, value)


def test_a_run_too_long_for_the_memory_is_an_error_and_not_the_end_of_python():
    code = """
import resource
import clutch
resource.setrlimit(resource.RLIMIT_AS, (600 << 20, 600 << 20))
try:
    clutch.simulate("smc_2", overrides={"run.duration_s": 9000})
except clutch.ParamError as e:
    print(e.field, "no memory" in str(e))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "run.duration_s True\n", done.stderr


def test_a_result_crosses_to_another_process():
    import concurrent.futures
    import multiprocessing

    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = next(pool.map(package.simulate, ["smc_2"]))
    here = package.simulate("smc_2")
    assert (there.scenario, there.metrics, there.samples, there.events) == (
        here.scenario,
        here.metrics,
        here.samples,
        here.events,
    )
    with pytest.raises(RuntimeError, match="another process"):
        there.save("nowhere.mcap")


def test_a_law_can_be_tried_on_a_tick_of_ones_own():
    tick = package.Tick(0.01, -0.2, target_velocity=0.5)
    assert (tick.error, tick.error_rate, tick.velocity, tick.time) == (0.01, -0.2, 0.7, 0.0)


def test_a_path_has_no_ticks_before_or_after_its_run():
    path = package.Scenario.load("smc_2").path()
    for tick in (-1, len(path)):
        with pytest.raises(IndexError, match=rf"tick {tick}: expected one of the run's, 0 to {len(path) - 1}"):
            path.at(tick)


# --- The package as a file ------------------------------------------------------------------------


def test_importing_the_package_imports_no_other_library():
    code = "import clutch, sys; print([m for m in sys.modules if m.split('.')[0] in %r])"
    heavy = ("numpy", "pandas", "matplotlib", "scipy", "tqdm", "pyarrow", "polars", "xarray", "gymnasium", "control")
    done = subprocess.run([sys.executable, "-c", code % (heavy,)], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_importing_the_package_imports_nothing_of_it():
    code = "import sys; before = set(sys.modules); import clutch; print(sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True)
    new = [name for name in ast.literal_eval(done.stdout) if name.split(".")[0] == "clutch"]
    assert new == ["clutch"]


def test_each_name_is_what_the_import_for_type_checkers_says():
    source = Path(package.__file__).read_text("utf-8")
    guarded = next(node for node in ast.parse(source).body if isinstance(node, ast.If))
    said = {"__version__"}
    for line in guarded.body:
        if isinstance(line, ast.AnnAssign):
            assert (line.target.id, package.__version__) == (
                "__version__",
                importlib.import_module("clutch._clutch").VERSION,
            )
            continue
        module = importlib.import_module(line.module)
        for name in line.names:
            if name.name == "*":
                said |= set(module.__all__)
                assert all(getattr(package, each) is getattr(module, each) for each in module.__all__)
            else:
                assert name.asname == name.name  # as type checkers ask of a name that is handed on
                said.add(name.name)
            # A module of the package's own may bring a library along.
            if name.name != "*" and line.module != "clutch":
                assert getattr(package, name.name) is getattr(module, name.name)
    assert said == set(package.__all__) == set(dir(package))
    with pytest.raises(AttributeError, match="module 'clutch' has no attribute 'simulator'"):
        package.simulator  # noqa: B018


def test_version_types_and_build_are_those_of_the_crates(clutch):
    from importlib.metadata import version

    assert package.__version__ == version("clutch-control")
    assert clutch("--version").stdout == f"clutch {package.__version__}\n"
    assert (Path(package.__file__).parent / "py.typed").is_file()
    assert (Path(package.__file__).parent / "_clutch.pyi").is_file()
    metadata = json.loads(
        subprocess.run(
            ["cargo", "metadata", "--no-deps", "--format-version", "1"], cwd=ROOT, capture_output=True, check=True
        ).stdout
    )
    assert {p["version"] for p in metadata["packages"] if p["name"] == "clutch-py"} == {package.__version__}


@pytest.mark.parametrize(
    "arguments",
    [
        ("--help",),
        ("sim", "smc_2", "--json"),
        ("sim", "nosuch"),
        ("sim",),
        ("certify", "ctc_2"),
        ("scenario", "list"),
        ("loop", "smc_2"),
    ],
    ids=" ".join,
)
def test_the_wheels_command_is_the_binary(clutch, arguments):
    ours = subprocess.run([COMMAND, *arguments], capture_output=True, text=True)
    theirs = clutch(*arguments, code=None)
    assert (ours.returncode, ours.stdout, ours.stderr) == (theirs.returncode, theirs.stdout, theirs.stderr)


@pytest.mark.parametrize("view", ["foxglove", "scope"])
def test_the_wheels_command_says_where_a_view_is_that_it_is_built_without(view):
    done = subprocess.run([COMMAND, "sim", "smc_2", f"--{view}"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "")
    assert f"--{view}: this command is built without it; the released command has it" in done.stderr


def test_the_wheels_command_runs_the_loop_and_ends_it_on_ctrl_c(tmp_path):
    import signal
    import time

    log = tmp_path / "loop.mcap"
    loop = subprocess.Popen([COMMAND, "loop", "--log", str(log)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    deadline = time.monotonic() + 30
    while not (log.exists() and log.stat().st_size > 20_000) and time.monotonic() < deadline:
        time.sleep(0.05)
    loop.send_signal(signal.SIGINT)
    text = loop.communicate(timeout=30)[0].decode()
    assert loop.returncode == 4, text
    assert package.read_log(log).complete
    assert package.replay(log).identical


# --- The paper ------------------------------------------------------------------------------------


def test_reproduce_gives_the_commands_claims_and_table(clutch, tmp_path):
    clutch("reproduce", "--out", tmp_path)
    theirs = json.loads((tmp_path / "report.json").read_text())
    paper = package.reproduce(progress=False)
    assert paper.claims["id"] == [c["id"] for c in theirs["claims"]]
    assert paper.claims["measured"].tolist() == [c["measured"] for c in theirs["claims"]]
    assert paper.claims["holds"].tolist() == [c["holds"] for c in theirs["claims"]]
    assert paper.table3["reduction_percent"].tolist() == [r["reduction_percent"] for r in theirs["table3"]]
    assert paper.as_documented
    assert [f.number for f in paper.figures] == [8, 9, 10]


@pytest.mark.skipif(sys.platform != "linux", reason="boards are followed on Linux")
def test_images_of_boards_that_a_wheel_brings_are_looked_for_in_the_package(tmp_path):
    code = "import sys; sys.argv = ['clutch', 'hil', '--image', 'nucleo-daq', 'board_smc_2']; from clutch import _cli; "
    environment = {key: value for key, value in os.environ.items() if key != "CLUTCH_IMAGES"}
    run = [sys.executable, "-c", code + "_cli.IMAGES = _cli.Path('brought'); sys.exit(_cli.main())"]
    told = subprocess.run(run, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert told.returncode != 0 and "brought/nucleo-daq" in told.stderr, told.stderr
