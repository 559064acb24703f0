"""Meshes that show a robot, read and written anew: numbers and colors, nothing that they name.

Results of strangers hold meshes. Those who draw one open what it names (materials, pictures), and
assimp finds such names in more places than a filter would: what is written here has none. All of it
takes time in proportion to the size.
"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.mesh_faults import collada_root
from sphshell_pin.shell.readers.mesh import STL_RECORD, stl_corners
from sphshell_pin.shell.readers.ply import parse_ply

_NAME = Path("mesh")
FORMATS = (".stl", ".dae", ".obj", ".ply")

_PLAIN = (
    "COLLADA asset unit up_axis library_geometries geometry mesh source technique_common accessor "
    "param vertices input triangles polylist polygons lines linestrips trifans tristrips "
    "library_visual_scenes visual_scene library_nodes node instance_geometry instance_node "
    "bind_material instance_material scene instance_visual_scene library_materials material "
    "instance_effect library_effects effect profile_COMMON technique phong lambert blinn constant "
    "emission ambient diffuse specular shininess reflective reflectivity transparent transparency "
    "index_of_refraction extra"
)
_OF_NUMBERS = "float_array p vcount matrix translate rotate scale color float double_sided"
_NUMBERS = frozenset(_OF_NUMBERS.split())
_KNOWN = _NUMBERS.union(_PLAIN.split())
_LINKS = ("url", "source", "target")
_UNIT = re.compile(rb"<unit\b[^<>]*?\bmeter\s*=\s*[\"']\s*([-+.\deE]+)")
_CORNER = re.compile(r"(-?\d{1,10})(?:/-?\d*)?(?:/(-?\d{1,10}))?", re.ASCII)


def collada_unit(path: Path) -> float:
    """Return the length of the unit that a Collada file states [m]."""
    found = _UNIT.search(read_bytes(path))
    try:
        return float(found[1]) if found else 1.0
    except ValueError:
        return 1.0


def plain_mesh(suffix: str, content: bytes) -> bytes | None:
    """Return a mesh file of one of FORMATS written anew; None for what cannot be read."""
    written = {".stl": _stl, ".dae": _collada, ".obj": _wavefront, ".ply": _ply}.get(suffix)
    if written is None:
        return None
    try:
        return written(content)
    except (SphshellError, ValueError, IndexError, OverflowError, ET.ParseError, LookupError):
        return None


def _stl(content: bytes) -> bytes:
    corners = stl_corners(_NAME, content)[0].reshape(-1, 3, 3)
    made = np.zeros(len(corners), STL_RECORD)
    made["corners"] = corners
    if int.from_bytes(content[80:84], "little") == len(
        made
    ):  # binary; of a text, they are left out
        made["normal"] = np.frombuffer(content, STL_RECORD, len(made), 84)["normal"]
    return bytes(80) + len(made).to_bytes(4, "little") + made.tobytes()


def _ply(content: bytes) -> bytes:
    raw = parse_ply(_NAME, content)
    rows = np.split(raw.corners, raw.offsets[1:-1])
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex {len(raw.vertices)}\n{axes}"
    head += f"element face {len(rows)}\nproperty list int int vertex_indices\nend_header\n"
    lines = [" ".join(map(repr, point)) for point in raw.vertices.tolist()]
    lines += [" ".join(map(str, [len(row), *row.tolist()])) for row in rows]
    return (head + "\n".join(lines) + "\n").encode()


def _wavefront(content: bytes) -> bytes:
    text = content.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ")
    lines = []
    for line in text.splitlines():
        kind, *words = line.partition("#")[0].split() or [""]
        if kind in ("v", "vn"):
            lines.append(" ".join([kind, *(repr(float(word)) for word in words)]))
        elif kind == "f":
            found = [_CORNER.fullmatch(word) for word in words]
            corners = [f"{a}//{n}" if n else a for a, n in (one.groups() for one in found if one)]
            if len(corners) != len(words):
                raise ValueError("a face has a corner that is no index")
            lines.append(" ".join([kind, *corners]))
        elif kind == "s":
            lines.append(f"s {int(words not in (['off'], ['0']))}")
    return ("\n".join(lines) + "\n").encode()


def _collada(content: bytes) -> bytes:
    root = _element(collada_root(content))
    if root is None or root.tag != "COLLADA":
        raise ValueError("it is no Collada file")
    root.set("xmlns", "http://www.collada.org/2005/11/COLLADASchema")
    return ET.tostring(root, encoding="unicode").encode()


def _element(given: ET.Element) -> ET.Element | None:
    """Return what is plain of an element and of those in it, None if nothing is."""
    tag = str(given.tag).rpartition("}")[2]
    if tag not in _KNOWN:
        return None
    made = ET.Element(tag)
    for name, value in given.attrib.items():
        if name in _LINKS and not value.startswith("#"):
            return None
        made.set(name.rpartition("}")[2], value)
    text = (given.text or "").strip()
    if tag in _NUMBERS:
        np.array(text.split(), float)  # ValueError for anything else
        made.text = " ".join(text.split())
    elif tag == "up_axis" and text in ("X_UP", "Y_UP", "Z_UP"):
        made.text = text
    made.extend([one for one in map(_element, given) if one is not None])
    return made
