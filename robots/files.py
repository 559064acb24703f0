"""Robots' files of all formats: read into one description, then into Pinocchio's models."""

import contextlib
import copy
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.base.regular_file import MOST_TEXT, StrPath, read_bytes, why_no_file
from sphshell_pin.base.texts import number_of
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.description import (
    INCLUDED,
    Description,
    add_limits,
    check_memory,
    check_size,
    check_tree,
    drop_empty_shapes,
    drop_loose_links,
    fix_root,
    frames_without_link,
    mimics_of,
    parsed,
)
from sphshell_pin.robots.mesh_faults import mesh_fault
from sphshell_pin.robots.packages import Folders, including
from sphshell_pin.robots.plain_mesh import collada_unit


class RobotError(SphshellError, ValueError):
    """A robot description that cannot be loaded."""


# What these hold, and what to do.
_REFUSED = {
    (".sdf", ".world"): "is an SDF file, and the wheel of pinocchio has no SDF reader: give the "
    "robot's URDF or xacro, or convert it to MJCF (pip install sdformat-mjcf)",
    (".usd", ".usda", ".usdc", ".usdz"): "is a USD file, which pinocchio does not read: export "
    "a URDF or MJCF from the program that made it (Isaac Sim has an exporter to URDF)",
    (".dae", ".stl", ".obj", ".ply", ".gltf", ".glb"): "is a mesh, without joints and masses: "
    "write a URDF or MJCF with a link that names it; as a surface to touch it is a shell's file",
    (".step", ".stp", ".iges", ".igs", ".brep"): "is a CAD file, without joints and masses: "
    "export a URDF from the CAD program; as a surface to touch it is a shell's file",
    (".srdf",): "is an SRDF file, which only adds poses to a robot: give the URDF as the file and "
    "this one as srdf",
    (".mjb",): "is a compiled MuJoCo model: give its MJCF (.xml)",
}

# A license before the declaration of XML, which no reader of robots minds.
_BEFORE_XML = re.compile(rb"\A(?:\s|<!--(?:(?!-->).)*-->)+(?=<\?xml\s)", re.DOTALL)
_NO_LIMITS = {"effort": "1e30", "velocity": "1e30"}
_NEXT = "robots are read from URDF (.urdf), xacro (.xacro) and MJCF (.xml) files"


def read(
    path: StrPath,
    package_dirs: Iterable[StrPath] = (),
    xacro_args: Mapping[str, object] | None = None,
    *,
    free_flyer: bool | None = None,
) -> Description:
    """Read a URDF, xacro or MJCF file.

    `free_flyer` frees the base of an MJCF or fixes it, False also that of a URDF with a floating
    joint; None: as the file states it.
    Raises RobotError, with the reason in a sentence, and MissingExtra for a xacro file without the
    package xacro.
    """
    file = Path(path)
    folders = Folders.of(file, package_dirs)
    check_readable(file)
    for folder in folders.given:
        if not os.path.isdir(folder):
            raise RobotError(f"{file}: the mesh package folder {folder} does not exist")
    said = list[str]()
    try:
        if file.suffix.lower() == ".xacro":
            from sphshell_pin.robots.xacro_file import expand

            text, said = expand(file, folders, xacro_args or {})
        elif xacro_args:
            raise ValueError("arguments are for files that end in .xacro")
        else:
            text = read_bytes(file, MOST_TEXT)
    except (ValueError, OSError) as error:
        raise RobotError(f"{file}: {_not_read(file, '', error)}") from None
    found = described(text, folders, free_flyer=free_flyer)
    return replace(found, notes=(*found.notes, *said))


def described(text: bytes, folders: Folders, *, free_flyer: bool | None = None) -> Description:
    """Return the description that `text`, of the file of `folders`, is; see `read`."""
    file, tag = folders.file, ""
    try:
        text = _BEFORE_XML.sub(b"", text)
        tag = check_size(text)
        if tag == "sdf":
            raise RobotError(f"{file}: {_reason('.sdf')}")
        if tag not in ("robot", "mujoco"):
            raise ValueError(f"its root element is <{tag}>; {_NEXT}; or {INCLUDED}")
        root = parsed(text)
        if tag == "mujoco":
            from sphshell_pin.robots.mjcf import read_mjcf

            return read_mjcf(root, folders, floats=free_flyer)
        notes = list[str]()
        if free_flyer is False:
            fix_root(root)
        frames = frames_without_link(root)
        if frames and (folders.kept is not None or including(file) is None):
            for name in frames:
                ET.SubElement(root, "link", name=name)
            notes.append(f"links that it does not have are frames: {', '.join(frames)}")
        if loose := drop_loose_links(root):
            notes.append(f"without links that no joint holds: {', '.join(loose)}")
        check_tree(root)
        drop_empty_shapes(root)
        notes += add_limits(root)
        return Description(file, folders, root, tuple(mimics_of(root)), notes=tuple(notes))
    except (ValueError, OSError, LookupError, RuntimeError) as error:  # the last: Pinocchio's
        if isinstance(error, SphshellError):
            raise
        said = f"{file}: {_not_read(file, tag, error)}"
        whole = including(file) if INCLUDED in said and folders.kept is None else None
        raise RobotError(said if whole is None else f"{said}: {whole}") from None


def _not_read(file: Path, tag: str, error: Exception) -> str:
    """Return why a file whose root element is `tag`, "" if that is not known, cannot be read."""
    kind = {".xacro": "a xacro file", ".xml": "an MJCF", ".mjcf": "an MJCF"}.get(
        file.suffix.lower(), "a URDF"
    )
    kind = {"robot": "a URDF", "mujoco": "an MJCF"}.get(tag, kind)
    return f"not {kind} that can be read: {_line(error)}"


def is_path(robot: StrPath) -> bool:
    """Whether `robot` is meant as a file, not as a name."""
    known = (".urdf", ".xacro", ".xml", ".mjcf", *(one for ends in _REFUSED for one in ends))
    return Path(robot).suffix.lower() in known or "/" in str(robot) or os.path.isfile(robot)


def check_readable(file: Path) -> None:
    """Raise RobotError for what is no file, or a file that holds no robot, with what to do."""
    if reason := why_no_file(file):
        raise RobotError(f"{file}: {reason}; {_NEXT}")
    if reason := _reason(file.suffix.lower()):
        raise RobotError(f"{file}: {reason}")


def _reason(suffix: str) -> str:
    return next((reason for ends, reason in _REFUSED.items() if suffix in ends), "")


def build_model(
    description: Description, *, free_flyer: bool | None = None, mimic: bool = False
) -> pin.Model:
    """Return the model, in which every joint moves freely; with `free_flyer` a URDF's root floats.

    With `mimic` continuous joints are without limits, but not wound round, where joints that mimic
    one another need it. Raises RobotError.
    """
    file, wound = description.file, list[str]()
    if mimic:
        description, wound = unwound(description)
    try:
        if description.mjcf is not None:
            return description.mjcf.model()
        root = [pin.JointModelFreeFlyer()] if free_flyer else []
        model = pin.buildModelFromXML(ET.tostring(description.root, encoding="unicode"), *root)
        check_memory(model.nv)
    except (ValueError, RuntimeError, OSError) as error:
        what = "a URDF" if description.mjcf is None else "an MJCF"
        raise RobotError(f"{file}: not {what} that pinocchio can read: {_line(error)}") from None
    for name in wound:
        at = model.joints[model.getJointId(name)].idx_q
        model.lowerPositionLimit[at], model.upperPositionLimit[at] = -np.inf, np.inf
    if free_flyer:
        _check_root(model, file)
    return model


def build_geometry(
    description: Description, model: pin.Model, kind: pin.GeometryType, *, drawn: bool = True
) -> tuple[pin.GeometryModel, list[str]]:
    """Return the geometry of a kind, and the meshes that are missing or broken.

    Collada meshes are in meters, but for visual ones that are `drawn`: who draws them applies their
    unit. Raises RobotError for other geometry that cannot be built.
    """
    visual = kind == pin.GeometryType.VISUAL
    if description.mjcf is not None:
        return description.mjcf.geometry(model, visual=visual)
    root, missing = _with_meshes(description, visual=visual, meters=not (visual and drawn))
    with contextlib.suppress(RobotError):
        return _geometry(description, root, model, kind), missing
    missing += _without_broken(root, model, kind)
    return _geometry(description, root, model, kind), missing


def _geometry(
    description: Description, root: ET.Element, model: pin.Model, kind: pin.GeometryType
) -> pin.GeometryModel:
    try:
        text = ET.tostring(root, encoding="unicode")
        return pin.buildGeomFromUrdfString(model, text, kind)
    except (ValueError, RuntimeError) as error:
        raise _cannot_load(description, _line(error)) from None


def _without_broken(root: ET.Element, model: pin.Model, kind: pin.GeometryType) -> list[str]:
    """Take the meshes of a kind that cannot be read out of a URDF; return their files.

    Other geometry stays: what is wrong with it is the error that Pinocchio states.
    """
    broken = []
    for link in root.findall("link"):
        for shape in link.findall(kind.name.lower()):
            if shape.find("geometry/mesh") is None:
                continue
            alone = ET.Element("robot", name="one")
            ET.SubElement(alone, "link", name=link.get("name", "")).append(shape)
            text = ET.tostring(alone, encoding="unicode")
            try:
                pin.buildGeomFromUrdfString(model, text, kind)
            except (ValueError, RuntimeError):
                link.remove(shape)
                broken += [one.get("filename", "") for one in shape.iter("mesh")]
    return broken


def keep_spheres(description: Description) -> None:
    """Drop every geometry but the spheres of collision geometry, and so all meshes."""
    if (mjcf := description.mjcf) is not None:
        mjcf.geoms = [g for g in mjcf.geoms if mjcf.touches(g) and mjcf.is_sphere(g)]
    _keep(description, lambda _, part: part.find("geometry/sphere") is not None)


def keep_geometry_of(
    description: Description, links: Collection[str], kind: str = "collision"
) -> None:
    """Drop every geometry but that of a `kind`, "collision" or "visual", of some links."""
    if (mjcf := description.mjcf) is not None:
        own = [g for g in mjcf.geoms if mjcf.body(g) in links]
        mjcf.geoms = [g for g in own if mjcf.touches(g) == (kind == "collision")]
    _keep(description, lambda name, _: name in links, kind)


def _keep(
    description: Description, wanted: Callable[[str, ET.Element], bool], kind: str = "collision"
) -> None:
    """Drop every geometry of a URDF but that of a `kind` that is `wanted`, by link and element."""
    for link in description.root.iter("link"):
        for part in [one for one in link if one.tag in ("visual", "collision")]:
            if part.tag != kind or not wanted(link.get("name", ""), part):
                link.remove(part)


def _with_meshes(
    description: Description, *, visual: bool, meters: bool
) -> tuple[ET.Element, list[str]]:
    """Return a copy that names meshes by absolute paths, without those that are missing.

    With `meters` Collada meshes are scaled by their unit, which Coal ignores.
    """
    root = copy.deepcopy(description.root)
    missing: dict[str, None] = {}
    for link in root.iter("link"):
        for part in link.findall("visual" if visual else "collision"):
            mesh = part.find("geometry/mesh")
            if mesh is None:
                continue
            uri = mesh.get("filename", "")
            found = description.folders.find(uri)
            if found is not None and not mesh_fault(found):
                mesh.set("filename", str(found.absolute()))
                if meters and found.suffix.lower() == ".dae":
                    scale = [number_of(x) for x in mesh.get("scale", "1 1 1").split()]
                    mesh.set("scale", " ".join(str(x * collada_unit(found)) for x in scale))
            else:
                missing[uri] = None
                link.remove(part)
    return root, list(missing)


def _cannot_load(description: Description, reason: str) -> RobotError:
    return RobotError(
        f"{description.file}: a mesh cannot be loaded ({reason}); searched in "
        f"{description.folders.searched()}: give the folder above the package with --package-dir, "
        "package_dirs in a scenario or in Python"
    )


def unwound(description: Description) -> tuple[Description, list[str]]:
    """Return a URDF whose continuous joints are revolute where mimicking needs their whole angle.

    Their names are returned too: `build_model` takes the limits away that a URDF has to state.
    A continuous joint is stored by cosine and sine: what mimics it by a ratio that is not a whole
    number, or with limits, would jump once a turn.
    """
    root = copy.deepcopy(description.root)
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    group = {name: name for name in joints}
    wound = {name for name, joint in joints.items() if joint.get("type") == "continuous"}
    for rule in description.mimics:
        of = {name for name in joints if group[name] in (group.get(rule.joint), group.get(rule.of))}
        group |= dict.fromkeys(of, rule.of)
    turned = {
        group.get(rule.of)
        for rule in description.mimics
        if not rule.ratio.is_integer() or (rule.joint in wound) != (rule.of in wound)
    }
    changed = [name for name in sorted(wound) if group[name] in turned]
    for name in changed:
        joints[name].set("type", "revolute")
        limit = joints[name].find("limit")
        limit = ET.SubElement(joints[name], "limit") if limit is None else limit
        limit.attrib.update(_NO_LIMITS | limit.attrib | {"lower": "-1e9", "upper": "1e9"})
    return replace(description, root=root), changed


def _check_root(model: pin.Model, file: Path) -> None:
    """Raise RobotError if the floating link moves no mass of its own that forces could act on."""
    if model.inertias[1].mass > 0.0 or model.nv < 6:
        return
    q = pin.randomConfiguration(model, np.full(model.nq, -1.0), np.full(model.nq, 1.0))
    least, *_, most = np.linalg.eigvalsh(mass_matrix(model, q))
    if least <= 1e-12 * most:
        bodies = [one.name for one in model.frames if one.parentJoint == 1]
        link = next((name for name in bodies if name != model.names[1]), model.names[1])
        advice = (
            "give it an <inertial>, or the folder of its meshes, --package-dir, and a --density"
        )
        if model.njoints > 2:
            advice += "; or fix it: without --free-flyer (free_flyer), in new with --base fixed"
        raise RobotError(
            f"{file}: the root link '{link}' is to float but has no mass, nor has what is fixed to "
            f"it: {advice}"
        )


def _line(error: Exception) -> str:
    """Return what is wrong on one line, without pinocchio's source file and line."""
    text = str(error)
    if "message:" in text:
        text = text.partition("message:")[2]
    return " ".join(text.split()).rstrip(".")
