"""Polygon files (.ply), text and binary.

A reader of our own: trimesh refuses binary files whose elements have different numbers of corners,
and takes truncated text files without a word.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import Floats, Ints, Longs, RawSurface
from sphshell_pin.shell.readers.text import finish, pack_polygons

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


def read_ply(path: Path) -> RawSurface:
    """Read a .ply file: polygons of any size, and vertex normals if it has them.

    Raises
    ------
    ShellFileError
        If the file is truncated, holds no faces, or does not follow the format.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ShellFileError(path, f"cannot be read ({error.strerror})") from error
    form, elements, start = _header(path, data)
    table: dict[str, Floats] = {}
    polygons: Polygons | None = None
    source = _Text(data[start:]) if form == "ascii" else _Binary(data[start:], _ORDER[form])
    try:
        for element in elements:
            lists = [prop for prop in element.properties if prop.count_kind]
            if element.name == "vertex" and not lists:
                table = source.table(element)
            elif element.name == "face" and any(prop.name in _CORNERS for prop in lists):
                polygons = source.polygons(element)
                break  # what follows is of no use here
            elif not lists:
                source.table(element)
            else:
                source.polygons(element)
    except (IndexError, ValueError) as error:
        raise ShellFileError(path, f"{_TOO_SHORT} ({error})") from error
    if polygons is None or any(axis not in table for axis in "xyz"):
        raise ShellFileError(path, "holds no vertices with x, y, z or no faces")
    vertices = np.stack([table[axis] for axis in "xyz"], axis=1)
    raw = finish(path, vertices, *polygons)
    if any(axis not in table for axis in ("nx", "ny", "nz")):
        return raw
    normals = np.stack([table[axis] for axis in ("nx", "ny", "nz")], axis=1)
    return RawSurface(raw.vertices, raw.offsets, raw.corners, normals[raw.corners])


_ORDER = {"binary_little_endian": "<", "binary_big_endian": ">"}


def _header(path: Path, data: bytes) -> tuple[str, list[_Element], int]:
    """Format, elements, and where the data start."""
    end = data.find(b"end_header")
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise ShellFileError(path, "is no .ply file, or its header is cut off")
    form = ""
    elements: list[_Element] = []
    for number, row in enumerate(data[:end].decode("ascii", "replace").splitlines(), start=1):
        words = row.split()
        try:
            if not words or words[0] in ("ply", "comment", "obj_info"):
                continue
            if words[0] == "format":
                form = words[1]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[0] == "property" and words[1] == "list":
                listed = _Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
                elements[-1].properties.append(listed)
            elif words[0] == "property":
                elements[-1].properties.append(_Property(words[2], _TYPES[words[1]], None))
            else:
                raise ValueError
        except (ValueError, IndexError, KeyError):
            raise ShellFileError(path, f"header line '{row}' is not understood", number) from None
    if form != "ascii" and form not in _ORDER:
        raise ShellFileError(path, f"format '{form}' is not known")
    return form, elements, line_end + 1


class _Text:
    """The data of a text file, word by word."""

    def __init__(self, data: bytes) -> None:
        self._words = data.split()
        self._at = 0

    def table(self, element: _Element) -> dict[str, Floats]:
        width = len(element.properties)
        rows = np.array(self._take(element.count * width), np.float64).reshape(-1, width)
        return {prop.name: rows[:, k] for k, prop in enumerate(element.properties)}

    def polygons(self, element: _Element) -> Polygons:
        def read(prop: _Property) -> list[int]:
            size = int(self._take(1)[0]) if prop.count_kind else 1
            words = self._take(size)
            return [int(word) for word in words] if prop.name in _CORNERS else []

        return _one_by_one(element, read)

    def _take(self, count: int) -> list[bytes]:
        words = self._words[self._at : self._at + count]
        if count < 0 or len(words) < count:
            raise ValueError("not enough numbers")
        self._at += count
        return words


class _Binary:
    """The data of a binary file."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data = data
        self._order = order
        self._at = 0

    def table(self, element: _Element) -> dict[str, Floats]:
        kind = np.dtype([(p.name, self._order + p.kind) for p in element.properties])
        rows = self._take(kind, element.count)
        return {prop.name: rows[prop.name].astype(np.float64) for prop in element.properties}

    def polygons(self, element: _Element) -> Polygons:
        return self._alike(element) or _one_by_one(element, self._read)

    def _read(self, prop: _Property) -> list[int]:
        size = 1
        if prop.count_kind:
            size = int(self._take(np.dtype(self._order + prop.count_kind), 1)[0])
        values = self._take(np.dtype(self._order + prop.kind), size)
        return [int(value) for value in values] if prop.name in _CORNERS else []

    def _alike(self, element: _Element) -> Polygons | None:
        """All polygons at once, if all have as many corners as the first."""
        start = self._at
        fields: list[Any] = []
        for prop in element.properties:
            if prop.count_kind:
                size = int(self._take(np.dtype(self._order + prop.count_kind), 1)[0])
                self._take(np.dtype(self._order + prop.kind), size)
                fields.append((f"{prop.name} count", self._order + prop.count_kind))
                fields.append((prop.name, self._order + prop.kind, (size,)))
            else:
                self._take(np.dtype(self._order + prop.kind), 1)
                fields.append((prop.name, self._order + prop.kind))
        self._at = start
        kind = np.dtype(fields)
        if start + element.count * kind.itemsize > len(self._data):
            return None
        rows = np.frombuffer(self._data, kind, element.count, start)
        for prop in element.properties:
            if prop.count_kind and (rows[f"{prop.name} count"] != rows[prop.name].shape[1]).any():
                return None
        self._at += element.count * kind.itemsize
        name = next((p.name for p in element.properties if p.name in _CORNERS), None)
        if name is None:
            return pack_polygons([], [])
        return pack_polygons(
            np.full(len(rows), rows[name].shape[1]), rows[name].astype(np.int64).ravel()
        )

    def _take(self, kind: np.dtype[Any], count: int) -> npt.NDArray[Any]:
        size = kind.itemsize * count
        # A row without properties has no bytes: its count needs a bound of its own.
        if not 0 <= count <= len(self._data) or self._at + size > len(self._data):
            raise ValueError("not enough data")
        values = np.frombuffer(self._data, kind, count, self._at)
        self._at += size
        return values


def _one_by_one(element: _Element, read: Callable[[_Property], list[int]]) -> Polygons:
    counts: list[int] = []
    corners: list[int] = []
    for _ in range(element.count):
        row: list[int] = []
        for prop in element.properties:
            row += read(prop)
        counts.append(len(row))
        corners += row
    return pack_polygons(counts, corners)
