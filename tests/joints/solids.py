"""Parts whose faces meet in every way [mm]: outlines of lines and arcs, turned and extruded."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.BRepTools import BRepTools
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec
from OCP.Message import Message
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.StlAPI import StlAPI_Writer

from sphshell_pin.base.arrays import Array
from tests.parts import occ
from tests.parts.occ import Rng, Solid, checked, rough_size

Family = Callable[[Rng], "Part"]


@dataclass(frozen=True)
class Piece:
    """A line from `begin` to `end`, or the arc about `middle` that turns by `turn` [rad]."""

    begin: Array
    end: Array
    middle: Array | None = None
    turn: float = 0.0

    @property
    def half(self) -> Array:
        """The point in the middle of an arc."""
        c, s = np.cos(self.turn / 2), np.sin(self.turn / 2)
        return self.middle + np.array([[c, -s], [s, c]]) @ (self.begin - self.middle)


@dataclass(frozen=True)
class Part:
    """An outline (x, z) turned about z, or if it has a `height` (x, y) extruded along z.

    Its pieces are connected: closed, or with both ends on the axis.
    """

    name: str
    pieces: tuple[Piece, ...]
    height: float = 0.0

    @property
    def size(self) -> float:
        """Its largest extent, about [mm]."""
        return 2 * max(float(np.abs(piece.begin).max()) for piece in self.pieces)

    def solid(self) -> Solid:
        wire = BRepBuilderAPI_MakeWire()
        first, last = self.pieces[0].begin, self.pieces[-1].end
        closing = () if np.allclose(first, last, rtol=0.0, atol=1e-12) else (Piece(last, first),)
        for piece in (*self.pieces, *closing):
            wire.Add(self._edge(piece))
        face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
        if self.height == 0.0:
            return checked(BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(), gp_Dir(0, 0, 1))).Shape())
        return checked(BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, self.height)).Shape())

    def _edge(self, piece: Piece) -> Solid:
        ends = [self._point(piece.begin), self._point(piece.end)]
        if piece.middle is None:
            return BRepBuilderAPI_MakeEdge(*ends).Edge()
        arc = GC_MakeArcOfCircle(ends[0], self._point(piece.half), ends[1])
        return BRepBuilderAPI_MakeEdge(arc.Value()).Edge()

    def _point(self, at: Array) -> gp_Pnt:
        return gp_Pnt(at[0], at[1], 0.0) if self.height else gp_Pnt(at[0], 0.0, at[1])


def outline(corners, radii, missed=None, cut=None, closed=False):
    """Round or cut corners of a polygon (k, 2).

    missed : angles [rad] by which the arc at a corner misses the tangents of both lines
    cut : widths of chamfers
    """
    corners, missed, cut = np.asarray(corners, float), missed or {}, cut or {}
    count = len(corners)
    entry = {k: corners[k] for k in range(count)}
    leave = dict(entry)
    between: dict[int, Piece] = {}
    for k in {*radii, *cut}:
        a, b, c = corners[k - 1], corners[k], corners[(k + 1) % count]
        u, v = (b - a) / np.linalg.norm(b - a), (c - b) / np.linalg.norm(c - b)
        if k in cut:
            entry[k], leave[k] = b - cut[k] * u, b + cut[k] * v
            between[k] = Piece(entry[k], leave[k])
            continue
        radius, (one, two) = radii[k], missed.get(k, (0.0, 0.0))
        sense = np.sign(u[0] * v[1] - u[1] * v[0])
        n, m = sense * np.array([-u[1], u[0]]), sense * np.array([-v[1], v[0]])
        # The center is off both lines by the radius, less what the arc cuts them.
        off = radius * np.cos([one, two])
        middle = b + np.linalg.solve(np.array([n, m]), off)
        entry[k] = middle - off[0] * n - radius * np.sin(one) * u
        leave[k] = middle - off[1] * m + radius * np.sin(two) * v
        p, q = entry[k] - middle, leave[k] - middle
        turn = float(np.arctan2(p[0] * q[1] - p[1] * q[0], p @ q))
        between[k] = Piece(entry[k], leave[k], middle, turn)
    pieces = []
    for k in range(count):
        if k in between:
            pieces.append(between[k])
        if closed or k < count - 1:
            begin, end = leave[k], entry[(k + 1) % count]
            if np.linalg.norm(end - begin) > 1e-12:
                pieces.append(Piece(begin, end))
    return tuple(pieces)


def write_step(solid: Solid, path: Path) -> Path:
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    writer = STEPControl_Writer()
    writer.Transfer(solid, STEPControl_AsIs)
    writer.Write(str(path))
    return path


def write_stl(solid: Solid, path: Path, deflection: float, angle: float = 0.3) -> Path:
    """A binary file: single precision."""
    BRepTools.Clean_s(solid)
    BRepMesh_IncrementalMesh(solid, deflection, False, angle, False)
    writer = StlAPI_Writer()
    writer.ASCIIMode = False
    writer.Write(solid, str(path))
    return path


def disc(radius: float, fillet: float, miss: float = 0.0) -> Part:
    """A disc with rounded rims, which may miss the tangents."""
    height = max(20.0, 3 * fillet)
    corners = [[0, 0], [radius, 0], [radius, height], [0, height]]
    missed = dict.fromkeys((1, 2), (miss, 0.7 * miss))
    name = f"disc {radius:g} fillet {fillet:g}" + (f" off {miss:g}" if miss else "")
    return Part(name, outline(corners, {1: fillet, 2: fillet}, missed))


def pocket(radius: float, floor: float, rim: float) -> Part:
    """A round pocket with a fillet at its floor, its rim rounded outward."""
    deep, wide = 3 * floor + 2 * rim + 5, radius + 3 * rim + 5
    top = deep + 8.0
    corners = [[0, 0], [wide, 0], [wide, top], [radius, top], [radius, 8.0], [0, 8.0]]
    name = f"pocket {radius:g} floor {floor:g} rim {rim:g}"
    return Part(name, outline(corners, {3: rim, 4: floor, 2: rim}))


def shaft(radius: float, fillet: float, miss: float = 0.0) -> Part:
    """A shaft on a flange, a fillet between them, a chamfer and a rounded rim."""
    wide, long = radius + 2 * fillet + 4, 4 * fillet + 20
    corners = [[0, 0], [wide, 0], [wide, 6], [radius, 6], [radius, 6 + long], [0, 6 + long]]
    name = f"shaft {radius:g} fillet {fillet:g}" + (f" off {miss:g}" if miss else "")
    rim = min(fillet, radius / 3)
    missed = {3: (miss, -miss), 4: (0.5 * miss, miss)}
    return Part(name, outline(corners, {3: fillet, 4: rim}, missed, {1: 1.0}))


def ring(radius: float, fillet: float) -> Part:
    """A tube whose four rims are rounded."""
    inner, high = radius - 3 * fillet - 1, 3 * fillet + 4
    corners = [[inner, 0], [radius, 0], [radius, high], [inner, high]]
    pieces = outline(corners, dict.fromkeys(range(4), fillet), closed=True)
    return Part(f"ring {radius:g} fillet {fillet:g}", pieces)


def cones(radius: float, lean: float, fillet: float = 0.0) -> Part:
    """A cone on a cylinder, and a tip; rounded between if there is a fillet."""
    rise = 15.0
    top = radius - rise * np.tan(lean)
    corners = [[0, 0], [radius, 0], [radius, 20], [top, 20 + rise], [0, 20 + rise + top]]
    radii = {2: fillet, 3: fillet} if fillet else {}
    return Part(f"cones {radius:g} lean {lean:g} fillet {fillet:g}", outline(corners, radii))


def dome(radius: float, length: float = 120.0) -> Part:
    """A rod with a ball end that is tangent, and a flatter dome at the other."""
    tip, flat = np.array([0.0, length]), 1.7 * radius
    deep = flat - np.sqrt(flat**2 - radius**2)
    center = np.array([0.0, flat - deep])
    low = np.array([0.0, -deep])
    turn = float(np.arcsin(radius / flat))
    pieces = (
        Piece(low, np.array([radius, 0.0]), center, turn),
        Piece(np.array([radius, 0.0]), np.array([radius, length - radius])),
        Piece(np.array([radius, length - radius]), tip, tip - [0.0, radius], np.pi / 2),
    )
    return Part(f"dome {radius:g}", pieces)


def slot(length: float, radius: float, depth: float = 20.0) -> Part:
    """A stadium, extruded: two lines and two arcs that are tangent."""
    corners = [[0, 0], [length, 0], [length, 2 * radius], [0, 2 * radius]]
    # Arcs of half a turn are two quarters.
    pieces = outline(corners, dict.fromkeys(range(4), radius), closed=True)
    return Part(f"slot {length:g} radius {radius:g}", pieces, depth)


def bar(side: float, a: float, b: float, miss: float = 0.0) -> Part:
    """A bar, its edges rounded, which may miss the tangents; one corner is hollow."""
    corners = side * np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    rounds = {0: a, 1: b, 3: a, 4: b}
    missed = dict.fromkeys(rounds, (miss, -0.6 * miss))
    pieces = outline(corners, rounds, missed, {2: min(a, side / 4)}, closed=True)
    return Part(f"bar {side:g} radii {a:g} {b:g} off {miss:g}", pieces, 80.0)


def d_shaft(radius: float, cut: float) -> Part:
    """A shaft with a flat, whose corners lie on the cylinder."""
    half = float(np.arccos(1 - cut / radius))
    ends = radius * np.array([[np.cos(half), np.sin(half)], [np.cos(half), -np.sin(half)]])
    middle = np.zeros(2)
    back = np.array([-radius, 0.0])
    arcs = Piece(ends[0], back, middle, np.pi - half), Piece(back, ends[1], middle, np.pi - half)
    pieces = (*arcs, Piece(ends[1], ends[0]))
    return Part(f"d-shaft {radius:g} cut {cut:g}", pieces, 60.0)


def _miss(rng: Rng) -> float:
    """An angle by which a joint is off tangent [rad]."""
    return float(10 ** rng.uniform(-5, -2) * rng.choice([-1.0, 1.0]))


def _sized(make: Callable[..., Part], *ranges: tuple[float, float], off: bool = False) -> Family:
    """Return what makes a part of random sizes, whose joints may be off tangent."""
    return lambda rng: make(*(rough_size(rng, *r) for r in ranges), *([_miss(rng)] * off))


ROUND = (0.05, 10)

FAMILIES: dict[str, Family] = {
    "disc": _sized(disc, (12, 200), (0.05, 5.5)),
    "disc off": _sized(disc, (12, 200), (0.05, 5.5), off=True),
    "pocket": _sized(pocket, (25, 200), ROUND, ROUND),
    "shaft": _sized(shaft, (5, 100), ROUND),
    "shaft off": _sized(shaft, (5, 100), ROUND, off=True),
    "ring": _sized(ring, (35, 200), ROUND),
    "cones": _sized(cones, (20, 100), (0.02, 0.6)),
    "cones filleted": _sized(cones, (20, 100), (0.1, 0.6), (0.1, 10)),
    "dome": _sized(dome, (5, 50)),
    "slot": _sized(slot, (25, 100), (1, 10)),
    "bar": _sized(bar, (25, 80), (0.05, 5), ROUND),
    "bar off": _sized(bar, (25, 80), (0.05, 5), ROUND, off=True),
    "d-shaft": _sized(d_shaft, (3, 40), (0.005, 1.0)),
}
"""Random parts of a family."""


def tube_on_equator(inner: float, tube: float, other: float) -> Solid:
    """Return half a torus whose hole of radius `inner` goes on as the bore of another torus.

    The first lies about z with a tube of radius `tube` [mm]; the bore bends on a radius `other`.
    """
    ring, below = occ.torus(inner + tube, tube), occ.box([-500, -500, -500], [500, 500, 0])
    block = occ.cylinder(inner + 2 * tube, 0.4 * other)
    bent = occ.torus(other, inner, (0, other, 0), (1, 0, 0))
    return checked(occ.fuse(occ.common(ring, below), occ.cut(block, bent)))


def drafted_slot(low: float, high: float, height: float, length: float) -> Solid:
    """Return a block between two cones about y, whose planes are tangent along their rulings.

    Their radii are `low` at y = 0, `high` at the `height`; the second is at z = `length` [mm].
    """
    wedge = occ.extruded([(-low, 0), (low, 0), (high, height), (-high, height)], length)
    first, second = (occ.cone(low, high, height, (0, 0, z), (0, 1, 0)) for z in (0, length))
    return checked(occ.fuse(occ.fuse(wedge, first), second))


def shift_planes(path: Path, by: float) -> None:
    """Move the planes of a STEP file [mm] along their normals, and leave its edges where they are.

    So CAD systems write borders that are off by the file's tolerance.
    """
    text, number = path.read_text(), r"\s*([-+0-9.E]+)\s*"
    for placement in set(re.findall(r"= PLANE\('',(#\d+)\)", text)):
        refers = rf"{placement} = AXIS2_PLACEMENT_3D\('',\s*(#\d+),\s*(#\d+)"
        point, axis = re.findall(refers, text)[0]
        row = rf"{axis} = DIRECTION\('',\s*\({number},{number},{number}\)\)"
        normal = np.array(re.findall(row, text)[0], float)
        row = rf"{point} = CARTESIAN_POINT\('',\s*\({number},{number},{number}\)\)"
        place = np.array(re.findall(row, text)[0], float) + by * normal
        moved = ",".join(f"{x:.17E}" for x in place)
        text = re.sub(row, f"{point} = CARTESIAN_POINT('',({moved}))", text)
    path.write_text(text)
