"""The page that simulates in a browser: the simulator's bits, the command's figures, both sizes and colour schemes."""

import http.server
import json
import os
import re
import resource
import shlex
import shutil
import statistics
import subprocess
import threading
import time
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = os.environ.get("CLUTCH_PLAYGROUND")
MOST_BYTES = 250_000
#: Processor time of a step of three laws in the browser, drawn, over that of its runs natively as tests build them:
#: 1.7 to 2.4 in fourteen series.
MOST_TIMES_NATIVE = 3.5
DESKTOP, PHONE = (1280, 900), (390, 844)

if not PAGE:
    pytest.skip("needs `cargo xtask playground`, and CLUTCH_PLAYGROUND", allow_module_level=True)
MODULE = os.environ["CLUTCH_PLAYGROUND_MODULE"]

# The worker of the page, in Node: the script and the module as they are.
IN_NODE = """
const { readFileSync } = require("fs");
const [worker, module, questions] = process.argv.slice(1);
const answers = [];
globalThis.postMessage = (told) => answers.push(told);
(0, eval)(readFileSync(worker, "utf8"));
(async () => {
  await onmessage({ data: { module: readFileSync(module) } });
  for (const question of readFileSync(questions, "utf8").trim().split("\\n")) await onmessage({ data: { question } });
  const broken = answers.find((told) => told.broken);
  if (broken || !answers[0].ready) throw new Error(JSON.stringify(broken));
  console.log(answers.slice(1).map((told) => told.answer).join("\\n"));
})();
"""

# The same in the page: a worker of its own, which is asked all questions in turn.
IN_PAGE = """
(async (questions) => {
  const worker = new Worker(URL.createObjectURL(new Blob([document.getElementById("worker").textContent])));
  const told = (message) => new Promise((resolve) => {
    worker.onmessage = ({ data }) => resolve(data);
    worker.postMessage(message);
  });
  await told({ module: bytes() });
  const answers = [];
  for (const question of questions) answers.push((await told({ question })).answer);
  return answers;
})(%s)
"""


@pytest.fixture(scope="module")
def questions(clutch):
    """Questions for the hash of every built-in scenario in both scalars, and for runs; answers of this machine."""
    names = [line.split()[0] for line in clutch("scenario", "list").stdout.splitlines() if line.strip()]
    assert len(names) >= 17
    scalars = [[name, [["sampling.scalar", f'"{scalar}"']]] for scalar in ("f64", "f32") for name in names]
    asked = [f"bits = {json.dumps([run])}" for run in scalars]
    runs = [["bench_pd_2", [["law.pd.kp_v_rad", "4000"]]], ["bench_glide_2", []], ["pd_2", [["law.pd.kp_v_rad", "x"]]]]
    asked.append(f"runs = {json.dumps(runs)}")
    here = subprocess.run(
        [os.environ["CLUTCH_PLAYGROUND_HERE"]],
        input="\n".join(asked),
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    answers = here.stdout.splitlines()
    assert len(answers) == len(asked)
    hashes = [next(iter(json.loads(answer).values())) for answer in answers[:-1]]
    assert sum(bool(re.fullmatch("[0-9a-f]{8}", h)) for h in hashes) >= 2 * len(names) - 1, hashes
    # f32_smc_2 is smc_2 in another scalar, and no run is another otherwise.
    assert len(set(hashes)) == len(hashes) - 2
    return asked, answers


def settle(page, script):
    """Run a script that changes a setting, and wait for the picture of it."""
    before = int(page.run("document.body.dataset.answers") or 0)
    page.run(script)
    for _ in range(1200):
        # Settled: nothing is asked, and nothing waits to be.
        if int(page.run("document.body.dataset.answers") or 0) > before and page.run("!busy && waiting === null"):
            return
        time.sleep(0.01)
    pytest.fail(f"no answer to {script}: {page.run('document.body.innerText')}")


def open_page(page, size=DESKTOP, scheme="light", fragment="", url=None):
    page.size(*size, scheme)
    page.call("Page.navigate", url="about:blank")
    page.call("Page.navigate", url=(url or Path(PAGE).as_uri()) + fragment)
    for _ in range(1200):
        if page.run("document.body?.dataset.answers"):
            return
        time.sleep(0.01)
    pytest.fail(page.run("document.body.innerText"))


def press(page, key, times=1):
    for _ in range(times):
        for kind in ("rawKeyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=39)


def shown(page):
    """Figures as the page has them: metrics by law."""
    return page.run("Object.fromEntries(answer.laws.map((law, i) => [law.scenario, answer.runs[i].metrics]))")


def commanded(page, clutch):
    """Figures of the commands that the page shows."""
    figures = {}
    for line in page.run("document.getElementById('command').textContent").splitlines():
        program, verb, *rest = shlex.split(line)
        assert program == "clutch"
        told = json.loads(clutch(verb, *rest, "--json").stdout)
        scenarios = [word for word in rest if word.startswith("bench_")]
        summaries = [told] if verb == "sim" else told["runs"]
        figures |= {name: summary["metrics"] for name, summary in zip(scenarios, summaries, strict=True)}
    return figures


def test_the_whole_page_is_small():
    if not shutil.which("node"):
        pytest.skip("needs Node, which compresses")
    size = "console.log(require('zlib').brotliCompressSync(require('fs').readFileSync(process.argv[1])).length)"
    told = subprocess.run(["node", "-e", size, PAGE], capture_output=True, encoding="utf-8", check=True)
    assert int(told.stdout) <= MOST_BYTES


def test_every_run_has_the_bits_of_this_machine_in_node(questions, tmp_path):
    if not shutil.which("node"):
        pytest.skip("needs Node")
    asked, answers = questions
    (tmp_path / "questions").write_text("\n".join(asked), encoding="utf-8")
    worker = ROOT / "crates/clutch-web/page/worker.js"
    command = ["node", "-e", IN_NODE, worker, MODULE, tmp_path / "questions"]
    told = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert told.stdout.splitlines() == answers, told.stderr


def test_every_run_has_the_bits_of_this_machine_in_the_page(page, questions):
    asked, answers = questions
    open_page(page)
    assert page.run(IN_PAGE % json.dumps(asked)) == answers


def test_a_slider_moves_the_figures_to_those_of_the_command(page, clutch):
    open_page(page)
    # Every law as its scenario has it, then one key of all laws, then one of PD alone.
    assert page.run("document.getElementById('command').textContent").startswith("clutch compare bench_pd_2 ")
    before = shown(page)
    assert before == commanded(page, clutch)
    for key in ("reference-ramp-rate_deg_s", "law-pd-kp_v_rad"):
        page.run(f"document.getElementById('{key}').focus()")
        press(page, "ArrowRight", 7)
        settle(page, "changed()")
        after = shown(page)
        assert after != before
        assert after == commanded(page, clutch)
        before = after
    assert "--set law.pd.kp_v_rad=" in page.run("document.getElementById('command').textContent")


def test_a_wrong_value_is_answered_in_the_words_of_the_command(page, clutch):
    open_page(page, fragment="#laws=pd,smc&law.pd.kp_v_rad=-1")
    wrong = clutch("sim", "bench_pd_2", "--set", "law.pd.kp_v_rad=-1", code=1).stderr
    said = page.run("document.getElementById('wrong').innerText")
    assert said.removeprefix("PD: ").strip() in " ".join(wrong.split())
    assert page.run("document.querySelectorAll('#figures td:nth-child(4)').length") == 5  # sliding mode runs
    settle(page, "document.getElementById('reset').click()")
    assert page.run("document.getElementById('wrong').hidden")
    # A key that no slider has, and that nobody has.
    settle(page, "set['rig.frction.preload'] = '1'; changed()")
    assert "unknown key" in page.run("document.getElementById('wrong').innerText")


def test_the_lesson_says_what_is_to_be_seen(page):
    open_page(page)
    figures = []
    for step in range(6):
        settle(page, f"document.querySelectorAll('#steps button')[{step}].click()")
        assert page.run("document.querySelectorAll('#steps button[aria-pressed=true]').length") == 1
        figures.append(shown(page))
    cycles = [{law: m["stick_slip_cycles_per_s"] for law, m in step.items()} for step in figures]
    pd, pid, smc, glide = "bench_pd_2", "bench_pid_2", "bench_smc_2", "bench_glide_2"
    assert 38 < cycles[0][pd] < 43  # some forty times a second
    assert list(cycles[0]) == [pd]
    assert cycles[1][smc] < cycles[1][pd] / 3
    largest = {law: m["max_error_rad"] for law, m in figures[2].items()}
    assert 3.5 < largest[smc] / largest[pd] < 4  # nearly four times
    assert cycles[2][glide] == 0 and largest[glide] < largest[pd] / 7
    assert figures[2][glide]["control_variation_v_s"] < figures[2][pd]["control_variation_v_s"] / 20
    assert 8.5 < cycles[3][pid] < 9.5 and cycles[3][glide] == 0  # some nine times a second
    assert cycles[4] == {glide: 0}
    assert list(cycles[5]) == [pd, smc, glide] and set(cycles[5].values()) == {0}
    # The changes that its steps invite to, and what they say of another speed.
    settle(page, "laws = new Set(['pid']); set = {}; changed()")
    assert shown(page)[pid]["stick_slip_cycles_per_s"] == 0
    settle(page, "laws = new Set(['smc']); set = {'law.smc.boundary_rad_s': '0.02'}; changed()")
    assert shown(page)[smc]["stick_slip_cycles_per_s"] > 2 * cycles[1][smc]
    settle(page, "laws = new Set(['glide']); set = {'rig.delay_ticks': '3'}; changed()")
    late = shown(page)[glide]["stick_slip_cycles_per_s"]
    settle(page, "set['law.glide.filter.delay_ticks'] = '3'; changed()")
    assert late > 0 and shown(page)[glide]["stick_slip_cycles_per_s"] < late


def test_a_link_brings_the_settings_back(page):
    open_page(page)
    settle(page, "laws = new Set(['pd', 'glide']); set = {'rig.ripple.rms': '0', 'law.glide.kp_1_s': '20'}; changed()")
    link, before = page.run("location.hash"), shown(page)
    open_page(page, fragment=link)
    assert shown(page) == before and len(before) == 2
    assert page.run("document.getElementById('law-glide-kp_1_s').getAttribute('aria-valuetext')") == "20 1/s"


def test_the_picture_follows_a_slider_that_is_dragged(page):
    open_page(page)
    drag = """(async () => {
        const pictures = new Set(), slider = document.getElementById("reference-ramp-rate_deg_s");
        for (let i = 0; i < 300 && pictures.size < 4; i++) {
            slider.value = 60 + (i % 80);
            slider.dispatchEvent(new Event("input"));
            pictures.add(document.querySelector("#position svg").outerHTML);
            await new Promise((done) => setTimeout(done, 10));
        }
        return pictures.size;
    })()"""
    assert page.run(drag) == 4  # while it moves, not once it rests


def test_slow_motion_goes_along_the_curves(page):
    open_page(page)
    page.run("document.getElementById('play').click()")
    where = "[...document.querySelectorAll('#position circle')].map((dot) => dot.getAttribute('cx'))"
    first = page.run(where)
    assert len(first) == 3
    for _ in range(500):
        if page.run(where) != first:
            break
        time.sleep(0.01)
    assert page.run(where) != first
    page.run("document.getElementById('play').click()")
    assert page.run(where) == []


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_both_sizes_and_both_schemes(page, size, scheme, tmp_path):
    open_page(page, size, scheme)
    assert page.run("document.documentElement.scrollWidth") <= size[0]
    paper = re.findall(r"\d+", page.run("getComputedStyle(document.body).backgroundColor"))
    assert (int(paper[0]) > 128) == (scheme == "light")
    # A picture in each place, within the window, and nothing wrong.
    for place in ("position", "error", "velocity", "voltage"):
        box = page.run(f"document.querySelector('#{place} svg').getBoundingClientRect().toJSON()")
        assert box["left"] >= 0 and box["right"] <= size[0] and box["height"] > 100
    assert page.run("document.getElementById('wrong').hidden")
    # The names of the laws stand beside each other.
    laws = page.run("[...document.querySelectorAll('#laws label')].map((law) => law.getBoundingClientRect().toJSON())")
    assert len(laws) == 4 and all(a["right"] < b["left"] for a, b in pairwise(laws)), laws
    # The step of the lesson that is pressed is seen: the third, and any other.
    for press in ("null", *(f"document.querySelectorAll('#steps button')[{step}].click()" for step in (0, 4))):
        page.run(press)
        box = page.run("document.querySelector('#steps [aria-pressed=true]').getBoundingClientRect().toJSON()")
        assert box["left"] >= 0 and box["right"] <= size[0], press
    # On a phone, moving a slider shows its effect.
    page.run("document.getElementById('law-glide-kp_1_s').scrollIntoView({block: 'center'})")
    top = page.run("document.querySelector('#position').getBoundingClientRect().toJSON()")
    slider = page.run("document.getElementById('law-glide-kp_1_s').getBoundingClientRect().toJSON()")
    if size == PHONE:
        assert top["top"] >= 0 and top["bottom"] <= slider["top"]
    # Everything that is set or pressed has a name.
    unnamed = """[...document.querySelectorAll('input, textarea, button')]
        .filter((e) => !(e.labels?.[0] ?? e).textContent.trim() && !e.ariaLabel).length"""
    assert page.run(unnamed) == 0


# Steps of a slider one after the other, in the page: their times in ms, and the questions that they ask.
STEPS = """
(async (law, rates) => {
  [laws, set] = [new Set(law.split(",")), {}];
  const times = [], questions = [];
  for (const rate of rates) {
    const before = document.body.dataset.answers;
    set["reference.ramp.rate_deg_s"] = rate;
    changed();
    while (document.body.dataset.answers === before || busy || waiting !== null)
      await new Promise((later) => setTimeout(later, 5));
    times.push(Number(document.body.dataset.step));
    questions.push(`runs = ${JSON.stringify(asked.laws.map((law) => [law.scenario, setOf(law)]))}`);
  }
  return [times, questions];
})(%s, %s)
"""


def test_a_step_of_a_slider_takes_little_more_than_its_simulation(page, capsys):
    """Counted in processor time, which other programs on the machine do not lengthen as they do a step."""
    open_page(page)
    report, ratios = [], {}
    rates = [f"{2 + 0.01 * i:.2f}" for i in range(32)]
    for law in ("pd", "smc", "glide", "pd,smc,glide"):
        # The first part compiles.
        page.run(STEPS % (json.dumps(law), json.dumps(rates[:8])))
        before = page.processor_s()
        times, questions = page.run(STEPS % (json.dumps(law), json.dumps(rates[8:])))
        taken = page.processor_s() - before
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        here = [os.environ["CLUTCH_PLAYGROUND_HERE"]]
        subprocess.run(here, input="\n".join(questions), capture_output=True, encoding="utf-8", check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        native = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        ratios[law] = taken / native
        ms = 1000 / len(times)
        took = f"processor {taken * ms:.0f} ms, {ratios[law]:.2f} times the native {native * ms:.0f} ms"
        report.append(f"{law}: median {statistics.median(times):.0f}, at most {max(times):.0f} ms; {took}")
    with capsys.disabled():
        print("\na step of a slider, simulated and drawn", *report, sep="\n  ")
    # Drawing has its part in a step of a single law, whose runs are short.
    assert ratios["pd,smc,glide"] < MOST_TIMES_NATIVE


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Files of a folder, without a word about each."""

    def log_message(self, *_):
        pass


def test_it_asks_for_nothing_and_complains_of_nothing(page):
    """From a stick, and from a server."""
    files = partial(Quiet, directory=Path(PAGE).parent)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), files) as server:
        threading.Thread(target=server.serve_forever).start()
        own = f"http://127.0.0.1:{server.server_port}/{Path(PAGE).name}"
        for url in (Path(PAGE).as_uri(), own):
            page.requests.clear()
            open_page(page, url=url)
            assert {each for each in page.requests if not each.startswith(("blob:", "data:"))} == {url}
        server.shutdown()
    assert page.complaints == []
