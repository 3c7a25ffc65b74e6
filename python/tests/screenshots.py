"""Takes pictures of each view in Chromium without a window, as ``cargo xtask screenshots`` does.

``screenshots.py CLUTCH STICK-SLIP.html FOLDER`` puts live view, playground and report at the sizes of a desktop and a
phone, in light and in dark, and the terminal's scope into FOLDER, to be looked at; those of the first screen are kept
in docs/figures, with few colours, for docs/screenshots.md. Live view and scope are of a loop in real time: a minute.
"""

import contextlib
import re
import subprocess
import sys
import time
from pathlib import Path

from PIL import Image

import browser
import terminal

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / "docs" / "figures"
SIZES = {"desktop": (1280, 900), "phone": (390, 844)}
SCHEMES = ("light", "dark")
#: Columns and rows of the terminal.
TERMINAL = (80, 24)
#: A kept picture is at most so large.
MOST_BYTES = 100_000
#: Parts that each view has to have before its picture is taken.
FULL = "typeof data == 'object' && data.t.length && data.t[data.t.length - 1] > 21 && !dirty"
ANSWERED = "document.body?.dataset.answers && !busy && waiting === null"
DRAWN = "document.readyState == 'complete' && document.querySelector('svg, pre') !== null"


def wait(page, condition, seconds=120):
    """Wait until a condition of the page holds."""
    end = time.monotonic() + seconds
    while not page.run(condition):
        if time.monotonic() > end:
            raise TimeoutError(f"{condition}: {page.run('document.body.innerText')}")
        time.sleep(0.05)


@contextlib.contextmanager
def live_view(clutch):
    """The address of a loop's view; its gains can be changed."""
    command = [clutch, "loop", "board_smc_2", "--set", "safety.live_gains=true", "--duration", "60", "--live"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, encoding="utf-8") as loop:
        try:
            yield next(line for line in loop.stderr if "http://" in line).split()[-1]
        finally:
            loop.terminate()


def report(clutch, folder):
    """The address of the report of `clutch reproduce`."""
    subprocess.run([clutch, "reproduce", "--quiet", "--out", folder / "reproduce"], check=True)
    return (folder / "reproduce" / "report.html").resolve().as_uri()


def scope(clutch, folder):
    """The address of a page with the terminal's screen in it, when a loop has run for 21 s."""
    command = [clutch, "loop", "board_smc_2", "--duration", "60", "--scope"]
    screen = terminal.when(re.compile(r"Running +2[1-9]\.\d+ of").search, command, TERMINAL)
    file = folder / "scope.html"
    file.write_text(terminal.page(screen), encoding="utf-8")
    return file.resolve().as_uri()


def load(page, address, ready, size):
    page.size(*size)
    page.call("Page.navigate", url=address)
    wait(page, ready)


def take(page, name, address, folder, ready, prepare="null"):
    """A picture of the window, and one of the whole page, for each size and scheme."""
    load(page, address, ready, SIZES["desktop"])
    page.run(prepare)
    for kind, size in SIZES.items():
        for scheme in SCHEMES:
            page.size(*size, scheme)
            time.sleep(0.5)  # the window tells the page of it
            wait(page, ready)
            file = folder / f"{name}_{kind}_{scheme}.png"
            page.screenshot(file)
            page.screenshot(file.with_stem(f"{file.stem}_whole"), whole=True)


def keep(folder):
    """Puts the pictures of a screen into the documentation, with as many colours as its size allows."""
    names = [
        f"{view}_{kind}_{scheme}" for view in ("live", "playground", "report") for kind in SIZES for scheme in SCHEMES
    ]
    for name in [*names, "scope"]:
        picture, file = Image.open(folder / f"{name}.png").convert("RGB"), FIGURES / f"{name}.png"
        for colours in (256, 64, 16):
            picture.quantize(colours).save(file, optimize=True)
            if file.stat().st_size <= MOST_BYTES:
                break
        else:
            raise ValueError(f"{file}: {file.stat().st_size} bytes: expected at most {MOST_BYTES}")
        print(f"wrote {file.relative_to(ROOT)}: {file.stat().st_size} bytes")


def main(clutch, playground, folder):
    """All of it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with browser.page() as page:
        with live_view(clutch) as address:
            take(page, "live", address, folder, FULL)
        third = "document.querySelectorAll('#steps button')[2].click()"
        take(page, "playground", Path(playground).resolve().as_uri(), folder, ANSWERED, third)
        take(page, "report", report(clutch, folder), folder, DRAWN)
        load(page, scope(clutch, folder), DRAWN, SIZES["desktop"])
        box = page.run("document.querySelector('pre').getBoundingClientRect().toJSON()")
        page.size(round(box["right"]), round(box["bottom"]))
        page.screenshot(folder / "scope.png")
    keep(folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
