"""A finished run as one HTML file that anybody can open: robot, shells, contacts, force arrows."""

from __future__ import annotations

import html
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.checks import check_positive
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_scene import check_scene, scene_of, sound_rows
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view import arrows as arrow
from sphshell_pin.view.bodies import SPHERE_COLOR
from sphshell_pin.view.camera import DIRECTIONS, choose_view
from sphshell_pin.view.contact_path import LARGEST, ContactRows, contact_paths, spaced
from sphshell_pin.view.curves import run_panel
from sphshell_pin.view.display import TRAIL_COLOR, Display
from sphshell_pin.view.frames import GRID_COLOR
from sphshell_pin.view.nodes import css, new_visualizer
from sphshell_pin.view.page import FilmWindow, render_page
from sphshell_pin.view.patches import RAMP as PRESSURE_RAMP
from sphshell_pin.view.patches import PatchScale
from sphshell_pin.view.robot import has_links

BARE = (
    "The robot is drawn by its joints, as the scene's model has no geometry: "
    "view(visual_model=...) takes a pinocchio.GeometryModel of the same joints."
)
MOST_ARROWS = 24
MOST_PIECES = 80  # of a trail
MOST_FRAMES = 1_000_000


def write_recording(
    path: StrPath,
    result: Result,
    scene: Scene,
    visual_model: pin.GeometryModel | None = None,
    *,
    title: str | None = None,
    **options: Any,
) -> Path:
    """Write `result` as one self-contained HTML file at `path`, and return the path.

    See `render_recording` for the rest; without a `title` the page is called as the file.

    Raises what `render_recording` does, ResultError if the file cannot be written.
    """
    title = title or Path(path).stem
    page = render_recording(result, scene, visual_model, title=title, **options)
    return write_whole(path, page.encode())


def render_recording(
    result: Result,
    scene: Scene,
    visual_model: pin.GeometryModel | None = None,
    *,
    fps: float = 30,
    speed: float = 1.0,
    title: str = "A finished run",
    faces: bool = False,
    span: tuple[float, float] | None = None,
    whole: bool = False,
) -> str:
    """Return `result` as one self-contained HTML page.

    The page opens offline, plays, pauses and scrubs. `visual_model` is any geometry model of
    `scene.model`, visual or collision; without one the joints are drawn as a skeleton. `fps` [1/s]
    frames are kept per second of the page, `speed` seconds of simulated time pass in one second of
    it. Each frame shows the recorded row nearest in time, or, where a touch begins and ends between
    two frames, that touch at its peak. With `faces` the shells are colored by the kinds of their
    faces. Of a `span` from and to a time of the run [s] the scene has that part alone, in one frame
    where both are the same. With `whole` the camera takes in all of the robot, else the
    surroundings of the contacts.

    Raises MissingExtra without meshcat, InvalidParameter for an `fps` or `speed` that is not
    positive, more than MOST_FRAMES frames, or a geometry model that does not fit, ResultError
    without a row of finite numbers.
    """
    check_pace(fps, speed)
    count = sound_rows("the result", result.q, limit=LARGEST)
    contacts = ContactRows.of(result.contacts, result.patch_rows)
    contacts = contacts.select(contacts.row < count)
    t = np.asarray(result.t)[:count]
    start, end = (float(t[0]), float(t[-1])) if span is None else span
    frames = (t[-1] - t[0]) * fps / speed
    if frames > MOST_FRAMES:
        raise InvalidParameter(
            "fps",
            fps,
            f"gives {frames:.2g} frames, of {MOST_FRAMES} at most, at the speed {speed:g}",
        )
    rows, times = choose_rows(t, contacts, fps, speed, span)
    # This holds for a part of a run, too: pictures of it have the same cameras and the same arrows.
    of_run = rows if span is None else choose_rows(t, contacts, fps, speed)[0]
    shown = contacts.select(np.isin(contacts.row, of_run))
    q = np.asarray(result.q, dtype=float)
    places = contacts.point_world, contacts.normal_world
    views = {
        name: choose_view(scene, q[of_run], *places, visual_model, direction=toward, whole=whole)
        for name, toward in DIRECTIONS.items()
    }
    view = views["fit"]
    length = arrow.arrow_length(scene, view.distance)
    # Friction is a fraction of the normal force: it shares its scale.
    scale = arrow.ArrowScale.from_forces(shown.normal_force, length)
    most = int(np.bincount(shown.row).max(initial=0)) if len(shown.row) else 0

    window = FilmWindow()
    display = Display(
        scene,
        visual_model,
        new_visualizer(window),
        view=view,
        arrow_scale=scale,
        pool=min(most, MOST_ARROWS),
    )
    if faces:
        display.show("faces", True)
    if shown.patches is not None:
        display.patch_scale = PatchScale.of(shown.patches, view.distance)
    for frame, row in enumerate(rows):
        window.frame = frame
        now = contacts.at(int(row))
        display.update(q[row], now, now.patches)
    window.frame = None
    trailed = _draw_trails(display, window, result, start, speed)

    panel = run_panel(result, scene, contacts, count, q[rows], views)
    clock = {
        "start": start,
        "end": end,
        "duration": float(t[-1] - t[0]),  # of the whole run
        "speed": float(speed),
        "frames": len(times),
        "digits": max(2, int(np.ceil(-np.log10(speed / fps)))),  # in which two frames differ
    }
    return render_page(
        [*window.commands(times), {**panel, "clock": clock}],
        title,
        _legend(scene, scale, shown, trailed) + _color_keys(display, shown),
    )


def check_pace(fps: float, speed: float) -> None:
    """Raise InvalidParameter for a pace that is not positive."""
    check_positive("fps", fps)
    check_positive("speed", speed)


@dataclass(frozen=True)
class RecordingView:
    """A recording: `page`, a whole HTML page, to be shown `height` [pixels] high.

    `hint` says in a sentence what could be better, "" if nothing.
    """

    page: str
    height: int = 480
    hint: str = ""

    def save(self, path: StrPath) -> Path:
        """Write the page at `path` and return it; ResultError if it cannot be written."""
        return write_whole(path, self.page.encode())

    def __repr__(self) -> str:
        hint = f"; {self.hint}" if self.hint else ""
        return f"<RecordingView: {len(self.page) / 1e6:.1f} MB, .save(path) writes the page{hint}>"

    def _repr_html_(self) -> str:
        """Return a frame with the page inside, which needs no server and no network."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" width="100%" height="{self.height}" '
            'style="border: 1px solid #c8d0d8; border-radius: 4px" allowfullscreen></iframe>'
        ) + (f'<div style="opacity: 0.7">{html.escape(self.hint)}</div>' if self.hint else "")


@dataclass(frozen=True)
class Shown:
    """What a recording of `result` is drawn with: see `Result.view`."""

    result: Result
    scene: Scene
    visual_model: pin.GeometryModel | None
    title: str
    speed: float

    @classmethod
    def of(
        cls,
        result: Result,
        scene: Scene | None,
        visual_model: pin.GeometryModel | None,
        title: str | None,
        speed: float | None,
    ) -> Shown:
        """Take from the scenario of `result` what is None."""
        if scene is None and result.origin is not None:
            from sphshell_pin.scenario.running.replay import Replay

            replay = Replay(result)
            scene, title = replay.scene, title or replay.title
            visual_model = replay.visual_model if visual_model is None else visual_model
            speed = replay.speed if speed is None else speed
        scene = scene_of(result, scene)
        speed = 1.0 if speed is None else speed
        return cls(result, scene, visual_model, title or "A finished run", speed)

    def page(self, fps: float = 30, span: tuple[float, float] | None = None) -> str:
        """Return the page of all of the robot: see `render_recording`."""
        return render_recording(
            self.result,
            self.scene,
            self.visual_model,
            fps=fps,
            speed=self.speed,
            title=self.title,
            span=span,
            whole=True,
        )


def view_result(
    result: Result,
    scene: Scene | None = None,
    visual_model: pin.GeometryModel | None = None,
    *,
    speed: float | None = None,
    height: int = 480,
    title: str | None = None,
) -> RecordingView:
    """Return the recording of `result`: see `Result.view`."""
    if isinstance(height, bool) or not isinstance(height, int) or height <= 0:
        raise InvalidParameter("height", height, "must be a positive number of pixels")
    shown = Shown.of(result, scene, visual_model, title, speed)
    check_scene(result, shown.scene, "the result")
    bare = shown.visual_model is None and has_links(shown.scene.model)
    return RecordingView(shown.page(), height, BARE if bare else "")


def choose_rows(
    t: Array,
    contacts: ContactRows,
    fps: float,
    speed: float,
    span: tuple[float, float] | None = None,
) -> tuple[Longs, Array]:
    """Return the recorded row of each frame (f,) and its time in the page (f,) [s].

    The frames are those of the run from and to the times `span` [s], one where both are the same;
    by default of all of it, two at least.
    """
    start, end = (t[0], t[-1]) if span is None else span
    duration = float(end - start) / speed
    count = round(duration * fps) + 1
    if span is None or duration > 0.0:
        count = max(2, count)
    times = np.linspace(0.0, duration, count)
    wanted = start + speed * times
    after = np.clip(np.searchsorted(t, wanted), 1, max(1, len(t) - 1))
    before = after - 1
    after = np.minimum(after, len(t) - 1)
    rows = np.where(wanted - t[before] <= t[after] - wanted, before, after).astype(np.int64)
    if not len(contacts.row) or count == 1:
        return rows, times
    force = np.zeros(len(t))
    np.maximum.at(force, contacts.row, arrow.largest_force(contacts))
    # A touch shorter than a frame would otherwise be lost between two frames.
    middles = np.searchsorted(t, 0.5 * (wanted[1:] + wanted[:-1]))
    first, last = np.searchsorted(t, start), np.searchsorted(t, end, side="right")
    starts, ends = np.append(first, middles), np.append(middles, last)
    for frame, (low, high) in enumerate(zip(starts, ends, strict=True)):
        if high > low and force[rows[frame]] == 0.0:
            peak = low + int(np.argmax(force[low:high]))
            if force[peak] > 0.0:
                rows[frame] = peak
    return rows, times


def _draw_trails(
    display: Display, window: FilmWindow, result: Result, start: float, speed: float
) -> bool:
    """Draw each pair's contact path on its shell, in pieces that appear as the run gets there.

    At the time `start` of the run [s] the page begins.
    """
    drawn = False
    for path in contact_paths(result, display.scene):
        if not path.on_shell:
            continue
        step = 0.5 * display.trail_width
        runs = [run[spaced(path.points[run], step)] for run in path.runs]
        # A contact that chatters has thousands of runs: the long ones are the picture.
        longest = sorted(runs, key=len, reverse=True)[:MOST_PIECES]
        length = max(1, -(-sum(map(len, longest)) // MOST_PIECES))
        for run in longest:
            for first in range(0, len(run) - 1, length):
                piece = run[first : first + length + 1]
                name = f"{path.pair}_{piece[0]}"
                node = display.draw_trail(name, path.points[piece], path.pair)
                if node is not None:
                    seen = float(result.t[path.row[piece[-1]]] - start) / speed
                    if seen >= 0.0:  # else it is there from the beginning
                        window.switch(node, np.array([0.0, max(seen, 1e-3)]), [False, True])
                    drawn = True
    return drawn


def _legend(
    scene: Scene, scale: arrow.ArrowScale, shown: ContactRows, trailed: bool
) -> list[tuple[str, str]]:
    legend = []
    radii = sorted({one.radius for pair in scene.pairs for one in pair.spheres})
    firsts = {pair.frame_i for pair in scene.pairs}
    on_what = "on the sphere"
    if not radii:
        on_what = f"on {firsts.pop()}" if len(firsts) == 1 else "on the first body of each pair"
    if radii:
        sizes = ", ".join(f"{radius * 1e3:g}" for radius in radii[:3])
        legend.append((css(SPHERE_COLOR), f"sphere, radius {sizes} mm"))
    if not len(shown.row):
        return [*legend, ("transparent", "no contact in this run")]
    legend.append((css(arrow.NORMAL_COLOR), f"normal force {on_what}, {scale}"))
    legend.append((css(arrow.FRICTION_COLOR), "friction force, same scale"))
    if scale.cuts(shown.normal_force):
        cut = f"arrows longer than {scale.longest * 1e3:.0f} mm are cut"
        legend.append(("transparent", cut))
    if shown.patches is None:
        legend.append((css(arrow.POINT_COLOR), "contact point"))
    if trailed:
        legend.append((css(TRAIL_COLOR), "path on the shell"))
    return legend


def _color_keys(display: Display, shown: ContactRows) -> list[tuple[str, str]]:
    """Return the legend of the colors of shells and patches, and of the grid."""
    found = []
    if shown.patches is not None and len(shown.row):
        ramp = f"linear-gradient(90deg, {', '.join(PRESSURE_RAMP)})"
        found.append((ramp, str(display.patch_scale)))
    return [*found, *display.face_keys, (css(GRID_COLOR), str(display.grid))]
