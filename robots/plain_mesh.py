"""Meshes that show a robot, read and written anew: numbers and colors, nothing that they name.

Results of strangers hold meshes. Those who draw one open what it names (materials, pictures), and
assimp finds such names in more places than a filter would: what is written here has none. All of it
takes time in proportion to the size.
"""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from sphshell_pin.base.regular_file import MOST_TEXT, open_regular, read_bytes
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.description import check_size
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
_ODD, _CONTINUED = re.compile(rb"[\0\f\v]|\\\r(?!\n)"), re.compile(rb"\\\r?\n")
_MATERIALS = re.compile(rb"mtllib([^\r\n]*)")
_CORNER = re.compile(r"(-?\d+)(?:/-?\d*)?(?:/(-?\d+))?")


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


def refused_reference(path: Path) -> str:
    """Say why what a mesh names must not be opened, as assimp would; "" if nothing hinders it.

    Materials of an .obj and buffers of a glTF may be in regular files of at most MOST_TEXT bytes.
    """
    suffix, names = path.suffix.lower(), list[str]()
    if suffix not in (".obj", ".gltf", ".glb"):
        return ""
    content = read_bytes(path)
    if suffix == ".obj":
        if _ODD.search(content):
            return f"{path}: it holds control characters"
        found = _MATERIALS.findall(_CONTINUED.sub(b"", content))
        names += [f"{path.stem}.mtl", f"{path.name}.mtl"]
        names += [name.decode("utf-8", "replace").strip() for name in found]
    else:
        if suffix == ".glb":
            content = content[20 : 20 + int.from_bytes(content[12:16], "little")]

        def take(pairs: list[tuple[str, object]]) -> dict[str, object]:
            uris = [str(value) for key, value in pairs if key == "uri"]
            names.extend(unquote(uri) for uri in uris if not uri.startswith("data:"))
            return dict(pairs)

        try:
            json.loads(content, object_pairs_hook=take)
        except (ValueError, RecursionError):
            return f"{path}: its JSON cannot be read"
    for name in dict.fromkeys(names):
        try:
            open_regular(f"{path.parent}/{name}", MOST_TEXT).close()
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as error:
            return f"{path}: it names '{name[:80]}': {getattr(error, 'strerror', error)}"
    return ""


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
    check_size(content)
    root = _element(ET.fromstring(content))
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
