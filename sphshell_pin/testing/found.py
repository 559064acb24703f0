"""No contact missed, none made up, nobody passes through: against every triangle, one by one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin.checks import check_points, check_positive
from sphshell_pin.dynamics import Result, Scene
from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.dynamics.scene import ContactPair
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.testing.finding import Finding, worst
from sphshell_pin.testing.triangles import crossed, distances, feet, pieces, samples

Array = NDArray[np.float64]

# Points nearer to each other, in radii, are one: how far off they are is told apart from that.
_SAME = 1e-3


def contacts_of_shell(
    shell: Any,
    radius: float,
    centers: Any = None,
    *,
    count: int = 200,
    seed: int = 0,
    method: str = "facets",
) -> Finding:
    """Compare `shell.contacts` of a sphere at many places to the distances of all triangles.

    `radius` [m]; `centers` (n, 3) in the shell's frame [m], else `count` random ones: deep, barely
    touching, near and far. Compared are whether there is a contact, the largest depth, whether each
    contact lies on the surface as far from the centre as its depth says, and, with the method
    "facets", whether each piece of the surface within the sphere has its contact, and each element
    that is nearest at its inside. The error is a length relative to the radius.

    The elements are taken as flat: with the method "smooth" the bulge of the curved ones is part of
    the error. InvalidParameter for a one-sided shell, which leaves out contacts on purpose.
    """
    radius = check_positive("radius", radius, "m")
    if shell.side != "both":
        raise InvalidParameter("shell.side", shell.side, "must be 'both': all contacts are counted")
    corners = shell.vertices[shell.triangles]
    if centers is None:
        places = sphere_centers(corners, radius, count, np.random.default_rng(seed))
    else:
        places = check_points("centers", centers)
    away = distances(places, corners)
    findings = []
    for center, row in zip(places, away, strict=True):
        found = shell.contacts(center, radius, method)
        findings.append(
            _compare(found.depth, found.point, center, radius, row, shell, whole=method == "facets")
        )
    return worst(findings, "no place was tried")


def contacts_of_scene(scene: Scene, q: Any, data: Any = None) -> Finding:
    """Compare `scene.contacts` at q (nq,) to the distances of all triangles of all its shells.

    Where spheres and shells are is found by Pinocchio's frames; for the rest see
    `contacts_of_shell`. Contact sources have no triangles and are left out. `data` of the scene's
    model is made unless given, which takes long for a large one.
    """
    q, _ = scene.check_state(q)
    model = scene.model
    data = model.createData() if data is None else data
    pin.framesForwardKinematics(model, data, q)
    contacts = scene.contacts(q)
    findings = []
    for k, pair in enumerate(scene.pairs):
        if pair.shell is None or pair.sphere is None:
            continue
        if pair.shell.side != "both":
            raise InvalidParameter("scene", pair.name, "must have a shell with side 'both'")
        placement, center = _Places.of(model, pair).at(data)
        mine = contacts.pair == k
        points = np.array([placement.actInv(p) for p in contacts.point_world[mine]]).reshape(-1, 3)
        row = distances(center[None], pair.shell.vertices[pair.shell.triangles])[0]
        finding = _compare(
            contacts.depth[mine],
            points,
            center,
            pair.sphere.radius,
            row,
            pair.shell,
            whole=pair.method == "facets",
        )
        findings.append(Finding(finding.error, f"contact '{pair.name}': {finding.where}"))
    return worst(findings, "the scene has no pair of a sphere and a shell")


def passage(result: Result) -> Finding:
    """Count how often the centre of a sphere went through its shell in a run.

    The way of the centre from each recorded row to the next, seen from the shell, is cut with every
    triangle; the run's own events of the kind "through" count too.
    """
    scene = result.scene
    if scene is None:
        raise InvalidParameter(
            "result", "a loaded result", "must know its scene: take what Simulation.run returned"
        )
    model, data = scene.model, scene.model.createData()
    told = [f"'{e.pair}' told so at t = {e.t:.6g} s" for e in result.events if e.kind == "through"]
    for k, pair in enumerate(scene.pairs):
        if pair.shell is None:
            continue
        corners, places = pair.shell.vertices[pair.shell.triangles], _Places.of(model, pair)
        before: Array | None = None
        for t, q in zip(result.t, result.q, strict=True):
            pin.framesForwardKinematics(model, data, q)
            _, center = places.at(data)
            if before is not None and len(hit := crossed(before, center, corners)):
                element = int(pair.shell.triangle_element[hit[0]])
                told.append(f"'{scene.pairs[k].name}', element {element}, before t = {t:.6g} s")
            before = center
    return Finding(float(len(told)), f"through the shell: {'; '.join(told[:3]) or 'never'}")


def sphere_centers(corners: Array, radius: float, count: int, rng: np.random.Generator) -> Array:
    """Return centres (count, 3) round triangles (t, 3, 3): deep, barely touching, near and far."""
    kinds = (
        (0.02, 0.98),  # deep to shallow
        (1.0 - 1e-6, 1.0 + 1e-6),  # barely
        (1.01, 2.0),  # near
        (5.0, 50.0),  # far
    )
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = spans / np.linalg.norm(spans, axis=1)[:, None]
    points = samples(corners, count, rng)
    home = np.argmin(distances(points, corners), axis=1)
    away = np.array([radius * rng.uniform(*kinds[k % len(kinds)]) for k in range(count)])
    # Along the normal most centres are as near as meant; askew they meet edges and borders.
    askew = rng.normal(size=(count, 3)) * np.where(np.arange(count) % 3 == 2, 0.5, 0.0)[:, None]
    direction = normals[home] * rng.choice([-1.0, 1.0], count)[:, None] + askew
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return np.asarray(points + away[:, None] * direction)


@dataclass(frozen=True)
class _Places:
    """Where a pair's two bodies are: frames by index, and what stands in them."""

    frame_i: int
    frame_j: int
    offset: Array
    placement: Any

    @classmethod
    def of(cls, model: Any, pair: ContactPair) -> _Places:
        offset = np.zeros(3) if pair.sphere is None else np.array(pair.sphere.offset)
        frames = find_frame(model, pair.frame_i), find_frame(model, pair.frame_j)
        return cls(*frames, offset, pair.placement)

    def at(self, data: Any) -> tuple[Any, Array]:
        """Return where the shell is in the world (SE3), and the sphere's centre (3,) seen from it.

        `data` holds the frames' placements.
        """
        shell = data.oMf[self.frame_j] * self.placement
        return shell, np.asarray(shell.actInv(data.oMf[self.frame_i].act(self.offset)))


def _compare(
    depth: Array,
    point: Array,
    center: Array,
    radius: float,
    away: Array,
    shell: Any,
    *,
    whole: bool,
) -> Finding:
    """Compare contacts to the distances `away` (t,) of all triangles."""
    at = "(" + ", ".join(f"{x:.9g}" for x in center) + ")"
    expected = max(radius - float(away.min()), 0.0)
    found = float(depth.max(initial=0.0))
    word = "missed" if found == 0.0 < expected else "made up" if expected == 0.0 < found else "off"
    if word == "off":
        where = f"depth {found:.9g} m found, {expected:.9g} m there is"
    else:
        where = f"a contact of depth {max(found, expected):.9g} m is {word}"
    element = int(shell.triangle_element[int(np.argmin(away))])
    place = f"centre {at} m in the shell's frame, radius {radius:.6g} m"
    findings = [
        Finding(abs(found - expected) / radius, f"{where} at element {element} ({place})"),
        *_ghosts(depth, point, center, radius, shell, place),
    ]
    if whole:
        findings += _unheard(depth, point, center, radius, away, shell, place)
    return worst(findings, place)


def _ghosts(
    depth: Array, point: Array, center: Array, radius: float, shell: Any, place: str
) -> Iterator[Finding]:
    """Tell of each contact how far it is from the surface, and its depth from its distance."""
    if not len(depth):
        return
    lift = distances(point, shell.vertices[shell.triangles]).min(axis=1)
    short = np.abs(radius - np.linalg.norm(point - center, axis=1) - depth)
    for k, off in enumerate(np.maximum(lift, short) / radius):
        told = f"contact {k} is {lift[k]:.3g} m off the surface, its depth {short[k]:.3g} m wrong"
        yield Finding(float(off), f"{told} ({place})")


def _unheard(
    depth: Array, point: Array, center: Array, radius: float, away: Array, shell: Any, place: str
) -> Iterator[Finding]:
    """Tell of each piece of surface and each foot within the sphere whether a contact lies there.

    Each has a least distance of its own: a piece somewhere on it, a foot at itself.
    """
    triangles = np.asarray(shell.triangles, dtype=np.int64)
    within = np.flatnonzero(away < radius)
    if not len(within):
        return
    for piece in pieces(triangles, away < radius):
        deep = radius - float(away[piece].min())
        near = distances(point, shell.vertices[triangles[piece]])
        if float(near.min(initial=np.inf)) > _SAME * radius:
            element = int(shell.triangle_element[piece[0]])
            told = f"{deep:.3g} m deep in a piece of {len(piece)} triangles, but no contact there"
            yield Finding(deep / radius, f"element {element}: {told} ({place})")
    inside, places = feet(center, shell.vertices[triangles[within]])
    for k, foot in zip(within[inside], places, strict=True):
        off = np.linalg.norm(point - foot, axis=1) if len(depth) else np.zeros(0)
        if float(off.min(initial=np.inf)) > _SAME * radius:
            deep = radius - float(away[k])
            told = f"{deep:.3g} m deep at its inside, but no contact there"
            yield Finding(
                deep / radius, f"element {int(shell.triangle_element[k])}: {told} ({place})"
            )
