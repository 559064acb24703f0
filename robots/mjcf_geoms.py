"""Geoms and meshes of MJCF: their shape in plain numbers, and the inertia they give a body."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.arrays import Array
from sphshell_pin.robots.mjcf_values import number, numbers, text_of, turned_to
from sphshell_pin.robots.packages import Folders

_INERTIA = pin.Inertia
# Numbers in `size` of each kind of geom, its volume by these, and its inertia by mass and these.
_SHAPES: dict[str, tuple[int, Callable[..., float], Callable[..., pin.Inertia]]] = {
    "sphere": (1, lambda r: 4 / 3 * np.pi * r**3, _INERTIA.FromSphere),
    "capsule": (
        2,
        lambda r, h: np.pi * r**2 * (2 * h + 4 / 3 * r),
        lambda m, r, h: _INERTIA.FromCapsule(m, r, 2 * h),
    ),
    "cylinder": (
        2,
        lambda r, h: np.pi * r**2 * 2 * h,
        lambda m, r, h: _INERTIA.FromCylinder(m, r, 2 * h),
    ),
    "box": (
        3,
        lambda x, y, z: 8 * x * y * z,
        lambda m, x, y, z: _INERTIA.FromBox(m, 2 * x, 2 * y, 2 * z),
    ),
    "ellipsoid": (3, lambda x, y, z: 4 / 3 * np.pi * x * y * z, _INERTIA.FromEllipsoid),
}
_EXACT = "masses of meshes that are not convex are those of their volume (inertia=exact)"
_HULLS = "masses of meshes that are not closed are those of their convex hulls"
_SEEN = ("contype", "conaffinity", "group")


class Meshes:
    """The meshes of an MJCF by name, with the absolute paths of their files."""

    def __init__(
        self,
        root: ET.Element,
        folders: Folders,
        compiler: Mapping[str, str],
        resolved: Callable[[ET.Element, str], dict[str, str]],
        notes: Mapping[str, list[str]],
    ) -> None:
        folder = Path(compiler.get("meshdir", compiler.get("assetdir", "")))
        strip = compiler.get("strippath") == "true"
        self.files: dict[str, tuple[Path, Array]] = {}
        self.colors: dict[str, str] = {}
        self.notes = notes
        self._moved: set[str] = set()
        self._kinds: dict[str, str] = {}
        for one in root.iterfind("asset/mesh"):
            stated = resolved(one, "main")
            if "file" not in stated:
                continue
            path = Path(Path(stated["file"]).name if strip else stated["file"])
            name = stated.get("name", path.stem)
            scale = numbers(stated.get("scale", "1 1 1"), 3)
            self.files[name] = (folders.beside(str(folder / path)), scale)
            self._kinds[name] = stated.get("inertia", "legacy")
            if "refpos" in stated or "refquat" in stated:
                self._moved.add(name)
        for one in root.iterfind("asset/material"):
            stated = resolved(one, "main")
            if "rgba" in stated and "name" in stated:
                self.colors[stated["name"]] = stated["rgba"]

    def asset(self) -> ET.Element:
        """Return the <asset> of the plain form."""
        made = ET.Element("asset")
        for name, (path, scale) in self.files.items():
            ET.SubElement(made, "mesh", name=name, file=str(path), scale=text_of(scale))
        return made

    def known(self, name: str | None) -> bool:
        """Whether a geom can show the mesh called `name`."""
        if name is not None and name in self._moved:
            raise ValueError(f"mesh '{name}' states refpos or refquat: move its geoms instead")
        return name in self.files

    def solid(self, name: str, body: str) -> tuple[float, pin.Inertia]:
        """Return volume [m^3] and inertia at a density of 1 of a mesh, in its own frame."""
        with interrupts_delayed():
            import trimesh

        path, scale = self.files[name]
        why = f"the mass of body '{body}' would be that of mesh '{name}', "
        kind = self._kinds[name]
        if kind == "shell":
            raise ValueError(f"{why}which is a shell: state its <inertial>")
        try:
            mesh: Any = trimesh.load(path, force="mesh")
            mesh.apply_scale(scale)
            mesh.merge_vertices()
            if kind == "convex":
                mesh = mesh.convex_hull
            if not mesh.is_watertight or not mesh.volume:
                self.notes[_HULLS].append(name)
                mesh = _hull(mesh)
            if kind == "legacy" and not mesh.is_convex:
                self.notes[_EXACT].append(name)
            volume, center = float(mesh.volume), np.asarray(mesh.center_mass)
            sign = float(np.sign(volume))
            moments = sign * np.asarray(mesh.moment_inertia)
        except Exception as error:  # of the readers of many formats, and of packages not there
            reason = " ".join(str(error).split()) or type(error).__name__
            raise ValueError(f"{why}which cannot be read ({reason}): state <inertial>") from None
        return sign * volume, pin.Inertia(sign * volume, center, moments)


def _hull(mesh: Any) -> Any:
    try:
        return mesh.convex_hull
    except ValueError:  # of a flat one
        raise ValueError("it has no volume") from None


def plain_place(
    stated: Mapping[str, str], pose_of: Callable[[Mapping[str, str]], pin.SE3]
) -> tuple[pin.SE3, float | None]:
    """Return the place of a geom or site; of one that states its ends, half its length [m] too."""
    if "fromto" not in stated:
        return pose_of(stated), None
    ends = numbers(stated["fromto"], 6).reshape(2, 3)
    along = ends[0] - ends[1]
    place = pin.SE3(turned_to(along), ends.mean(axis=0))
    return place, 0.5 * float(np.linalg.norm(along))


def plain_geom(
    stated: Mapping[str, str], meshes: Meshes, pose_of: Callable[[Mapping[str, str]], pin.SE3]
) -> tuple[ET.Element | None, pin.SE3]:
    """Return a geom without its place, and its place in the body; None for kinds left out."""
    kind = stated.get("type", "sphere" if "mesh" not in stated else "mesh")
    size = numbers(stated.get("size", "")).tolist()
    pose, half = plain_place(stated, pose_of)
    if half is not None and size:
        size = [size[0], half] if kind in ("capsule", "cylinder") else [size[0], size[0], half]
    fitted = kind != "mesh" and "mesh" in stated
    known = meshes.known(stated.get("mesh")) if kind == "mesh" else kind in _SHAPES and not fitted
    if not known:
        what = f"{kind} fitted to a mesh" if fitted else kind
        meshes.notes["geoms of these kinds are left out"].append(what)
        return None, pose
    made = ET.Element("geom", type=kind)
    if kind == "mesh":
        made.set("mesh", stated["mesh"])
    else:
        need, *_ = _SHAPES[kind]
        if len(size) < need:
            raise ValueError(f"a geom of the type {kind} needs {need} numbers in size")
        made.set("size", " ".join(repr(k) for k in size[:need]))
    for key in (*_SEEN, "name"):
        if key in stated:
            made.set(key, stated[key])
    color = stated.get("rgba") or meshes.colors.get(stated.get("material", ""))
    if color:
        made.set("rgba", color)
    return made, pose


def geom_inertia(
    stated: Mapping[str, str], made: ET.Element | None, meshes: Meshes, body: str
) -> pin.Inertia:
    """Return the inertia that a geom gives its body, in the geom's frame."""
    kind = stated.get("type", "sphere")
    density = number(stated.get("density"), 1000.0)
    mass = number(stated["mass"], 0.0) if "mass" in stated else None
    if kind in ("plane", "hfield") or mass == 0.0 or (mass is None and density == 0.0):
        return pin.Inertia.Zero()
    if made is None:
        raise ValueError(f"the mass of a geom of body '{body}' is not known: state its <inertial>")
    if stated.get("shellinertia") == "true":
        raise ValueError(f"a geom of body '{body}' is a shell: state the body's <inertial>")
    if made.get("type") == "mesh":
        volume, inertia = meshes.solid(made.attrib["mesh"], body)
        factor = density if mass is None else mass / volume
        return pin.Inertia(factor * inertia.mass, inertia.lever, factor * inertia.inertia)
    size = numbers(made.attrib["size"]).tolist()
    _, volume_of, inertia_of = _SHAPES[made.attrib["type"]]
    try:
        weight = float(density * volume_of(*size)) if mass is None else mass
    except OverflowError:
        raise ValueError(f"a geom of body '{body}' is too large to compute with: {size}") from None
    return inertia_of(weight, *size)
