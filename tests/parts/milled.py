"""Families of milled and molded parts: mostly planes, with fillets, chamfers, bores, ribs [mm]."""

import numpy as np

from tests.parts import occ
from tests.parts.occ import Rng, Solid


def _sides(rng: Rng, low: float = 20.0, high: float = 100.0) -> np.ndarray:
    return rng.uniform(low, high, 3)


def _outline(rng: Rng, radius: float) -> np.ndarray:
    """Corners (k, 2) of a convex outline whose turns are 11 to 45 degrees."""
    turns = np.radians(rng.uniform(11.0, 45.0, 40))
    count = int(np.searchsorted(np.cumsum(turns), 2 * np.pi - np.radians(11.0)))
    angle = np.concatenate([[0.0], np.cumsum(turns[:count])]) * 2 * np.pi / turns[: count + 1].sum()
    return radius * rng.uniform(0.6, 1.0, 2) * np.stack([np.cos(angle), np.sin(angle)], 1)


def rounded_box(rng: Rng) -> Solid:
    """A box whose edges along x, y and z have radii of their own: they meet in corners."""
    sides = _sides(rng)
    solid = occ.box((0, 0, 0), sides)
    radii = sides.min() * rng.uniform(0.03, 0.4, 3) * (rng.random(3) < 0.8)
    if not radii.any():
        radii[0] = 0.2 * sides.min()
    edges = occ.edges_where(solid, lambda p: True)
    along = [int(np.argmax(occ.span(edge))) for edge in edges]
    chosen = [(e, float(radii[k])) for e, k in zip(edges, along, strict=True) if radii[k] > 0]
    return occ.filleted_each(solid, chosen)


def variable_fillets(rng: Rng) -> Solid:
    """Fillets whose radius changes along the edge."""
    sides = _sides(rng)
    solid = occ.box((0, 0, 0), sides)
    radii = 0.4 * sides.min() * rng.uniform(0.1, 1.0, 2)
    axis = int(rng.integers(3))
    edges = occ.edges_where(solid, lambda p: bool(np.argmax(np.ptp(p, axis=0)) == axis))
    return occ.filleted(solid, edges[: int(rng.integers(1, 5))], *radii.tolist())


def plate(rng: Rng) -> Solid:
    """A plate with round corners, holes, and a rounded upper rim."""
    x, y, z = _sides(rng) * (1.0, 1.0, 0.15)
    solid = occ.box((0, 0, 0), (x, y, z))
    solid = occ.filleted(solid, occ.upright_edges(solid), 0.2 * min(x, y) * rng.uniform(0.3, 1))
    if rng.random() < 0.6:
        solid = occ.filleted(solid, occ.edges_at(solid, z), z * rng.uniform(0.1, 0.6))
    for place in rng.uniform(0.3, 0.7, (int(rng.integers(0, 4)), 2)):
        hole = occ.cylinder(min(x, y) * rng.uniform(0.03, 0.12), 3 * z, (*place * (x, y), -z))
        solid = occ.cut(solid, hole)
    return solid


def boss(rng: Rng) -> Solid:
    """A cylinder or cone on a plate, with a fillet at its foot and on its rim."""
    x, y, z = _sides(rng, 40.0, 100.0) * (1.0, 1.0, 0.2)
    radius, height = min(x, y) * rng.uniform(0.12, 0.3), rng.uniform(8.0, 40.0)
    top = radius * rng.choice([1.0, rng.uniform(0.6, 0.9)])
    solid = occ.box((-x / 2, -y / 2, -z), (x / 2, y / 2, 0.0))
    solid = occ.fuse(
        solid, occ.cone(radius, top, height) if top < radius else occ.cylinder(radius, height)
    )
    foot = occ.edges_about_axis(solid, radius, 0.0)
    solid = occ.filleted(solid, foot, rng.uniform(0.1, 0.6) * min(height / 2, x / 2 - radius))
    if rng.random() < 0.6:
        rim = occ.edges_about_axis(solid, top, height)
        solid = occ.filleted(solid, rim, rng.uniform(0.1, 0.8) * min(height / 3, top))
    if rng.random() < 0.5:
        solid = occ.cut(
            solid, occ.cylinder(top * rng.uniform(0.3, 0.6), height + 3 * z, (0, 0, -2 * z))
        )
    return solid


def rib(rng: Rng) -> Solid:
    """An L-bracket with a rib, and fillets where walls meet."""
    x, y, z = _sides(rng, 40.0, 100.0)
    wall = rng.uniform(0.08, 0.2) * min(x, z)
    corner = [(0, 0), (x, 0), (x, wall), (wall, wall), (wall, z), (0, z)]
    solid = occ.extruded(corner, y)
    reach = rng.uniform(0.4, 0.8) * np.array([x, z])
    slope = occ.extruded([(wall / 2, wall / 2), (reach[0], wall), (wall, reach[1])], wall)
    solid = occ.fuse(solid, occ.moved(slope, (0, 0, (y - wall) / 2)))
    inner = occ.edges_where(solid, lambda p: bool(np.abs(p[:, :2] - wall).max() < 1e-3))
    solid = occ.filleted(solid, inner, rng.uniform(0.2, 0.9) * wall)
    outer = occ.edges_where(solid, lambda p: bool(np.abs(p[:, :2]).max() < 1e-3))
    return occ.filleted(solid, outer, rng.uniform(0.2, 1.2) * wall)


def thin_box(rng: Rng) -> Solid:
    """An open box with thin walls, rounded inside and outside."""
    x, y, z = _sides(rng, 30.0, 100.0)
    radius, wall = rng.uniform(0.1, 0.3) * min(x, y, z), rng.uniform(0.01, 0.04) * max(x, y, z)
    outer = occ.box((0, 0, 0), (x, y, z))
    outer = occ.filleted(outer, occ.upright_edges(outer), radius)
    inside = max(radius - wall, 0.3 * radius)
    inner = occ.box((wall, wall, wall), (x - wall, y - wall, z + 1.0))
    inner = occ.filleted(inner, occ.upright_edges(inner), inside)
    if rng.random() < 0.7:
        outer = occ.filleted(outer, occ.edges_at(outer, 0.0), 0.9 * radius)
        inner = occ.filleted(inner, occ.edges_at(inner, wall), 0.9 * inside)
    return occ.cut(outer, inner)


def mitred_prism(rng: Rng) -> Solid:
    """A prism with turns of 11 to 45 degrees: the fillets of its rim meet end to end in mitres."""
    height = rng.uniform(10.0, 60.0)
    outline = _outline(rng, 50.0)
    solid = occ.extruded(outline, height)
    rim = occ.edges_at(solid, height)
    if rng.random() < 0.4:
        rim += occ.edges_at(solid, 0.0)
    return occ.filleted(solid, rim, rng.uniform(0.05, 0.35) * min(height, 20.0))


def mitred_frame(rng: Rng) -> Solid:
    """A frame around a window, its rims rounded: concave mitres besides the convex ones."""
    height = rng.uniform(5.0, 20.0)
    outline = _outline(rng, 50.0)
    share = rng.uniform(0.5, 0.8)
    window = occ.moved(occ.extruded(share * outline, 3 * height), (0, 0, -height))
    solid = occ.cut(occ.extruded(outline, height), window)
    radius = rng.uniform(0.1, 0.4) * min(height, 0.3 * (1 - share) * 50.0)
    return occ.filleted(solid, occ.edges_at(solid, height), radius)


def bores(rng: Rng) -> Solid:
    """A block with bores, counterbores and countersinks, some crossing."""
    x, y, z = sides = _sides(rng, 30.0, 80.0)
    solid = occ.box((0, 0, 0), sides)
    for _ in range(int(rng.integers(1, 4))):
        radius = min(x, y) * rng.uniform(0.05, 0.12)
        at = (*rng.uniform(0.25, 0.75, 2) * (x, y), -1.0)
        solid = occ.cut(solid, occ.cylinder(radius, z + 2.0, at))
        wide, deep = radius * rng.uniform(1.4, 2.0), z * rng.uniform(0.1, 0.3)
        kind = rng.integers(3)
        if kind == 1:
            solid = occ.cut(solid, occ.cylinder(wide, deep + 1.0, (at[0], at[1], z - deep)))
        elif kind == 2:
            sink = occ.cone(radius, wide, wide - radius, (at[0], at[1], z - wide + radius))
            solid = occ.cut(solid, sink)
    if rng.random() < 0.5:
        at = (-1.0, *rng.uniform(0.3, 0.7, 2) * (y, z))
        solid = occ.cut(solid, occ.cylinder(0.1 * min(y, z), x + 2.0, at, (1, 0, 0)))
    return solid


def chamfered_block(rng: Rng) -> Solid:
    """Chamfers of all edges, of the rim, or around a bore."""
    sides = _sides(rng)
    solid, width = occ.box((0, 0, 0), sides), sides.min() * rng.uniform(0.03, 0.25)
    kind = rng.integers(3)
    if kind == 0:
        return occ.chamfered(solid, occ.edges_where(solid, lambda p: True), width)
    if kind == 1:
        return occ.chamfered(solid, occ.edges_at(solid, sides[2]), width)
    radius = 0.25 * sides[:2].min()
    solid = occ.cut(solid, occ.cylinder(radius, 3 * sides[2], (*sides[:2] / 2, -sides[2])))
    around = occ.edges_about_axis(solid, radius, sides[2], sides[:2] / 2)
    return occ.chamfered(solid, around, 0.3 * radius)


def pocket(rng: Rng) -> Solid:
    """A block with a milled pocket: round corners, and a round or sharp floor."""
    x, y, z = _sides(rng, 40.0, 100.0) * (1.0, 1.0, 0.5)
    wall, radius = 0.15 * min(x, y), rng.uniform(0.05, 0.2) * min(x, y)
    tool = occ.box((wall, wall, z * rng.uniform(0.2, 0.6)), (x - wall, y - wall, 2 * z))
    floor = float(occ.lowest(tool))
    tool = occ.filleted(tool, occ.upright_edges(tool), radius)
    if rng.random() < 0.6:
        tool = occ.filleted(tool, occ.edges_at(tool, floor), radius * rng.uniform(0.2, 0.9))
    return occ.cut(occ.box((0, 0, 0), (x, y, z)), tool)


def star(rng: Rng) -> Solid:
    """A gear with straight flanks, or a knurl: many narrow planes, and a rounded or cut rim."""
    teeth, radius = int(rng.integers(8, 36)), rng.uniform(20.0, 50.0)
    depth = radius * min(0.25, 4.0 / teeth) * rng.uniform(0.5, 1.0)
    angle = 2 * np.pi * np.arange(4 * teeth) / (4 * teeth)
    reach = np.tile([radius, radius, radius - depth, radius - depth], teeth)
    outline = reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    height = rng.uniform(8.0, 30.0)
    solid = occ.extruded(outline, height)
    if rng.random() < 0.5:
        solid = occ.common(solid, occ.cone(radius + 0.3 * height, radius - depth, height))
    if rng.random() < 0.5:
        solid = occ.cut(solid, occ.cylinder(0.3 * radius, 3 * height, (0, 0, -height)))
    return solid


def nut(rng: Rng) -> Solid:
    """A prism of six to twelve sides, cut by a cone, with a bore."""
    count, radius = int(rng.integers(6, 13)), rng.uniform(15.0, 40.0)
    angle = 2 * np.pi * np.arange(count) / count
    height = radius * rng.uniform(0.4, 1.2)
    solid = occ.extruded(radius * np.stack([np.cos(angle), np.sin(angle)], 1), height)
    rise = radius * rng.uniform(0.15, 0.3)
    solid = occ.common(solid, occ.cone(radius + 2 * (height - rise), radius - 2 * rise, height))
    return occ.cut(solid, occ.cylinder(0.55 * radius, 3 * height, (0, 0, -height)))


def random_boolean(rng: Rng) -> Solid:
    """Three to six primitives added and removed, and an edge rounded where that works."""
    solid = occ.box(-_sides(rng, 15.0, 40.0), _sides(rng, 15.0, 40.0))
    for _ in range(int(rng.integers(2, 6))):
        combine = occ.fuse if rng.random() < 0.5 else occ.cut
        solid = combine(solid, _primitive(rng))
    edges = occ.edges_where(solid, lambda p: True)
    for k in rng.permutation(len(edges))[:3].tolist():
        try:
            return occ.checked(occ.filleted(solid, [edges[k]], rng.uniform(0.5, 3.0)))
        except Exception:  # OpenCASCADE's errors have no class of their own
            continue
    return solid


def _primitive(rng: Rng) -> Solid:
    at, axis, size = rng.uniform(-25, 25, 3), rng.normal(size=3), rng.uniform(6.0, 18.0)
    kind = int(rng.integers(5))
    if kind == 0:
        return occ.cylinder(size, 4 * size, at - 2 * size * axis / np.linalg.norm(axis), axis)
    if kind == 1:
        return occ.cone(size, 0.4 * size, 3 * size, at, axis)
    if kind == 2:
        return occ.ball(size, at, axis)
    if kind == 3:
        return occ.torus(size, 0.35 * size, at, axis)
    return occ.box(at - size, at + size * rng.uniform(0.5, 2.0, 3))
