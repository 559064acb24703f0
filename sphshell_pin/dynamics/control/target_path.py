"""A path through points: straight pieces or a spline, and how fast a target moves along it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell

__all__ = ["Curve", "Timing", "path_fields"]


# A path on a shell has a knot each `size` / KNOTS: pieces between points leave a curved surface. A
# spline has that many on its length, and some between two points.
KNOTS, KNOTS_BETWEEN = 500, 8
# Length of a path on a shell, over the size of the shell: what is longer is in another unit.
LONGEST = 2000.0
# A spline has corners: where it turns by more at a knot [rad] it has a corner, not a curvature.
# Knots that are nearer than this part of their usual distance are one.
CORNER, SAME = 0.2, 1e-6


@dataclass(frozen=True, eq=False)
class Curve:
    """Knots (n, 3) [m] at the arc lengths `along` (n,) [m], with the surface's normals (n, 3).

    Between them the curve is a cubic with the given `tangents` (n, 3), or straight where there are
    none (0, 3). At the arc lengths `corners` it turns: a spline has two knots there, one with the
    tangent that comes in and one with that which goes out.
    """

    along: Array
    points: Array
    tangents: Array
    normals: Array
    corners: Array

    @classmethod
    def through(cls, points: Array, shell: Shell | None, *, spline: bool) -> Curve:
        """Lead a curve through `points` (k, 3) [m], projected on `shell` where there is one.

        A spline is the natural cubic one over the square roots of the distances (centripetal: Lee,
        Computer-Aided Design 21, 1989: no loops and little overshoot where distances differ), then
        through the projected knots over their arc length, from corner to corner.

        Raises InvalidParameter for a path that is too long.
        """
        _check_length(points, shell)
        if spline:
            points = points if shell is None else shell.closest_points(points).points
            points = _without_repetitions(points)
        step = np.inf if shell is None else shell.size / KNOTS
        smooth = spline and len(points) > 1
        if smooth:
            step = min(step, float(_lengths(points)[-1]) / KNOTS)
            knots = _on_spline(points, step)
        else:
            knots, at = _on_chords(points, step)
        normals = np.zeros_like(knots)
        if shell is not None:
            projected = shell.closest_points(knots)
            knots, normals = projected.points, projected.normals
        if not smooth:
            along = _lengths(knots)
            return cls(along, knots, np.zeros((0, 3)), normals, along[at])
        # Points beside the surface may all have the same nearest point.
        apart = _apart(knots, SAME * step)
        knots, normals = knots[apart], normals[apart]
        ends = _corners(knots)
        twice = np.sort(np.concatenate([np.arange(len(knots)), ends[1:-1]]))
        along = _lengths(knots)
        tangents = [_slopes(along[a : b + 1], knots[a : b + 1]) for a, b in pairwise(ends)]
        if not tangents:
            return cls(along, knots, np.zeros((0, 3)), normals, along)
        return cls(
            along[twice], knots[twice], np.concatenate(tangents), normals[twice], along[ends]
        )

    @property
    def length(self) -> float:
        """Length of the curve [m]."""
        return float(self.along[-1])

    @property
    def jump(self) -> tuple[float, Array, Array]:
        """The longest distance [m] of two neighboring knots, and the two (3,) [m]."""
        if len(self.points) == 1:
            return 0.0, self.points[0], self.points[0]
        k = int(np.argmax(np.diff(self.along)))
        return float(self.along[k + 1] - self.along[k]), self.points[k], self.points[k + 1]

    def curvature(self, start: float, stop: float) -> float:
        """Return the largest curvature of a spline between two corners [1/m]; 0 of chords."""
        if len(self.tangents) == 0:
            return 0.0
        first = np.searchsorted(self.along, start, side="right") - 1
        last = np.searchsorted(self.along, stop, side="left") + 1
        bends = np.diff(self.tangents[first:last], axis=0)
        sizes = np.linalg.norm(bends, axis=1) / np.diff(self.along[first:last])
        return float(sizes.max(initial=0.0))

    def speed_limit(
        self, start: float, stop: float, speed: float, acceleration: float | None
    ) -> float:
        """Return `speed` [m/s], or that at which the curvature takes the `acceleration` [m/s2]."""
        curvature = 0.0 if acceleration is None else self.curvature(start, stop)
        if acceleration is None or curvature == 0:
            return speed
        return min(speed, float(np.sqrt(acceleration / curvature)))

    def at(self, place: Array) -> Array:
        """Return points (m, 3) [m] at the arc lengths `place` (m,), by straight pieces."""
        return np.stack([np.interp(place, self.along, column) for column in self.points.T], axis=1)


@dataclass(frozen=True, eq=False)
class Timing:
    """Phases of constant jerk: from times[k] [s] on the place is a cubic; the last one rests.

    `places` [m], `speeds` [m/s], `accelerations` [m/s2] and `jerks` [m/s3] hold at the begin of
    each phase.
    """

    times: Array
    places: Array
    speeds: Array
    accelerations: Array
    jerks: Array

    @classmethod
    def along(
        cls,
        curve: Curve,
        begin: float,
        speed: float,
        acceleration: float | None,
        jerk: float | None,
    ) -> Timing:
        """Move along `curve` from the time `begin` [s] on, as fast as the limits allow.

        Without limits the speed is the same all along. With them a motion begins and ends at
        rest: that over each piece between corners. The speed over a piece of a spline is one at
        which its curvature takes no more than `acceleration`.

        Raises InvalidParameter where the limits are too small to come to an end.
        """
        limited = acceleration is not None or jerk is not None
        rows = [(begin, 0.0, 0.0, 0.0, 0.0)]
        for start, stop in pairwise(curve.corners if limited else curve.along[[0, -1]]):
            if stop > start:
                most = curve.speed_limit(start, stop, speed, acceleration)
                del rows[-1]
                rows += _from_rest_to_rest(begin, start, stop, most, acceleration, jerk)
                begin = rows[-1][0]
        timing = cls(*np.array(rows).T)
        if not np.isfinite(timing.times).all():
            raise InvalidParameter(
                "speed", speed, "is too small, or a limit is: the path has no end"
            )
        return timing

    def at(self, t: Array) -> Array:
        """Return the place [m] at the times `t` (m,) [s]."""
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, None)
        x = np.maximum(t - self.times[k], 0.0)
        rates = self.speeds[k] + x * (self.accelerations[k] / 2 + x * self.jerks[k] / 6)
        return np.asarray(
            np.where(k + 1 < len(self.times), self.places[k] + x * rates, self.places[k])
        )

    def reaching(self, places: Array) -> Array:
        """Return the first times [s] at which the target is at `places` (m,) [m]."""
        if len(self.times) == 1:
            return np.full(len(places), self.times[0])
        k = np.clip(np.searchsorted(self.places, places, side="left") - 1, 0, len(self.times) - 2)
        even = (self.accelerations[k] == 0) & (self.jerks[k] == 0)
        since = (places - self.places[k]) / np.where(even, self.speeds[k], 1.0)
        low, high = self.times[k], self.times[k + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            before = self.at(middle) < places
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return np.asarray(np.where(even, self.times[k] + since, high))


def path_fields(curve: Curve, timing: Timing) -> dict[str, ArrayLike]:
    """Return what the C++ path is made of; integrators with error control meet its kinks."""
    # The ends are times of phases already.
    bends = curve.along if len(curve.tangents) == 0 else curve.corners[1:-1]
    kinks = np.unique(np.concatenate([timing.times, timing.reaching(bends)]))
    curved = {name: getattr(curve, name) for name in ("along", "points", "tangents", "normals")}
    return {**curved, **vars(timing), "kinks": kinks}


Row = tuple[float, float, float, float, float]


def _from_rest_to_rest(
    t: float, start: float, stop: float, speed: float, most: float | None, jerk: float | None
) -> list[Row]:
    """Return phases of the quickest motion within the limits, the last one at rest.

    The symmetric double S (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and
    Robots, 2008, section 3.4); a limit that is None does not hold.
    """
    length = stop - start
    speed, bend, ramp = _peak(length, speed, most, jerk)
    top = speed / ramp if jerk is None and ramp > 0 else (jerk or 0.0) * bend
    rate = 0.0 if jerk is None else jerk
    even = max(length / speed - (ramp + bend), 0.0)
    # (duration, acceleration, jerk): up in `bend`, held in `ramp` - `bend`, down in `bend`.
    up = [(bend, 0.0, rate), (ramp - bend, top, 0.0), (bend, top, -rate)]
    down = [(bend, 0.0, -rate), (ramp - bend, -top, 0.0), (bend, -top, rate)]
    rows, place, now = list[Row](), start, speed if ramp + bend == 0 else 0.0
    for duration, a, j in [*up, (even, 0.0, 0.0), *down]:
        if t + duration > t:
            rows.append((t, place, now, a, j))
        # Also in a phase that is too short for the clock the speed changes.
        place += duration * (now + duration * (a / 2 + duration * j / 6))
        now += duration * (a + duration * j / 2)
        t += duration
    return [*rows, (t, stop, 0.0, 0.0, 0.0)]


def _peak(
    length: float, speed: float, most: float | None, jerk: float | None
) -> tuple[float, float, float]:
    """Return the speed reached over `length`, the time of a jerk, and that from rise to its end.

    From rest the speed v takes the times T_j (jerk up), T_a - T_j (even), T_j (jerk down), that is
    `ramp` + `bend` with ramp = v / a and bend = T_j, and the distance v (ramp + bend) / 2.
    """
    bend, ramp = _rise(speed, most, jerk)
    if speed * (ramp + bend) > length:
        speed = _speed_reached(length, most, jerk)
        bend, ramp = _rise(speed, most, jerk)
    return speed, bend, ramp


def _rise(speed: float, most: float | None, jerk: float | None) -> tuple[float, float]:
    """Return `bend` and `ramp` [s] of a rise from rest to `speed` [m/s]."""
    bend = 0.0 if jerk is None else float(np.sqrt(speed / jerk))
    if most is None:
        return bend, bend
    if jerk is not None and most / jerk < bend:
        bend = most / jerk
    elif jerk is not None:
        return bend, bend
    return bend, speed / most


def _speed_reached(length: float, most: float | None, jerk: float | None) -> float:
    """Return the speed v [m/s] of v (ramp + bend) = length [m]: without an even phase."""
    if jerk is not None:
        speed = float(np.cbrt(jerk) * np.cbrt(length / 2) ** 2)  # of 2 v sqrt(v / jerk) = length
        if most is None or np.sqrt(speed / jerk) <= most / jerk:
            return speed
    assert most is not None  # without limits every speed is reached
    bend = 0.0 if jerk is None else most / jerk
    # Root of v (v / most + bend) = length, without a difference of near numbers.
    return float(2 * length / (bend + np.sqrt(bend * bend + 4 * length / most)))


def _check_length(points: Array, shell: Shell | None) -> None:
    """Raise InvalidParameter for a path of another unit: its knots would fill the memory."""
    with np.errstate(over="ignore"):
        length = float(_lengths(points)[-1])
    if not np.isfinite(length):
        raise InvalidParameter("path", f"{length:g} m", "is too long to compute with")
    if shell is not None and length > LONGEST * shell.size:
        raise InvalidParameter(
            "path",
            f"{length:.3g} m",
            f"is over {LONGEST:g} times as long as '{shell.name}', which measures "
            f"{shell.size:.3g} m: give points in the shell's own coordinates [m]",
        )


def _without_repetitions(points: Array) -> Array:
    moved = np.linalg.norm(np.diff(points, axis=0), axis=1) > 0
    return np.asarray(points[np.concatenate([[True], moved])])


def _lengths(points: Array) -> Array:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _on_chords(points: Array, step: float) -> tuple[Array, NDArray[np.intp]]:
    """Divide the straight pieces into parts no longer than `step`; also the corners' indices."""
    pieces, at = [points[:1]], [0]
    for a, b in pairwise(points):
        n = max(1, int(np.ceil(np.linalg.norm(b - a) / step)))
        pieces.append(a + (b - a) * (np.arange(1, n + 1) / n)[:, None])
        at.append(at[-1] + n)
    return np.concatenate(pieces), np.array(at)


def _apart(points: Array, least: float) -> NDArray[np.intp]:
    """Return which points are farther than `least` [m] from the one before that is taken."""
    if (np.linalg.norm(np.diff(points, axis=0), axis=1) > least).all():
        return np.arange(len(points))
    taken = [0]
    for k in range(1, len(points)):
        if np.linalg.norm(points[k] - points[taken[-1]]) > least:
            taken.append(k)
    return np.array(taken)


def _corners(knots: Array) -> NDArray[np.intp]:
    """Return the first knot, those at which the chords turn by more than CORNER, and the last."""
    chords = np.diff(knots, axis=0)
    chords /= np.linalg.norm(chords, axis=1, keepdims=True)
    turns = np.einsum("ij,ij->i", chords[:-1], chords[1:]) < np.cos(CORNER)
    return np.unique(np.concatenate([[0], np.flatnonzero(turns) + 1, [len(knots) - 1]]))


def _on_spline(points: Array, step: float) -> Array:
    """Divide the spline through `points` into parts of about `step`."""
    from scipy.interpolate import CubicSpline

    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    x = np.concatenate([[0.0], np.cumsum(np.sqrt(chords))])
    parts = np.maximum(KNOTS_BETWEEN, np.ceil(chords / step).astype(int))
    pieces = [a + (b - a) * np.arange(n) / n for (a, b), n in zip(pairwise(x), parts, strict=True)]
    places = np.concatenate([*pieces, x[-1:]])
    return np.asarray(CubicSpline(x, points, bc_type="natural")(places))


def _slopes(x: Array, y: Array) -> Array:
    """Return dy/dx (n, 3) at the knots of the natural cubic spline through y (n, 3) at x (n,)."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(x, y, bc_type="natural")(x, 1))
