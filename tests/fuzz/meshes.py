"""Damaged surfaces, written in every mesh format."""

import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from tests import meshes
from tests.fuzz.mutate import NUMBERS, alter, word


@dataclass
class Mesh:
    """Vertices, faces by index from 0, normals, and what its file says of them.

    In a damaged one any value may stand in the place of another.
    """

    vertices: list[Any]
    faces: list[Any]
    normals: list[Any] = field(default_factory=list)
    said: dict[str, Any] = field(default_factory=dict)
    """The counts of vertices and faces, and of corners of the first face, where they are wrong."""


def _mesh(vertices: Any, faces: Any) -> Mesh:
    return Mesh([[f"{x:.6g}" for x in one] for one in vertices], [list(one) for one in faces])


def _box() -> Mesh:
    vertices, faces = meshes.cube(quads=True)
    return _mesh(vertices + 0.5, faces.tolist())


def _sheet() -> Mesh:
    vertices, faces = meshes.grid_plate(5, 5, quads=True)
    bent = [(x + 0.5, y + 0.5, 0.1 * (5 * x) ** 2 / 5) for x, y, _ in vertices]
    return _mesh(bent, faces.tolist())


def _polygon() -> Mesh:
    star = [(k * (1.0 + k % 2), float(k * k % 7), 0.0) for k in range(12)]
    return _mesh(star, [range(12), range(3)])


def _tetrahedra() -> Mesh:
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [1, 4, 2], [2, 4, 3], [1, 3, 4]]
    return _mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], faces)


SHAPES = (_box, _sheet, _polygon, _tetrahedra)


def damaged_mesh(rng: random.Random) -> Mesh:
    """Return a small surface of which some vertices, faces, normals or counts are wrong."""
    mesh = rng.choice(SHAPES)()
    if rng.random() < 0.3:
        mesh.normals = [["0", "0", "1"] for _ in mesh.vertices]
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        part = rng.choice(("vertices", "vertices", "normals", "faces", "faces", "said", "all"))
        if part == "all":
            _stretch(rng, mesh)
        elif part == "said":
            lies = (-3, -1, 0, 1, 2, 1000, 2**31 - 1, 2**31, 2**32, 10**12, 10**30)
            mesh.said[rng.choice(("vertices", "faces", "corners"))] = rng.choice(lies)
        elif old := getattr(mesh, part):
            near = (-2, -1, 0, len(mesh.vertices), len(mesh.vertices) + 1)
            values = near if part == "faces" else NUMBERS
            mesh = replace(mesh, **{part: _rows(alter(rng, old, values))})
    return mesh


def _stretch(rng: random.Random, mesh: Mesh) -> None:
    """Scale all vertices by a power of ten, or put them into a plane."""
    power = rng.choice((-300, -40, -20, -9, 9, 20, 38, 150, 300))
    axes = rng.choice(((0, 1, 2), (rng.randrange(3),)))
    for vertex in mesh.vertices:
        for axis in axes[: len(vertex)]:
            old = word(vertex[axis % len(vertex)]).partition("e")[0]
            vertex[axis % len(vertex)] = f"{(len(axes) > 1 and old) or 1}e{power}"


def _rows(table: Any) -> list[list[Any]]:
    """Return a table whose rows are lists, whatever they were altered to."""
    return [one if isinstance(one, list) else [one] for one in table]


def _text(row: list[Any]) -> str:
    return " ".join(map(word, row))


def _index(corner: Any, first: int = 0) -> Any:
    return corner + first if isinstance(corner, int) else corner


def _reals(row: list[Any]) -> list[float]:
    out = []
    for value in row:
        try:
            out.append(float(word(value)))
        except ValueError:
            out.append(0.0)
    return out


def _counts(mesh: Mesh) -> tuple[int, int]:
    said = mesh.said
    return said.get("vertices", len(mesh.vertices)), said.get("faces", len(mesh.faces))


def _size(mesh: Mesh, face: list[Any]) -> int:
    return len(face) + (mesh.said.get("corners", 0) if face is mesh.faces[0] else 0)


def _counted(mesh: Mesh, first: int) -> str:
    rows = [[_size(mesh, face), *(_index(i, first) for i in face)] for face in mesh.faces]
    return "\n".join(map(_text, rows))


def _with_normals(mesh: Mesh) -> list[list[Any]]:
    """Return the vertices, each with its normal."""
    normals = mesh.normals or [[]] * len(mesh.vertices)
    return [vertex + normal for vertex, normal in zip(mesh.vertices, normals, strict=False)]


def _corners(mesh: Mesh, face: list[Any]) -> list[list[Any]]:
    """Return three corners of a face."""
    places = [i if isinstance(i, int) else 0 for i in (*face, 0, 0, 0)[:3]]
    return [mesh.vertices[i % len(mesh.vertices)] for i in places]


def write_obj(mesh: Mesh) -> bytes:
    rows = [f"v {_text(one)}" for one in mesh.vertices]
    rows += [f"vn {_text(one)}" for one in mesh.normals]
    mark = "{0}//{0}" if mesh.normals else "{0}"
    for face in mesh.faces:
        corners = (word(_index(i, isinstance(i, int) and i >= 0)) for i in face)
        rows.append("f " + " ".join(map(mark.format, corners)))
    return "\n".join(rows).encode()


def write_off(mesh: Mesh) -> bytes:
    head = "NOFF" if mesh.normals else "OFF", _text([*_counts(mesh), 0])
    return "\n".join((*head, *map(_text, _with_normals(mesh)), _counted(mesh, 0))).encode()


def write_shl(mesh: Mesh) -> bytes:
    counts, rows = list(_counts(mesh)), map(_text, mesh.vertices)
    version = ["Version: 2"] if mesh.normals else []
    head = *version, _text([*counts, *([len(mesh.normals)] if version else []), "0.001"])
    return "\n".join((*head, *rows, _counted(mesh, 1), *map(_text, mesh.normals))).encode()


def write_stl(mesh: Mesh) -> bytes:
    rows = ["solid s"]
    for face in mesh.faces:
        rows += ["facet normal 0 0 1", "outer loop"]
        rows += [f"vertex {_text(corner)}" for corner in _corners(mesh, face)]
        rows += ["endloop", "endfacet"]
    return "\n".join((*rows, "endsolid s")).encode()


def write_binary_stl(mesh: Mesh) -> bytes:
    data = bytearray(b"\0" * 80 + struct.pack("<I", _counts(mesh)[1] % 2**32))
    for face in mesh.faces:
        row = [0.0, 0.0, 1.0]
        for corner in _corners(mesh, face):
            row += [float("inf") if abs(x) > 3e38 else x for x in _reals(corner)]
        data += struct.pack(f"<{len(row)}f2x", *row)
    return bytes(data)


def _ply_head(mesh: Mesh, form: str) -> str:
    vertices, faces = _counts(mesh)
    names = ("x", "y", "z", "nx", "ny", "nz") if mesh.normals else ("x", "y", "z")
    rows = ["ply", f"format {form} 1.0", f"element vertex {vertices}"]
    rows += [f"property double {name}" for name in names]
    rows += [f"element face {faces}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(rows)


def write_ply(mesh: Mesh) -> bytes:
    rows = map(_text, _with_normals(mesh))
    return (_ply_head(mesh, "ascii") + "\n".join((*rows, _counted(mesh, 0)))).encode()


def write_binary_ply(mesh: Mesh) -> bytes:
    data = bytearray(_ply_head(mesh, "binary_little_endian").encode())
    for row in map(_reals, _with_normals(mesh)):
        data += struct.pack(f"<{len(row)}d", *row)
    for face in mesh.faces:
        data.append(_size(mesh, face) % 256)
        data += b"".join(struct.pack("<I", i % 2**32) for i in face if isinstance(i, int))
    return bytes(data)


WRITERS: dict[str, tuple[str, Callable[[Mesh], bytes]]] = {
    "stl": (".stl", write_stl),
    "stl-binary": (".stl", write_binary_stl),
    "obj": (".obj", write_obj),
    "ply": (".ply", write_ply),
    "ply-binary": (".ply", write_binary_ply),
    "off": (".off", write_off),
    "shl": (".shl", write_shl),
}
"""By kind: the suffix, and what writes a mesh in the format."""
