"""Spheres over and around joints, and what is wrong with the contacts that a shell finds."""

from dataclasses import dataclass

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from tests.joints.solids import Part
from tests.joints.verdict import MM, Verdict, exact_elements
from tests.parts.occ import Rng

RADII = 0.2e-3, 20e-3
"""Of spheres [m]."""

DEPTHS = 1e-6, 0.9
"""Of spheres, over the radius."""

BESIDE = 1e-9, 5e-4
"""How far from the joint [m]."""


@dataclass(frozen=True)
class Spheres:
    """Centers (n, 2) in the plane of the outline [mm], (n, 3) in the file [m], radii (n,) [m]."""

    flat: Array
    centers: Array
    radii: Array
    joint: Array


def spheres(part: Part, count: int, rng: Rng) -> Spheres:
    """Return spheres over both sides of every joint of a part, inside and outside."""
    profile, joints = part.profile, part.profile.joints()
    which = np.arange(count) % len(joints)
    radii = np.exp(rng.uniform(*np.log(RADII), count)) / MM
    beside = np.exp(rng.uniform(*np.log(BESIDE), count)) / MM
    depth = radii * np.exp(rng.uniform(*np.log(DEPTHS), count))
    side, out = rng.integers(0, 2, count), rng.choice([-1.0, 1.0], count)
    flat = np.empty((count, 2))
    for k, joint in enumerate(joints):
        one, two = (profile.pieces[i] for i in joint)
        for s, piece in enumerate((one, two)):
            own = np.flatnonzero((which == k) & (side == s))
            step = np.minimum(beside[own], piece.length / 2)
            points, normals = piece.at(step if s else piece.length - step)
            # A third of them over the joint itself, between both normals.
            other = (two.at(np.zeros(1)) if s == 0 else one.at(np.array([one.length])))[1]
            between = rng.random((len(own), 1))
            lean = np.where(rng.random((len(own), 1)) < 0.3, between, 0.0)
            normals = (1 - lean) * normals + lean * other
            normals = normals / np.linalg.norm(normals, axis=1)[:, None]
            points = np.where(lean > 0, two.begin, points)
            flat[own] = points + (out[own] * (radii[own] - depth[own]))[:, None] * normals
    if part.turned:
        # Beside the axis; on the other side of it is on this one.
        flat[:, 0] = np.abs(flat[:, 0])
        angle = rng.uniform(0, 2 * np.pi, count)
        seam = rng.random(count) < 0.2
        angle[seam] = rng.choice([0, np.pi / 2, np.pi], seam.sum()) + rng.choice(
            [-1, 1], seam.sum()
        ) * 10.0 ** rng.uniform(-14, -2, seam.sum())
        kept, along = flat[:, 0] > 1e-3, angle
    else:
        # Clear of both ends.
        kept = radii < 0.45 * part.height
        low = np.where(kept, radii * 1.05, 0.0)
        along = low / part.height + rng.random(count) * (1 - 2 * low / part.height)
    centers = part.in_space(flat, along, along)
    return Spheres(flat[kept], centers[kept] * MM, radii[kept] * MM, which[kept])


def kinds_of(part: Part) -> list[str]:
    """Kinds of the faces that the pieces make."""
    found = []
    for piece in part.profile.pieces:
        way = piece.end - piece.begin
        if piece.middle is not None:
            about = abs(piece.middle[0]) < 1e-9 and part.turned
            found.append("sphere" if about else "torus" if part.turned else "cylinder")
        elif not part.turned or abs(way[1]) < 1e-12 * abs(way[0]):
            found.append("plane")
        else:
            found.append("cylinder" if abs(way[0]) < 1e-12 * abs(way[1]) else "cone")
    return found


def joints_of(part: Part) -> list[str]:
    """Say of each joint which kinds meet, and how."""
    kinds, found = kinds_of(part), []
    for joint in part.profile.joints():
        angle = abs(part.profile.angle(joint))
        how = "tangent" if angle < 1e-9 else "nearly" if angle < 0.03 else "angle"
        found.append(f"{'-'.join(sorted(kinds[k] for k in joint))} {how}")
    return found


def exact_pieces(shell: sp.Shell, part: Part) -> Array:
    """Whether the face of each piece (k,) and those beside it are exact in the shell."""
    middles = [piece.at(np.array([piece.length / 2]))[0][0] for piece in part.profile.pieces]
    near = shell.closest_points(part.in_space(np.array(middles), 0.3, 0.5) * MM, method="facets")
    exact = exact_elements(shell, whole=True)[near.elements]
    # Beside a face that is not exact the chord error is allowed.
    return np.asarray(exact & np.roll(exact, 1) & np.roll(exact, -1))


def chord_error(shell: sp.Shell, part: Part) -> float:
    """How far flat elements are off the part [m], at their middles and those of their sides."""
    corners = shell.vertices[shell.triangles]
    at = [corners.mean(axis=1), *((corners[:, k] + corners[:, k - 1]) / 2 for k in range(3))]
    flat = part.in_plane(np.concatenate(at) / MM)
    return MM * float(np.abs(part.profile.truth(flat, np.zeros(len(flat))).depth).max())


def judge(shell, part, asked, digits, rough, exact=1e-10):
    """Compare the contacts of every sphere with the truth.

    exact : tolerance of depths on exact faces [radii], beside that of the `digits` of the file [m]
    rough : tolerance of depths on other faces [m]
    """
    kinds, names = kinds_of(part), joints_of(part)
    truth = part.profile.truth(asked.flat, asked.radii / MM)
    strict, known = exact_pieces(shell, part), exact_elements(shell)
    joints = [names[k] for k in asked.joint.tolist()]
    out = Verdict(part.name, asked.centers, asked.radii, joints)
    tolerances = np.where(strict[truth.piece], exact * asked.radii + digits, rough)
    # Components that a hair of the radius makes or joins count either way.
    most = {}
    for beside in (0.0, rough):
        hair = np.maximum(np.maximum(tolerances, beside), 1e-9 * asked.radii) / MM
        more = part.profile.truth(asked.flat, asked.radii / MM + hair).count
        less = part.profile.truth(asked.flat, asked.radii / MM - hair).count
        most[beside] = np.maximum(np.maximum(more, less), truth.count)
    for row, (center, radius) in enumerate(zip(asked.centers, asked.radii.tolist(), strict=True)):
        terms = shell.contacts(center, radius).terms
        normal, depth, element, weight = terms.normal, terms.depth, terms.element, terms.weight
        deepest, tolerance = truth.depth[row] * MM, tolerances[row]
        if len(depth) == 0:
            if deepest > tolerance:
                out.add("lost", row, f"depth {deepest / radius} r")
            continue
        found = depth.max()
        error = abs(found - deepest)
        # Ripples of what is not exact, within its chord error, are apart where they barely touch.
        beside = 0.0 if strict[truth.piece[row]] and known[element].all() else rough
        tolerance = max(tolerance, beside)
        if error > tolerance:
            name = "shallow" if found < deepest else "deep"
            out.add(name, row, f"{found / radius} r instead of {deepest / radius} r")
            continue
        out.worst = max(out.worst, error / radius)
        # A minimum and its saddle that the digits of the file bring to one depth are no component;
        # saddles that are shallower than the chord error may join what they should.
        levels = (0.0, *(beside + k * tolerances[row] for k in (0, 2, 4)))
        if min(weight[depth > level].sum() for level in levels) > most[beside][row]:
            out.add("double", row, f"{weight.sum():g} instead of {most[beside][row]}")
            continue
        # The energy of a law whose force is three times the square of the depth.
        energy, single = truth.energy[row] * MM**3, truth.minima[row] == 1
        # Of the cube of a depth that is off by the tolerance: far from linear where that is larger.
        slack = 1e-6 + (1 + 3 * tolerance / deepest) ** 3 - 1
        off = abs(weight @ depth**3 / energy - 1)
        if off > slack:
            out.add("energy" if single else "bridge", row, f"off by {off:.1e}")
        elif single and kinds[truth.piece[row]] == "plane":
            push = 3 * (weight * depth**2) @ normal
            off = abs(np.linalg.norm(push) / (np.linalg.norm(truth.force[row]) * MM**2) - 1)
            if off > slack:
                out.add("force", row, f"off by {off:.1e}")
    return out
