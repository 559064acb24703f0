"""Families of turned, bent and free-form parts [mm]."""

import numpy as np

from tests.parts import occ
from tests.parts.occ import Rng, Solid


def peg(rng: Rng) -> Solid:
    """A cylinder, its rims rounded or cut, perhaps on a flange."""
    radius, height = rng.uniform(5.0, 25.0), rng.uniform(20.0, 120.0)
    solid = occ.cylinder(radius, height)
    if rng.random() < 0.5:
        wide, thick = radius * rng.uniform(1.3, 2.5), rng.uniform(3.0, 12.0)
        solid = occ.fuse(solid, occ.cylinder(wide, thick, (0, 0, -thick)))
        foot = occ.edges_about_axis(solid, radius, 0.0)
        solid = occ.filleted(solid, foot, rng.uniform(0.1, 0.8) * (wide - radius))
    rim = occ.edges_about_axis(solid, radius, height)
    width = rng.uniform(0.05, 0.9) * min(radius, height / 4)
    return (occ.filleted if rng.random() < 0.7 else occ.chamfered)(solid, rim, width)


def bottle(rng: Rng) -> Solid:
    """A barrel, a shoulder cone, a neck, with fillets between them."""
    radius, height = rng.uniform(20.0, 45.0), rng.uniform(50.0, 160.0)
    neck, rise = radius * rng.uniform(0.4, 0.93), rng.uniform(8.0, 40.0)
    profile = [(0, 0), (radius, 0), (radius, height), (neck, height + rise)]
    top = height + rise
    if rng.random() < 0.5:
        top += rng.uniform(5.0, 30.0)
        profile.append((neck, top))
    solid = occ.turned([*profile, (0, top)])
    shoulder = occ.edges_about_axis(solid, radius, height)
    solid = occ.filleted(solid, shoulder, rng.uniform(5.0, 20.0))
    if rng.random() < 0.5:
        foot = occ.edges_about_axis(solid, radius, 0.0)
        solid = occ.filleted(solid, foot, rng.uniform(2.0, 12.0))
    return solid


def cones(rng: Rng) -> Solid:
    """Cones on cones: steps of slopes on one axis, perhaps with a tip."""
    count = int(rng.integers(2, 6))
    radii = rng.uniform(8.0, 30.0, count + 1)
    heights = np.concatenate([[0.0], np.cumsum(rng.uniform(5.0, 40.0, count))])
    if rng.random() < 0.4:
        radii[-1] = 0.0
    profile = [(0.0, 0.0), *np.c_[radii, heights].tolist()]
    if radii[-1] > 0.0:
        profile.append((0.0, float(heights[-1])))
    return occ.turned(profile)


def round_ends(rng: Rng) -> Solid:
    """A rod with balls or domes at its ends."""
    radius, length = rng.uniform(5.0, 20.0), rng.uniform(15.0, 90.0)
    solid = occ.cylinder(radius, length)
    share = rng.choice([1.0, rng.uniform(1.05, 1.8)])
    below = np.sqrt((share * radius) ** 2 - radius**2)
    dome = occ.ball(share * radius, (0, 0, length - below))
    if share > 1.0 and rng.random() < 0.5:
        return occ.fuse(solid, occ.ball(share * radius, (0, 0, length)))
    solid = occ.fuse(solid, occ.common(dome, occ.cylinder(2 * radius, 4 * radius, (0, 0, length))))
    if rng.random() < 0.5:
        solid = occ.fuse(solid, occ.ball(radius))
    return solid


def grooved_shaft(rng: Rng) -> Solid:
    """A shaft with grooves of round or square section, perhaps a flat and a keyway."""
    radius, length = rng.uniform(8.0, 20.0), rng.uniform(50.0, 120.0)
    solid = occ.cylinder(radius, length)
    for height in (np.arange(1, int(rng.integers(2, 5))) * length / 5).tolist():
        tube = rng.uniform(0.1, 0.35) * radius
        if rng.random() < 0.7:
            tool = occ.torus(radius + tube * rng.uniform(0.0, 0.5), tube, (0, 0, height))
        else:
            inner = occ.cylinder(radius - 0.7 * tube, tube, (0, 0, height))
            tool = occ.cut(occ.cylinder(2 * radius, tube, (0, 0, height)), inner)
        solid = occ.cut(solid, tool)
    if rng.random() < 0.5:
        flat = radius * rng.uniform(0.5, 0.9)
        solid = occ.cut(solid, occ.box((flat, -40, 0.75 * length), (40, 40, 2 * length)))
    if rng.random() < 0.4:
        width = 0.25 * radius
        key = occ.box((0.6 * radius, -width, 0.83 * length), (2 * radius, width, 0.95 * length))
        solid = occ.cut(solid, key)
    return solid


def crossing_cylinders(rng: Rng) -> Solid:
    """Two cylinders that cross at an angle, perhaps bored, with a fillet where they meet."""
    radius, length = rng.uniform(12.0, 25.0), rng.uniform(60.0, 120.0)
    angle = np.radians(rng.uniform(50.0, 90.0))
    axis = (np.sin(angle), 0.0, np.cos(angle))
    small = radius * rng.uniform(0.4, 0.85)
    branch = occ.cylinder(small, length, (0, 0, 0), axis)
    solid = occ.fuse(occ.cylinder(radius, length, (0, 0, -length / 2)), branch)

    def on_seam(p: np.ndarray) -> bool:
        off = np.abs(np.hypot(p[:, 0], p[:, 1]) - radius).max()
        return bool(off < 1e-2 and np.abs(p[:, 2]).max() < 0.49 * length)

    seam = occ.edges_where(solid, on_seam)
    if rng.random() < 0.8:
        solid = occ.filleted(solid, seam, rng.uniform(0.05, 0.4) * small)
    if rng.random() < 0.4:
        solid = occ.cut(solid, occ.cylinder(0.6 * radius, 2 * length, (0, 0, -length)))
    return solid


def elbow(rng: Rng) -> Solid:
    """A straight pipe, a bend and another straight pipe, hollow or not."""
    ring, tube = rng.uniform(25.0, 50.0), rng.uniform(5.0, 15.0)
    angle = np.radians(rng.uniform(30.0, 150.0))
    length = rng.uniform(20.0, 80.0)
    end = np.array([ring * np.cos(angle), ring * np.sin(angle), 0.0])
    ahead = (-np.sin(angle), np.cos(angle), 0.0)

    def filled(radius: float) -> Solid:
        bend = occ.torus_part(ring, radius, angle)
        first = occ.cylinder(radius, length, (ring, 0, 0), (0, -1, 0))
        return occ.fuse(bend, first, occ.cylinder(radius, length, end, ahead))

    solid = filled(tube)
    return occ.cut(solid, filled(tube * rng.uniform(0.6, 0.9))) if rng.random() < 0.5 else solid


def spline_pipe(rng: Rng) -> Solid:
    """A round rod along a spline."""
    at = np.linspace(0.0, 120.0, 6)
    return occ.piped(np.c_[at, rng.uniform(-20, 20, (6, 2))], rng.uniform(3.0, 6.0))


def loft(rng: Rng) -> Solid:
    """Polygons that turn and shrink, joined by ruled or by smooth faces."""
    count = int(rng.integers(3, 9))
    angle = 2 * np.pi * np.arange(count) / count
    sections = []
    for k in range(int(rng.integers(2, 5))):
        radius, turn = rng.uniform(12.0, 35.0), 0.15 * k * rng.uniform(-1, 1)
        flat = radius * np.stack([np.cos(angle + turn), np.sin(angle + turn)], 1)
        sections.append(np.c_[flat, np.full(count, 25.0 * k)])
    return occ.lofted(sections, bool(rng.random() < 0.3))


def spline_vase(rng: Rng) -> Solid:
    """A spline turned about an axis."""
    heights = np.linspace(0.0, rng.uniform(50.0, 120.0), 7)
    return occ.turned_spline(np.c_[rng.uniform(14.0, 34.0, 7), heights])


def spline_prism(rng: Rng) -> Solid:
    """A block with one wavy side, its rim perhaps rounded."""
    points = np.c_[np.linspace(0.0, 90.0, 8), rng.uniform(0.0, 14.0, 8)]
    height = rng.uniform(10.0, 50.0)
    solid = occ.extruded_spline(points, height, rng.uniform(10.0, 40.0))
    if rng.random() < 0.4:
        solid = occ.filleted(solid, occ.upright_edges(solid), 3.0)
    return solid


def stepped_shaft(rng: Rng) -> Solid:
    """Steps of different radii, with fillets at the shoulders, and cut ends."""
    radii = rng.uniform(8.0, 25.0, int(rng.integers(2, 5)))
    heights = np.concatenate([[0.0], np.cumsum(rng.uniform(15.0, 40.0, len(radii)))])
    profile = [(0.0, 0.0)]
    for radius, low, high in zip(radii.tolist(), heights[:-1], heights[1:], strict=True):
        profile += [(radius, float(low)), (radius, float(high))]
    solid = occ.turned([*profile, (0.0, float(heights[-1]))])
    for one, other, height in zip(radii[:-1], radii[1:], heights[1:-1], strict=True):
        foot = occ.edges_about_axis(solid, min(one, other), height)
        solid = occ.filleted(solid, foot, rng.uniform(0.1, 0.7) * min(abs(one - other), 8.0))
    rim = occ.edges_about_axis(solid, radii[-1], heights[-1])
    return occ.chamfered(solid, rim, rng.uniform(0.05, 0.2) * radii[-1])
