"""Curved triangles made from vertices and unit normals: error of the contact force, jump, cost.

python -m benchmarks.element_types

All are Bezier triangles (Gregory's with a rational rest), so that one evaluation and one Newton
iteration serve them all. Arrays keep elements or places last: a field of vectors is (3, n).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import factorial, prod

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.benchmarks.surfaces import (
    SHEET,
    Mesh,
    ball_places,
    icosphere,
    on_sheet,
    on_torus,
    sheet,
    torus,
)
from sphshell_pin.benchmarks.timing import one_core, ratio, take_turns

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Control = tuple[int, int, int]  # a Bezier point, by its exponents of b0, b1, b2
Net = dict[Control, Array]

DEPTH, EXPONENT = 0.04, 1.5  # of a sphere of radius 1, and the law of its force
SIDES = (0.6, 0.3, 0.15)  # of the elements, about
PLACES, NEAR, CLEAR = 2000, 8, 1.3  # of spheres; nearest triangles tried; distance to borders
BALL, RING, TUBE = 4.0, 6.0, 3.0
PAIRS, BLOCK, ROUNDS = 20_000, 2000, 9  # of an element and a centre, timed; a block fits the cache
ORDERS = (0, 1, 1, 2, 2, 2)  # of x, x_u, x_v, x_uu, x_uv, x_vv, where u = b1 and v = b2
TYPES = {  # and the numbers they store beside their corners
    "flat": 0,
    "Nagata, quadratic": 9,
    "PN, cubic": 21,
    "arc cubic": 21,
    "Gregory, A linear": 36,
    "Gregory, A quadratic": 36,
}


def dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("cn,cn->n", a, b))


def cross(a: Array, b: Array) -> Array:
    return np.cross(a, b, axis=0)


def unit(a: Array) -> Array:
    return np.asarray(a / np.sqrt(dot(a, a)))


def angle(a: Array, b: Array) -> Array:
    """Return angles [deg], to round-off also where they are small."""
    sine = cross(a, b)
    return np.degrees(np.arctan2(np.sqrt(dot(sine, sine)), dot(a, b)))


def on(side: int, first: int, last: int, third: int = 0) -> Control:
    """Return the point with these exponents at a side's two ends and at the third corner."""
    i, j, k = np.roll((first, last, third), side).tolist()
    return i, j, k


def controls(degree: int) -> list[Control]:
    return [(degree - j - k, j, k) for j in range(degree + 1) for k in range(degree + 1 - j)]


def bernstein(degree: int, u: Array, v: Array) -> Array:
    """Return the weights (m, n) of the Bezier points."""
    p, q, r = (np.cumprod([np.ones_like(b), *[b] * degree], axis=0) for b in (1 - u - v, u, v))
    times = {c: factorial(degree) / prod(map(factorial, c)) for c in controls(degree)}
    return np.array([t * p[i] * q[j] * r[k] for (i, j, k), t in times.items()]).reshape(-1, len(u))


def derivatives(degree: int) -> list[Array]:
    """Return the matrices from Bezier points to those of x and its derivatives, as `ORDERS`."""

    def by(degree: int, corner: int) -> Array:
        columns = {control: i for i, control in enumerate(controls(degree))}
        matrix = np.zeros((len(controls(degree - 1)), len(columns)))
        for row, (i, j, k) in enumerate(controls(degree - 1)):
            matrix[row, columns[i, j + (corner == 1), k + (corner == 2)]] = degree
            matrix[row, columns[i + 1, j, k]] = -degree
        return matrix

    (u, v), (uu, vv) = ([by(d, corner) for corner in (1, 2)] for d in (degree, degree - 1))
    return [np.eye(u.shape[1]), u, v, uu @ u, vv @ u, vv @ v]


def twists(u: Array, v: Array, order: int) -> list[Array]:
    """Return 12 w^2 x^2 y / (x + y) and its derivatives, (3, n) each, for every corner.

    w, x, y are the barycentric coordinates from the corner on. This moves the inner point near it
    from where the side before it wants it (seen at x = 0) to where the side after it does (y = 0).
    """
    b = np.stack([1 - u - v, u, v])
    w, x, y = b, b[[1, 2, 0]], b[[2, 0, 1]]
    share = np.where(x + y > 1e-9, 1 / np.maximum(x + y, 1e-9), 0)  # no pole beyond the corner
    p, q = x * share, y * share
    f, fx, fy = 12 * x * p * y, 12 * p * q * (x + 2 * y), 12 * x * p * p  # without w^2
    jet = [w * w * f]
    xu, yu, xv, yv = np.array([[1, 0, -1], [0, -1, 1], [0, 1, -1], [1, -1, 0]])[:, :, None]
    if order > 0:
        by_x, by_y = w * (w * fx - 2 * f), w * (w * fy - 2 * f)
        jet += [xu * by_x + yu * by_y, xv * by_x + yv * by_y]
    if order > 1:
        xx = 24 * w * w * q**3 - 4 * w * fx + 2 * f
        xy = 12 * w * w * p * p * (x + 3 * y) * share - 2 * w * (fx + fy) + 2 * f
        yy = -24 * w * w * p**3 - 4 * w * fy + 2 * f
        jet += [
            xu * xu * xx + 2 * xu * yu * xy + yu * yu * yy,
            xu * xv * xx + (xu * yv + xv * yu) * xy + yu * yv * yy,
            xv * xv * xx + 2 * xv * yv * xy + yv * yv * yy,
        ]
    return jet


@dataclass(frozen=True)
class Elements:
    """Patches x(u, v): Bezier points (m, 3, n) of x and of its derivatives, as `ORDERS`."""

    degree: int
    points: list[Array]
    twist: Array | None = None  # Gregory's rest: factors (3, 3, n) of `twists`

    @classmethod
    def of(cls, net: Net, twist: Array | None = None) -> Elements:
        """Make elements from the Bezier points (3, n) of x."""
        degree = sum(next(iter(net)))
        x = np.stack([net[c] for c in controls(degree)])
        return cls(degree, [np.tensordot(m, x, 1) for m in derivatives(degree)], twist)

    def chosen(self, which: Indices) -> Elements:
        """Return some of the elements, as often as they are named."""
        twist = None if self.twist is None else self.twist[..., which]
        return Elements(self.degree, [p[..., which] for p in self.points], twist)

    def jet(self, u: Array, v: Array, order: int) -> list[Array]:
        """Return x and its derivatives up to `order`, (3, n) each."""
        weights = [bernstein(self.degree - d, u, v) for d in range(order + 1)]
        terms = [(weights[d], p) for d, p in zip(ORDERS, self.points, strict=True) if d <= order]
        jet = [np.asarray(np.einsum("mn,mcn->cn", w, p)) for w, p in terms]
        if self.twist is not None:
            rest = [np.einsum("mn,mcn->cn", w, self.twist) for w in twists(u, v, order)]
            jet = [x + more for x, more in zip(jet, rest, strict=True)]
        return jet

    def along(self, side: int, t: float) -> tuple[Array, Array]:
        """Return u and v, of every element, at t from the first end of a side to its last."""
        _, u, v = np.roll((1 - t, t, 0.0), side)
        return np.full(self.points[0].shape[-1], u), np.full(self.points[0].shape[-1], v)

    def side_normals(self, t: float) -> Array:
        """Return the unit normals (3, 3n) at t along every half-edge."""
        tangents = [self.jet(*self.along(k, t), 1)[1:] for k in range(3)]
        return np.hstack([unit(cross(by_u, by_v)) for by_u, by_v in tangents])


class Shell:
    """A mesh, per corner or side of its triangles, (3, 3, n). A half-edge is side * n + triangle.

    twin: the neighbour's half-edge, at a border one's own
    opposite, opposite_normals: the neighbour's corner that is not on the side
    """

    def __init__(self, mesh: Mesh) -> None:
        first, last, third = (np.roll(mesh.triangles.T, -k, axis=0).ravel() for k in range(3))
        edge = np.minimum(first, last) * np.int64(len(mesh.vertices)) + np.maximum(first, last)
        order = np.argsort(edge, kind="stable")
        pairs = np.flatnonzero(edge[order][1:] == edge[order][:-1])
        self.twin = np.arange(edge.size)
        self.twin[order[pairs]], self.twin[order[pairs + 1]] = order[pairs + 1], order[pairs]

        def at(field: Array, vertices: NDArray[np.int32]) -> Array:
            return field[vertices].reshape(3, -1, 3).transpose(0, 2, 1)

        self.corners, self.normals = at(mesh.vertices, first), at(mesh.normals, first)
        self.opposite = at(mesh.vertices, third[self.twin])
        self.opposite_normals = at(mesh.normals, third[self.twin])
        a, b, c = self.corners
        self.facet_normals = unit(cross(b - a, c - a))

    def sides(self) -> list[tuple[Array, Array, Array, Array]]:
        """Return the ends p0, p1 of each side and the normals n0, n1 there."""
        p, n = self.corners, self.normals
        return [(p[k], p[k - 2], n[k], n[k - 2]) for k in range(3)]

    def common_normals(self, net: Net) -> list[Array]:
        """Return for each side the mean of both neighbours' normals in its middle."""
        own = Elements.of(net).side_normals(0.5)
        return np.split(unit(own + own[:, self.twin]), 3, axis=1)


def nagata(shell: Shell) -> Net:
    """Bend each side by the shortest c with n0 . (d - c) = 0 and n1 . (d + c) = 0."""
    net = {on(k, 2, 0): p for k, p in enumerate(shell.corners)}
    for k, (p0, p1, n0, n1) in enumerate(shell.sides()):
        d, total, change = p1 - p0, n0 + n1, n0 - n1
        bend = dot(change, d) / dot(total, total) * total
        bend += dot(total, d) / np.maximum(dot(change, change), 1e-14) * change
        bend *= dot(bend, bend) < dot(d, d) / 4  # S-shaped sides would fold: they stay straight
        net[on(k, 1, 1)] = (p0 + p1 - bend) / 2
    return net


def cubic(shell: Shell, arcs: bool) -> Net:
    """Return PN triangles (Vlachos et al., 2001), or such whose sides fit circular arcs better."""

    def handle(d: Array, n: Array) -> Array:
        along = d - dot(d, n) * n
        cosine = np.sqrt(dot(along, along) / dot(d, d))
        return np.asarray(along * (2 / (cosine * (1 + cosine)) if arcs else 1) / 3)

    net = {on(k, 3, 0): p for k, p in enumerate(shell.corners)}
    for k, (p0, p1, n0, n1) in enumerate(shell.sides()):
        net |= {on(k, 2, 1): p0 + handle(p1 - p0, n0), on(k, 1, 2): p1 + handle(p0 - p1, n1)}
    handles = np.sum([net[on(k, *ends)] for k in range(3) for ends in ((2, 1), (1, 2))], axis=0)
    return net | {(1, 1, 1): handles / 4 - shell.corners.sum(axis=0) / 6}


def arc_cubic(shell: Shell) -> Net:
    """Return cubics that, extended, best meet the neighbours' opposite corners and normals.

    The only unknown is the height of the centre. Least squares of the misses in height and, times
    the triangle's size, in both slopes. At a border that corner is one's own, and is met anyway.
    """
    net = cubic(shell, arcs=True)
    elements, up, (a, b, c) = Elements.of(net), shell.facet_normals, shell.corners
    frame = np.stack([unit(b - a), cross(up, unit(b - a)), up])
    size = np.sqrt(dot(up, cross(b - a, c - a)))
    top = bottom = np.zeros(len(size))
    for k in range(3):
        normal = np.einsum("kcn,cn->kn", frame, shell.opposite_normals[k])
        uv = 2 * np.array(elements.along(k, 0.5)) - np.roll((0, 0, 1), k)[1:, None]
        for _ in range(3):  # Newton in the flat triangle's plane, from a parallelogram's corner
            x, *by = elements.jet(uv[0], uv[1], 1)
            seen = np.einsum("kcn,jcn->jkn", frame, [x - shell.opposite[k], *by])
            inverse = np.linalg.inv(seen[1:, :2].T)
            uv = uv - np.einsum("npc,cn->pn", inverse, seen[0, :2])
        (u, v), w = uv, 1 - uv.sum(axis=0)
        rise_by = np.stack([6 * v * (w - u), 6 * u * (w - v)])  # of 6 w u v, the centre's weight
        slopes, rises = np.einsum("npc,hpn->hcn", inverse, [seen[1:, 2], rise_by]) * size
        miss = np.stack([seen[0, 2], *(slopes + normal[:2] / normal[2] * size)])
        rise = np.stack([6 * w * u * v, *rises])
        top, bottom = top + dot(rise, miss), bottom + dot(rise, rise)
    return net | {(1, 1, 1): net[1, 1, 1] - top / np.maximum(bottom, 1e-9) * up}


def gregory(shell: Shell, net: Net, middle: list[Array] | None = None) -> Elements:
    """Return quartics on the sides of cubics that share the tangent planes of their neighbours.

    Both sides of an edge x(t) leave it along p(t) A(t) + q(t) x'(t), p and q linear, with one A(t):
    linear (Walton and Meek, 1996), or quadratic through the common `middle` normals.
    """
    quartic: Net = {}
    inner = []  # points that each side wants near its first and its last end
    for k, (p0, p1, n0, n1) in enumerate(shell.sides()):
        side = [net[on(k, 3 - i, i)] for i in range(4)]
        x = [(1 - i / 4) * side[min(i, 3)] + i / 4 * side[max(i - 1, 0)] for i in range(5)]
        quartic |= {on(k, 4 - i, i): point for i, point in enumerate(x)}
        t0, t1, t2 = 3 * np.diff(side, axis=0)
        a0, a2 = unit(cross(n0, t0)), unit(cross(n1, t2))
        a1 = (a0 + a2) / 2
        if middle is not None:
            a1 = 2 * unit(cross(middle[k], t0 + 2 * t1 + t2)) - a1
        d0, d3 = 3 * (net[on(k, 2, 0, 1)] - p0) - t0 / 2, 3 * (net[on(k, 0, 2, 1)] - p1) + t2 / 2
        f0, f1 = dot(d0, a0), dot(d3, a2)
        g0, g1 = dot(d0, t0) / dot(t0, t0), dot(d3, t2) / dot(t2, t2)
        d1 = (2 * f0 * a1 + f1 * a0 + 2 * g0 * t1 + g1 * t0) / 3
        d2 = (f0 * a2 + 2 * f1 * a1 + g0 * t2 + 2 * g1 * t1) / 3
        inner.append((d1 / 4 + (x[1] + x[2]) / 2, d2 / 4 + (x[2] + x[3]) / 2))
    quartic |= {on(k, 2, 1, 1): inner[k - 1][1] for k in range(3)}
    return Elements.of(quartic, np.stack([inner[k][0] - inner[k - 1][1] for k in range(3)]))


def all_types(shell: Shell) -> dict[str, Elements]:
    arc = arc_cubic(shell)
    flat = {on(k, 1, 0): p for k, p in enumerate(shell.corners)}
    nets = (flat, nagata(shell), cubic(shell, arcs=False), arc)
    middles = (None, shell.common_normals(arc))
    made = [*map(Elements.of, nets), *(gregory(shell, arc, middle) for middle in middles)]
    return dict(zip(TYPES, made, strict=True))


def feet(elements: Elements, centres: Array, steps: int) -> tuple[Array, Array]:
    """Return u, v of the foot of each centre on its own element, or not far beyond its sides."""
    u = v = np.full(centres.shape[1], 1 / 3)
    for _ in range(steps):
        x, by_u, by_v, by_uu, by_uv, by_vv = elements.jet(u, v, 2)
        away = x - centres
        slope_u, slope_v = dot(away, by_u), dot(away, by_v)
        uu, vv = dot(by_u, by_u) + dot(away, by_uu), dot(by_v, by_v) + dot(away, by_vv)
        uv = dot(by_u, by_v) + dot(away, by_uv)
        area = uu * vv - uv * uv
        u = np.clip(u - (slope_u * vv - slope_v * uv) / area, -0.3, 1.3)
        v = np.clip(v - (slope_v * uu - slope_u * uv) / area, -0.3, 1.3)
    return u, v


def nearest(elements: Elements, centres: Array) -> Array:
    """Return the nearest point (3, n) of each element: its foot, or one on the side before that."""
    u, v = feet(elements, centres, 6)
    b = np.stack([1 - u - v, u, v])
    third = b.argmin(axis=0)
    start, t = np.eye(3)[:, third - 2], np.full(len(u), 0.5)
    along = np.eye(3)[:, third - 1] - start
    for _ in range(4):
        (_, du, dv), (_, u, v) = along, start + t * along
        x, by_u, by_v, by_uu, by_uv, by_vv = elements.jet(u, v, 2)
        away, by_t = x - centres, du * by_u + dv * by_v
        by_tt = du * du * by_uu + 2 * du * dv * by_uv + dv * dv * by_vv
        t = np.clip(t - dot(away, by_t) / (dot(by_t, by_t) + dot(away, by_tt)), 0, 1)
    _, u, v = np.where(b.min(axis=0) < 0, start + t * along, b)
    return elements.jet(u, v, 0)[0]


def ball(side: float) -> Mesh:
    return icosphere(round(np.log2(1.16 * BALL / side)), BALL)


def on_ball(rng: np.random.Generator) -> tuple[Array, Array]:
    return ball_places(BALL, rng, PLACES)


def torus_places(rng: np.random.Generator) -> tuple[Array, Array]:
    return on_torus(RING, TUBE, *rng.uniform(0, 2 * np.pi, (2, PLACES)))


def sheet_places(rng: np.random.Generator) -> tuple[Array, Array]:
    return on_sheet(*rng.uniform(CLEAR - SHEET, SHEET - CLEAR, (2, PLACES)))


Places = Callable[[np.random.Generator], tuple[Array, Array]]
SURFACES: dict[str, tuple[Callable[[float], Mesh], Places, int]] = {
    "dome: outside a sphere, R = 4": (ball, on_ball, 1),
    "bowl: inside a sphere, R = 4": (ball, on_ball, -1),
    "inside a torus, R = 6 and 3": (lambda side: torus(RING, TUBE, side / 1.15), torus_places, -1),
    "on a wavy sheet": (sheet, sheet_places, 1),
}


def measure(mesh: Mesh, points: Array, normals: Array) -> dict[str, list[float]]:
    """Return for all types the mean side, the error of the force, its direction's, jumps' angles.

    Spheres touch at points (n, 3) along unit normals (n, 3). Of the jumps mean and largest.
    """
    shell = Shell(mesh)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    far = np.square(middles).sum(axis=1) - 2 * points @ middles.T
    near = np.argpartition(far, NEAR, axis=1)[:, :NEAR].ravel()
    centres = (points + (1 - DEPTH) * normals).T
    half = np.flatnonzero(shell.twin > np.arange(len(shell.twin)))
    found = {}
    for name, elements in all_types(shell).items():
        tried = nearest(elements.chosen(near), np.repeat(centres, NEAR, axis=1))
        away = centres[:, :, None] - tried.reshape(3, PLACES, NEAR)
        best = np.arange(PLACES), np.linalg.norm(away, axis=0).argmin(axis=1)
        away = away[:, *best]
        depth = np.maximum(1 - np.linalg.norm(away, axis=0), 0)
        errors = np.linalg.norm((depth / DEPTH) ** EXPONENT * unit(away) - normals.T, axis=0)
        along = {t: elements.side_normals(t) for t in (0.25, 0.5, 0.75)}
        jumps = [angle(n[:, half], along[1 - t][:, shell.twin[half]]) for t, n in along.items()]
        figures = [errors, angle(away, normals.T), jumps]
        found[name] = [mesh.mean_side, *(float(np.mean(f)) for f in figures), float(np.max(jumps))]
    return found


def print_errors(name: str, found: list[dict[str, list[float]]]) -> None:
    """Print one surface: a line per type, orders from one mesh to the next in brackets."""
    print(name)
    for kind in TYPES:
        sides, *figures = np.transpose([of[kind] for of in found])
        columns = []
        for values in figures:
            column = [f"{values[0]:.1e}"]
            for (coarse, before), (fine, after) in pairwise(zip(sides, values, strict=True)):
                order = f"{np.log(before / after) / np.log(coarse / fine):.1f}"
                column.append(f"{after:.1e} [{order if before > 1e-9 else ' - '}]")
            columns.append(column)
        force, *rest = columns
        print(f"  {kind:21s}", "  ".join(force), " ", "  ".join(column[-1] for column in rest))


def cost() -> dict[str, Array]:
    """Return times [s] of a foot by four Newton steps, all types in turn, (rounds,) each."""
    shell = Shell(sheet(0.3))
    which = np.random.default_rng(0).integers(shell.facet_normals.shape[1], size=PAIRS)
    centres = shell.corners.mean(axis=0) + (1 - DEPTH) * shell.facet_normals
    blocks = np.split(which, range(BLOCK, PAIRS, BLOCK))

    def contestant(elements: Elements) -> Callable[[], float]:
        work = [(elements.chosen(block), centres[:, block]) for block in blocks]

        def run() -> float:
            start = time.perf_counter()
            for block, of_block in work:
                feet(block, of_block, 4)
            return (time.perf_counter() - start) / PAIRS

        return run

    return take_turns({k: contestant(e) for k, e in all_types(shell).items()}, ROUNDS)


def main() -> None:
    """Measure and print."""
    one_core()
    print(
        f"Sphere of radius 1 at depth {DEPTH:g}, force depth^{EXPONENT:g}, {PLACES} places\n"
        f"force: mean of |error| / |exact|, sides of about {', '.join(map(str, SIDES))} [order]\n"
        "direction of the force: mean error, deg; joint: angle between neighbours on their edge, "
        "deg;\nboth on the finest mesh [order]\n"
        f"{'':24s}{'force':43s}{'direction':15s}{'joint, mean':15s}largest"
    )
    for name, (mesh, places, sign) in SURFACES.items():
        points, normals = places(np.random.default_rng(0))
        print_errors(name, [measure(mesh(side), points, sign * normals) for side in SIDES])
    times = cost()
    print("Numbers stored beside the corners, and time of Newton's method / Nagata's [quartiles]")
    for kind, t in times.items():
        print(f"  {kind:21s} {TYPES[kind]:3d} {ratio(t, times['Nagata, quadratic'])}")


if __name__ == "__main__":
    main()
