"""Mesh files without a unit: .stl, .obj and .off.

The readers are our own: trimesh triangulates the quads and larger polygons of obj files and drops
the normals of their corners, and it loses the quads of off files altogether; here elements must
stay what they are.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import RawSurface
from sphshell_pin.shell.readers import text
from sphshell_pin.shell.readers.text import read_bytes, read_text

STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
"""A triangle of a binary .stl file."""

_VERTEX = re.compile(rb"(?i)\bvertex\s+([^\s_]+)\s+([^\s_]+)\s+([^\s_]+)(?!\S)")
_END_OF_FACET = re.compile(rb"(?i)\bendfacet\b")


def read_stl(path: Path) -> RawSurface:
    """Read a binary or text .stl file: a soup of triangles."""
    vertices, notes = stl_corners(path, read_bytes(path))
    offsets, corners = text.pack_polygons(np.full(len(vertices) // 3, 3), np.arange(len(vertices)))
    return text.finish(path, vertices.astype(np.float64), offsets, corners, notes=notes)


def stl_corners(path: Path, data: bytes) -> tuple[npt.NDArray[np.floating], tuple[str, ...]]:
    """Return the corners (3n, 3) of the triangles in the .stl file `data`, and notes on it.

    `path` is for messages. A text holds no null character, a binary file does.
    """
    count, size = int.from_bytes(data[80:84], "little"), STL_RECORD.itemsize
    if b"\0" in data or len(data) == 84 + count * size:
        held = (len(data) - 84) // size
        if held < max(count, 1) or held > count:
            raise ShellFileError(
                path,
                f"is cut off or damaged: its header promises {count} triangles, and it holds "
                f"{max(held, 0)}; export it anew",
            )
        rest = len(data) - 84 - count * size
        notes = (f"{rest} bytes behind the last triangle of the file are left out",) * (rest > 0)
        return np.frombuffer(data, STL_RECORD, count, 84)["corners"].reshape(-1, 3), notes
    vertices = _reals(path, _VERTEX.findall(data))
    count = len(_END_OF_FACET.findall(data))
    if len(vertices) != 3 * count or not count:
        raise ShellFileError(
            path,
            f"is cut off, or no .stl file: as a text it holds {len(vertices)} vertices in {count} "
            "whole facets, each of which needs three; as a binary file it would hold null bytes",
        )
    return vertices, ()


def read_obj(path: Path) -> RawSurface:
    """Read the vertices, faces and corner normals of a Wavefront .obj file.

    Indices count from 1, or back from the latest if negative; `v`, `v/vt`, `v//vn` and `v/vt/vn`
    are understood, and lines continued by a backslash.
    """
    points: list[str] = []
    normals: list[str] = []
    counts: list[int] = []
    corners: list[int] = []
    corner_normals: list[int] = []
    pending = ""
    for number, row in enumerate(read_text(path).splitlines(), start=1):
        if row.endswith("\\"):
            pending += row[:-1] + " "
            continue
        words = (pending + row).split("#", 1)[0].split()
        pending = ""
        if not words:
            continue
        if words[0] == "v":
            _check_reals(path, number, words)
            points += words[1:4]
        elif words[0] == "vn":
            _check_reals(path, number, words)
            normals += words[1:4]
        elif words[0] == "f":
            at, along = len(points) // 3, len(normals) // 3
            named = words[1:]
            if len(named) < 3:
                raise ShellFileError(path, f"a face of {len(named)} corners needs three", number)
            for word in named:
                parts = word.split("/")
                corners.append(_obj_index(path, number, parts[0], at, "vertex"))
                third = parts[2] if len(parts) > 2 else ""
                corner_normals.append(
                    _obj_index(path, number, third, along, "normal") if third else -1
                )
            counts.append(len(named))
    vertices = _reals(path, points)
    offsets, flat = text.pack_polygons(counts, corners)
    # Forward references are legal: whether a vertex exists is known only now.
    raw = text.finish(path, vertices, offsets, flat)
    which = text.indices(corner_normals)
    if not (which >= 0).any():
        return raw
    # A last row of zeros stands for corners without a normal.
    table = np.concatenate([_reals(path, normals), np.zeros((1, 3))])
    if which.max() >= len(table) - 1:
        raise ShellFileError(
            path, f"a face uses normal {which.max() + 1}, but the file has {len(table) - 1} normals"
        )
    return replace(raw, normals=table[which])


def _obj_index(path: Path, line: int, word: str, latest: int, what: str) -> int:
    try:
        text.check_ascii([word])
        index = int(word)
    except ValueError:
        raise ShellFileError(path, f"'{word}' is not the index of a {what}", line) from None
    if index == 0 or index < -latest:
        raise ShellFileError(
            path, f"a face uses {what} {index}; {latest} came before, counted from 1", line
        )
    return index - 1 if index > 0 else latest + index


def _check_reals(path: Path, line: int, words: list[str]) -> None:
    try:
        if len(words) < 4:
            raise ValueError("three numbers are needed")
        text.real_numbers(words[1:4])
    except ValueError as error:
        raise ShellFileError(path, f"'{' '.join(words)}': {error}", line) from None


def _reals(path: Path, words: Sequence[object], width: int = 3) -> Array:
    try:
        return text.real_numbers(words).reshape(-1, width)
    except ValueError as error:
        raise ShellFileError(path, f"holds a coordinate that is not a number ({error})") from None


def read_off(path: Path) -> RawSurface:
    """Read an .off file (also COFF, NOFF, STOFF): polygons of any size.

    Line ends do not matter in the format, except that colors may follow the corners of a face up
    to the end of its line: they are tried where the plain reading does not come out even.
    """
    lines = enumerate(read_text(path).splitlines(), start=1)
    rows = [(number, row.split("#", 1)[0].split()) for number, row in lines]
    rows = [(number, row) for number, row in rows if row]
    if not rows or not rows[0][1][0].upper().endswith("OFF"):
        raise ShellFileError(path, "does not begin with 'OFF'", 1)
    first, (word, *header) = rows[0]
    kind = word.upper()
    if "4" in kind or "n" in word.replace("off", ""):
        raise ShellFileError(path, f"{kind} is not three-dimensional: not readable", first)
    if header and header[0].upper() == "BINARY":
        raise ShellFileError(path, "binary .off files cannot be read: save it as text", first)
    data = [row for _, row in rows[1:]]
    if not header and data:
        header = data.pop(0)
    words = header + [word for row in data for word in row]
    try:
        text.check_ascii(words)
        num_vertices, num_faces = int(words[0]), int(words[1])
    except (ValueError, IndexError):
        raise ShellFileError(path, "must count vertices, faces and edges first", first) from None
    # With normals (N), colors (C, three or four numbers) or texture (ST): the first vertex tells.
    width = 3 if kind == "OFF" or not data else max(len(data[0]), 3)
    start = 2 if len(header) == 2 else 3
    last = start + num_vertices * width
    if num_vertices < 3 or num_faces < 1 or last > len(words):
        raise ShellFileError(
            path,
            f"ends too early or is no surface: it promises {num_vertices} vertices and "
            f"{num_faces} faces",
        )
    table = _reals(path, words[start:last], width)
    faces = _off_faces(words[last:], num_faces, True)
    if faces is None:
        # One face per line; what follows its corners is its color.
        ends = np.cumsum([len(header), *map(len, data)])
        at = int(np.searchsorted(ends, last))
        lines_left = data[at : at + num_faces]
        found = [_off_faces(row, 1, False) for row in lines_left]
        if at == len(ends) or ends[at] != last or len(found) < num_faces or None in found:
            raise ShellFileError(
                path, f"ends too early or holds a damaged face: {num_faces} faces were promised"
            )
        faces = [corners for one in found if one for corners in one]
    offsets, corners = text.pack_polygons(
        list(map(len, faces)), [v for face in faces for v in face]
    )
    raw = text.finish(path, np.ascontiguousarray(table[:, :3]), offsets, corners)
    if "N" not in kind.replace("OFF", ""):
        return raw
    return replace(raw, normals=table[corners, 3:6])


def _off_faces(words: list[str], count: int, all_words: bool) -> list[list[int]] | None:
    """Read `count` faces; None if they are damaged, or are to be `all_words` and are not."""
    faces: list[list[int]] = []
    at = 0
    try:
        for _ in range(count):
            size = int(words[at])
            face = [int(word) for word in words[at + 1 : at + 1 + size]]
            if size < 1 or len(face) < size:
                return None
            faces.append(face)
            at += 1 + size
    except (ValueError, IndexError):
        return None
    return None if all_words and at != len(words) else faces
