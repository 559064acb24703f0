"""The curves and figures of a run that a recording shows under its scene."""

import itertools
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.view.camera import ASPECT, FIELD_OF_VIEW, View
from sphshell_pin.view.contact_path import LARGEST, ContactRows
from sphshell_pin.view.meshes import pack_numbers
from sphshell_pin.view.nodes import Json

CLOSE = 8.0  # radii of the sphere around it that a close-up shows, at least


def run_panel(
    result: Result,
    scene: Scene,
    contacts: ContactRows,
    count: int,
    frames: Array,
    views: Mapping[str, View],
) -> Json:
    """Return the page's command "panel" for the first `count` rows of `result`.

    `frames` (f, nq) are the configurations of the page's frames, `views` its cameras.
    """
    return {
        "type": "panel",
        "path": "",
        "aspect": ASPECT,
        "views": {
            name: {"eye": one.eye.tolist(), "target": one.target.tolist()}
            for name, one in views.items()
        },
        "focus": _focus(scene, contacts, frames),
        "curves": [one.packed() for one in run_curves(result, count)],
    }


def _focus(scene: Scene, contacts: ContactRows, frames: Array) -> Json | None:
    """Describe the way of the tip: `points` (f, 3) [m], and the `distance` [m] of a close-up.

    It is the mean of the centers of the spheres, each weighted by what its pair pressed in total,
    so that it does not jump where one contact ends and another begins. None without spheres.
    """
    pressed = np.zeros(len(scene.pairs))
    np.add.at(pressed, contacts.pair, np.maximum(contacts.normal_force, 0.0))
    if not pressed.any():
        pressed = np.ones(len(scene.pairs))
    parts = [
        (one, weight / len(pair.spheres))
        for pair, weight in zip(scene.pairs, pressed, strict=True)
        for one in pair.spheres
        if weight > 0.0
    ]
    if not parts:
        return None
    shares = np.array([weight for _, weight in parts])
    shares /= shares.sum()
    model, data = scene.model, scene.model.createData()
    points, spread = np.empty((len(frames), 3)), 0.0
    for frame, q in enumerate(frames):
        pin.forwardKinematics(model, data, q)
        centers = np.array([data.oMi[one.joint].act(one.in_joint.translation) for one, _ in parts])
        points[frame] = shares @ centers
        if contacts.row.size:
            # The root of the mean square: a sphere that hardly pressed does not count.
            squares = np.sum((centers - points[frame]) ** 2, axis=1)
            spread = max(spread, float(np.sqrt(shares @ squares)))
    radius = float(shares @ np.array([one.radius for one, _ in parts]))
    half = 1.5 * spread + CLOSE * radius
    return {
        "points": pack_numbers(points.reshape(-1), exact=False),
        "distance": float(half / np.tan(np.deg2rad(0.5 * FIELD_OF_VIEW))),
    }


MOST_PAIRS = 8
BINS = 300  # of time: of each the extremes are kept
ALL = "all pairs, summed"


@dataclass(frozen=True)
class Curves:
    """Forces [N] and depth [m] of one pair, or of all, at times `t` (k,) [s]; and its figures.

    `contact_time` [s], `mean` and `peak` of the normal force [N], and the largest `depth` are
    those over all steps where the run has them, else those of the recorded rows.
    """

    name: str
    t: Array
    normal: Array
    friction: Array
    depth: Array
    figures: dict[str, float]

    def packed(self) -> Json:
        """Describe it for the page; `unfold` of its script reads the numbers."""
        columns = {
            name: pack_numbers(getattr(self, name), exact=False)
            for name in ("t", "normal", "friction", "depth")
        }
        return {"name": self.name, "figures": self.figures, **columns}


def run_curves(result: Result, count: int) -> list[Curves]:
    """Return the curves of the first `count` rows: of all pairs that touched, and of their sum.

    Of more than MOST_PAIRS pairs those with the largest forces are there; the sum is that of all.
    """
    touched = np.unique(np.asarray(result.contacts.pair, dtype=np.int64))
    with np.errstate(invalid="ignore"):  # of a run that diverged
        pairs = [PairSeries.of(result, int(pair)) for pair in touched]
    t = np.asarray(result.t, dtype=float)[:count]
    curves = []
    if len(pairs) != 1:
        zero = np.zeros(len(result.t))
        whole = PairSeries(
            ALL,
            sum((one.normal for one in pairs), zero),
            sum((one.friction for one in pairs), zero),
            np.max([zero, *(one.depth for one in pairs)], axis=0),
            zero,
        )
        curves.append(_curves(whole, t, {}))
    for one in sorted(pairs, key=lambda pair: -pair.peak)[:MOST_PAIRS]:
        stats = result.stats.pairs.get(one.name)
        known = {} if stats is None else asdict(stats)
        names = {"mean_force": "mean", "peak_force": "peak", "max_depth": "depth"}
        figures = {names.get(key, key): float(value) for key, value in known.items()}
        curves.append(_curves(one, t, figures))
    return curves


def _curves(series: PairSeries, t: Array, known: dict[str, float]) -> Curves:
    columns = [t, *(one[: len(t)] for one in (series.normal, series.friction, series.depth))]
    # The last row of a run that diverged may hold forces that no chart can show.
    sound = (np.abs(np.stack(columns)) < LARGEST).all(axis=0)
    t, normal, friction, depth = (column[sound] for column in columns)
    rows = extremes(BINS, normal, friction, depth)
    figures = _figures(t, normal, depth) | {
        key: known[key] for key in ("contact_time", "mean", "peak", "depth") if key in known
    }
    return Curves(series.name, t[rows], normal[rows], friction[rows], depth[rows], figures)


def _figures(t: Array, normal: Array, depth: Array) -> dict[str, float]:
    """Return the figures of rows, by the trapezoidal rule."""
    steps = np.diff(t)
    touch = (depth > 0.0) | (normal > 0.0)
    touching = float(steps @ (0.5 * (touch[1:].astype(float) + touch[:-1])))
    impulse = float(steps @ (0.5 * (normal[1:] + normal[:-1])))
    return {
        "contact_time": touching,
        "mean": impulse / touching if touching else 0.0,
        "peak": float(normal.max(initial=0.0)),
        "depth": float(depth.max(initial=0.0)),
    }


def extremes(bins: int, *columns: Array) -> Longs:
    """Return the rows of the extremes of each column (n,) within `bins` equal parts of the rows.

    All rows, where these are fewer than the extremes might be.
    """
    count = len(columns[0])
    if count <= 2 * bins * len(columns):
        return np.arange(count, dtype=np.int64)
    kept = {0, count - 1}
    for start, end in itertools.pairwise(np.linspace(0, count, bins + 1).astype(int).tolist()):
        for column in columns:
            part = column[start:end]
            kept |= {start + int(part.argmin()), start + int(part.argmax())}
    return np.array(sorted(kept), dtype=np.int64)
