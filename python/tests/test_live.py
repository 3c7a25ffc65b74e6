"""The live view in a browser: what its page shows is what the run's log has; both sizes, both colour schemes."""

import contextlib
import json
import subprocess
import threading
import time

import pytest

DESKTOP, PHONE = (1280, 800), (390, 844)


@contextlib.contextmanager
def viewed(clutch, *args):
    """A command with its view: the process, and the view's address."""
    command = [clutch.binary, *map(str, args), "--live"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8")
    try:
        address = next(line for line in process.stderr if "http://" in line).split()[-1]
        threading.Thread(target=process.stderr.read, daemon=True).start()
        yield process, address
    finally:
        process.kill()
        process.wait()


def wait_for(page, condition):
    for _ in range(1500):
        if page.run(condition):
            return
        time.sleep(0.02)
    pytest.fail(f"{condition}: {page.run('document.body.innerText')}")


def text(page, name):
    return page.run(f"document.getElementById('{name}').textContent")


def test_the_page_follows_a_loop_and_its_button_stops_it(clutch, page, tmp_path):
    log = tmp_path / "run.mcap"
    with viewed(clutch, "loop", "board_smc_2", "--duration", 120, "--log", log) as (process, address):
        page.size(*DESKTOP)
        page.call("Page.navigate", url=address)
        wait_for(page, "typeof data == 'object' && data.t.length > 1500")
        assert text(page, "scenario") == "SMC at 2 °/s on a board"
        assert text(page, "state") == "running"
        # New frames come some thirty times a second; a busy machine may have fewer, and none for a second.
        before, begun, pace = page.run("data.t[data.t.length - 1]"), time.monotonic(), 0.0
        while pace < 0.3 and time.monotonic() < begun + 10:
            time.sleep(1)
            moved = page.run("data.t[data.t.length - 1]") - before
            pace = moved / (time.monotonic() - begun)
        assert 0.3 < pace < 1.2
        page.run("document.getElementById('stop').click()")
        assert process.wait(timeout=20) == 4
        wait_for(page, "document.getElementById('stop').disabled")
        said = page.run("document.getElementById('events').innerText")
        assert "stopped by the operator" in said and "you have stopped the run" in said
        figures = page.run("[last.tick, last.cycles, data.t.length, data.vlow, data.t]")
    # The log has what the page drew.
    exported = clutch("log", "export", log, "--out", tmp_path / "run.csv", "--channel", "command")
    assert exported.returncode == 0
    names, *rows = [line.split(",") for line in (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()]
    # On a busy machine two samples come in one wake-up: then both have the tick of the one that was answered.
    volts: dict[int, list[float]] = {}
    for row in rows:
        volts.setdefault(int(row[names.index("tick")]), []).append(float(row[names.index("voltage_v")]))
    tick, cycles, points, drawn, times = figures
    assert tick in volts and points > 1500
    assert cycles > 5
    pairs = zip(times, drawn, strict=True)
    wrong = [(t, v) for t, v in pairs if min(abs(logged - v) for logged in volts[round(t * 1000)]) > 1e-4]
    assert wrong == []


def test_a_gain_is_set_from_the_page(clutch, page):
    allowed = ("--set", "safety.live_gains=true")
    with viewed(clutch, "loop", "board_smc_2", "--duration", 120, *allowed) as (_, address):
        page.size(*DESKTOP)
        page.call("Page.navigate", url=address)
        wait_for(page, "document.querySelectorAll('#gains input').length == 4")
        put = """(() => {
            const input = document.querySelector('input[name="law.smc.kp_v"]');
            input.value = %s; input.dispatchEvent(new Event('input'));
            input.nextElementSibling.click();
        })()"""
        page.run(put % json.dumps("400"))
        wait_for(page, "document.getElementById('verdict').className == 'bad'")
        assert "not certified as sampled" in text(page, "verdict")
        page.run(put % json.dumps("4"))
        wait_for(page, "document.getElementById('events').innerText.includes('law.smc.kp_v = 4')")
        wait_for(page, "document.getElementById('verdict').textContent.startsWith('certified as sampled')")
        assert page.run("document.querySelector('input[name=\"law.smc.kp_v\"]').dataset.now") == "4"


def test_it_fits_both_sizes_and_both_schemes_and_asks_for_nothing_else(clutch, page):
    with viewed(clutch, "loop", "board_smc_2", "--duration", 120) as (_, address):
        page.requests.clear()
        page.complaints.clear()  # the browser complains of a refusal, as of that gain
        for size, scheme in [(DESKTOP, "light"), (DESKTOP, "dark"), (PHONE, "light"), (PHONE, "dark")]:
            page.size(*size, scheme)
            page.call("Page.navigate", url="about:blank")
            page.call("Page.navigate", url=address)
            wait_for(page, "typeof data == 'object' && data.t.length > 200 && !dirty")
            assert page.run("document.documentElement.scrollWidth") <= size[0]
            # Something is drawn in each picture.
            for name in ("position", "error", "volts"):
                inked = f"""(() => {{
                    const c = document.getElementById('{name}');
                    const seen = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
                    return new Set(new Uint32Array(seen.buffer)).size;
                }})()"""
                assert page.run(inked) > 3, name
            stop = page.run("document.getElementById('stop').getBoundingClientRect().toJSON()")
            assert stop["top"] >= 0 and stop["bottom"] < size[1] and stop["height"] >= 44
        base = address.split("?")[0]
        asked = {each.split("?")[0] for each in page.requests if not each.startswith(("data:", "about:"))}
        assert asked == {base, f"{base}events"}
    assert page.complaints == []
