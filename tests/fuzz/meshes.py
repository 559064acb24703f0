"""Damaged surfaces, written in every mesh format."""

import random
import struct
from collections.abc import Callable
from dataclasses import dataclass

from tests.fuzz.mutate import NUMBERS

Corner = tuple[float, float, float]


@dataclass
class Mesh:
    """Vertices, faces by index from 0, and how many a header says there are (None: the truth)."""

    vertices: list[list[str]]
    faces: list[list[int]]
    normals: list[list[str]] | None = None
    said_vertices: int | None = None
    said_faces: int | None = None
    corner_lie: int = 0
    """Added to the count of corners of the first face."""


def _mesh(vertices: list[Corner], faces: list[list[int]]) -> Mesh:
    return Mesh([[f"{x:.6g}" for x in one] for one in vertices], faces)


def _box() -> Mesh:
    corners = [(float(x), float(y), float(z)) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return _mesh(corners, faces)


def _sheet(n: int = 5) -> Mesh:
    rows = [(i / n, j / n, 0.1 * (i - n / 2) ** 2 / n) for i in range(n + 1) for j in range(n + 1)]
    m = n + 1
    faces = [
        [i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1]
        for i in range(n)
        for j in range(n)
    ]
    return _mesh(rows, faces)


def _polygon(n: int = 12) -> Mesh:
    star = [(k * (1.0 + k % 2), float(k * k % 7), 0.0) for k in range(n)]
    return _mesh(star, [list(range(n)), [0, 1, 2]])


def _tetrahedra() -> Mesh:
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)]
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [1, 4, 2], [2, 4, 3], [1, 3, 4]]
    return _mesh(points, faces)


SHAPES = (_box, _sheet, _polygon, _tetrahedra)


def damaged_mesh(rng: random.Random) -> Mesh:
    """Return a small surface of which some vertices, faces, normals or counts are wrong."""
    mesh = rng.choice(SHAPES)()
    if rng.random() < 0.3:
        mesh.normals = [["0", "0", "1"] for _ in mesh.vertices]
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        rng.choice(_WAYS)(rng, mesh)
        if not mesh.vertices or not mesh.faces:
            break
    return mesh


def _coordinate(rng: random.Random, mesh: Mesh) -> None:
    table = mesh.normals if mesh.normals and rng.random() < 0.3 else mesh.vertices
    rng.choice(table)[rng.randrange(3)] = rng.choice(NUMBERS)


def _merge(rng: random.Random, mesh: Mesh) -> None:
    a, b = rng.randrange(len(mesh.vertices)), rng.randrange(len(mesh.vertices))
    mesh.vertices[a] = list(mesh.vertices[b])
    if rng.random() < 0.5:
        mesh.vertices[a][0] += "00000001" if "." in mesh.vertices[a][0] else ".00000001"


def _flatten(rng: random.Random, mesh: Mesh) -> None:
    axis, scale = rng.randrange(3), rng.choice(("0", "1e-12", "1e30", "1e-30"))
    for vertex in mesh.vertices:
        vertex[axis] = scale


def _scale(rng: random.Random, mesh: Mesh) -> None:
    power = rng.choice((-300, -40, -20, -9, 9, 20, 38, 150, 300))
    for vertex in mesh.vertices:
        for axis, number in enumerate(vertex):
            mantissa = number.partition("e")[0]
            vertex[axis] = f"{mantissa or 0}e{power}"


def _index(rng: random.Random, mesh: Mesh) -> None:
    face = rng.choice(mesh.faces)
    if face:
        n = len(mesh.vertices)
        face[rng.randrange(len(face))] = rng.choice(
            (-1, -2, n, n + 1, 0, rng.randrange(n), 2**31 - 1, 2**31, 2**40, -(2**31) - 1, 10**25)
        )


def _corners(rng: random.Random, mesh: Mesh) -> None:
    size = rng.choice((0, 1, 2, 3, 4, 5, 9, 30, 300))
    face = [rng.randrange(len(mesh.vertices)) for _ in range(size)]
    mesh.faces[rng.randrange(len(mesh.faces))] = face


def _drop(rng: random.Random, mesh: Mesh) -> None:
    del mesh.faces[rng.randrange(len(mesh.faces)) : rng.choice((None, None, len(mesh.faces) - 1))]


def _double(rng: random.Random, mesh: Mesh) -> None:
    face = list(rng.choice(mesh.faces))
    if rng.random() < 0.5:
        face.reverse()
    mesh.faces += [list(face) for _ in range(rng.choice((1, 2, 50)))]


def _counts(rng: random.Random, mesh: Mesh) -> None:
    lie = rng.choice((-1, 0, 1, 2, 3, 1000, 2**31 - 1, 2**31, 2**32, 10**12, 10**30))
    if rng.random() < 0.5:
        mesh.said_vertices = lie
    else:
        mesh.said_faces = lie


def _corner_lie(rng: random.Random, mesh: Mesh) -> None:
    mesh.corner_lie = rng.choice((-3, -1, 1, 2, 100, 2**31))


_WAYS = (
    *(_coordinate, _coordinate, _merge, _flatten, _scale, _index, _index, _corners, _drop),
    *(_double, _counts, _corner_lie),
)


def _reals(row: list[str]) -> list[float]:
    def real(text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return 0.0

    return [real(one) for one in row]


def _said(mesh: Mesh) -> tuple[int, int]:
    vertices = len(mesh.vertices) if mesh.said_vertices is None else mesh.said_vertices
    return vertices, len(mesh.faces) if mesh.said_faces is None else mesh.said_faces


def _counted(mesh: Mesh, first: int) -> str:
    rows = []
    for k, face in enumerate(mesh.faces):
        size = len(face) + (mesh.corner_lie if k == 0 else 0)
        rows.append(" ".join(map(str, (size, *(i + first for i in face)))))
    return "\n".join(rows)


def write_obj(mesh: Mesh) -> bytes:
    rows = ["v " + " ".join(one) for one in mesh.vertices]
    rows += ["vn " + " ".join(one) for one in mesh.normals or ()]
    mark = "{0}//{0}" if mesh.normals else "{0}"
    rows += ["f " + " ".join(mark.format(i + (i >= 0)) for i in one) for one in mesh.faces]
    return "\n".join(rows).encode()


def write_off(mesh: Mesh) -> bytes:
    vertices, faces = _said(mesh)
    kind = "NOFF" if mesh.normals else "OFF"
    normals = mesh.normals or [[]] * len(mesh.vertices)
    rows = [" ".join(v + n) for v, n in zip(mesh.vertices, normals, strict=False)]
    return "\n".join((kind, f"{vertices} {faces} 0", *rows, _counted(mesh, 0))).encode()


def write_shl(mesh: Mesh) -> bytes:
    vertices, faces = _said(mesh)
    rows = [" ".join(one) for one in mesh.vertices]
    if mesh.normals is None:
        return "\n".join((f"{vertices} {faces} 0.001", *rows, _counted(mesh, 1))).encode()
    head = ("Version: 2", f"{vertices} {faces} {len(mesh.normals)} 0.001")
    normals = [" ".join(one) for one in mesh.normals]
    return "\n".join((*head, *rows, _counted(mesh, 1), *normals)).encode()


def write_stl(mesh: Mesh) -> bytes:
    rows = ["solid s"]
    for face in mesh.faces:
        rows += ["facet normal 0 0 1", "outer loop"]
        for i in face[:3]:
            rows.append("vertex " + " ".join(mesh.vertices[i % len(mesh.vertices)]))
        rows += ["endloop", "endfacet"]
    return "\n".join((*rows, "endsolid s")).encode()


def write_binary_stl(mesh: Mesh) -> bytes:
    data = bytearray(b"\0" * 80 + struct.pack("<I", _said(mesh)[1] % 2**32))
    for face in mesh.faces:
        data += struct.pack("<3f", 0.0, 0.0, 1.0)
        for i in (*face, 0, 0, 0)[:3]:
            data += struct.pack("<3f", *map(_single, mesh.vertices[i % len(mesh.vertices)]))
        data += b"\0\0"
    return bytes(data)


def _single(text: str) -> float:
    (value,) = _reals([text])
    return float("inf") if abs(value) > 3e38 else value


def _ply_head(mesh: Mesh, form: str, real: str) -> str:
    vertices, faces = _said(mesh)
    names = ("x", "y", "z", "nx", "ny", "nz") if mesh.normals else ("x", "y", "z")
    rows = ["ply", f"format {form} 1.0", f"element vertex {vertices}"]
    rows += [f"property {real} {name}" for name in names]
    rows += [f"element face {faces}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(rows)


def write_ply(mesh: Mesh) -> bytes:
    normals = mesh.normals or [[]] * len(mesh.vertices)
    rows = [" ".join(v + n) for v, n in zip(mesh.vertices, normals, strict=False)]
    return (_ply_head(mesh, "ascii", "double") + "\n".join((*rows, _counted(mesh, 0)))).encode()


def write_binary_ply(mesh: Mesh) -> bytes:
    data = bytearray(_ply_head(mesh, "binary_little_endian", "double").encode())
    normals = mesh.normals or [[]] * len(mesh.vertices)
    for vertex, normal in zip(mesh.vertices, normals, strict=False):
        row = _reals(vertex + normal)
        data += struct.pack(f"<{len(row)}d", *row)
    for k, face in enumerate(mesh.faces):
        data.append((len(face) + (mesh.corner_lie if k == 0 else 0)) % 256)
        data += b"".join(struct.pack("<I", i % 2**32) for i in face)
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
