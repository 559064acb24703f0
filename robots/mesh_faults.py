"""Meshes of robots that assimp, the reader that Pinocchio has, must not be given.

It reads in this process. Of what strangers write, some makes it open any file that a mesh names,
crash, take all memory, or go on without end.
"""

import json
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from urllib.parse import unquote

from sphshell_pin.base.regular_file import MOST_TEXT, open_regular, read_bytes
from sphshell_pin.errors import ShellFileError
from sphshell_pin.robots.description import check_size
from sphshell_pin.shell.readers import READERS

MESHES = (".stl", ".dae", ".obj", ".ply", ".off", ".gltf", ".glb")
"""Formats of the meshes that a robot may name: those that have been tried."""

MOST_NODES = 100_000
"""Most nodes of a mesh, those that stand for others counted as often as they are copied."""

MOST_TRIANGLES = 20_000_000
"""Most triangles of a mesh, counted in the same way."""

DEEPEST_NODE = 200
"""Most nodes inside each other: the reader calls itself for each."""

_ODD, _CONTINUED = re.compile(rb"[\0\f\v]|\\\r(?!\n)"), re.compile(rb"\\\r?\n")
_MATERIALS = re.compile(rb"mtllib([^\r\n]*)")
_LONG_NUMBER = re.compile(rb"[0-9]{400}")
_INDICES = re.compile(r"[\s0-9+-]*", re.ASCII)


def mesh_fault(path: Path) -> str:
    """Say why assimp must not be given a mesh; "" if nothing hinders it.

    Materials of an .obj and buffers of a glTF may be in regular files of at most MOST_TEXT bytes.
    """
    suffix = path.suffix.lower()
    if suffix not in MESHES:
        return f"{path}: not one of the formats {', '.join(MESHES)}"
    try:
        if suffix in (".ply", ".off"):
            READERS[suffix](path)
        elif suffix == ".obj":
            return _wavefront_fault(path, read_bytes(path))
        elif suffix == ".dae":
            collada_root(read_bytes(path))
        elif suffix in (".gltf", ".glb"):
            return _gltf_fault(path, read_bytes(path))
        else:
            open_regular(path).close()
    except ShellFileError as error:
        return str(error)
    except OSError as error:
        return f"{path}: {error.strerror}"
    except ValueError as error:
        return f"{path}: {error}"
    return ""


def collada_root(content: bytes) -> ET.Element:
    """Return the root of a Collada file; ValueError for what assimp must not be given."""
    if not content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16
        content = content.strip(b"\0 \t\r\n")  # which assimp does not mind
    check_size(content)
    try:
        root = ET.fromstring(content)
    except ET.ParseError as error:  # of namespaces, which `check_size` does not look at
        raise ValueError(f"it is not well-formed XML: {error}") from None
    if fault := _collada_fault(root):
        raise ValueError(fault)
    return root


def _collada_fault(root: ET.Element) -> str:
    """Say what of a Collada file assimp would read without end, or copy too often."""
    named: dict[str, list[int]] = defaultdict(list)
    graph: dict[int, list[int]] = {}
    links: list[tuple[int, str]] = []
    triangles: dict[str, int] = defaultdict(int)
    own: dict[int, int] = defaultdict(int)
    for one in root.iter():
        tag = _tag(one)
        if tag in ("p", "vcount", "v") and not _INDICES.fullmatch(one.text or ""):
            return f"its <{tag}> holds what is no index"
        if tag == "geometry":  # three numbers and what is between them are six characters or more
            size = sum(len(text.text or "") // 6 + 1 for text in one.iter() if _tag(text) == "p")
            triangles[f"#{one.get('id')}"] += size
        if tag in ("node", "visual_scene"):
            graph[id(one)] = [id(inner) for inner in one if _tag(inner) == "node"]
            for key in {one.get("id"), one.get("name")} - {None}:
                named[f"#{key}"].append(id(one))
            links += [
                (id(one), inner.get("url", "")) for inner in one if _tag(inner) == "instance_node"
            ]
    for node in root.iter():
        if id(node) in graph:
            for inner in node:
                if _tag(inner) == "instance_geometry":
                    own[id(node)] += triangles[inner.get("url", "")]
                elif _tag(inner) == "instance_controller":  # of any geometry
                    own[id(node)] += max(triangles.values(), default=0)
    for holder, url in links:
        graph[holder] += named[url]
    return _tree_fault(graph, own)


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _tree_fault(graph: Mapping[int, Sequence[int]], own: Mapping[int, int]) -> str:
    """Say if nodes with their inner ones, and their own triangles, are too many once expanded."""
    nodes, triangles, depth = dict[int, int](), dict[int, int](), dict[int, int]()
    try:
        order = tuple(TopologicalSorter(graph).static_order())
    except CycleError:
        return "one of its nodes holds itself"
    for key in order:
        inner = graph.get(key, ())
        nodes[key] = 1 + sum(nodes[one] for one in inner)
        triangles[key] = own.get(key, 0) + sum(triangles[one] for one in inner)
        depth[key] = 1 + max((depth[one] for one in inner), default=0)
    if max(depth.values(), default=0) > DEEPEST_NODE:
        return f"its nodes are nested more than {DEEPEST_NODE} deep"
    if max(nodes.values(), default=0) > MOST_NODES:
        return f"its nodes stand for more than {MOST_NODES} nodes"
    if max(triangles.values(), default=0) > MOST_TRIANGLES:
        return f"its nodes stand for more than {MOST_TRIANGLES} triangles"
    return ""


def _wavefront_fault(path: Path, content: bytes) -> str:
    if _ODD.search(content):
        return f"{path}: it holds control characters"
    joined = _CONTINUED.sub(b"", content)
    if _LONG_NUMBER.search(joined):  # it takes time by the square of their digits
        return f"{path}: it holds a number of 400 digits or more"
    found = _MATERIALS.findall(joined)
    names = [f"{path.stem}.mtl", f"{path.name}.mtl"]
    return _reference_fault(path, names + [_text(name) for name in found])


def _text(name: bytes) -> str:
    return name.decode("utf-8", "replace").strip()


def _gltf_fault(path: Path, content: bytes) -> str:
    if path.suffix.lower() == ".glb":
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]
    names: list[str] = []

    def take(pairs: list[tuple[str, object]]) -> dict[str, object]:
        uris = [str(value) for key, value in pairs if key == "uri"]
        names.extend(unquote(uri) for uri in uris if not uri.startswith("data:"))
        return dict(pairs)

    try:
        document = json.loads(content, object_pairs_hook=take)
        accessors = [int(one.get("count", 0)) for one in document.get("accessors", [])]
        meshes = [
            sum(
                accessors[part.get("indices", part.get("attributes", {}).get("POSITION", 0))]
                for part in mesh.get("primitives", [])
            )
            for mesh in document.get("meshes", [])
        ]
        nodes = document.get("nodes", [])
        graph = {k: [int(one) for one in node.get("children", [])] for k, node in enumerate(nodes)}
        own = {k: meshes[node["mesh"]] // 3 for k, node in enumerate(nodes) if "mesh" in node}
    except (ValueError, RecursionError):
        return f"{path}: its JSON cannot be read"
    except (TypeError, AttributeError, LookupError, OverflowError):
        return f"{path}: its JSON is not that of a glTF"
    fault = _tree_fault(graph | {-1: []}, own | {-1: sum(meshes) // 3})
    return f"{path}: {fault}" if fault else _reference_fault(path, names)


def _reference_fault(path: Path, names: Sequence[str]) -> str:
    """Say which of the files that a mesh names must not be opened."""
    for name in dict.fromkeys(names):
        try:
            open_regular(f"{path.parent}/{name}", MOST_TEXT).close()
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as error:
            return f"{path}: it names '{name[:80]}': {getattr(error, 'strerror', error)}"
    return ""
