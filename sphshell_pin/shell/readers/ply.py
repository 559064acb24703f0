"""Polygon files (.ply), text and binary.

A reader of our own: trimesh refuses binary files whose elements have different numbers of corners,
and accepts truncated text files.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import LARGEST_COUNT, RawSurface
from sphshell_pin.shell.readers import text
from sphshell_pin.shell.readers.text import read_bytes

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDER = {"binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
_TOO_SHORT = "ends too early: its header promises more"


@dataclass
class _Property:
    name: str
    kind: str
    count_kind: str | None  # of a list


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]


Polygons = tuple[Longs, Ints]
_Values = npt.NDArray[Any]  # of the types that the header names


def read_ply(path: Path) -> RawSurface:
    """Read a .ply file, see `parse_ply`."""
    return parse_ply(path, read_bytes(path))


def parse_ply(path: Path, data: bytes) -> RawSurface:
    """Read the content of a .ply file: polygons of any size, and vertex normals if it has them.

    Raises
    ------
    ShellFileError
        If the file is truncated, holds no faces, or does not follow the format.
    """
    form, elements, start = _header(path, data)
    table: dict[str, Array] = {}
    polygons: Polygons | None = None
    try:
        body = data[start:]
        if form == "ascii":  # as if it were binary, all numbers 64-bit reals
            body = text.real_numbers(body.decode("latin-1").split()).tobytes()
        source = _Data(body)
        for element in elements:
            lists = [prop for prop in element.properties if prop.count_kind]
            if element.name == "vertex" and not lists:
                table = source.table(element)
            elif element.name == "face" and any(prop.name in _CORNERS for prop in lists):
                polygons = source.polygons(element)
                break  # what follows is of no use here
            elif lists:
                for _ in range(element.count):
                    for prop in element.properties:
                        source.values(prop)
            else:
                source.table(element)
    except (IndexError, ValueError) as error:
        raise ShellFileError(path, f"{_TOO_SHORT} ({error})") from error
    if polygons is None or any(axis not in table for axis in "xyz"):
        raise ShellFileError(path, "holds no vertices with x, y, z or no faces")
    vertices = np.stack([table[axis] for axis in "xyz"], axis=1)
    raw = text.finish(path, vertices, *polygons)
    if any(axis not in table for axis in ("nx", "ny", "nz")):
        return raw
    normals = np.stack([table[axis] for axis in ("nx", "ny", "nz")], axis=1)
    return replace(raw, normals=normals[raw.corners])


def _header(path: Path, data: bytes) -> tuple[str, list[_Element], int]:
    """Format, elements, and where the data start."""
    end = data.find(b"end_header")
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise ShellFileError(path, "is no .ply file, or its header is cut off")
    form = ""
    elements: list[_Element] = []

    def kind(name: str) -> str:
        binary = _ORDER.get(form, "<") + _TYPES[name]
        return "<f8" if form == "ascii" else binary

    for number, row in enumerate(data[:end].decode("ascii", "replace").splitlines(), start=1):
        words = row.split()
        try:
            if not words or words[0] in ("ply", "comment", "obj_info"):
                continue
            text.check_ascii(words[2:3] if words[0] == "element" else [])
            if words[0] == "format":
                form = words[1]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[0] == "property" and words[1] == "list":
                listed = _Property(words[4], kind(words[3]), kind(words[2]))
                elements[-1].properties.append(listed)
            elif words[0] == "property":
                elements[-1].properties.append(_Property(words[2], kind(words[1]), None))
            else:
                raise ValueError
        except (ValueError, IndexError, KeyError):
            raise ShellFileError(path, f"header line '{row}' is not understood", number) from None
    if form != "ascii" and form not in _ORDER:
        raise ShellFileError(path, f"format '{form}' is not known")
    return form, elements, line_end + 1


class _Data:
    """The data of a file, element by element."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def table(self, element: _Element) -> dict[str, Array]:
        """Read an element without lists: its columns by name."""
        rows = self._take(np.dtype([(p.name, p.kind) for p in element.properties]), element.count)
        return {prop.name: rows[prop.name].astype(np.float64) for prop in element.properties}

    def polygons(self, element: _Element) -> Polygons:
        """Read an element with lists; its corners are those of the properties named so."""
        alike = self._alike(element)
        if alike is not None:
            return alike
        rows = []
        for _ in range(element.count):
            values = [self.values(prop) for prop in element.properties]
            found = zip(element.properties, values, strict=True)
            rows.append(np.concatenate([v for p, v in found if p.name in _CORNERS]))
        return text.pack_polygons([len(row) for row in rows], _whole(np.concatenate(rows)))

    def values(self, prop: _Property) -> _Values:
        count = 1
        if prop.count_kind:
            count = int(_whole(self._take(np.dtype(prop.count_kind), 1))[0])
        return self._take(np.dtype(prop.kind), count)

    def _alike(self, element: _Element) -> Polygons | None:
        """Read all polygons at once, if all have as many corners as the first."""
        start = self._at
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        for prop in element.properties:
            size = len(self.values(prop))
            if prop.count_kind:
                fields.append((f"{prop.name} count", prop.count_kind, ()))
            fields.append((prop.name, prop.kind, (size,)))
        self._at = start
        kind = np.dtype(fields)
        if start + element.count * kind.itemsize > len(self._data):
            return None
        rows = self._take(kind, element.count)
        for prop in element.properties:
            if prop.count_kind and (rows[f"{prop.name} count"] != rows[prop.name].shape[1]).any():
                self._at = start
                return None
        name = next(prop.name for prop in element.properties if prop.name in _CORNERS)
        corners = rows[name]
        return text.pack_polygons(np.full(len(rows), corners.shape[1]), _whole(corners.ravel()))

    def _take(self, kind: np.dtype[Any], count: int) -> _Values:
        size = kind.itemsize * count
        # A row without properties has no bytes: its count needs a bound of its own.
        if not 0 <= count <= len(self._data) or self._at + size > len(self._data):
            raise ValueError("not enough data")
        values = np.frombuffer(self._data, kind, count, self._at)
        self._at += size
        return values


def _whole(values: _Values) -> Longs:
    """Return indices; those of a text file were read as reals."""
    reals = values.astype(np.float64)
    if (reals != np.floor(reals)).any():
        raise ValueError("an index is not a whole number")
    return np.clip(reals, -LARGEST_COUNT, LARGEST_COUNT).astype(np.int64)
