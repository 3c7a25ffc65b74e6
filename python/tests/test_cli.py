"""The command as a user meets it: what it prints, writes and exits with."""

import csv
import html.parser
import json
import struct
import time
import xml.etree.ElementTree as ElementTree
import zlib

import numpy as np
import pytest

from oracle import PERIOD, TURN, Ctc, Dac, Pd, Smc

SVG = "http://www.w3.org/2000/svg"


# --- sim ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("scenario", ["pd_2", "smc_2", "ctc_2", "bench_pd_2"])
def test_the_figures_in_the_json_are_those_of_the_samples_in_the_csv(clutch, scenario):
    summary, d = clutch.simulate(scenario, "run.duration_s=2", "run.settle_s=0.5")
    d = d[d["time_s"] >= 0.5]
    n, error, m = len(d), d["error_rad"], summary["metrics"]
    jerk = np.diff(d["velocity_rad_s"], 2) / PERIOD**2
    expected = {
        "measured_s": n * PERIOD,
        "max_error_rad": np.max(np.abs(error)),
        "rms_error_rad": np.sqrt(np.mean(error**2)),
        "mean_error_rad": np.mean(error),
        "iae_rad_s": np.sum(np.abs(error)) * PERIOD,
        "control_variation_v_s": np.sum(np.abs(np.diff(d["voltage_v"]))) / (n * PERIOD),
        "jerk_rms_rad_s3": np.sqrt(np.sum(jerk**2) / (n - 2)),
    }
    for name, value in expected.items():
        assert m[name] == pytest.approx(value, rel=1e-10), f"{name} is not what its definition gives"
    # Sticks lie between samples: at least those that a sample saw, and their time to a period each.
    seen = np.count_nonzero(np.diff(d["stuck"]) > 0.0)
    cycles = m["stick_slip_cycles_per_s"] * n * PERIOD
    assert cycles >= seen - 1, f"{cycles} sticks, the samples show {seen}"
    share = np.mean(d["stuck"])
    assert abs(m["stick_time_fraction"] - share) <= (cycles + 1) / n, "time stuck is not that of the samples"


@pytest.mark.parametrize(
    ("scenario", "law"),
    [("pd_2", Pd()), ("smc_2", Smc()), ("ctc_2", Ctc()), ("bench_pd_2", Pd()), ("bench_smc_2", Smc())],
)
def test_each_row_of_the_csv_is_encoder_derivative_5_law_limits_and_converter(clutch, scenario, law):
    _, d = clutch.simulate(scenario, "run.duration_s=1", "run.settle_s=0")
    assert np.allclose(d["time_s"], np.arange(1000) * PERIOD, rtol=1e-14)
    assert np.all(d["counts"] == np.floor(d["position_rad"] * 20_000 / TURN)), "the encoder does not floor"
    assert np.allclose(d["error_rad"], d["target_position_rad"] - d["position_rad"], atol=1e-15)
    e = d["target_position_rad"] - d["counts"] * TURN / 20_000
    assert np.allclose(d["measured_error_rad"], e, atol=1e-14), "e is not θ_d − counts"
    rate, dac = 0.0, Dac()
    for k in range(1000):
        rate = 0.8 * rate + 0.2 * (e[k] - e[max(k - 1, 0)]) / PERIOD
        assert abs(d["error_rate_rad_s"][k] - rate) < 1e-11, f"derivative (5) at tick {k}"
        demand = law.demand(e[k], rate, d["target_velocity_rad_s"][k])
        volts = dac.volts(dac.code(min(max(demand, 0.0), 10.0)))
        assert dac.volts(d["code"][k]) == d["voltage_v"][k], f"the converter's code at tick {k}"
        # Half a step of the converter, where rounding of the demand may fall either way.
        near = abs(d["voltage_v"][k] - volts) <= 1e-12 or abs(d["voltage_v"][k] - demand) <= 20 / 8192 + 1e-9
        assert near, f"{type(law).__name__} at tick {k}: {d['voltage_v'][k]} V, the equation gives {volts} V"
    assert np.all((d["voltage_v"] >= 0.0) & (d["voltage_v"] <= 10.0)), "a pad can only push, up to 10 V"


def test_json_is_alone_on_standard_output_and_nothing_is_on_standard_error(clutch):
    done = clutch("sim", "smc_2", "--json", "--set", "run.duration_s=2")
    assert done.stderr == ""
    summary = json.loads(done.stdout)
    assert {"scenario", "version", "engine", "seed", "metrics"} <= summary.keys()
    done = clutch("certify", "smc_2", "--json")
    assert done.stderr == "" and json.loads(done.stdout)["certified_continuous_time"] is True


@pytest.mark.parametrize("scenario", ["pd_2", "bench_smc_2"])
def test_a_seed_repeats_to_the_byte_and_another_seed_differs(clutch, scenario, tmp_path):
    def run(name, seed):
        file = tmp_path / name
        done = clutch("sim", scenario, "--json", "--csv", file, "--set", f"run.seed={seed}")
        return done.stdout, file.read_bytes()

    first, again, other = run("a.csv", 7), run("b.csv", 7), run("c.csv", 8)
    assert first == again, "the same seed gave another run"
    assert first[1] != other[1], "another seed gave the same samples"
    assert json.loads(first[0])["metrics"] != json.loads(other[0])["metrics"]


def test_plots_of_a_run_are_valid_files(clutch, tmp_path):
    for name in ("run.svg", "run.png"):
        clutch("sim", "pd_2", "--set", "run.duration_s=2", "--plot", tmp_path / name)
    check_svg(tmp_path / "run.svg")
    check_png(tmp_path / "run.png")


# --- exit codes --------------------------------------------------------------------------------


def test_certify_exits_0_for_certified_gains_and_2_for_gains_that_are_not(clutch):
    clutch("certify", "smc_2", code=0)
    weak = clutch("certify", "smc_2", "--json", "--set", "law.smc.kp_v=2", code=2)
    answer = json.loads(weak.stdout)
    assert answer["certified_continuous_time"] is False and answer["reason"]
    assert weak.stderr == ""


def test_errors_exit_1_and_are_printed_to_standard_error_only(clutch, tmp_path):
    for args, word in [
        (("sim", tmp_path / "none.toml"), "none.toml"),
        (("sim", "smc_2", "--set", "law.smc.kp_v=-1"), "kp_v"),
        (("sim", "smc_2", "--set", "law.smc.unknown=1"), "unknown"),
        (("certify", "smc_2", "--set", "rig.friction.stribeck.mu_static=-1"), "mu_static"),
    ]:
        done = clutch(*args, code=1)
        assert done.stdout == "" and word in done.stderr, done.stderr


def test_a_command_line_that_cannot_be_understood_exits_64(clutch):
    assert clutch("simulate", code=64).stdout == ""
    clutch("--version", code=0)


# --- reproduce ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def reproduced(clutch, tmp_path_factory):
    """Folder and outcome of `clutch reproduce`, run once."""
    folder = tmp_path_factory.mktemp("reproduce") / "out"
    return folder, clutch("reproduce", "--out", folder, code=None)


def test_every_statement_of_the_paper_holds_or_fails_as_documented(reproduced):
    _, done = reproduced
    assert done.returncode == 0, done.stdout.splitlines()[-2:] or done.stderr


def test_no_progress_bar_is_drawn_into_a_pipe(reproduced):
    _, done = reproduced
    assert done.stderr == ""
    assert "\x1b" not in done.stdout and "\r" not in done.stdout


def test_each_claim_says_what_was_stated_measured_and_allowed(reproduced):
    claims = json.loads((reproduced[0] / "report.json").read_text(encoding="utf-8"))["claims"]
    assert len(claims) >= 20
    assert len({c["id"] for c in claims}) == len(claims), "ids of claims repeat"
    for c in claims:
        assert {"id", "paper", "measured", "unit", "band", "holds", "note"} <= c.keys()
        low, high = c["band"]
        inside = (low is None or c["measured"] >= low) and (high is None or c["measured"] <= high)
        assert c["holds"] == inside, f"{c['id']}: holds is not whether {c['measured']} lies in {c['band']}"


def test_table_3_is_the_reduction_that_the_papers_example_means(reproduced):
    with open(reproduced[0] / "table3.csv", newline="", encoding="utf-8") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    assert [r["rate_deg_s"] for r in rows] == [10.0, 6.0, 2.0]
    assert [r["paper_percent"] for r in rows] == [88.6, 88.9, 83.8]
    for r in rows:
        reduction = 100.0 * (1.0 - r["smc_cycles_per_s"] / r["pd_cycles_per_s"])
        assert r["reduction_percent"] == pytest.approx(reduction, rel=1e-12), "(32) is 100 (1 − SMC/PD)"


@pytest.mark.parametrize("figure", ["laws", "fig8", "fig9", "fig10"])
def test_figures_are_valid_files(reproduced, figure):
    check_svg(reproduced[0] / f"{figure}.svg")
    check_png(reproduced[0] / f"{figure}.png")


def until_drawn(page):
    for _ in range(500):
        if page.run("document.readyState == 'complete' && document.querySelector('figure svg') != null"):
            return
        time.sleep(0.02)
    pytest.fail("no figure")


def test_the_first_figure_of_the_report_is_on_a_phones_first_screen(reproduced, page):
    width, height = 390, 844
    for scheme in ("light", "dark"):
        page.size(width, height, scheme)
        page.call("Page.navigate", url="about:blank")
        page.call("Page.navigate", url=(reproduced[0] / "report.html").as_uri())
        until_drawn(page)
        figure = page.run("document.querySelector('figure svg').getBoundingClientRect().toJSON()")
        # Enough of it that one sees what it is.
        assert figure["top"] < height - 100 and figure["height"] > 200, (scheme, figure)
        assert figure["left"] >= 0 and figure["right"] <= width
        assert page.run("document.documentElement.scrollWidth") <= width


def test_the_figures_of_the_report_are_dark_where_the_page_is(reproduced, page, tmp_path):
    image = pytest.importorskip("PIL.Image")
    lightness = {}
    for scheme in ("light", "dark"):
        page.size(1280, 900, scheme)
        page.call("Page.navigate", url="about:blank")
        page.call("Page.navigate", url=(reproduced[0] / "report.html").as_uri())
        until_drawn(page)
        box = page.run("document.querySelector('figure svg').getBoundingClientRect().toJSON()")
        page.screenshot(tmp_path / f"{scheme}.png", whole=True)
        shot = image.open(tmp_path / f"{scheme}.png").convert("L")
        # A figure is mostly paper: the median is its lightness, beside that of the page.
        figure = shot.crop([round(box[side]) for side in ("left", "top", "right", "bottom")])
        lightness[scheme] = [np.median(np.asarray(figure)), shot.getpixel((2, 2))]
    assert lightness["light"] == [255, 255]
    on_figure, on_page = lightness["dark"]
    assert on_page < 40 and abs(on_figure - on_page) < 8


def test_the_report_is_one_page_that_needs_no_network(reproduced):
    text = (reproduced[0] / "report.html").read_text(encoding="utf-8")
    left = text.replace(SVG, "")
    assert "http://" not in left and "https://" not in left, "the report refers to the network"
    page = Page()
    page.feed(text)
    page.close()
    assert page.open == [] and page.wrong == [], (page.open, page.wrong)
    assert all(x.startswith(("#", "data:")) for x in page.references), page.references
    assert page.seen.count("svg") == 4 + 6 + 4 + 6 and "table" in page.seen


class Page(html.parser.HTMLParser):
    """Checks that tags close in order and gathers what a page refers to."""

    VOID = frozenset({"meta", "br", "hr", "img", "link", "input", "col"})

    def __init__(self):
        super().__init__()
        self.open, self.wrong, self.references, self.seen = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.seen.append(tag)
        self.references += [v for k, v in attrs if k in ("src", "href", "xlink:href")]

    def handle_endtag(self, tag):
        # A paragraph, row or cell may be left open; anything else may not.
        while self.open and self.open[-1] != tag and self.open[-1] in ("p", "td", "th", "tr", "li"):
            self.open.pop()
        if not self.open or self.open.pop() != tag:
            self.wrong.append((tag, self.getpos()))


def check_svg(file):
    root = ElementTree.parse(file).getroot()
    assert root.tag == f"{{{SVG}}}svg", f"{file.name} is not an SVG"
    drawn = [e for e in root.iter() if e.tag.rpartition("}")[2] in ("polyline", "path", "line")]
    assert drawn, f"{file.name} shows no line"


def check_png(file):
    """Chunks with their checksums, and as many bytes of pixels as the header says."""
    data = file.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n"), f"{file.name} is not a PNG"
    at, chunks = 8, []
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        body = data[at + 4 : at + 8 + length]
        (checksum,) = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        assert zlib.crc32(body) == checksum, f"{file.name}: a chunk is damaged"
        chunks.append((body[:4], body[4:]))
        at += 12 + length
    assert chunks[0][0] == b"IHDR" and chunks[-1][0] == b"IEND"
    width, height, depth, colour = struct.unpack(">IIBB", chunks[0][1][:10])
    assert depth == 8 and colour in (2, 6)
    pixels = zlib.decompress(b"".join(body for kind, body in chunks if kind == b"IDAT"))
    assert len(pixels) == height * (1 + width * {2: 3, 6: 4}[colour])
    assert len(set(pixels)) > 2, f"{file.name} is blank"
