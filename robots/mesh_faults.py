"""Meshes of robots that assimp, the reader that Pinocchio has, must not be given.

It reads in this process. Of what strangers write, some makes it open any file that a mesh names,
crash, take all memory, or go on without end.
"""

import json
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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


@dataclass
class _Node:
    """A node or a geometry, or the name of some: keys of what it holds, and its own triangles."""

    inner: list[str | int] = field(default_factory=list)
    triangles: int = 0
    count: int = 0
    """1 of a node, which the reader copies wherever it is held."""


def _collada_fault(root: ET.Element) -> str:
    """Say what of a Collada file assimp would read without end, or copy too often."""
    nodes: dict[str | int, _Node] = defaultdict(_Node)
    largest = _Node()
    for one in root.iter():
        tag = _tag(one)
        if tag in ("p", "vcount", "v") and not _INDICES.fullmatch(one.text or ""):
            return f"its <{tag}> holds what is no index"
        if tag == "geometry":  # three numbers and what is between them are six characters or more
            size = sum(len(text.text or "") // 6 + 1 for text in one.iter() if _tag(text) == "p")
            geometry = nodes[f"geometry#{one.get('id')}"]
            geometry.triangles += size
            largest = max(largest, geometry, key=lambda one: one.triangles)
        elif tag in ("node", "visual_scene"):
            nodes[id(one)].count = 1
            nodes[id(one)].inner = [_held(inner) for inner in one]
            for name in {one.get("id"), one.get("name")} - {None}:
                nodes[f"node#{name}"].inner.append(id(one))
    nodes["controller"] = largest  # of any geometry
    return _tree_fault(nodes)


def _held(element: ET.Element) -> str | int:
    """Return the key of what an element inside a node stands for."""
    tag = _tag(element)
    if tag == "node":
        return id(element)
    kind = tag.removeprefix("instance_")
    return kind if kind == "controller" else f"{kind}{element.get('url', '')}"


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _tree_fault(nodes: Mapping[str | int, _Node]) -> str:
    """Say if nodes with what they hold are too many once expanded, too deep, or too large."""
    counts, triangles, depth = (
        dict[str | int, int](),
        dict[str | int, int](),
        dict[str | int, int](),
    )
    try:
        order = tuple(TopologicalSorter({k: one.inner for k, one in nodes.items()}).static_order())
    except CycleError:
        return "one of its nodes holds itself"
    for key in order:
        one = nodes.get(key, _Node())
        counts[key] = one.count + sum(counts[inner] for inner in one.inner)
        triangles[key] = one.triangles + sum(triangles[inner] for inner in one.inner)
        depth[key] = one.count + max((depth[inner] for inner in one.inner), default=0)
    if max(depth.values(), default=0) > DEEPEST_NODE:
        return f"its nodes are nested more than {DEEPEST_NODE} deep"
    if max(counts.values(), default=0) > MOST_NODES:
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
        nodes: dict[str | int, _Node] = {"meshes": _Node(triangles=sum(meshes) // 3)}
        for k, node in enumerate(document.get("nodes", [])):
            size = meshes[node["mesh"]] // 3 if "mesh" in node else 0
            nodes[k] = _Node([int(one) for one in node.get("children", [])], size, 1)
    except (ValueError, RecursionError):
        return f"{path}: its JSON cannot be read"
    except (TypeError, AttributeError, LookupError, OverflowError):
        return f"{path}: its JSON is not that of a glTF"
    fault = _tree_fault(nodes)
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
