"""Takes pictures of live view and playground in Chromium without a window, as ``cargo xtask screenshots`` does.

``screenshots.py CLUTCH STICK-SLIP.html FOLDER`` puts each view at the sizes of a desktop and a phone, in light and in
dark, into FOLDER, to be looked at; those that the documentation shows are kept in docs/figures, with few colours. The
live view is of a loop in real time: half a minute.
"""

import contextlib
import subprocess
import sys
import time
from pathlib import Path

from PIL import Image

import browser

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / "docs" / "figures"
SIZES = {"desktop": (1280, 900), "phone": (390, 844)}
#: Names of pictures that are kept, and their names in the documentation.
KEPT = {
    "live_desktop_light": "live",
    "live_phone_dark": "live_phone",
    "playground_desktop_light": "playground",
    "playground_phone_dark": "playground_phone",
}
#: What each view has to have before its picture is taken.
FULL = "typeof data == 'object' && data.t.length && data.t[data.t.length - 1] > 21 && !dirty"
ANSWERED = "document.body?.dataset.answers && !busy && waiting === null"


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


def take(page, name, address, folder, ready, prepare="null"):
    """A picture of the window, and one of the whole page, for each size and scheme."""
    page.size(*SIZES["desktop"])
    page.call("Page.navigate", url=address)
    wait(page, ready)
    page.run(prepare)
    for kind, size in SIZES.items():
        for scheme in ("light", "dark"):
            page.size(*size, scheme)
            time.sleep(0.5)  # the window tells the page of it
            wait(page, ready)
            file = folder / f"{name}_{kind}_{scheme}.png"
            page.screenshot(file)
            page.screenshot(file.with_stem(f"{file.stem}_whole"), whole=True)


def keep(folder):
    """Puts the documentation's pictures into its folder, with 256 colours."""
    for name, kept in KEPT.items():
        picture = Image.open(folder / f"{name}.png").convert("RGB")
        picture.quantize(256).save(FIGURES / f"{kept}.png", optimize=True)
        print(f"wrote docs/figures/{kept}.png")


def main(clutch, playground, folder):
    """All of it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with browser.page() as page:
        with live_view(clutch) as address:
            take(page, "live", address, folder, FULL)
        third = "document.querySelectorAll('#steps button')[2].click()"
        take(page, "playground", Path(playground).resolve().as_uri(), folder, ANSWERED, third)
    keep(folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
