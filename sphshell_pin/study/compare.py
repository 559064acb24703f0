"""Results over each other: figures, curves over time and settings, with their differences."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import Table, quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_columns import state_titles
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.dynamics.result.result_scene import sound_rows
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.patches.placed import poses_along
from sphshell_pin.scenario.running.figures import NOT_REPEATABLE, recorded_figures


@dataclass(frozen=True)
class Curve:
    """A quantity over time: `t` (n,) [s] and `values` (n,) in `unit`, linear in between."""

    t: Array
    values: Array
    unit: str


@dataclass(frozen=True)
class Measured:
    """A run as it is compared: `figures` (value, unit) and `curves` by name, `settings` by key.

    `parts` are its contacts, joints and sensors, `span` the times of its first and last row [s].
    """

    label: str
    parts: tuple[str, ...]
    span: tuple[float, float]
    figures: Mapping[str, tuple[float, str]]
    curves: Mapping[str, Curve]
    settings: Mapping[str, object]


class FigureDifference(NamedTuple):
    """A figure of the first run and of another one.

    `absolute` is the other less the first, `relative` that over the size of the first, nan where
    this is 0.
    """

    name: str
    unit: str
    first: float
    other: float
    absolute: float
    relative: float

    @property
    def same(self) -> bool:
        """Whether the two are equal to the last bit, or both not known."""
        return self.first == self.other or (math.isnan(self.first) and math.isnan(self.other))


@dataclass(frozen=True)
class CurveDifference:
    """What a curve of another run is away from that of the first, over the time that both have.

    `t` (k,) [s] are the recorded times of either, `values` (k,) the difference there, linear in
    between as both curves are: `largest` is its largest size, at time `at` [s], `rms` the root of
    its mean square over time. `of_range` is `largest` over the range of the first curve in that
    time, nan where this is constant.
    """

    name: str
    unit: str
    t: Array
    values: Array
    of_range: float

    @property
    def largest(self) -> float:
        """The largest size of the difference, in `unit`."""
        return float(np.abs(self.values).max())

    @property
    def at(self) -> float:
        """When it is largest [s]."""
        return float(self.t[np.abs(self.values).argmax()])

    @property
    def rms(self) -> float:
        """Root of the mean square over time, exact for what is linear between the times."""
        a, b, step = self.values[:-1], self.values[1:], np.diff(self.t)
        time = float(self.t[-1] - self.t[0])
        if not time > 0.0:
            return self.largest
        return float(np.sqrt(((a * a + a * b + b * b) * step).sum() / (3.0 * time)))


@dataclass(frozen=True)
class Difference:
    """One run beside the first: figures and curves of both, by name.

    `settings` are those of the scenarios that differ: key, of the first, of the other.
    `only_first`, `only_other` are the parts that one alone has, `span` the time that both have [s],
    None without any.
    """

    label: str
    figures: tuple[FigureDifference, ...]
    curves: tuple[CurveDifference, ...]
    settings: tuple[tuple[str, object, object], ...]
    only_first: tuple[str, ...]
    only_other: tuple[str, ...]
    span: tuple[float, float] | None


@dataclass(frozen=True)
class Comparison:
    """Two or more runs, each of `others` beside the first of `runs`."""

    runs: tuple[Measured, ...]
    others: tuple[Difference, ...]


def compare(runs: Sequence[Measured]) -> Comparison:
    """Compare each of `runs` with the first.

    Curves are compared at the recorded times of both runs, within the time that both have; between
    its rows a curve is taken as linear. Pairs, joints and sensors are those of the same name.

    Raises
    ------
    InvalidParameter
        There are fewer than two.
    ResultError
        Two runs have no contact, joint or sensor of the same name: they are of different models.
    """
    if len(runs) < 2:
        raise InvalidParameter("runs", len(runs), "must be two at least")
    return Comparison(tuple(runs), tuple(_difference(runs[0], other) for other in runs[1:]))


def measured(label: str, result: Result, scene: Scene | None) -> Measured:
    """Return what of `result` is compared; without a `scene` joints have numbers as names.

    The figures are those of its pairs, joints, sensors, energy and cost, and the last state; the
    curves normal force, friction and depth of each pair, the positions of joints with one number,
    and the path of each sphere in the world. A run that diverged is compared up to where it did.

    Raises ResultError where no row has finite numbers.
    """
    count = sound_rows(label, result.q, result.v)
    titles, _ = state_titles(result, scene)
    if scene is None:
        joints = [f"coordinate {title}" for title in titles]
    else:
        joints = [f"joint {name}" for name in list(scene.model.names)[1:]]
    parts = [f"contact {name}" for name in result.pairs]
    parts += joints + [f"sensor {name}" for name in result.sensors]
    t, recorded = result.t[:count], recorded_figures(result, scene, count - 1)
    settings = {} if result.origin is None else dict(_flat(result.origin.settings))
    settings.pop("description", None)  # says what the run is, and changes nothing in it
    return Measured(
        label,
        tuple(parts),
        (float(t[0]), float(t[-1])),
        {name: figure for name, figure in recorded.items() if name not in NOT_REPEATABLE},
        _curves(result, titles, scene, count),
        settings,
    )


def tables_of(comparison: Comparison) -> dict[str, Table]:
    """Return the tables "figures" and "curves": a row for each of another run."""
    figures = [(other.label, *one) for other in comparison.others for one in other.figures]
    curves = [
        (other.label, one.name, one.unit, one.largest, one.at, one.rms, one.of_range)
        for other in comparison.others
        for one in other.curves
    ]
    titles = {
        "figures": ("run", "figure", "unit", "first", "other", "difference", "relative"),
        "curves": ("run", "curve", "unit", "largest", "at [s]", "rms", "largest over range"),
    }
    rows: dict[str, list[tuple[str | float, ...]]] = {"figures": [*figures], "curves": [*curves]}
    return {
        name: {title: [row[k] for row in rows[name]] for k, title in enumerate(columns)}
        for name, columns in titles.items()
    }


def _difference(first: Measured, other: Measured) -> Difference:
    if not set(first.parts) & set(other.parts):
        has = (f"{one.label} has {', '.join(one.parts[:6]) or 'none'}" for one in (first, other))
        raise ResultError(
            other.label,
            f"has no contact, joint or sensor in common with {first.label}, so that nothing can be "
            f"compared: {'; '.join(has)}",
        )
    begin, end = max(first.span[0], other.span[0]), min(first.span[1], other.span[1])
    span = (begin, end) if begin <= end else None
    keys = dict.fromkeys((*first.settings, *other.settings))
    settings = [(key, first.settings.get(key), other.settings.get(key)) for key in keys]
    return Difference(
        other.label,
        tuple(
            _figure_difference(name, unit, value, other.figures[name][0])
            for name, (value, unit) in first.figures.items()
            if name in other.figures
        ),
        tuple(
            _curve_difference(name, curve, other.curves[name], span)
            for name, curve in first.curves.items()
            if name in other.curves and span is not None
        ),
        tuple(one for one in settings if one[1] != one[2]),
        tuple(part for part in first.parts if part not in other.parts),
        tuple(part for part in other.parts if part not in first.parts),
        span,
    )


def _figure_difference(name: str, unit: str, first: float, other: float) -> FigureDifference:
    away = other - first
    relative = away / abs(first) if first else math.nan
    return FigureDifference(name, unit, first, other, away, relative)


def _curve_difference(
    name: str, first: Curve, other: Curve, span: tuple[float, float]
) -> CurveDifference:
    t = np.union1d(first.t, other.t)
    t = np.unique(np.clip(t, *span))
    a, b = (np.interp(t, one.t, one.values) for one in (first, other))
    extent, values = float(np.ptp(a)), b - a
    of_range = float(np.abs(values).max()) / extent if extent else math.nan
    return CurveDifference(name, first.unit, t, values, of_range)


def _curves(result: Result, titles: list[str], scene: Scene | None, count: int) -> dict[str, Curve]:
    t = result.t[:count]
    found: dict[str, Curve] = {}
    for index, name in enumerate(result.pairs):
        pair = PairSeries.of(result, index)
        for what, values, unit in (
            ("normal_force", pair.normal, "N"),
            ("friction_force", pair.friction, "N"),
            ("depth", pair.depth, "m"),
        ):
            found[f"pairs.{name}.{what}"] = Curve(t, values[:count], unit)
    if scene is None:
        positions = dict(zip(titles, result.q.T, strict=True))
        return found | {name: Curve(t, q[:count], "") for name, q in positions.items()}
    model = scene.model
    for joint, name in zip(list(model.joints)[1:], list(model.names)[1:], strict=True):
        if joint.nv != 1 or joint.shortname() == "JointModelMimic":
            continue
        q = result.q[:count, joint.idx_q]
        if joint.nq == 2:  # cosine and sine
            q = np.unwrap(np.arctan2(result.q[:count, joint.idx_q + 1], q))
        unit = "rad" if joint.nq == 2 else quantity_of(titles[joint.idx_q])[1]
        found[f"q.{name}"] = Curve(t, q, unit)
    carried, rows = [one for one in scene.pairs if one.spheres], np.arange(count)
    poses = {
        joint: poses_along(result, scene, rows, joint, pin.SE3.Identity())
        for joint in {one.joint_i for one in carried}
    }
    for one in carried:
        turned, moved = poses[one.joint_i]
        for axis, values in zip(
            "xyz", (turned @ one.placement_i.translation + moved).T, strict=True
        ):
            found[f"sphere.{one.name}.{axis}"] = Curve(t, values, "m")
    return found


def _flat(value: object, key: str = "") -> Iterator[tuple[str, object]]:
    """Yield the dotted key and the value of each setting; items of lists by name or number."""
    if isinstance(value, dict):
        for name, one in value.items():
            yield from _flat(one, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        for number, one in enumerate(value):
            name = one.get("name") or one.get("label") or number
            yield from _flat(one, f"{key}.{name}")
    else:
        yield key, value
