"""Writing surfaces: .shl versions 1 and 2, .stl, .obj, .ply, .off.

A file appears whole or not at all.
"""

import struct
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Mask
from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.base import ShellBase
from sphshell_pin.shell.raw import area_vectors
from sphshell_pin.shell.readers.mesh import STL_RECORD
from sphshell_pin.units import meters_per_unit


@dataclass(frozen=True)
class Written:
    """What the writers need of a surface.

    vertices (n, 3) in file units, elements (m, 4) with -1 ending triangles, triangles (t, 3),
    normals per element corner (m, 4, 3) or None, scale [m per file unit].
    """

    vertices: Array
    elements: Ints
    triangles: Ints
    normals: Array | None
    scale: float
    name: str

    @property
    def used(self) -> Mask:
        """(m, 4) which corners exist."""
        return self.elements >= 0

    def rows(self, first: int) -> list[str]:
        """Corners of each element, its number in front, counted from `first`."""
        return [
            " ".join([str(len(row)), *(str(v + first) for v in row)])
            for row in ([v for v in line if v >= 0] for line in self.elements.tolist())
        ]


def write_surface(path: StrPath, shell: ShellBase, unit: str) -> None:
    """Write `shell` in the format the suffix names, see `Shell.to_file`."""
    path = Path(path)
    data = encoded(path, shell, unit)
    try:
        with atomic_file(path) as file:
            file.write(data)
    except OSError as error:
        raise ShellFileError(path, f"cannot be written ({error.strerror})") from error


def encoded(path: Path, shell: ShellBase, unit: str) -> bytes:
    """Return the contents of a file of `shell`, in the format the suffix of `path` names.

    Raises
    ------
    InvalidParameter
        Of an unknown suffix or unit; the message lists the known ones.
    """
    scale = meters_per_unit(unit)
    surface = Written(
        vertices=shell.vertices / scale,
        elements=shell.elements,
        triangles=shell.triangles,
        normals=corners_of_elements(
            shell.normals, shell.elements, shell.triangles, shell.triangle_element
        ),
        scale=scale,
        name=shell.name,
    )
    try:
        form = WRITERS[path.suffix.lower()]
    except KeyError:
        raise InvalidParameter(
            "path", str(path), f"must end in one of: {', '.join(WRITERS)}"
        ) from None
    return form(surface)


def corners_of_elements(
    normals: Array | None, elements: Ints, triangles: Ints, triangle_element: Ints
) -> Array | None:
    """Return normals by element corner (m, 4, 3) from those by triangle corner (t, 3, 3)."""
    if normals is None:
        return None
    out = np.zeros((len(elements), 4, 3))
    owner = elements[triangle_element]
    for k in range(3):
        place = np.argmax(owner == triangles[:, k, None], axis=1)
        out[triangle_element, place] = normals[:, k]
    return out


def _points(vertices: Array, start: str = "") -> list[str]:
    # repr gives the shortest text that reads back as the same number.
    return [f"{start}{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]


def _split_by_normal(surface: Written, normals: Array) -> tuple[Written, Array]:
    """Return the surface with points repeated where normals differ, and a normal for each."""
    used = surface.used
    corner, normal = surface.elements[used], normals[used]
    # Normals that agree to single precision are one, as far as a file is concerned.
    key = np.column_stack([corner.astype(np.float64), np.round(normal, 7) + 0.0])
    _, first, place = np.unique(key, axis=0, return_index=True, return_inverse=True)
    elements = np.full_like(surface.elements, -1)
    elements[used] = place.ravel()
    points = surface.vertices[corner[first]]
    return replace(surface, vertices=points, elements=elements), normal[first]


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def _shl(surface: Written) -> bytes:
    if surface.normals is None:
        header = [f"{len(surface.vertices)} {len(surface.elements)} {surface.scale!r}"]
        return _text(header + _points(surface.vertices) + surface.rows(1))
    split, normals = _split_by_normal(surface, surface.normals)
    counts = f"{len(normals)} {len(split.elements)} {len(normals)} {surface.scale!r}"
    body = _points(split.vertices) + split.rows(1) + _points(normals)
    return _text(["Version: 2", counts, *body])


def _stl(surface: Written) -> bytes:
    corners = surface.vertices[surface.triangles]
    normal = area_vectors(corners)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    table = np.zeros(len(corners), STL_RECORD)
    table["normal"] = normal / np.where(length > 0.0, length, 1.0)
    table["corners"] = corners
    head = f"binary stl of {surface.name}"[:80].encode("ascii", "replace").ljust(80)
    return head + struct.pack("<I", len(corners)) + table.tobytes()


def _obj(surface: Written) -> bytes:
    lines = [f"o {surface.name.replace(' ', '_')}", *_points(surface.vertices, "v ")]
    if surface.normals is None:
        faces = ["f " + row.split(" ", 1)[1] for row in surface.rows(1)]
        return _text(lines + faces)
    flat = surface.normals[surface.used]
    table, place = np.unique(np.round(flat, 15) + 0.0, axis=0, return_inverse=True)
    lines += _points(table, "vn ")
    which = np.full(surface.elements.shape, -1)
    which[surface.used] = place.ravel()
    for corners, normals in zip(surface.elements.tolist(), which.tolist(), strict=True):
        pairs = zip(corners, normals, strict=True)
        lines.append("f " + " ".join(f"{v + 1}//{n + 1}" for v, n in pairs if v >= 0))
    return _text(lines)


def _off(surface: Written) -> bytes:
    header = ["OFF", f"{len(surface.vertices)} {len(surface.elements)} 0"]
    return _text(header + _points(surface.vertices) + surface.rows(0))


def _ply(surface: Written) -> bytes:
    columns, data = ["x", "y", "z"], surface.vertices
    if surface.normals is not None:
        surface, normals = _split_by_normal(surface, surface.normals)
        columns += ["nx", "ny", "nz"]
        data = np.column_stack([surface.vertices, normals])
    head = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(data)}",
        *(f"property double {column}" for column in columns),
        f"element face {len(surface.elements)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    body = [" ".join(repr(x) for x in row) for row in data.tolist()]
    return _text(head + body + surface.rows(0))


WRITERS = {".shl": _shl, ".stl": _stl, ".obj": _obj, ".ply": _ply, ".off": _off}
"""Writers by suffix."""
