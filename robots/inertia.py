"""Masses of links whose URDF states none, from their geometry, and what to do without them."""

import copy
import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_positive
from sphshell_pin.base.texts import number_of
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.robots.description import Description
from sphshell_pin.robots.files import build_geometry, build_model, keep_geometry_of
from sphshell_pin.robots.mesh_faults import mesh_fault
from sphshell_pin.shell.shell import Shell

# A mass that keeps a place for one that the file does not state, as a part of the heaviest link's.
_SPECK = 1e-5
# Names that a sentence lists; a part of the largest inertia below which a joint moves no mass.
_LISTED, _NONE = 8, 1e-14


def with_density(description: Description, density: float) -> tuple[Description, str]:
    """Return a URDF in which each link has an inertial that states none, and what was added.

    `density` [kg/m^3] is that of its collision geometry, or of its visual one if it has no other,
    or but a speck that keeps a place; open meshes are taken for their convex hulls. A link with a
    mass and no moments of inertia keeps its mass. Links without geometry stay as they are.
    """
    check_positive("density", density, "kg/m^3")
    if description.is_mjcf:
        raise InvalidParameter("density", density, "is for URDF files: MJCF states its own")
    root, added, turned = copy.deepcopy(description.root), dict[str, float](), list[str]()
    model = build_model(description)
    frames = {f.name: k for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}
    for kind in ("collision", "visual"):
        speck = max(_speck(description), _SPECK * max(added.values(), default=0.0))
        bare = [one for one in root.findall("link") if not (_mass(one) > speck and _turns(one))]
        part = copy.deepcopy(description)
        keep_geometry_of(part, {one.get("name", "") for one in bare}, kind)
        of = getattr(pin.GeometryType, kind.upper())
        geometry, _ = build_geometry(part, model, of, drawn=False)
        for link in bare:
            name, mass = link.get("name", ""), _mass(link)
            inertia = _inertia(model, geometry, frames.get(name), density)
            if mass > speck and not _turns(link) and inertia.mass > 0.0:
                origin = link.find("inertial/origin")
                at = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
                moments = mass / inertia.mass * inertia.inertia
                inertia = pin.Inertia(mass, np.array(at.split(), dtype=float), moments)
                turned.append(name)
            elif inertia.mass > mass:
                added[name] = inertia.mass
            else:
                continue
            for stated in link.findall("inertial"):
                link.remove(stated)
            link.insert(0, inertial_element(inertia))
    said = "are those of their geometry"
    notes = [
        f"the masses of {_list(list(added))} {said} at {density:g} kg/m^3, "
        f"{sum(added.values()):.3g} kg in all, as the file states none",
        f"the moments of inertia of {_list(turned)} {said}, as those of the file are 0",
    ]
    told = [one for one, some in zip(notes, (added, turned), strict=True) if some]
    return replace(description, root=root), "; ".join(told)


def lacks_moments(description: Description | None) -> bool:
    """Whether a URDF of meshes states masses, and no moment of inertia."""
    if description is None or description.is_mjcf:
        return False
    stated = [one for one in description.root.findall("link") if _mass(one)]
    meshes = any(one.find(".//mesh") is not None for one in stated)
    return meshes and not any(map(_turns, stated))


def lacks_masses(model: pin.Model, description: Description | None, *, floating: bool) -> bool:
    """Whether a body that moves has no mass, and geometry that can give it one.

    With `floating` the root link of a URDF moves too, though it is fixed in `model`.
    """
    if description is None or description.is_mjcf:
        return False
    links, speck = description.root.findall("link"), _speck(description)
    bodies = {f.name: f.parentJoint for f in model.frames if f.type == pin.FrameType.BODY}
    empty = (
        one
        for one in links
        if ((joint := bodies.get(one.get("name"), 0)) or floating)
        and model.inertias[joint].mass <= speck
    )
    return any(_has_geometry(one, description) for one in empty)


def _speck(description: Description) -> float:
    """Return the mass [kg] up to which a link of a URDF counts as one without."""
    return _SPECK * max(map(_mass, description.root.findall("link")), default=0.0)


def _turns(link: ET.Element) -> bool:
    """Whether a link of a URDF states a moment of inertia."""
    inertia = link.find("inertial/inertia")
    moments = [] if inertia is None else [inertia.get(name, "0") for name in ("ixx", "iyy", "izz")]
    return any(number_of(one) for one in moments)


def joints_without_mass(model: pin.Model, q: Array) -> list[str]:
    """Return the joints that move no mass, at any configuration q (nq,)."""
    inertia = np.diag(mass_matrix(model, q))
    return [
        name
        for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
        if joint.nv and inertia[joint.idx_v] <= _NONE * inertia.max(initial=0.0)
    ]


def mass_fault(
    model: pin.Model, q: Array, description: Description | None, lock: Collection[str] = ()
) -> str | None:
    """Say which links lack a mass that a joint not in `lock` needs, and what to do; None if none.

    `q` (nq,) is any configuration.
    """
    bare = [name for name in joints_without_mass(model, q) if name not in lock]
    if not bare:
        return None
    said = f"nothing that joint '{bare[0]}' moves has a mass"
    if description is None or description.is_mjcf:
        return f"{said}: give its links masses, or lock the joint"
    moved = {f.name for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint > 0}
    links = [one for one in description.root.iter("link") if one.get("name") in moved]
    empty = [one for one in links if not _mass(one)]
    if not empty:
        return f"{said} off its axis, nor a moment of inertia: write the <inertia> of its links"
    solid = [str(one.get("name")) for one in empty if one.find(".//geometry") is not None]
    if not solid:
        names = _list([str(one.get("name")) for one in empty])
        return f"{said}: {names} have neither a mass nor geometry: write their <inertial>"
    said += f", as the file states none of {_list(solid)}"
    if not any(_has_geometry(one, description) for one in empty):
        return (
            f"{said}, whose meshes are missing or broken: give the folder above their package with "
            "--package-dir and their --density, or write their <inertial>"
        )
    return (
        f"{said}: take them from the meshes with "
        "--density 2700 [kg/m^3] (density = 2700 in a scenario), or write such a file with "
        "check-robot FILE --density 2700 --mend OUT.urdf"
    )


def _has_geometry(link: ET.Element, description: Description) -> bool:
    """Return whether a link of a URDF has a shape, or a mesh that can be read."""
    for shape in link.iterfind(".//geometry/*"):
        found = description.folders.find(shape.get("filename", "")) if shape.tag == "mesh" else None
        if shape.tag != "mesh" or (found is not None and not mesh_fault(found)):
            return True
    return False


def _mass(link: ET.Element) -> float:
    """Return the mass that a link of a URDF states [kg], 0 where it states none."""
    mass = link.find("inertial/mass")
    try:
        return max(number_of(mass.get("value", "0")), 0.0) if mass is not None else 0.0
    except ValueError:
        return 1.0  # left to the parser, which refuses it


def _inertia(
    model: pin.Model, geometry: pin.GeometryModel, frame: int | None, density: float
) -> pin.Inertia:
    """Return the inertia of the solids on a link's frame, in that frame."""
    total = pin.Inertia.Zero()
    for part in geometry.geometryObjects:
        if part.parentFrame == frame:
            place = model.frames[frame].placement.actInv(part.placement)
            total += place.act(inertia_of_solid(Shell.from_geometry(part), density))
    return total


def inertia_of_solid(shell: Shell, density: float) -> pin.Inertia:
    """Return the inertia of what a shell encloses, or of its convex hull where it is open."""
    with interrupts_delayed():
        import trimesh
    from scipy.spatial import QhullError

    # Counted from the middle: far from the origin the moments would be differences of near numbers.
    middle = np.asarray(shell.vertices).mean(axis=0)
    solid = trimesh.Trimesh(shell.vertices - middle, shell.triangles, process=False)
    try:
        solid = solid if shell.is_closed else solid.convex_hull
    except (QhullError, ValueError):  # flat
        return pin.Inertia.Zero()
    if not abs(solid.volume) > 0.0:
        return pin.Inertia.Zero()
    solid.density = math.copysign(density, solid.volume)
    return pin.Inertia(float(solid.mass), middle + solid.center_mass, solid.moment_inertia)


def inertial_element(inertia: pin.Inertia) -> ET.Element:
    """Return what a link of a URDF states."""
    out = ET.Element("inertial")
    ET.SubElement(out, "origin", xyz=" ".join(f"{x:.9g}" for x in inertia.lever), rpy="0 0 0")
    ET.SubElement(out, "mass", value=f"{inertia.mass:.9g}")
    of = inertia.inertia
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2)}
    places |= {"iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(out, "inertia", {name: f"{of[at]:.9g}" for name, at in places.items()})
    return out


def _list(links: list[str]) -> str:
    return f"link{'s' * (len(links) > 1)} {few(links)}"


def few(names: Sequence[str], most: int = _LISTED) -> str:
    """List the first of `names`, at `most` so many, and say how many more there are."""
    more = f" and {len(names) - most} others" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"
