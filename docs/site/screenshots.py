"""Takes pictures of the pages that users see: `python docs/site/screenshots.py FOLDER`.

Each at 1440 x 900 and 390 x 844, light and dark: the live page of a scenario, its recording, and,
where they were made before, the pages of these documents (`make docs`). `--picture` writes
docs/pictures/live_page.png besides, which was made with
`--time 5.9 --change contact.tip-blade.method=facets`. Needs playwright and a Chromium.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.scenario import build, run_scenario
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.view import Live

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[2]
LIVE_PAGE = ROOT / "docs" / "pictures" / "live_page.png"
SIZES = ((1440, 900), (390, 844))
SCHEMES = ("light", "dark")
# Software rendering, on machines that have no graphics card.
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
PATIENCE = 120_000  # [ms]


def main() -> None:
    """Read the command line and take the pictures."""
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--scenario", default="fingertip_on_blade")
    options.add_argument("--time", type=float, default=3.0, help="shown on the live page [s]")
    options.add_argument("--change", metavar="KEY=WORD", help="a menu changed at half that time")
    options.add_argument("--site", type=Path, default=ROOT / "build" / "site" / "index.html")
    options.add_argument("--only", choices=("live", "recording", "docs"), action="append")
    options.add_argument("--picture", action="store_true", help="write docs/pictures/live_page.png")
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    wanted = given.only or ["live", "recording", "docs"]
    with browser() as chromium:
        if "live" in wanted:
            with live_page(given.scenario, given.time, given.change) as url:
                shoot(chromium, given.folder, "live", url, "globalThis.state?.t > 0")
        if "recording" in wanted:
            with tempfile.TemporaryDirectory() as folder:
                run_scenario(given.scenario, Path(folder) / "out")
                url = (Path(folder) / "out" / "recording.html").as_uri()
                shoot(chromium, given.folder, "recording", url, "window.recording")
        if "docs" in wanted:
            page = given.site.resolve()
            if page.is_file():
                shoot(chromium, given.folder, "docs", page.as_uri(), "true")
            else:
                print(f"no pictures of the docs: there is no {page}", file=sys.stderr)
    if given.picture:
        shutil.copyfile(given.folder / "live_1440x900_light.png", LIVE_PAGE)
        print(LIVE_PAGE)


@contextmanager
def browser() -> Iterator[Browser]:
    """Open a Chromium: that of the machine, else playwright's own."""
    from playwright.sync_api import sync_playwright

    names = ("chromium", "chromium-browser", "google-chrome")
    program = next(filter(None, map(shutil.which, names)), None)
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=program, args=FLAGS)
        yield chromium
        chromium.close()


@contextmanager
def live_page(scenario: str, time: float, change: str | None = None) -> Iterator[str]:
    """Serve a scenario, which stands still after `time` [s], with a change at half of it."""
    run = LiveRun(build(scenario))
    live = Live(run, running=False)
    try:
        # Before anybody looks: as it would be without waiting for pictures.
        while run.time < time and run.ended is None:
            if change and run.time >= time / 2:
                key, _, word = change.partition("=")
                run.change(key, word)
                change = None
            live._advance(1 / 60, 1.0)
            live.picture.update(run, None)
        live.start()
        yield live.url
    finally:
        live.stop()


def shoot(chromium: Browser, folder: Path, name: str, url: str, ready: str) -> None:
    """Take the pictures of one page once `ready`, an expression in it, holds."""
    for width, height in SIZES:
        for scheme in SCHEMES:
            page: Page = chromium.new_page(
                viewport={"width": width, "height": height}, color_scheme=scheme
            )
            page.goto(url, timeout=PATIENCE)
            page.wait_for_function(ready, timeout=PATIENCE, polling=100)
            page.wait_for_timeout(1500)  # for the last meshes
            target = folder / f"{name}_{width}x{height}_{scheme}.png"
            page.screenshot(path=target, timeout=PATIENCE)
            page.close()
            print(target)


if __name__ == "__main__":
    main()
