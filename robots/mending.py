"""A URDF that needs no options: masses, prefixes, mimic joints and names of meshes set right."""

import copy
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

import pinocchio as pin

from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.robots.files import RobotError, build_geometry, build_model, read, unwound
from sphshell_pin.robots.inertia import with_density

_DECLARED = re.compile(r"\{(urn:([\w.-]+))\}")


def mended(
    path: StrPath,
    package_dirs: Iterable[StrPath] = (),
    xacro_args: Mapping[str, object] | None = None,
    density: float | None = None,
) -> tuple[str, list[str]]:
    """Return a URDF as text, with a comment beside each change, and the changes as sentences.

    Links without a mass get that of their geometry at `density` [kg/m^3]; prefixes are declared;
    continuous joints that mimic by a part of their turn become revolute; meshes are named by
    absolute paths, and those that are missing or broken are left out. Raises RobotError as
    `robots.load_file` does, and for an MJCF.
    """
    stated = read(path, package_dirs, xacro_args)
    if stated.is_mjcf:
        raise RobotError(f"{path}: is an MJCF; --mend writes URDFs, of a URDF or xacro file")
    changes: list[str] = []
    filled, _ = with_density(stated, density) if density is not None else (stated, "")
    straight, wound = unwound(filled)
    root = copy.deepcopy(straight.root)
    model = build_model(stated)
    kinds = (pin.GeometryType.VISUAL, pin.GeometryType.COLLISION)
    missing = [uri for kind in kinds for uri in build_geometry(stated, model, kind)[1]]

    def note(parent: ET.Element, at: int, text: str) -> None:
        parent.insert(at, ET.Comment(f" {text.replace('--', '- -')} "))
        changes.append(text)

    for before, link in zip(stated.root.findall("link"), root.findall("link"), strict=True):
        name = link.get("name")
        for kind in ("visual", "collision"):
            for shape in link.findall(kind):
                mesh = shape.find("geometry/mesh")
                uri = "" if mesh is None else mesh.get("filename", "")
                if uri in missing:
                    at = list(link).index(shape)
                    link.remove(shape)
                    note(link, at, f"link {name}: without the mesh {uri}, missing or broken")
                elif mesh is not None and (found := stated.folders.find(uri)) is not None:
                    mesh.set("filename", str(found.absolute()))
                    if mesh.get("filename") != uri:
                        note(link, list(link).index(shape), f"link {name}: {uri} by its path")
        if link.find("inertial") is not None and _mass_of(link) != _mass_of(before):
            note(link, 0, f"link {name}: the mass of its geometry at {density:g} kg/m^3")
    for joint in root.findall("joint"):
        if joint.get("name") in wound:
            note(joint, 0, f"joint {joint.get('name')}: was continuous, but mimics or is mimicked")
    names = [str(name) for one in root.iter() for name in (one.tag, *one.attrib)]
    for uri, prefix in sorted(set(_DECLARED.findall(" ".join(names)))):
        ET.register_namespace(prefix, uri)
        note(root, 0, f"the prefix {prefix} is declared")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True), changes


def _mass_of(link: ET.Element) -> str | None:
    mass = link.find("inertial/mass")
    return None if mass is None else mass.get("value")
