"""A URDF that needs no options: masses, prefixes, mimic joints and names of meshes set right."""

import copy
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from os import PathLike

from sphshell_pin.robots.files import RobotError, read, unwound
from sphshell_pin.robots.inertia import with_density
from sphshell_pin.robots.mesh_faults import mesh_fault

_DECLARED = re.compile(r"\{(urn:([\w.-]+))\}")


def mended(
    path: str | PathLike[str],
    package_dirs: Iterable[str | PathLike[str]] = (),
    xacro_args: Mapping[str, object] | None = None,
    density: float | None = None,
) -> str:
    """Return a URDF as text.

    Links without a mass get that of their geometry at `density` [kg/m^3]; prefixes are declared;
    continuous joints that mimic by a part of their turn become revolute; meshes are named by
    absolute paths, and those that are missing or broken are left out. Raises RobotError as
    `robots.load_file` does, and for an MJCF.
    """
    stated = read(path, package_dirs, xacro_args)
    if stated.is_mjcf:
        raise RobotError(f"{path}: is an MJCF; --mend writes URDFs, of a URDF or xacro file")
    if density is not None:
        stated, _ = with_density(stated, density)
    root = copy.deepcopy(unwound(stated)[0].root)
    for link in root.iter("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            mesh = shape.find("geometry/mesh")
            if mesh is not None:
                found = stated.folders.find(mesh.get("filename", ""))
                if found is None or mesh_fault(found):
                    link.remove(shape)
                else:
                    mesh.set("filename", str(found.absolute()))
    names = " ".join(str(name) for one in root.iter() for name in (one.tag, *one.attrib))
    for uri, prefix in _DECLARED.findall(names):
        ET.register_namespace(prefix, uri)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True)
