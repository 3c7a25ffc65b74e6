"""The referee: this package's engines, SciPy, straw men, adapters, and an engine of one's own."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clutch import _clutch, referee
from clutch.referee import _compare
from clutch.referee._kamino import Kamino
from clutch.referee._mujoco import MuJoCo, MuJoCoLuGre
from clutch.referee._scipy import SciPy
from clutch.referee._straw_men import Armstrong, Karnopp, Makkar, Tanh

DOCS = Path(__file__).resolve().parents[2] / "docs"
CASES = referee.cases()
#: Those that SciPy solves within seconds.
QUICK = [name for name in CASES if name not in ("D2_coulomb", "D2_lugre", "D2_elasto_plastic", "A7")]


@pytest.mark.parametrize("name", QUICK)
def test_scipy_and_this_package_find_what_a_case_expects(name):
    case = CASES[name]
    results = [r for r in referee.compare([case], [*referee.own(), SciPy()]) if r.refused is None]
    assert results
    for result in results:
        assert result.failed is None
        assert result.held == len(result.figures), (result.engine, result.figures)
    # A scenario is for this package only.
    assert ("scipy" in {r.engine for r in results}) == (case.mechanism is not None)


def test_scipy_sees_a_break_away_that_is_over_within_a_step():
    # The load is above what friction bears for a hundredth of its period, at any place against the solver's steps.
    for phase in np.linspace(0, 0.2, 9):
        case = referee.Case(f"""
            id = "S1"
            title = "A sine that is just above the friction"
            source = "analytic"
            duration_s = 0.75
            sample_s = 0.01
            [mechanism]
            inertia = [[1.0]]
            load = [[{{ amplitude = 1.0005, frequency_hz = 1.0, phase_turns = {-phase} }}]]
            [[mechanism.row]]
            joints = [1.0]
            normal = [{{ constant = 1.0 }}]
            friction.coulomb = {{ mu_static = 1.0, mu_dynamic = 1.0 }}
            [[expect]]
            name = "break-away"
            value = {phase + np.arcsin(1 / 1.0005) / (2 * np.pi)}
            within = 1e-9
            unit = "s"
            observe = {{ kind = "slips" }}
        """)
        (result,) = referee.compare([case], [SciPy()])
        assert result.failed is None, result.failed
        assert result.held == 1, (phase, result.figures)


def test_a_straw_man_creeps_where_friction_holds():
    results = {r.engine: r for r in referee.compare([CASES["C1"]], [Tanh(), Makkar(), Karnopp(), Armstrong()])}
    for name in ("tanh", "makkar"):
        speed = results[name].figures[0].measured
        assert 1e-5 < speed < 1e-3, name
    assert results["karnopp"].held == 2


def test_an_engine_whose_package_is_missing_is_skipped_with_a_word(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    results = referee.compare([CASES["P3"]], [MuJoCo(), MuJoCoLuGre(), Kamino(), SciPy()])
    assert [r.refused for r in results] == [
        "mujoco is not installed: pip install mujoco",
        "mujoco is not installed: pip install mujoco",
        "newton is not installed: pip install newton",
        "scipy is not installed: pip install 'clutch-control[sweep]'",
    ]
    assert "mujoco           skipped: mujoco is not installed" in referee.table([CASES["P3"]], results)


def test_an_engine_that_gives_no_trajectory_is_told_so():
    class Five(Tanh):
        name = "five"

        def run(self, case):
            return 5

    with pytest.raises(TypeError, match=r"engine five: run\(\) gave 5: expected a clutch\.referee\.Trajectory"):
        referee.compare([CASES["C1"]], [Five()])


def test_an_engine_that_this_package_does_not_have_is_refused_by_its_name():
    with pytest.raises(ValueError, match=r"^name = 'nosuch': expected one of system, bristled_system, .*, bristle$"):
        referee.Own("nosuch")


def test_an_engine_that_does_not_take_a_case_says_why():
    assert "bristles" in MuJoCo().refuses(CASES["L1"])
    assert "scenario" in MuJoCo().refuses(CASES["A3_pd"])
    assert MuJoCoLuGre().refuses(CASES["L1"]) is None
    assert "tree" in Kamino().refuses(CASES["X2"]) or "inertia" in Kamino().refuses(CASES["X2"])
    assert "60000 steps" in Kamino().refuses(CASES["A5"])
    with pytest.raises(referee.DoesNotApply, match="it needs friction with bristles"):
        CASES["P3"].run("bristle")


def test_mujoco_takes_what_it_says_it_takes():
    pytest.importorskip("mujoco")
    results = referee.compare([CASES[name] for name in ("C1", "P3", "X2_over", "L5_4")], [MuJoCo(), MuJoCoLuGre()])
    for r in results:
        assert (r.refused is None) == ((r.case == "L5_4") == (r.engine == "mujoco_lugre"))
        assert r.failed is None
    # Its creep at 84 % of what friction bears, rad/s.
    creep = next(r for r in results if r.case == "C1").figures[0].measured
    assert creep == pytest.approx(np.radians(1.674), rel=0.01)


def test_an_engine_that_gives_up_does_not_end_the_comparison():
    class Breaks:
        name, about = "breaks", "gives up"

        def missing(self):
            return None

        def refuses(self, case):
            return None

        def run(self, case):
            raise ArithmeticError("no step is short enough")

    # Nor does one of this package, of a load that no number holds.
    text = dict(_clutch.referee_cases())["C1"].replace("constant = 0.047088", "constant = 1e308")
    beyond = referee.compare([referee.Case(text)], referee.own())
    assert {r.engine for r in beyond if r.failed} >= {"system", "dormand_prince", "exact_flow"}

    case = CASES["P3"]
    with pytest.raises(ValueError, match="case P3: given twice"):
        referee.compare([case, case], referee.own())
    with pytest.raises(ValueError, match="engine breaks: given twice"):
        referee.compare([case], [Breaks(), Breaks()])
    results = referee.compare([case], [Breaks(), *referee.own()])
    assert results[0].failed == "no step is short enough"
    text = referee.table([case], results)
    assert "breaks         gave up: no step is short enough" in text
    assert next(r for r in results if r.engine == "system").held == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position": np.zeros((2, 2001))}, r"P3: trajectory.position: 2 lists; expected 1"),
        ({"velocity": np.zeros((1, 2000))}, r"P3: trajectory.velocity\[0\]: 2000 samples; expected 2001"),
        ({"position": np.full((1, 2001), np.nan)}, r"P3: trajectory.position\[0\]\[0\] = NaN: expected a finite"),
        ({"torque": np.zeros((3, 2001))}, r"P3: trajectory.torque: 3 lists; expected 1"),
        ({"events": [(0.5, 1, True)]}, r"P3: trajectory.events\[0\]: row 1: expected one from 0 to 0"),
        ({"events": [(0.5, -1, True)]}, r"P3: trajectory.events\[0\]: row -1: expected a number from 0 on"),
        (
            {"events": [(0.5, 0, True), (0.4, 0, False)]},
            r"P3: trajectory.events\[1\]: time 0.4 s: expected one from 0.5",
        ),
        ({"events": [(2.5, 0, True)]}, r"P3: trajectory.events\[0\]: time 2.5 s: expected one from 0 to 2 s"),
        ({"position": np.zeros((1, 1, 2001))}, r"an array of 3 dimensions"),
    ],
)
def test_a_trajectory_that_does_not_fit_its_case_is_refused(change, said):
    case = CASES["P3"]
    whole = {"position": np.zeros((1, 2001)), "velocity": np.zeros((1, 2001))}
    with pytest.raises(ValueError, match=said):
        case.judge(referee.Trajectory(**{**whole, **change}))


def test_a_case_of_ones_own_is_a_text():
    text = dict(_clutch.referee_cases())["A9"]
    mine = referee.Case(text.replace("position = [0.105]", "position = [0.125]"), "mine")
    stops = mine.judge(mine.run("system"))
    # Six half cycles: it would stop at 0.005, and does so after 6π/10 s.
    assert stops[0].measured == pytest.approx(0.6 * np.pi, abs=1e-9)
    assert stops[1].measured == pytest.approx(0.005, abs=1e-9)
    with pytest.raises(ValueError, match=r"mine: mechanism.position: 2 numbers; expected 1"):
        referee.Case(text.replace("[0.105]", "[0.1, 0.2]"), "mine")
    with pytest.raises(ValueError, match=r"engine = \"euler\": expected one of: system, bristled_system"):
        mine.run("euler")
    with pytest.raises(ValueError, match=r"step = 3e-1 s: expected a whole part"):
        mine.run("dormand_prince", step=0.3)


def test_the_page_has_every_case_what_the_engines_make_of_them_and_a_case_to_begin_with():
    page, whole = (DOCS / "referee.md").read_text(encoding="utf-8"), (DOCS / "referee.txt").read_text(encoding="utf-8")
    results = referee.compare(CASES.values(), referee.own())
    assert f"{len(CASES)} cases" in page
    for case in CASES.values():
        assert f"{case.id}  {case.title}\n" in whole
    for engine in referee.own():
        own = [r for r in results if r.engine == engine.name and r.refused is None]
        figures, held = sum(len(r.figures) for r in own), sum(r.held for r in own)
        assert re.search(rf"^{engine.name} +{len(own)} +{figures} +{held} ", whole, re.MULTILINE), engine.name
        assert re.search(rf"^\| `{engine.name}`.* \| {len(own)} \| {figures} \| {held} \|$", page, re.MULTILINE)
    (text,) = re.findall(r"^```toml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    mine = referee.Case(text, "mine")
    assert all(figure.holds for figure in mine.judge(mine.run("system")))


def test_the_command_prints_a_table_that_fits_a_terminal(tmp_path):
    asked = [sys.executable, "-m", "clutch.referee", "P3", "X1"]
    done = subprocess.run(asked, capture_output=True, encoding="utf-8", timeout=300)
    assert done.returncode == 0, done.stderr
    figures, about = done.stdout.rstrip().rsplit("\n\n", 1)
    assert all(len(line) <= 80 for line in figures.splitlines()), done.stdout
    assert "SciPy " in about
    assert "P3  A brake that closes at 0.1 s stops a sliding mass" in done.stdout
    assert "exact_flow" in done.stdout and "karnopp" in done.stdout
    wrong = subprocess.run([*asked, "--engine", "eule"], capture_output=True, encoding="utf-8", timeout=60)
    assert wrong.returncode == 2 and "--engine eule: expected one of system, " in wrong.stderr
    file = tmp_path / "mine.toml"
    file.write_text(dict(_clutch.referee_cases())["P3"].replace("sample_s = 0.001", "sample_s = 0.3"), encoding="utf-8")
    bad = subprocess.run([*asked[:3], str(file)], capture_output=True, encoding="utf-8", timeout=60)
    assert bad.returncode == 2 and "mine.toml: sample_s = 0.3: expected" in bad.stderr, bad.stderr
    none = subprocess.run([*asked[:3], "L1", "--engine", "system"], capture_output=True, encoding="utf-8", timeout=60)
    assert none.returncode == 1, none.stdout


def test_the_same_engine_twice_gives_the_same_bits():
    case = CASES["X1"]
    a, b = case.run("system"), case.run("system")
    assert np.array_equal(a.position, b.position) and a.events == b.events
    assert _compare.Own("system").run(case).position.shape == (4, 1501)
