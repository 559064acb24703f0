"""Results over each other: figures, curves over time and settings, with their differences."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import Table, quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_scene import sound_rows
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.scenario.running.figures import NOT_REPEATABLE, recorded_figures


class Curve(NamedTuple):
    """A quantity over time: `t` (n,) [s] and `values` (n,) in `unit`, linear in between."""

    t: Array
    values: Array
    unit: str


@dataclass(frozen=True)
class Measured:
    """A run as it is compared: `figures` (value, unit) and `curves` by name, `settings` by key."""

    label: str
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


class CurveDifference(NamedTuple):
    """What a curve of another run is away from that of the first, over the time that both have.

    `difference` is the difference at the recorded times of either, linear in between as both curves
    are: `largest` is its largest size, at time `at` [s], `rms` the root of its mean square over
    time. `of_range` is `largest` over the range of the first curve in that time, nan where this is
    constant.
    """

    name: str
    unit: str
    largest: float
    at: float
    rms: float
    of_range: float
    difference: Curve


@dataclass(frozen=True)
class Difference:
    """One run beside the first: figures and curves of both, by name.

    `settings` are those of the scenarios that differ: key, of the first, of the other.
    """

    label: str
    figures: tuple[FigureDifference, ...]
    curves: tuple[CurveDifference, ...]
    settings: tuple[tuple[str, object, object], ...]


def measured(label: str, result: Result, scene: Scene | None) -> Measured:
    """Return what of `result` is compared; without a `scene` joints have numbers as names.

    The figures are those of its pairs, joints, sensors, energy and cost, and the last state; the
    curves the columns of its rows. A run that diverged is compared up to where it did.

    Raises ResultError where no row has finite numbers.
    """
    count = sound_rows(label, result.q, result.v)
    recorded = recorded_figures(result, scene, count - 1)
    settings = {} if result.origin is None else dict(_flat(result.origin.settings))
    settings.pop("description", None)  # says what the run is, and changes nothing in it
    columns = {quantity_of(title): one for title, one in result.row_columns(scene).items()}
    return Measured(
        label,
        {name: figure for name, figure in recorded.items() if name not in NOT_REPEATABLE},
        {
            name: Curve(result.t[:count], np.asarray(values)[:count], unit)
            for (name, unit), values in columns.items()
            if name not in ("", "t")
        },
        settings,
    )


def compare(runs: Sequence[Measured]) -> tuple[Difference, ...]:
    """Compare each of `runs` with the first.

    Curves are compared at the recorded times of both runs, within the time that both have; between
    its rows a curve is taken as linear. Pairs, joints and sensors are those of the same name.

    Raises
    ------
    InvalidParameter
        There are fewer than two.
    ResultError
        Two runs have no curve of the same name: they are of different models.
    """
    if len(runs) < 2:
        raise InvalidParameter("runs", len(runs), "must be two at least")
    return tuple(_difference(runs[0], other) for other in runs[1:])


def tables_of(differences: Sequence[Difference]) -> dict[str, Table]:
    """Return the tables "figures" and "curves": a row for each of another run."""
    rows: dict[str, list[tuple[object, ...]]] = {
        "figures": [("run", "figure", "unit", "first", "other", "difference", "relative")],
        "curves": [("run", "curve", "unit", "largest", "at [s]", "rms", "largest over range")],
    }
    for other in differences:
        rows["figures"] += [(other.label, *one) for one in other.figures]
        rows["curves"] += [(other.label, *one[:-1]) for one in other.curves]
    return {
        name: {str(title): list(values) for title, *values in zip(*lines, strict=True)}
        for name, lines in rows.items()
    }


def _difference(first: Measured, other: Measured) -> Difference:
    both = [name for name in first.curves if name in other.curves]
    if not both:
        reason = f"has no contact and no joint in common with {first.label}: nothing to compare"
        raise ResultError(other.label, reason)
    keys = dict.fromkeys((*first.settings, *other.settings))
    settings = [(key, first.settings.get(key), other.settings.get(key)) for key in keys]
    curves = (_curve_difference(name, first.curves[name], other.curves[name]) for name in both)
    figures = []
    for name in (one for one in first.figures if one in other.figures):
        (a, unit), (b, _) = first.figures[name], other.figures[name]
        relative = (b - a) / abs(a) if a else math.nan
        figures.append(FigureDifference(name, unit, a, b, b - a, relative))
    return Difference(
        other.label,
        tuple(figures),
        tuple(one for one in curves if one is not None),
        tuple(one for one in settings if one[1] != one[2]),
    )


def _curve_difference(name: str, first: Curve, other: Curve) -> CurveDifference | None:
    """Return the difference of two curves; None where they have no time in common."""
    begin, end = max(first.t[0], other.t[0]), min(first.t[-1], other.t[-1])
    if begin > end:
        return None
    t = np.unique(np.clip(np.union1d(first.t, other.t), begin, end))
    a, b = (np.interp(t, one.t, one.values) for one in (first, other))
    extent, away = float(np.ptp(a)), b - a
    largest, time = float(np.abs(away).max()), float(end - begin)
    # Exact for what is linear between the times.
    squares = away[:-1] ** 2 + away[:-1] * away[1:] + away[1:] ** 2
    rms = math.sqrt(float(squares @ np.diff(t)) / (3.0 * time)) if time > 0.0 else largest
    at, of_range = float(t[np.abs(away).argmax()]), largest / extent if extent else math.nan
    whole = Curve(t, away, first.unit)
    return CurveDifference(name, first.unit, largest, at, rms, of_range, whole)


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
