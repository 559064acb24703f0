"""A finished run as a picture or a film, drawn by a headless browser.

The browser shows the page of `render_recording` and is told the time of each picture: what it
draws does not depend on how fast it draws.
"""

from __future__ import annotations

import io
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import pinocchio as pin

from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.checks import check_finite, check_vector
from sphshell_pin.base.films import Pixels, write_film
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.dynamics.result.result_scene import sound_rows
from sphshell_pin.errors import InvalidParameter, MissingExtra, ResultError
from sphshell_pin.view.contact_path import LARGEST
from sphshell_pin.view.recording import Shown, check_pace

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene

Camera = Literal["fit", "front", "side", "top", "follow", "contact"]
CAMERAS: tuple[Camera, ...] = get_args(Camera)
PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# Drawn by the processor: the same picture on every machine, with or without a graphics card.
FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
LAID_OUT = 1280 * 720  # pixels of the area for which text has its usual size
LEAST_SIZE, MOST_SIZE = 64, 7680  # pixels
PATIENCE = 120_000.0  # [ms] until the page is loaded


def render_film(
    path: StrPath,
    result: Result,
    scene: Scene | None = None,
    visual_model: pin.GeometryModel | None = None,
    *,
    time: float | None = None,
    span: tuple[float | None, float | None] = (None, None),
    size: tuple[int, int] = (1280, 720),
    fps: float = 30.0,
    speed: float | None = None,
    camera: Camera = "fit",
    chart: bool = True,
    dark: bool = False,
    title: str | None = None,
    told: Callable[[int, int], object] = lambda done, all_: None,
) -> Path:
    """Draw `result` at `path`, and return the path.

    Parameters
    ----------
    path
        A .png is one picture, a .mp4 a film. It is written whole or not at all.
    scene, visual_model, title
        As in `Result.view`.
    time
        Of a picture, the time of the run [s]; by default its end.
    span
        Of a film, the times of the run from and to which it shows it [s]; None is its
        beginning or end.
    size
        Width and height [pixels].
    fps
        Pictures per second.
    speed
        Simulated seconds per second; by default as the scenario has it, or 1.
    camera
        From where: one of CAMERAS.
    chart
        Whether the chart of forces and depth is under the scene.
    dark
        Whether the background is dark.
    told
        Called with the number of pictures that are drawn, and of all.

    Raises
    ------
    InvalidParameter
        A value is none of these, or a time is not in the run.
    MissingExtra
        A package of the extra `video` or `view` is not installed.
    ResultError
        There is no scene or no Chromium, or the file cannot be written.
    """
    path = Path(path)
    still = path.suffix.lower() == ".png"
    if not still and path.suffix.lower() != ".mp4":
        raise InvalidParameter("path", str(path), "must end in .png or .mp4")
    if camera not in CAMERAS:
        raise InvalidParameter("camera", camera, f"must be one of {', '.join(CAMERAS)}")
    for name, value in (("speed", speed), ("span", span)):
        if still and value not in (None, (None, None)):
            raise InvalidParameter(name, value, "is for a film, not a .png")
    if not still and time is not None:
        raise InvalidParameter("time", time, "is for a .png: a film has a span")
    size = _checked_size(size)
    if not still and (size[0] % 2 or size[1] % 2):
        # Its colors are stored for squares of two by two pixels.
        must = "must be even in both directions for a .mp4"
        raise InvalidParameter("size", f"{size[0]}x{size[1]}", must)
    shown = Shown.of(result, scene, visual_model, title, speed)
    check_pace(fps, shown.speed)
    times = _times(result, (time, time) if still else span, still=still)
    stage = _Stage(shown.page(fps, times), size, camera, chart, dark, told)

    def draw() -> None:
        with stage.opened(path):
            if still:
                write_whole(path, stage.picture(0))
            else:
                write_film(path, stage.film(), size, fps)

    _interruptibly(draw, stage.stopped.set)
    return path


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height [pixels]; InvalidParameter unless both are whole and in bounds."""
    width, height = check_vector("size", size, 2, ": width and height [pixels]")
    if not all(one == round(one) and LEAST_SIZE <= one <= MOST_SIZE for one in (width, height)):
        must = f"must be whole numbers between {LEAST_SIZE} and {MOST_SIZE} [pixels]"
        raise InvalidParameter("size", f"{width:g}x{height:g}", must)
    return int(width), int(height)


def _times(
    result: Result, span: tuple[float | None, float | None], *, still: bool
) -> tuple[float, float]:
    t = np.asarray(result.t)[: sound_rows("the result", result.q, limit=LARGEST)]
    first, last = float(t[0]), float(t[-1])
    name = "time" if still else "span"
    if not isinstance(span, (tuple, list)) or len(span) != 2:
        raise InvalidParameter(name, span, "must be two times of the run [s], or None for its ends")
    for value in span:
        if value is not None and not first <= check_finite(name, value) <= last:
            raise InvalidParameter(name, value, f"must be in the run: {first:g} to {last:g} s")
    start, end = span
    if still:
        return (last if end is None else end,) * 2
    start, end = first if start is None else start, last if end is None else end
    if not start < end:
        raise InvalidParameter("span", f"{start:g} to {end:g} s", "must end after it begins")
    return start, end


class _Stopped(Exception):
    """Ctrl-C was pressed in the main thread."""


def _interruptibly(draw: Callable[[], None], stop: Callable[[], None]) -> None:
    """Call `draw` in a thread of its own; `stop` it on Ctrl-C.

    Playwright can neither be interrupted within a call nor be used where an event loop runs, as in
    a notebook.
    """
    with ThreadPoolExecutor(1) as pool:
        drawn = pool.submit(draw)
        try:
            drawn.result()
        except KeyboardInterrupt:
            stop()
            raise


@dataclass
class _Stage:
    """A browser that shows the page `html` of a recording, and draws its pictures by number."""

    html: str
    size: tuple[int, int]
    camera: Camera
    chart: bool
    dark: bool
    told: Callable[[int, int], object]
    stopped: threading.Event = field(default_factory=threading.Event)
    page: Page = field(init=False)
    count: int = 0

    @contextmanager
    def opened(self, path: Path) -> Iterator[None]:
        """Open the browser for the block; errors name the `path` that is to be written."""
        try:
            from playwright.sync_api import Error, sync_playwright
        except ImportError as missing:
            raise MissingExtra("playwright", "video", "a picture or film of a run") from missing
        # Text has the same size relative to the picture in every size of it.
        scale = max(0.5, float(np.sqrt(self.size[0] * self.size[1] / LAID_OUT)))
        width, height = (max(1, round(pixels / scale)) for pixels in self.size)
        try:
            with sync_playwright() as driver:
                browser = _launch(driver, path)
                context = browser.new_context(
                    viewport={"width": width, "height": height},
                    device_scale_factor=scale,
                    color_scheme="dark" if self.dark else "light",
                    reduced_motion="reduce",
                    offline=True,
                )
                page = self.page = context.new_page()
                page.set_default_timeout(PATIENCE)
                page.set_content(self.html)
                page.wait_for_function("window.recording || window.recording_fault")
                if not page.evaluate("Boolean(window.recording)"):
                    fault = page.locator("#fault").text_content()
                    raise ResultError(path, f"cannot be drawn: {fault}")
                page.evaluate("given => recording.film(...given)", [self.camera, self.chart])
                self.count = int(page.evaluate("recording.clock.frames"))
                yield
                browser.close()
        except Error as fault:
            raise ResultError(path, f"cannot be drawn: {fault.message.splitlines()[0]}") from fault

    def picture(self, number: int) -> bytes:
        """Draw the picture with this `number`, and return it as a .png file."""
        from PIL import Image

        if self.stopped.is_set():
            raise _Stopped
        self.page.evaluate("k => recording.draw_frame(k)", number)
        drawn = self.page.screenshot()
        with Image.open(io.BytesIO(drawn)) as image:
            if image.size == self.size:
                return drawn
            # Whole pixels of the page are not always whole pixels of the picture.
            stream = io.BytesIO()
            image.resize(self.size, Image.Resampling.LANCZOS).save(stream, "png")
            return stream.getvalue()

    def pixels(self, number: int) -> Pixels:
        """Draw the picture with this `number`; return its colors (height, width, 3)."""
        from PIL import Image

        with Image.open(io.BytesIO(self.picture(number))) as image:
            return np.asarray(image.convert("RGB"))

    def film(self) -> Iterator[Pixels]:
        """Draw one picture after the other."""
        for number in range(self.count):
            yield self.pixels(number)
            self.told(number + 1, self.count)


def _launch(driver: Playwright, path: Path) -> Browser:
    """Start the Chromium of this machine, or the one that playwright has installed."""
    from playwright.sync_api import Error

    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    # Within its own sandbox Chromium does not start for root, as in a container.
    flags = [*FLAGS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    try:
        return driver.chromium.launch(executable_path=program, args=flags, handle_sigint=False)
    except Error as fault:
        if program is None:
            raise ResultError(
                path,
                "needs Chromium to be drawn, and there is none: playwright install chromium "
                "installs one",
            ) from fault
        raise
