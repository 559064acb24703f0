"""Spheres over the edges, corners and seams of any solid, judged by its trimmed faces."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from OCP.STEPControl import STEPControl_Reader

from sphshell_pin.base.arrays import Array
from tests.joints.trimmed import PERSISTENCE, Edge, Minima, TrimmedSolid
from tests.joints.verdict import MM, Verdict, exact_elements
from tests.parts.occ import Rng, Solid

RADII = 0.2, 8.0
"""Of spheres [mm]."""

DEPTHS = 1e-6, 0.9
"""Of spheres, over the radius."""

BESIDE = 1e-6, 0.5
"""How far from the joint [mm]."""

NEAR = 1e-3
"""Points of one minimum are nearer than this to each other [radii]."""


def read_step(path: Path) -> Solid:
    """The shape of a file [mm]."""
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def spheres_of(solid: TrimmedSolid, count: int, rng: Rng) -> tuple[Array, Array]:
    """Return up to `count` spheres over both sides of edges, corners and seams, on all sides.

    Their centers (n, 3) and radii (n,) [mm].
    """
    centers, radii = [], []
    known = [edge for edge in solid.edges if all(solid.surfaces[f].kind for f in edge.faces)]
    sides = [(edge, k) for edge in known for k in range(len(edge.faces))]
    sides += [(Edge(curve, 0.0, [row], [True], (0, 0)), 0) for row, curve in solid.seams]
    per = -(-count // max(len(sides), 1))
    for edge, k in sides:
        if not solid.surfaces[edge.faces[k]].kind:
            continue
        r = np.exp(rng.uniform(*np.log(RADII), per))
        low, high = edge.span
        at, near = rng.uniform(low, high, per), rng.random(per) < 0.35
        # Beside the ends of the edge, where other joints come.
        length = max(np.linalg.norm(np.diff(edge.grid[1], axis=0), axis=1).sum(), 1e-9)
        hair = np.exp(rng.uniform(*np.log(BESIDE), per)) / length * (high - low)
        hair = np.minimum(hair, (high - low) / 2)
        at = np.where(near, np.where(rng.random(per) < 0.5, low + hair, high - hair), at)
        points, tangents = edge.at(at)
        into = solid.inward(edge, k, points, tangents)
        beside = np.exp(rng.uniform(*np.log(BESIDE), per))
        if edge in sides[-len(solid.seams) :] and solid.seams:
            beside *= rng.choice([-1, 1], per)
        surface = solid.surfaces[edge.faces[k]]
        other = solid.surfaces[edge.faces[-1 - k]]
        lean = rng.random((per, 1)) * (rng.random((per, 1)) < 0.3)
        points = points + np.where(lean > 0, 0.0, beside[:, None]) * into
        distance, normal = surface.closest(points)
        points = points - distance[:, None] * normal
        out = rng.choice([-1.0, 1.0], (per, 1))
        # The same side of the solid on both faces.
        m = other.closest(points)[1] * _side(edge)
        normal = (1 - lean) * normal + lean * m
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        depth = r * np.exp(rng.uniform(*np.log(DEPTHS), per))
        centers.append(points + out * (r - depth)[:, None] * normal)
        radii.append(r)
    at, r = np.concatenate(centers), np.concatenate(radii)
    if not len(solid.free):
        return at, r
    away = np.array([np.linalg.norm(solid.free - c, axis=1).min() for c in at])
    kept = away > r + solid.size / 100
    return at[kept], r[kept]


def _side(edge: Edge) -> float:
    """Whether the normals of both faces of an edge are on one side of the solid.

    If they agree, the edge is on the left of one face and on the right of the other.
    """
    return -1.0 if edge.left in ([True, True], [False, False]) else 1.0


def judge_solid(shell, solid, name, centers, radii, digits, rough):
    """Compare the contacts of every sphere with the local minima of the distance.

    digits, rough : tolerances of depths on exact faces, beside 1e-10 r, and on other ones [mm]
    """
    truth = solid.minima(centers, radii)
    exact = exact_elements(shell)
    out = Verdict(name, len(radii))
    for here, center, r in zip(truth, centers, radii.tolist(), strict=True):
        terms = shell.contacts(center * MM, r * MM).terms
        element = terms.element
        found = Found(terms.point / MM, terms.normal, terms.depth / MM, terms.weight)
        for strict in (True, False):
            fault, detail = _fault(here, found, r, 1e-10 * r + digits if strict else rough)
            if not fault:
                break
            # Where a face is not exact, the chord error is allowed.
            if strict:
                near = [here.points] if len(here.points) else []
                places = np.concatenate([*near, found.points])
                beside = (shell.contacts(p * MM, rough * MM, "elements").element for p in places)
                if exact[np.concatenate([element, *beside])].all():
                    break
        if fault:
            where = f"center {(center * MM).tolist()}, radius {r * MM}"
            out.faults[fault].append(f"{where}: {detail}")
    return out


@dataclass(frozen=True)
class Found:
    """The minima and saddles of a shell's contacts [mm]."""

    points: Array
    normals: Array
    depths: Array
    weights: Array


def _fault(truth: Minima, found: Found, r: float, tolerance: float) -> tuple[str, str]:
    # Faces that are nearly tangent cross farther away than by what they miss each other.
    tolerance += 4 * truth.off
    sure = truth.sure & (truth.depths > tolerance)
    if not len(found.depths):
        return ("lost", f"depth {truth.depths.max()}") if sure.any() else ("", "")
    if not len(truth.depths):
        made_up = found.depths.max() > tolerance
        return ("phantom", f"depth {found.depths.max()}") if made_up else ("", "")
    deepest, most = truth.depths.max(), found.depths.max()
    if most > deepest + tolerance:
        return "deep", f"{most} instead of {deepest}"
    # On a border any of the faces beside it may be right.
    least = truth.depths[truth.sure].max() if truth.sure.any() else truth.depths.min()
    if most < least - tolerance:
        return "shallow", f"{most} instead of {least}"
    apart = np.abs(truth.depths[:, None] - found.depths)
    away = np.linalg.norm(truth.points[:, None] - found.points, axis=2)
    # A closest point is worse determined than its distance.
    same = (apart <= tolerance) & (away <= NEAR * r + np.sqrt(r * tolerance))
    plus = found.weights > 0
    for k in np.flatnonzero(sure & ~same[:, plus].any(axis=1)):
        return "missing", f"{truth.depths[k]} at {truth.points[k].tolist()}"
    steps = np.abs(found.depths[:, None] - found.depths)
    level = steps <= np.maximum(tolerance, 1e-6 * found.depths)
    if tolerance < 1e-6 * r:
        alone = plus & ~same.any(axis=0) & ~(level & (found.weights < 0)).any(axis=1)
        for k in np.flatnonzero(alone & (found.depths > tolerance)):
            return "phantom", f"{found.depths[k]} at {found.points[k].tolist()}"
        for k in np.flatnonzero(truth.depths > tolerance).tolist():
            # The saddle between two that are nearly one is hardly shallower.
            beside = (away[k] <= NEAR * r) & (apart[k] <= max(tolerance, PERSISTENCE * r))
            total = found.weights[same[k] | (beside & ~plus)].sum()
            own = truth.points[same[:, same[k]].any(axis=1)]
            if total > _distinct(own, PERSISTENCE * r):
                return "double", f"weights {total} at {truth.points[k].tolist()}"
    apart = np.linalg.norm(truth.points - truth.points[truth.depths.argmax()], axis=1)
    single = (apart <= NEAR * r) & (np.abs(truth.depths - deepest) <= 1e-9 * r)
    if single.all() and len(found.depths) == 1 and truth.plane[truth.depths.argmax()]:
        push = np.linalg.norm(found.depths**2 * found.normals)
        off = abs(push / deepest**2 - 1)
        # The push is the square of a depth that is off by the tolerance.
        if off > 1e-6 + (1 + 2 * tolerance / deepest) ** 2 - 1:
            return "force", f"{off}"
    return "", ""


def _distinct(points: Array, apart: float) -> int:
    """How many of points (n, 3) are farther than that from all before them.

    Minima on a border are listed once for each face and edge that may have them.
    """
    kept: list[Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) > apart for other in kept):
            kept.append(point)
    return len(kept)
