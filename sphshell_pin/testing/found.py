"""No contact missed, none made up, nobody passes through: against every triangle, one by one."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import trimesh
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.base.checks import check_points, check_positive
from sphshell_pin.dynamics import Result, Scene
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.dynamics.scene.scene import ContactPair
from sphshell_pin.dynamics.scene.sides import ShellSide, SphereSide
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell
from sphshell_pin.shell.raw import area_vectors, random_places
from sphshell_pin.testing.conservation import scene_of
from sphshell_pin.testing.finding import Finding, Optional, worst


def distances(points: Array, corners: Array) -> Array:
    """Return the distance (n, t) [m] of each of points (n, 3) to each triangle (t, 3, 3)."""
    return np.array([np.linalg.norm(closest(point, corners) - point, axis=1) for point in points])


def closest(point: Array, corners: Array) -> Array:
    """Return the point (t, 3) of each triangle (t, 3, 3) that is closest to `point` (3,)."""
    same = np.broadcast_to(point, (len(corners), 3))
    return np.asarray(trimesh.triangles.closest_point(corners, same))  # type: ignore[no-untyped-call]


def closest_inside(point: Array, corners: Array) -> tuple[Longs, Array]:
    """Return the triangles (k,) of (t, 3, 3) closest to `point` (3,) at their inside, and where.

    Points (k, 3) well inside: there the distance has a strict minimum, whatever the neighbors are.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    twice = np.einsum("tx,tx->t", normal, normal)
    away = point - a
    first = np.einsum("tx,tx->t", np.cross(away, v), normal) / twice
    second = np.einsum("tx,tx->t", np.cross(u, away), normal) / twice
    margin = 1e-6
    inside = np.flatnonzero((first > margin) & (second > margin) & (first + second < 1 - margin))
    return inside, (a + first[:, None] * u + second[:, None] * v)[inside]


def pieces(triangles: Longs, touched: Mask) -> list[Longs]:
    """Split the `touched` (t,) among triangles (t, 3) into pieces that hang together by vertices.

    Returns the indices of the triangles of each piece.
    """
    rows = np.flatnonzero(touched)
    corners = triangles[rows].astype(np.int64)
    size, first = int(triangles.max()) + 1, corners[:, [0, 0]].ravel()
    joined = coo_array((np.ones(first.size), (first, corners[:, 1:].ravel())), (size, size))
    label = connected_components(joined, directed=False)[1][corners[:, 0]]
    return [rows[label == one] for one in np.unique(label)]


def crossed(start: Array, end: Array, corners: Array) -> Longs:
    """Return the triangles (t, 3, 3) through which the path from `start` (3,) to `end` (3,) leads.

    By Moeller and Trumbore (1997); a path within a triangle's plane crosses nothing.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    way = end - start
    across = np.cross(way, v)
    det = np.einsum("tx,tx->t", u, across)
    safe = np.where(det == 0.0, 1.0, det)
    from_a = start - a
    first = np.einsum("tx,tx->t", from_a, across) / safe
    other = np.cross(from_a, u)
    second = other @ way / safe
    share = np.einsum("tx,tx->t", v, other) / safe
    hit = (first >= 0) & (second >= 0) & (first + second <= 1) & (share >= 0) & (share <= 1)
    return np.flatnonzero(hit & (det != 0.0))


# Points nearer to each other, in radii, count as one; how far off they are is measured separately.
_SAME = 1e-3


def contacts_of_shell(
    shell: Shell,
    radius: float,
    centers: Optional = None,
    *,
    count: int = 200,
    seed: int = 0,
    method: str = "facets",
) -> Finding:
    """Compare `shell.contacts` to the distances of all triangles; see `assert_no_contact_missed`.

    Compared are whether there is a contact, the largest depth, whether each contact lies on the
    surface as far from the center as its depth says, and, with the method "facets", whether each
    piece of the surface within the sphere has its contact, and each element whose closest point is
    inside it.
    """
    radius = check_positive("radius", radius, "m")
    if shell.side != "both":
        raise InvalidParameter("shell.side", shell.side, "must be 'both': all contacts are counted")
    if centers is None:
        corners = shell.vertices[shell.triangles]
        places = sphere_centers(corners, radius, count, np.random.default_rng(seed))
    else:
        places = check_points("centers", centers)
    findings = []
    for center in places:
        found = shell.contacts(center, radius, method)
        query = _Query(shell, center, radius, found.point, found.depth)
        findings.append(query.compare(whole=method == "facets"))
    return worst(findings, "no place was tried")


def contacts_of_scene(scene: Scene, q: ArrayLike, data: pin.Data | None = None) -> Finding:
    """Compare `scene.contacts` at q (nq,) to the distances of all triangles of all its shells.

    Pinocchio's frames place spheres and shells; of two spheres the distance of their centers is
    compared. Contact sources have no triangles and are left out.
    `data` of the scene's model is made unless given, which takes long for a large one.
    """
    q, _ = scene.check_state(q)
    model = scene.model
    data = model.createData() if data is None else data
    pin.framesForwardKinematics(model, data, q)
    contacts = scene.contacts(q)
    findings = []
    for k, pair in enumerate(scene.pairs):
        mine = contacts.pair == k
        if len(pair.spheres) == 2:
            finding = _of_two_spheres(model, data, pair, contacts.depth[mine])
            findings.append(Finding(finding.error, f"contact '{pair.name}': {finding.where}"))
        for on_sphere, on_shell in pair.sphere_on_shell:
            if on_shell.shell.side != "both":
                raise InvalidParameter("scene", pair.name, "must have a shell with side 'both'")
            place, center = _places(model, on_sphere, on_shell)(data)
            points = np.array([place.actInv(p) for p in contacts.point_world[mine]]).reshape(-1, 3)
            depths = contacts.depth[mine]
            query = _Query(on_shell.shell, center, on_sphere.radius, points, depths)
            finding = query.compare(whole=on_shell.method == "facets")
            findings.append(Finding(finding.error, f"contact '{pair.name}': {finding.where}"))
    return worst(findings, "the scene has no pair of a sphere and a shell or another one")


def _of_two_spheres(model: pin.Model, data: pin.Data, pair: ContactPair, depths: Array) -> Finding:
    """Compare the depths (1,) or (0,) of two spheres to the distance of their centers."""
    centers, radii = [], []
    for sphere in (one.sphere for one in pair.spheres):
        frame = data.oMf[find_frame(model, sphere.frame)]
        centers.append(frame.act(np.array(sphere.offset)))
        radii.append(sphere.radius)
    depth = sum(radii) - float(np.linalg.norm(centers[0] - centers[1]))
    where = f"the spheres are {depth:.6g} m deep in each other"
    if len(depths) > 1 or (len(depths) == 0 and depth > _SAME * min(radii)):
        return Finding(np.inf, f"{where}, and have {len(depths)} contacts")
    found = float(depths[0]) if len(depths) else 0.0
    return Finding(abs(found - max(depth, 0.0)) / min(radii), where)


def passage(result: Result) -> Finding:
    """Count how often the center of a sphere went through its shell in a run.

    The path of the center from each recorded row to the next, seen from the shell, is cut with
    every triangle; the run's own events of the kind "through" count too.
    """
    scene = scene_of(result)
    model, data = scene.model, scene.model.createData()
    passed = [
        f"'{e.pair}' by its event at t = {e.t:.6g} s" for e in result.events if e.kind == "through"
    ]
    of_shells = [(pair.name, *sides) for pair in scene.pairs for sides in pair.sphere_on_shell]
    for name, on_sphere, on_shell in of_shells:
        shell, places = on_shell.shell, _places(model, on_sphere, on_shell)
        corners = shell.vertices[shell.triangles]
        before: Array | None = None
        for t, q in zip(result.t, result.q, strict=True):
            pin.framesForwardKinematics(model, data, q)
            _, center = places(data)
            if before is not None and len(hit := crossed(before, center, corners)):
                element = int(shell.triangle_element[hit[0]])
                passed.append(f"'{name}', element {element}, before t = {t:.6g} s")
            before = center
    return Finding(float(len(passed)), f"through the shell: {'; '.join(passed[:3]) or 'never'}")


def sphere_centers(corners: Array, radius: float, count: int, rng: np.random.Generator) -> Array:
    """Return centers (count, 3) round triangles (t, 3, 3): deep, barely touching, near and far."""
    # Deep to shallow, barely, near, far.
    kinds = (0.02, 0.98), (1.0 - 1e-6, 1.0 + 1e-6), (1.01, 2.0), (5.0, 50.0)
    spans = area_vectors(corners)
    normals = spans / np.linalg.norm(spans, axis=1)[:, None]
    points = random_places(corners, count, rng)[1]
    home = np.argmin(distances(points, corners), axis=1)
    away = np.array([radius * rng.uniform(*kinds[k % len(kinds)]) for k in range(count)])
    # Along the normal most centers are as near as meant; askew they meet edges and borders.
    askew = rng.normal(size=(count, 3)) * np.where(np.arange(count) % 3 == 2, 0.5, 0.0)[:, None]
    direction = normals[home] * rng.choice([-1.0, 1.0], count)[:, None] + askew
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return np.asarray(points + away[:, None] * direction)


def _places(
    model: pin.Model, on_sphere: SphereSide, on_shell: ShellSide
) -> Callable[[pin.Data], tuple[pin.SE3, Array]]:
    """Return a function of placed data: the pose of a pair's shell, and the sphere's center (3,).

    The pose is that in the world, the center is in the shell's frame.
    """
    offset = np.array(on_sphere.sphere.offset)
    frame_i, frame_j = find_frame(model, on_sphere.frame), find_frame(model, on_shell.frame)

    def at(data: pin.Data) -> tuple[pin.SE3, Array]:
        shell = data.oMf[frame_j] * on_shell.placement
        return shell, np.asarray(shell.actInv(data.oMf[frame_i].act(offset)))

    return at


@dataclass(frozen=True)
class _Query:
    """A sphere at a shell, and the contacts found, points (k, 3) and depths (k,), to compare."""

    shell: Shell
    center: Array
    radius: float
    point: Array
    depth: Array

    def compare(self, *, whole: bool) -> Finding:
        """Return the worst difference [radii] to what all triangles say."""
        corners = self.shell.vertices[self.shell.triangles]
        away = distances(self.center[None], corners)[0]
        at = ", ".join(f"{x:.9g}" for x in self.center)
        place = f"(center ({at}) m in the shell's frame, radius {self.radius:.6g} m)"
        findings = [self._deepest(away), *self._beside(corners)]
        if whole:
            findings += self._missed(corners, away)
        found = worst(findings, "")
        return Finding(found.error, f"{found.where} {place}".strip())

    def _deepest(self, away: Array) -> Finding:
        expected = max(self.radius - float(away.min()), 0.0)
        found = float(self.depth.max(initial=0.0))
        if found == 0.0 < expected or expected == 0.0 < found:
            word = "missed" if found == 0.0 else "made up"
            text = f"a contact of depth {max(found, expected):.9g} m is {word}"
        else:
            text = f"depth {found:.9g} m found, {expected:.9g} m there is"
        element = int(self.shell.triangle_element[int(np.argmin(away))])
        return Finding(abs(found - expected) / self.radius, f"{text} at element {element}")

    def _beside(self, corners: Array) -> Iterator[Finding]:
        """Yield how far each contact is from the surface, and its depth from its distance."""
        lift = distances(self.point, corners).min(axis=1) if len(self.depth) else self.depth
        distance = np.linalg.norm(self.point - self.center, axis=1)
        short = np.abs(self.radius - distance - self.depth)
        for k, off in enumerate(np.maximum(lift, short) / self.radius):
            text = f"contact {k} is {lift[k]:.3g} m off the surface, its depth {short[k]:.3g} m"
            yield Finding(float(off), f"{text} wrong")

    def _missed(self, corners: Array, away: Array) -> Iterator[Finding]:
        """Yield each piece of surface and each closest point in the sphere without a contact.

        Each has a smallest distance of its own: a piece somewhere on it, a closest point at itself.
        """
        triangles = np.asarray(self.shell.triangles, dtype=np.int64)
        within = np.flatnonzero(away < self.radius)
        if not len(within):
            return
        for piece in pieces(triangles, away < self.radius):
            near = distances(self.point, corners[piece])
            if float(near.min(initial=np.inf)) > _SAME * self.radius:
                what = f"in a piece of {len(piece)} triangles"
                yield self._alone(int(piece[0]), float(away[piece].min()), what)
        inside, places = closest_inside(self.center, corners[within])
        for k, place in zip(within[inside], places, strict=True):
            off = np.linalg.norm(self.point - place, axis=1)
            if float(off.min(initial=np.inf)) > _SAME * self.radius:
                yield self._alone(int(k), float(away[k]), "at its inside")

    def _alone(self, triangle: int, away: float, where: str) -> Finding:
        deep = self.radius - away
        element = int(self.shell.triangle_element[triangle])
        text = f"element {element}: {deep:.3g} m deep {where}, but no contact there"
        return Finding(deep / self.radius, text)
