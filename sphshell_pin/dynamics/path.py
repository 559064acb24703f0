"""A path through points: straight pieces or a spline, and how fast a target moves along it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.shell import Shell

__all__ = ["Curve", "Timing", "core_path"]

Array = NDArray[np.float64]

# A path on a shell has a knot each `size` / KNOTS: pieces between points leave a curved surface.
KNOTS = 500


@dataclass(frozen=True, eq=False)
class Curve:
    """Knots (n, 3) [m] at the arc lengths `along` (n,) [m], with the surface's normals (n, 3).

    Between them the curve is a cubic with the given `tangents` (n, 3), or straight where there are
    none (0, 3). At the arc lengths `corners` it turns.
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
        through the projected knots over their arc length.
        """
        if spline:
            points = points if shell is None else shell.closest_points(points).points
            points = _without_repetitions(points)
        step = np.inf if shell is None else shell.size / KNOTS
        if spline and len(points) > 2:
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
            step = min(step, float(steps.sum()) / KNOTS)
            knots, at = _on_spline(points, step)
        else:
            knots, at = _on_chords(points, step)
        normals = np.zeros_like(knots)
        if shell is not None:
            projected = shell.closest_points(knots)
            knots, normals = projected.points, projected.normals
        along = _lengths(knots)
        tangents = _slopes(along, knots) if spline and len(knots) > 1 else np.zeros((0, 3))
        return cls(along, knots, tangents, normals, along[at])

    @property
    def length(self) -> float:
        """Length of the curve [m]."""
        return float(self.along[-1])

    @property
    def curvature(self) -> float:
        """Largest curvature of a spline [1/m]; 0 of straight pieces."""
        if len(self.tangents) == 0:
            return 0.0
        bends = np.diff(self.tangents, axis=0) / np.diff(self.along)[:, None]
        return float(np.linalg.norm(bends, axis=1).max(initial=0.0))

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
        rest: that over a spline, and that over each piece between corners. The speed over a spline
        is one at which its curvature takes no more than `acceleration`.
        """
        limited = acceleration is not None or jerk is not None
        stops = curve.corners if limited and len(curve.tangents) == 0 else curve.along[[0, -1]]
        if acceleration is not None and curve.curvature > 0:
            speed = min(speed, float(np.sqrt(acceleration / curve.curvature)))
        rows = [(begin, 0.0, 0.0, 0.0, 0.0)]
        for start, stop in pairwise(stops):
            if stop > start:
                del rows[-1]
                rows += _from_rest_to_rest(begin, start, stop, speed, acceleration, jerk)
                begin = rows[-1][0]
        return cls(*np.array(rows).T)

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


def core_path(curve: Curve, timing: Timing) -> _core.Path:
    """Build the C++ path; steps of integrators with error control meet its kinks."""
    kinks = timing.times
    if len(curve.tangents) == 0:
        kinks = np.unique(np.concatenate([kinks, timing.reaching(curve.along)]))
    return _core.Path(
        along=curve.along.tolist(),
        points=curve.points,
        tangents=curve.tangents,
        normals=curve.normals,
        times=timing.times.tolist(),
        places=timing.places.tolist(),
        speeds=timing.speeds.tolist(),
        accelerations=timing.accelerations.tolist(),
        jerks=timing.jerks.tolist(),
        kinks=kinks.tolist(),
    )


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

    def times(v: float) -> tuple[float, float]:
        bend = 0.0 if jerk is None else float(np.sqrt(v / jerk))
        if most is None:
            return bend, bend
        if jerk is not None and most / jerk < bend:
            bend = most / jerk
        elif jerk is not None:
            return bend, bend
        return bend, v / most

    bend, ramp = times(speed)
    if speed * (ramp + bend) > length:
        # The distance grows with the speed: halve until the doubles between are used up.
        low, high = 0.0, speed
        for _ in range(200):
            speed = 0.5 * (low + high)
            bend, ramp = times(speed)
            low, high = (speed, high) if speed * (ramp + bend) <= length else (low, speed)
        speed = low
        bend, ramp = times(speed)
    return speed, bend, ramp


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


def _on_spline(points: Array, step: float) -> tuple[Array, NDArray[np.intp]]:
    """Divide the spline through `points` into parts of about `step`."""
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    x = np.concatenate([[0.0], np.cumsum(np.sqrt(chords))])
    slopes = _slopes(x, points)
    pieces, at = [points[:1]], [0]
    for k, chord in enumerate(chords):
        n = max(1, int(np.ceil(chord / step)))
        u = (np.arange(1, n + 1) / n)[:, None]
        h, w, rise = x[k + 1] - x[k], 1 - u, points[k + 1] - points[k]
        pieces.append(
            points[k]
            + u * (rise + w * (w * (h * slopes[k] - rise) - u * (h * slopes[k + 1] - rise)))
        )
        at.append(at[-1] + n)
    return np.concatenate(pieces), np.array(at)


def _slopes(x: Array, y: Array) -> Array:
    """Return dy/dx (n, 3) at the knots of the natural cubic spline through y (n, 3) at x (n,).

    Continuous second derivatives, zero at the ends, give a tridiagonal system (de Boor, A Practical
    Guide to Splines, 1978, chapter 4), solved by elimination.
    """
    h = np.diff(x)
    rise = np.diff(y, axis=0) / h[:, None]
    left, right = np.append(1 / h, 0.0), np.append(0.0, 1 / h)
    diagonal = 2 * (np.append(1 / h, 0.0) + np.append(0.0, 1 / h))
    target = np.zeros_like(y)
    target[:-1] += 3 * rise / h[:, None]
    target[1:] += 3 * rise / h[:, None]
    for k in range(1, len(x)):
        factor = right[k] / diagonal[k - 1]
        diagonal[k] -= factor * left[k - 1]
        target[k] -= factor * target[k - 1]
    slopes = np.empty_like(y)
    slopes[-1] = target[-1] / diagonal[-1]
    for k in range(len(x) - 2, -1, -1):
        slopes[k] = (target[k] - left[k] * slopes[k + 1]) / diagonal[k]
    return slopes
