"""Comparison: the figures are those of the runs, in the table and in print."""

import json
import pickle

import numpy as np
import pytest

from clutch import Result, Scenario, compare, simulate

SHORT = {"run.duration_s": 1.0, "run.settle_s": 0.25}


@pytest.fixture(scope="module")
def both():
    return compare("pd_2", "smc_2", labels=["PD", "sliding mode"], overrides=SHORT)


def test_a_comparison_has_the_runs_and_a_row_for_each(both):
    alone = simulate("smc_2", overrides=SHORT)
    assert both["sliding mode"].metrics == alone.metrics and len(both) == 2
    assert all(isinstance(run, Result) for run in both)
    table = both.table
    assert list(table["run"]) == ["PD", "sliding mode"]
    assert table["max_error_rad"][1] == alone.metrics.max_error_rad
    none = compare("bench_glide_2", "pd_2").table
    assert np.isnan(none["break_away_torque_nm"][0]) and none["break_away_torque_nm"][1] > 0


def test_its_print_has_a_column_for_each_run_in_the_units_that_people_are_shown(both):
    head, *rows = str(both).splitlines()
    assert head.split("  ")[-2:] == ["PD", "sliding mode"] or head.split() == ["PD", "sliding", "mode"]
    row = next(r for r in rows if r.startswith("max |error| (°)"))
    shown = [float(cell) for cell in row.split()[-2:]]
    assert shown == pytest.approx(np.degrees(both.table["max_error_rad"]), rel=1e-4)
    assert {len(line) for line in [head, *rows]} == {len(head)}
    assert "<th>sliding mode</th>" in both._repr_html_()
    assert repr(both) == "<Comparison of PD, sliding mode>"


def test_its_print_stays_within_80_columns_with_long_names_and_many_runs():
    many = compare(*["pd_2", "smc_2"] * 3, overrides=SHORT)
    lines = str(many).splitlines()
    assert lines[:2] == [f"[{i + 1}] {label}" for i, label in enumerate(many.labels[:2])]
    assert max(map(len, lines)) <= 80
    rows = [line for line in lines if line.startswith("max |error| (°)")]
    assert len(rows) > 1 and sum(len(row.split()) - 3 for row in rows) == 6


def test_scenarios_of_one_name_are_told_apart_and_results_are_taken_as_they_are():
    one = simulate("smc_2", overrides=SHORT)
    two = compare(one, Scenario.load("smc_2").override({**SHORT, "run.seed": 2}))
    assert two.results[0] is one
    assert two.labels == [f"{one.scenario.name} (1)", f"{one.scenario.name} (2)"]


def test_a_run_from_another_process_can_be_compared(both):
    again = pickle.loads(pickle.dumps(both["PD"]))
    assert again.window == both["PD"].window
    assert np.array_equal(again.sticks["from_s"], both["PD"].sticks["from_s"])
    assert compare(again, both["sliding mode"]).table["rms_error_rad"].tolist() == both.table["rms_error_rad"].tolist()


def test_what_cannot_be_compared_is_named(both):
    with pytest.raises(ValueError, match="expected two runs or more, got 1"):
        compare("pd_2")
    with pytest.raises(ValueError, match=r"labels = \['a', 'a'\]: expected 2 different ones"):
        compare("pd_2", "smc_2", labels=["a", "a"], overrides=SHORT)
    with pytest.raises(ValueError, match="overrides: expected scenarios"):
        compare(both["PD"], "smc_2", overrides=SHORT)
    with pytest.raises(KeyError, match="CTC: no such run; there are PD, sliding mode"):
        both["CTC"]


def test_the_commands_comparison_has_the_same_figures_and_window(capfd):
    from clutch import _cli, _clutch

    assert _clutch.main(["clutch", "compare", "bench_pd_2", "bench_smc_2", "--json"], _cli.IMAGES) == 0
    told = json.loads(capfd.readouterr().out)
    ours = compare("bench_pd_2", "bench_smc_2")
    for run, result in zip(told["runs"], ours, strict=True):
        assert run["metrics"]["rms_error_rad"] == result.metrics.rms_error_rad
    assert (told["window"]["from_s"], told["window"]["to_s"]) == ours.results[0].window
