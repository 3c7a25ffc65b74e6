"""Figures: the lines are the runs, the axes have units, and nothing of matplotlib is left changed."""

import re
import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("agg")

import matplotlib.pyplot as plt
from matplotlib.collections import QuadMesh

from clutch import ParamError, Scenario, StribeckFriction, Table, plot, read_log, reproduce, simulate, sweep

SHORT = {"run.duration_s": 1.0, "run.settle_s": 0.25}


@pytest.fixture(scope="module")
def pd():
    """A second of the paper's PD at 2 °/s, which sticks."""
    return simulate("pd_2", overrides=SHORT)


@pytest.fixture(scope="module")
def smc():
    """A second of the paper's sliding mode at 2 °/s."""
    return simulate("smc_2", overrides=SHORT)


@pytest.fixture(scope="module")
def gains():
    """A small sweep over two gains and two seeds."""
    grid = {"law.smc.kp_v": [3.0, 4.0, 5.0], "law.smc.boundary_rad_s": [0.05, 0.1]}
    return sweep(Scenario.load("smc_2").override(SHORT), grid, seeds=2, progress=False)


@pytest.fixture(autouse=True)
def untouched():
    """Each test leaves matplotlib's settings as it found them, and no figure open."""
    before = dict(matplotlib.rcParams)
    yield
    plt.close("all")
    assert dict(matplotlib.rcParams) == before


def drawn(drawing, folder, name):
    """Render, and give the pixels: a figure must not be empty, and its text must lie within it."""
    figure = getattr(drawing, "figure", drawing)
    path = folder / f"{name}.png"
    figure.savefig(path)
    pixels = plt.imread(path)[..., :3]
    ink = np.argwhere(pixels.min(axis=2) < 0.6)
    low, high = ink.min(axis=0), ink.max(axis=0)
    assert (low > 0).all() and (high < np.array(pixels.shape[:2]) - 1).all(), "cut at the edge"
    return pixels


def line(ax, label):
    (found,) = [one for one in ax.lines if one.get_label() == label]
    return found


def band(ax, number=0):
    """Lowest and highest of each part of a curve's envelope."""
    vertices = ax.collections[number].get_paths()[0].vertices
    places = np.unique(vertices[:, 0])
    at = [vertices[vertices[:, 0] == x, 1] for x in places]
    return np.array([y.min() for y in at]), np.array([y.max() for y in at])


def names(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_importing_clutch_and_its_plots_imports_no_matplotlib():
    code = "import sys, clutch, clutch.plot; print({'matplotlib', 'numpy', 'pandas'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


# --- Tracking ----------------------------------------------------------------------------------


def test_a_tracking_plot_is_the_error_in_degrees_over_the_time_of_the_run(pd, tmp_path):
    ax = plot.tracking(pd)
    drawn(ax, tmp_path, "tracking")
    # The mean of each part is a line; the band reaches as far as the samples do.
    error = np.degrees(pd.samples["error_rad"])
    mean = line(ax, pd.scenario.name).get_ydata()
    assert len(mean) == 120 and error.min() < mean.min() and mean.max() < error.max()
    assert mean.mean() == pytest.approx(error.mean(), abs=1e-4)
    band = ax.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == (error.min(), error.max())
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (s)", "error (°)")
    assert ax.get_xlim() == (0.0, 1.0)
    assert ax.get_legend() is None


def test_a_stretch_of_a_tracking_plot_is_drawn_sample_by_sample_with_its_sticks(tmp_path):
    bench = simulate("bench_pd_2", overrides=SHORT)
    start, end = bench.window
    ax = plot.tracking(bench, stretch=bench.window)
    drawn(ax, tmp_path, "stretch")
    time, error = line(ax, bench.scenario.name).get_data()
    within = (bench.samples["time_s"] >= start) & (bench.samples["time_s"] < end)
    assert np.array_equal(time, bench.samples["time_s"][within])
    assert np.array_equal(error, np.degrees(bench.samples["error_rad"][within]))
    assert len(ax.collections[0].get_paths()) > 2  # sticks
    with pytest.raises(ValueError, match="stretch"):
        plot.tracking(bench, stretch=(5.0, 6.0))


def test_several_runs_have_a_colour_and_a_label_each(pd, smc, tmp_path):
    ax = plot.tracking([pd, smc], labels=["PD", "sliding mode"])
    drawn(ax, tmp_path, "two")
    assert names(ax) == ["PD", "sliding mode"]
    assert line(ax, "PD").get_color() != line(ax, "sliding mode").get_color()
    assert names(plot.tracking([pd, smc])) == [pd.scenario.name, smc.scenario.name]


def test_runs_that_differ_in_the_seed_alone_are_told_apart_by_it(smc):
    other = simulate("smc_2", overrides={**SHORT, "run.seed": 7})
    assert names(plot.tracking([smc, other])) == [f"{smc.scenario.name}, seed {n}" for n in (1, 7)]


def test_more_runs_than_colours_differ_in_their_dashes(smc):
    ax = plot.tracking([smc] * 9, labels=[str(n) for n in range(9)])
    looks = [(line(ax, str(n)).get_color(), line(ax, str(n)).get_linestyle()) for n in range(9)]
    assert len(set(looks)) == 9


def test_results_and_labels_that_do_not_fit_are_named(pd):
    with pytest.raises(ValueError, match=r"labels = \['a', 'b'\]: expected 1"):
        plot.tracking(pd, labels=["a", "b"])
    with pytest.raises(ValueError, match="no result"):
        plot.tracking([])
    with pytest.raises(TypeError, match=r"expected a Result of clutch\.simulate, got 'p'"):
        plot.tracking("pd_2")


def test_an_axes_of_ones_own_is_drawn_into_and_keeps_its_look(pd):
    figure, ax = plt.subplots()
    ax.set_title("mine")
    assert plot.tracking(pd, ax=ax) is ax
    assert ax.get_title() == "mine" and ax.spines["top"].get_visible()
    assert plt.get_fignums() == [figure.number]


def test_an_axes_within_a_subfigure_will_do(gains):
    left, right = plt.figure().subfigures(1, 2)
    left.subplots()
    ax = plot.sweep_map(gains, "law.smc.kp_v", "law.smc.boundary_rad_s", "rms_error_rad", ax=right.subplots())
    assert ax.figure is right


def test_a_figure_is_one_column_wide_with_text_that_can_be_read_there(pd):
    ax = plot.tracking(pd)
    assert ax.figure.get_figwidth() * 25.4 == pytest.approx(85)
    ax.figure.canvas.draw()
    texts = [ax.xaxis.label, ax.yaxis.label, *ax.get_xticklabels(), *ax.get_yticklabels()]
    assert {text.get_fontsize() for text in texts} == {7.0, 8.0}


# --- Long runs ---------------------------------------------------------------------------------


def test_a_long_line_is_thinned_and_keeps_the_smallest_and_largest_sample_of_each_column(tmp_path):
    long = simulate("pd_2", overrides={"run.duration_s": 40.0})
    ax = plot._one(None)
    plot._line(ax, long.samples["time_s"], np.degrees(long.samples["error_rad"]))
    drawn(ax, tmp_path, "long")
    x, y = ax.lines[0].get_data()
    time, error = long.samples["time_s"], np.degrees(long.samples["error_rad"])
    columns = int(85 / 25.4 * 600)
    assert len(x) <= 2 * columns + 2 < len(time)
    assert np.isin(y, error).all() and (np.diff(x) > 0).all()
    where = np.searchsorted(np.linspace(time[0], time[-1], columns + 1)[1:-1], time, side="right")
    there = np.searchsorted(np.linspace(time[0], time[-1], columns + 1)[1:-1], x, side="right")
    for column in range(0, columns, 7):
        whole, kept = error[where == column], y[there == column]
        assert (whole.min(), whole.max()) == (kept.min(), kept.max())
    assert (x[0], x[-1]) == (time[0], time[-1])


def test_one_sample_of_a_hundred_thousand_is_not_lost_by_thinning():
    time = np.arange(100_000) * 1e-3
    value = np.zeros_like(time)
    value[61_803] = 1.0
    keep = plot._thin(time, value, 2000)
    assert 61_803 in keep and len(keep) < 5000


def test_unknown_samples_do_not_hide_known_ones_by_thinning():
    time = np.arange(50_000) * 1e-3
    value = np.sin(time)
    value[1::2] = np.nan
    value[20_000:30_000] = np.nan
    keep = plot._thin(time, value, 1000)
    assert np.nanmax(value[keep]) == np.nanmax(value)
    assert np.isfinite(value[keep][time[keep] < 19.9][1:]).all()
    assert np.isnan(value[keep][(time[keep] > 20.1) & (time[keep] < 29.9)]).all()


# --- The paper's figures, friction, phase plane --------------------------------------------------


def test_the_papers_figures_have_a_row_for_each_rate_with_the_simulation_left(tmp_path):
    for figure in reproduce(progress=False).figures:
        drawing = plot.paper_figure(figure)
        drawn(drawing, tmp_path, f"paper{figure.number}")
        rates = list(dict.fromkeys(panel.rate_deg_s for panel in figure.panels))
        assert len(drawing.axes) == len(figure.panels) == 2 * len(rates)
        for left, right in zip(drawing.axes[::2], drawing.axes[1::2], strict=True):
            assert left.get_ylim() == right.get_ylim(), "they are compared"
        for ax, panel in zip(drawing.axes, figure.panels, strict=True):
            side = "(b) bench" if panel.experiment else "(a) simulation"
            assert ax.get_title(loc="left") == f"{side}, {panel.rate_deg_s:g} °/s"
            assert ax.get_ylabel() == "error (°)"
            low, high = band(ax)
            assert (low.min(), high.max()) == (np.min(panel.error_deg), np.max(panel.error_deg)), "no peak is lost"
            assert np.mean(ax.lines[-1].get_ydata()) == pytest.approx(np.mean(panel.error_deg), rel=1e-2)
        assert [ax.get_xlabel() for ax in drawing.axes[-2:]] == ["time (s)"] * 2
    with pytest.raises(ValueError, match="figure 8 has no panels"):
        plot.paper_figure(SimpleNamespace(number=8, law="PD controller", panels=[]))


def test_the_friction_curve_is_drawn_between_its_two_levels(tmp_path):
    friction = StribeckFriction(mu_static=0.3, mu_dynamic=0.1, stribeck_velocity_rad_s=0.01)
    ax = plot.stribeck(friction)
    drawn(ax, tmp_path, "stribeck")
    x, y = ax.lines[-1].get_data()
    assert (ax.get_xlabel(), ax.get_xscale()) == ("|velocity| (rad/s)", "log")
    assert (x[0], x[-1]) == pytest.approx((1e-4, 1.0))
    assert y == pytest.approx(0.1 + 0.2 * np.exp(-x / 0.01), rel=1e-12)
    marked = {text.get_text() for text in ax.texts}
    assert marked == {"static 0.3", "dynamic 0.1", "Stribeck velocity\n0.01 rad/s"}


def test_friction_at_velocities_of_ones_own_and_none_at_rest():
    ax = plot.stribeck(StribeckFriction(), velocity_rad_s=[0.1, 0.001])
    assert ax.lines[-1].get_xdata().tolist() == [0.001, 0.1]
    for bad in ([0.0, 1.0], [-1.0], [], [np.nan], [np.inf]):
        with pytest.raises(ValueError, match="velocity_rad_s: expected velocities above 0"):
            plot.stribeck(StribeckFriction(), velocity_rad_s=bad)


def test_the_phase_plane_marks_the_stuck_samples_and_the_layer(smc, tmp_path):
    ax = plot.phase_plane(smc)
    drawn(ax, tmp_path, "phase")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("error (°)", "error rate (°/s)")
    samples = smc.samples
    rate = np.degrees(samples["target_velocity_rad_s"] - samples["velocity_rad_s"])
    assert np.array_equal(line(ax, "path").get_ydata(), rate)
    stuck = np.asarray(samples["stuck"])
    assert stuck.any()
    assert np.array_equal(line(ax, "stuck").get_xdata(), np.degrees(samples["error_rad"])[stuck])
    assert np.allclose(line(ax, "stuck").get_ydata(), 2.0)  # a shaft at rest falls behind at the path's rate
    e, rate = line(ax, "σ = 0").get_data()
    assert rate == pytest.approx(-70.0 * e)
    edges = [one for one in ax.lines if len(one.get_xdata()) == 2 and one.get_label().startswith("_")]
    sigma = [np.radians(one.get_ydata() + 70.0 * one.get_xdata()) for one in edges]
    assert np.array(sigma) == pytest.approx(np.array([[-0.1, -0.1], [0.1, 0.1]]))
    assert "|σ| ≤ 0.1 rad/s" in names(ax)


def test_only_a_law_with_a_surface_gets_one(pd):
    # The law's own word, and no key of it: PD's is where its output ends, and an integral's is no line here.
    assert "σ = 0" in names(plot.phase_plane(pd))
    for law in ("pid", "smc_integral", "glide"):
        assert "σ = 0" not in names(plot.phase_plane(simulate("smc_2", overrides={**SHORT, "law": {law: {}}})))
    sign = simulate("smc_2", overrides={**SHORT, "law": {"smc_sign": {}}})
    assert "σ = 0" in names(plot.phase_plane(sign)) and not any("≤" in name for name in names(plot.phase_plane(sign)))


# --- Stick-slip ----------------------------------------------------------------------------------


def test_the_raster_has_a_bar_from_each_stick_to_its_break_away(pd, smc, tmp_path):
    ax = plot.stick_slip([pd, smc], labels=["PD", "SMC"])
    drawn(ax, tmp_path, "raster")
    assert ax.get_xlabel() == "time (s)"
    assert [text.get_text() for text in ax.get_yticklabels()] == ["PD", "SMC"]
    for row, run in enumerate((pd, smc)):
        corners = [path.get_extents() for path in ax.collections[row].get_paths()]
        kinds = np.array(list(run.events["kind"]))
        times = np.asarray(run.events["time_s"])
        sticks, ends = times[kinds == "stick"], times[kinds == "break_away"]
        assert len(corners) == len(sticks) and len(ends) in (len(sticks), len(sticks) - 1)
        assert [box.x0 for box in corners] == pytest.approx(sticks.tolist())
        assert [box.x1 for box in corners][: len(ends)] == pytest.approx(ends.tolist())
        assert all(box.y0 < row < box.y1 for box in corners)
    numbers = [text.get_text() for text in ax.texts]
    assert numbers == [f"{run.metrics.stick_slip_cycles_per_s:.1f}" for run in (pd, smc)] + ["cycles/s"]


def test_a_run_that_begins_and_ends_at_rest_is_stuck_from_its_start_and_to_its_end():
    run = simulate("minimum_jerk")
    spans = plot._sticks(run)
    assert spans[0, 0] == 0.0 and spans[-1, 1] == run.scenario.run.duration_s
    assert (np.diff(spans.ravel()) >= 0).all()
    settled = run.scenario.run.settle_s
    inside = np.clip(spans, settled, None)
    stuck = (inside[:, 1] - inside[:, 0]).sum() / run.metrics.measured_s
    assert stuck == pytest.approx(run.metrics.stick_time_fraction, rel=1e-9)


def test_a_run_without_sticks_has_an_empty_row():
    smooth = simulate("smc_2", overrides={**SHORT, "rig.base": "ideal"})
    assert plot._sticks(smooth).shape == (0, 2)
    ax = plot.stick_slip(smooth, labels=["ideal"])
    assert not ax.collections[0].get_paths()


# --- Sweeps --------------------------------------------------------------------------------------


def mesh(ax):
    (found,) = [one for one in ax.collections if isinstance(one, QuadMesh)]
    return found


def test_a_map_has_the_means_over_the_seeds_in_the_cells_of_their_keys(gains, tmp_path):
    ax = plot.sweep_map(gains, "law.smc.kp_v", "law.smc.boundary_rad_s", "max_error_rad")
    drawn(ax, tmp_path, "map")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("law.smc.kp (V)", "law.smc.boundary (rad/s)")
    assert ax.figure.axes[1].get_ylabel() == "max |error| (°)"
    assert names(ax) == ["lines: stick-slip (cycles/s)"]
    values = mesh(ax).get_array()
    assert values.shape == (2, 3)
    for i, boundary in enumerate((0.05, 0.1)):
        for j, kp in enumerate((3.0, 4.0, 5.0)):
            settings = {**SHORT, "law.smc.kp_v": kp, "law.smc.boundary_rad_s": boundary}
            runs = [simulate("smc_2", overrides={**settings, "run.seed": seed}) for seed in (1, 2)]
            mean = np.mean([run.metrics.max_error_rad for run in runs])
            assert values[i, j] == pytest.approx(np.degrees(mean), rel=1e-12)
    assert np.allclose(mesh(ax).get_coordinates()[0, :, 0], [2.5, 3.5, 4.5, 5.5])


def test_missing_cells_are_empty_before_a_hatched_ground(tmp_path):
    x, y = np.repeat([1.0, 2.0, 3.0], 3), np.tile([0.0, 1.0, 2.0], 3)
    value = np.arange(9.0)
    value[4] = np.nan
    ax = plot.sweep_map(
        Table({"law.pd.kp_v_rad": x, "run.seed": y, "jerk_rms_rad_s3": value}),
        "law.pd.kp_v_rad",
        "run.seed",
        "jerk_rms_rad_s3",
    )
    drawn(ax, tmp_path, "missing")
    mask = np.zeros((3, 3), dtype=bool)
    mask[1, 1] = True
    assert np.array_equal(np.ma.getmaskarray(mesh(ax).get_array()), mask)
    assert ax.patch.get_hatch() == "////"
    assert ax.get_xlabel() == "law.pd.kp (V/rad)" and ax.get_ylabel() == "run.seed"
    assert ax.figure.axes[1].get_ylabel() == "jerk RMS (rad/s³)"


def test_values_spaced_by_factors_get_a_logarithmic_axis_with_plain_numbers():
    x = np.repeat([0.01, 0.1, 1.0], 2)
    table = Table({"a_v": x, "b_v": np.tile([1.0, 2.0], 3), "mean_error_rad": x})
    ax = plot.sweep_map(table, "a_v", "b_v", "mean_error_rad")
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "linear")
    edges = mesh(ax).get_coordinates()[0, :, 0]
    assert np.allclose(edges, [10**-2.5, 10**-1.5, 10**-0.5, 10**0.5])
    ax.figure.canvas.draw()
    assert {"0.01", "0.1", "1"} <= {text.get_text() for text in ax.get_xticklabels()}


def test_choices_are_an_axis_of_words():
    table = Table({"rig.base": ["paper", "bench"] * 2, "run.seed": [1, 1, 2, 2], "rms_error_rad": [1.0, 2.0, 3.0, 4.0]})
    ax = plot.sweep_map(table, "rig.base", "run.seed", "rms_error_rad")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["paper", "bench"]
    assert np.degrees([[1.0, 2.0], [3.0, 4.0]]) == pytest.approx(mesh(ax).get_array())


def test_alternatives_are_told_by_their_names_and_what_differs():
    laws = [
        '{"pd": {"kp_v_rad": 5.0}}',
        '{"smc": {"kp_v": 3.0, "slope_1_s": 70.0}}',
        '{"smc": {"kp_v": 4.0, "slope_1_s": 70.0}}',
    ]
    table = Table({"law": laws * 2, "run.seed": [1, 1, 1, 2, 2, 2], "rms_error_rad": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]})
    ax = plot.sweep_map(table, "law", "run.seed", "rms_error_rad")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["pd", "smc\nkp_v 3.0", "smc\nkp_v 4.0"]


def test_a_data_frame_draws_as_its_table_does(gains):
    keys = ("law.smc.kp_v", "law.smc.boundary_rad_s", "rms_error_rad")
    one, other = plot.sweep_map(gains.table, *keys), plot.sweep_map(gains.to_pandas(), *keys)
    assert np.array_equal(mesh(one).get_array(), mesh(other).get_array())


def test_what_cannot_be_mapped_is_named(gains):
    keys = ("law.smc.kp_v", "law.smc.boundary_rad_s")
    with pytest.raises(ValueError, match=r"max_error_deg: no such column; there are .*max_error_rad"):
        plot.sweep_map(gains, *keys, "max_error_deg")
    with pytest.raises(ValueError, match="cycles: no such column"):
        plot.sweep_map(gains, *keys, "max_error_rad", contours="cycles")
    with pytest.raises(ValueError, match=r"law\.smc\.boundary_rad_s was swept too"):
        plot.sweep_map(gains, "law.smc.kp_v", "run.seed", "max_error_rad")
    n = np.arange(20.0)
    with pytest.raises(ValueError, match="not a grid over a_v and b_v: 20 by 20"):
        plot.sweep_map(Table({"a_v": n, "b_v": n, "mean_error_rad": n}), "a_v", "b_v", "mean_error_rad")


def test_contours_are_left_out_on_request_and_where_nothing_sticks():
    table = {"a_v": [1.0, 1.0, 2.0, 2.0], "b_v": [1.0, 2.0, 1.0, 2.0], "rms_error_rad": [1.0, 2.0, 3.0, 4.0]}
    still = Table({**table, "stick_slip_cycles_per_s": [0.0] * 4})
    moving = Table({**table, "stick_slip_cycles_per_s": [0.0, 5.0, 10.0, 20.0]})
    for given, wanted, legend in (
        (still, "stick_slip_cycles_per_s", False),
        (moving, None, False),
        (moving, "stick_slip_cycles_per_s", True),
    ):
        ax = plot.sweep_map(given, "a_v", "b_v", "rms_error_rad", contours=wanted)
        assert (ax.get_legend() is not None) is legend


@pytest.mark.parametrize(
    ("key", "label"),
    [
        ("law.smc.kp_v", "law.smc.kp (V)"),
        ("law.pd.kd_v_s_rad", "law.pd.kd (V s/rad)"),
        ("law.smc.slope_1_s", "law.smc.slope (1/s)"),
        ("law.ctc.kp_1_s2", "law.ctc.kp (1/s²)"),
        ("law.ctc.outer_gain", "law.ctc.outer_gain"),
        ("rig.friction.stribeck.mu_static", "rig.friction.stribeck.mu_static"),
        ("rig.drive.weight.mass_kg", "rig.drive.weight.mass (kg)"),
        ("rig.drive.weight.gravity_m_s2", "rig.drive.weight.gravity (m/s²)"),
        ("rig.inertia_kg_m2", "rig.inertia (kg m²)"),
        ("rig.viscous_damping_nm_s_rad", "rig.viscous_damping (N m s/rad)"),
        ("rig.encoder.counts_per_rev", "rig.encoder.counts_per_rev (counts per revolution)"),
        ("safety.limits.jumps", "safety.limits.jumps (within 128 periods)"),
        ("velocity.observer.disturbance_walk_nm_rt_s", "velocity.observer.disturbance_walk (N m/√s)"),
        ("reference.ramp.rate_deg_s", "reference.ramp.rate (°/s)"),
        ("sampling.period_us", "sampling.period (µs)"),
        ("bounds.friction_percent", "bounds.friction (%)"),
        ("run.seed", "run.seed"),
    ],
)
def test_a_keys_label_has_the_unit_of_its_row(key, label):
    assert plot._label(key) == label


@pytest.mark.parametrize(
    ("name", "label", "factor"),
    [
        ("max_error_rad", "max |error| (°)", 180 / np.pi),
        ("iae_rad_s", "integral of |error| (° s)", 180 / np.pi),
        ("jerk_rms_rad_s3", "jerk RMS (rad/s³)", 1.0),
        ("stick_slip_cycles_per_s", "stick-slip (cycles/s)", 1.0),
        ("stick_time_fraction", "time stuck (%)", 100.0),
        ("break_away_torque_nm", "torque at break-away (mN m)", 1000.0),
        ("control_variation_v_s", "voltage variation (V/s)", 1.0),
        ("detected_stick_slip_cycles_per_s", "stick-slip seen by the encoder (cycles/s)", 1.0),
        ("certified_continuous_time", "certified_continuous_time", 1.0),
        ("law.smc.kp_v", "law.smc.kp (V)", 1.0),
    ],
)
def test_a_metric_is_drawn_in_the_words_and_the_unit_of_the_command(name, label, factor):
    assert plot._metric(name) == (label, pytest.approx(factor))


# --- Certificate ---------------------------------------------------------------------------------


def region(ax, kp, kd):
    """True if a point lies in the shaded region."""
    return any(path.contains_point((kp, kd)) for one in ax.collections[:1] for path in one.get_paths())


def test_the_region_is_where_the_certificate_says_so(tmp_path):
    scenario = Scenario.load("smc_2")
    ax = plot.certificate_region(scenario)
    drawn(ax, tmp_path, "region")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("law.smc.kp (V)", "law.smc.kd (V s/rad)")
    for kp in (2.0, 2.2, 2.3, 2.5, 3.0, 5.0):
        for kd in (3.0, 5.5, 6.0, 20.0, 400.0):
            asked = scenario.override({"law.smc.kp_v": kp, "law.smc.kd_v_s_rad": kd}).certificate()
            assert region(ax, kp, kd) == asked.certified_continuous_time, (kp, kd)
    dot = line(ax, "3 V, 400 V s/rad: certified")
    assert (list(dot.get_xdata()), list(dot.get_ydata())) == ([3.0], [400.0])


def test_the_region_of_pd_and_of_the_sign_law_and_of_gains_that_are_not_certified(tmp_path):
    pd = plot.certificate_region(Scenario.load("pd_2"))
    drawn(pd, tmp_path, "pd")
    assert (pd.get_xlabel(), pd.get_ylabel()) == ("law.pd.kp (V/rad)", "law.pd.kd (V s/rad)")
    assert region(pd, 5000.0, 50.0)
    sign = plot.certificate_region(Scenario.load("smc_2").override({"law": {"smc_sign": {"kp_v": 2.0}}}))
    drawn(sign, tmp_path, "sign")
    assert sign.get_xlabel() == "law.smc_sign.kp (V)"
    dot = line(sign, "2 V, 400 V s/rad: not certified")
    assert dot.get_markerfacecolor() == "white"
    assert region(sign, 2.3, 6.0) and not region(sign, 2.2, 6.0)


def test_the_region_of_ctc_is_where_its_certificate_says_so(tmp_path):
    scenario = Scenario.load("ctc_2")
    ax = plot.certificate_region(scenario)
    drawn(ax, tmp_path, "ctc")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("law.ctc.kp (1/s²)", "law.ctc.kd (1/s)")
    seen = set()
    for kp in (6.0, 30.0, 100.0, 1000.0, 1900.0):
        for kd in (0.04, 0.3, 0.7, 3.0, 13.0):
            asked = scenario.override({"law.ctc.kp_1_s2": kp, "law.ctc.kd_1_s": kd}).certificate()
            assert region(ax, kp, kd) == asked.certified_continuous_time, (kp, kd)
            seen.add(asked.certified_continuous_time)
    assert seen == {True, False}


def test_the_border_of_a_region_is_found_to_a_256th_of_an_axis_by_a_few_questions():
    grid = np.linspace(0.0, 1.0, 257)
    shapes = {
        "circle": lambda x, y: (x - 0.4) ** 2 + (y - 0.5) ** 2 < 0.1,
        "corner": lambda x, y: x > 0.3217 and y > 0.7713,
        "wedge": lambda x, y: 0.2 * x < y < 0.35 * x + 0.1,
        "all": lambda x, y: True,
    }
    for name, inside in shapes.items():
        count = 0

        def counted(x, y, inside=inside):
            nonlocal count
            count += 1
            return inside(x, y)

        found = plot._refined(counted, grid, grid)
        assert np.array_equal(found, [[inside(x, y) for x in grid] for y in grid]), name
        assert count < 4000, name


def test_gains_of_ones_own_are_the_axes():
    ax = plot.certificate_region(Scenario.load("smc_2"), kp=[2.0, 3.0, 4.0], kd=[10.0, 20.0])
    assert (ax.get_xlim(), ax.get_ylim()) == ((2.0, 4.0), (10.0, 20.0))
    none = plot.certificate_region(Scenario.load("smc_2"), kp=[1.0, 2.0], kd=[10.0, 20.0])
    assert not none.collections


def test_what_has_no_region_is_named():
    smc = Scenario.load("smc_2")
    with pytest.raises(ValueError, match=r"law\.pid: expected a law with two gains, kp_… and kd_…, and a sliding"):
        plot.certificate_region(smc.override({"law": {"pid": {}}}))
    with pytest.raises(ValueError, match=r"law\.hold: expected a law with two gains"):
        plot.certificate_region(Scenario.load("smc_2").override({"law": {"hold": {}}}))
    with pytest.raises(ValueError, match="both kp and kd"):
        plot.certificate_region(smc, kp=[1.0, 2.0])
    with pytest.raises(ValueError, match="kd: expected two or more gains that rise"):
        plot.certificate_region(smc, kp=[1.0, 2.0], kd=[2.0, 1.0])
    with pytest.raises(ValueError, match="61 by 60 gains: expected at most 3600 pairs"):
        plot.certificate_region(smc, kp=np.arange(61.0), kd=np.arange(60.0))
    with pytest.raises(ParamError, match="kp_v"):
        plot.certificate_region(smc, kp=[-1.0, 2.0], kd=[1.0, 2.0])


# --- Runs and logs -------------------------------------------------------------------------------


def test_a_run_is_drawn_closely_around_a_stick_and_whole_as_an_envelope(pd, tmp_path):
    figure = plot.run_overview(pd)
    drawn(figure, tmp_path, "run")
    position, error, velocity, voltage = figure.axes
    labels = ["position (counts)", "error (°)", "velocity (°/s)", "voltage (V)"]
    assert [ax.get_ylabel() for ax in figure.axes] == labels
    start, end = pd.window
    assert position.get_xlim() == velocity.get_xlim() == (start, end) and 0.0 <= start < end <= 1.0
    assert error.get_xlim() == voltage.get_xlim() == (0.0, 1.0)
    # The window is the one of the command, and holds the stick that its title names.
    at, ms = re.search(r"around the stick at (\S+) s, (\S+) ms long", position.get_title("left")).groups()
    sticks = np.stack([pd.sticks["from_s"], pd.sticks["to_s"]], axis=1)
    (this,) = sticks[np.abs(sticks[:, 0] - float(at)) < 6e-4]
    assert this[1] - this[0] == pytest.approx(float(ms) / 1e3, abs=1e-4)
    assert start <= this[0] and this[1] <= end
    # Stairs of whole counts, against a path that goes on by some 24 of them.
    shaft, path = line(position, "shaft").get_ydata(), line(position, "path").get_ydata()
    assert np.array_equal(shaft, np.round(shaft)) and 22 < path[-1] - path[0] < 26
    assert line(velocity, "path").get_ydata() == pytest.approx(2.0)
    for ax, values in ((error, np.degrees(pd.samples["error_rad"])), (voltage, pd.samples["voltage_v"])):
        low, high = band(ax)
        assert len(low) == 120 and (low.min(), high.max()) == (values.min(), values.max())
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["shaft", "at rest", "path", "the window"]


def test_a_run_without_a_stick_is_shown_around_its_largest_error():
    glide = simulate("bench_glide_2")
    title = plot.run_overview(glide).axes[0].get_title("left")
    at = float(re.search(r"around the largest error, at (\S+) s", title).group(1))
    settled = glide.time >= glide.scenario.run.settle_s
    worst = np.abs(glide.samples["error_rad"])[settled].max()
    assert abs(glide.samples["error_rad"][np.argmin(np.abs(glide.time - at))]) == worst


def test_runs_are_compared_on_the_same_axes_against_one_path(pd, smc, tmp_path):
    figure = plot.comparison([pd, smc], labels=["PD", "sliding mode"])
    drawn(figure, tmp_path, "comparison")
    position, error, velocity, _ = figure.axes
    assert position.get_xlim() == pd.window, "the window of the first that sticks"
    assert [one.get_label() for one in position.lines if one.get_label() == "path"] == ["path"]
    for ax in (position, velocity):
        assert line(ax, "PD" if ax is position else "path")
    for number, run in enumerate((pd, smc)):
        low, high = band(error, number)
        values = np.degrees(run.samples["error_rad"])
        assert (low.min(), high.max()) == (values.min(), values.max())
    both = [text.get_text() for text in figure.legends[0].get_texts()]
    assert both == ["PD", "sliding mode", "path", "the window"]
    # Other encoders: not counts, but degrees.
    coarse = simulate("pd_2", overrides={**SHORT, "rig.encoder.counts_per_rev": 2000})
    assert plot.comparison([pd, coarse]).axes[0].get_ylabel() == "position (°)"
    with pytest.raises(ValueError, match="expected 2, one for each result"):
        plot.comparison([pd, smc], labels=["PD"])


@pytest.fixture(scope="module")
def log(smc, tmp_path_factory):
    """A simulation's log."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    smc.save(path)
    return read_log(path)


def test_a_simulations_log_shows_what_was_measured_and_commanded(log, smc, tmp_path):
    figure = plot.log_overview(log)
    drawn(figure, tmp_path, "log")
    labels = ["position (counts)", "position (°)", "error (°)", "voltage (V)", "state"]
    assert [ax.get_ylabel() for ax in figure.axes] == labels
    close, position, error, voltage, state = figure.axes
    start, end = log.window
    assert close.get_xlim() == (start, end) and end - start < 0.5
    time, stairs = line(close, "encoder").get_data()
    assert time[0] >= start and time[-1] < end and 10 < np.ptp(stairs) < 200
    assert names(close) == ["encoder", "path", "at rest"]
    assert state.get_xlabel() == "time (s)"
    counts = np.asarray(smc.samples["counts"])
    assert line(position, "encoder").get_ydata() == pytest.approx(counts * 0.018)
    assert line(position, "target").get_ydata() == pytest.approx(
        np.degrees(smc.samples["target_position_rad"]), abs=0.018 * 2**-15
    )
    for ax, seen in ((error, np.degrees(smc.samples["measured_error_rad"])), (voltage, smc.samples["voltage_v"])):
        band = ax.collections[0].get_paths()[0].vertices[:, 1]
        assert (band.min(), band.max()) == pytest.approx((seen.min(), seen.max()))
        assert ax.lines[-1].get_ydata().mean() == pytest.approx(seen.mean(), rel=1e-2, abs=1e-4)
    assert [text.get_text() for text in state.get_yticklabels()] == ["Running"]


COUNTERS = (
    "lost",
    "late",
    "duplicated",
    "reordered",
    "rejected_frames",
    "rejected_samples",
    "deadline_misses",
    "log_dropped",
)


def loop_log(log, lost=0):
    """The same log as if a loop had written it: answers that take time, a link, and a fault at the end."""
    channels = {name: dict(table.to_dict()) for name, table in log.channels.items() if name != "truth"}
    sample, command = channels["sample"], channels["command"]
    n = len(sample["time_s"])
    sample["lateness_us"] = np.arange(n) % 30 + 10
    sample["arrival"] = ["Fresh"] * (n - 1) + ["Missing"]
    command["source"] = ["Law"] * (n - 1) + ["Safe"]
    command["state"] = ["Running"] * (n - 1) + ["Faulted"]
    channels["event"] = {
        "time_s": [0.0, float(command["time_s"][-1])],
        "tick": [0, n - 1],
        "kind": ["StateChange"] * 2,
        "from_state": ["Armed", "Running"],
        "to_state": ["Running", "Faulted"],
        "cause": ["None", "StandStill"],
        "value": [0.0, 4e-4],
    }
    link = {name: [0, lost] for name in COUNTERS}
    channels["link"] = {"time_s": [0.5, 0.999], "tick": [500, 999], "received": [500, 999], **link}
    safe = Scenario.load("board_smc_2")
    tables = {k: Table(v) for k, v in channels.items()}
    return SimpleNamespace(channels=tables, scenario=safe, _picture=log._picture)


def test_a_loops_log_shows_answers_link_and_the_fault_that_ended_it(log, tmp_path):
    figure = plot.log_overview(loop_log(log))
    drawn(figure, tmp_path, "loop")
    labels = ["position (°)", "error (°)", "voltage (V)", "state", "answer (µs)", "link (count)"]
    assert [ax.get_ylabel() for ax in figure.axes] == ["position (counts)", *labels]
    position, error, _, state, answer, link = figure.axes[1:]
    assert [text.get_text() for text in state.get_yticklabels()] == ["Running", "Faulted"]
    assert [text.get_text() for text in state.texts] == ["stand still"]
    assert names(answer) == ["answer", "deadline"]
    assert link.texts[0].get_text() == "none lost, late or refused of 999"
    n = len(log.channels["sample"])
    assert len(line(position, "encoder").get_xdata()) == n - 1
    assert np.flatnonzero(np.isnan(line(position, "target").get_ydata())).tolist() == [n - 1]
    assert not np.isnan(error.lines[-1].get_ydata()).any()  # what is no number does not count


def test_what_went_wrong_on_the_link_is_drawn_by_name(log, tmp_path):
    figure = plot.log_overview(loop_log(log, lost=3))
    drawn(figure, tmp_path, "link")
    assert set(names(figure.axes[-1])) == {name.replace("_", " ") for name in COUNTERS}
    assert line(figure.axes[-1], "lost").get_ydata().tolist() == [0, 3]


def test_counts_that_wrap_are_drawn_without_a_jump(log):
    channels = {name: dict(table.to_dict()) for name, table in log.channels.items()}
    counts = np.asarray(channels["sample"]["counts"], dtype=np.int64)
    channels["sample"]["counts"] = (counts + 2**31 - 50 + 2**31) % 2**32 - 2**31
    tables = {k: Table(v) for k, v in channels.items()}
    wrapped = SimpleNamespace(channels=tables, scenario=log.scenario, _picture=lambda: (None, None))
    shown = line(plot.log_overview(wrapped).axes[0], "encoder").get_ydata()
    assert np.diff(shown) == pytest.approx(np.diff(counts) * 0.018)


def test_a_log_without_commands_is_refused(log):
    with pytest.raises(ValueError, match="no records of commands"):
        plot.log_overview(SimpleNamespace(channels={}, scenario=None))


def test_a_result_a_sweep_and_the_paper_draw_themselves(smc, gains):
    assert [ax.get_ylabel() for ax in smc.plot().axes][:2] == ["position (counts)", "error (°)"]
    assert gains.plot("law.smc.kp_v", "law.smc.boundary_rad_s", "rms_error_rad").get_xlabel() == "law.smc.kp (V)"
