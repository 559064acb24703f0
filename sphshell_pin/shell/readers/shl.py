"""ADAMS shell files (.shl), versions 1 and 2.

Version 1 is `NPTS NPOLY SCALE`, the points, then polygons `n i1 .. in` with indices from 1. Version
2 starts with a line `Version: 2`, its header is `NPTS NPOLY NNORM SCALE`, and NNORM unit normals
follow the polygons, one per point (points repeat where normals differ). SCALE is metres per file
unit in the files seen. Winding cannot be trusted, and counts may be written as reals.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import Floats, Ints, Longs, RawSurface
from sphshell_pin.shell.readers.text import finish, pack_polygons, read_text

# No two neighbours in a pattern match the same text: a long line would cost its length squared.
_VERSION = re.compile(r"\s*version\s*(?:[:=]\s*)?([\d.]+)\s*$", re.IGNORECASE)
_FORTRAN_EXPONENT = str.maketrans("dD", "eE")
# What a line of numbers may be made of; the words a real may be spelled with are not among it.
_NUMBERS = re.compile(r"(?=[^0-9]*[0-9])[-+0-9.eEdD\s]*$")
_NOT_FINITE = re.compile(r"(?i)(?<![a-z])[-+]?(nan|inf|infinity)(?![a-z])")


@dataclass(frozen=True)
class ShlSurface:
    """What a .shl file holds: the surface in file units, and SCALE as written."""

    raw: RawSurface
    scale: float
    version: int


@dataclass(frozen=True)
class _Lines:
    """Lines that hold numbers only, with where they stand in the file (from 1)."""

    path: Path
    text: list[str]
    number: list[int]
    skipped: tuple[int, str] | None
    num_skipped: int

    def hint(self) -> str:
        """Return what to add to a complaint about missing lines."""
        if self.skipped is None:
            return ""
        return (
            f" ({self.num_skipped} lines of text were skipped, the first is line "
            f"{self.skipped[0]}: {self.skipped[1]!r})"
        )


def read_shl(path: Path) -> ShlSurface:
    """Read a .shl file of version 1 or 2; coordinates stay in file units.

    Raises
    ------
    ShellFileError
        For a file that is truncated or does not follow the format; with the line.
    """
    rows = read_text(path).splitlines()
    version, start = _version(path, rows)
    lines = _number_lines(path, rows, start)
    if not lines.text:
        raise ShellFileError(path, "holds no numbers" + lines.hint())
    header = _floats(lines, 0)
    if len(header) not in (3, 4) or (version == 2 and len(header) != 4):
        wanted = "NPTS NPOLY NNORM SCALE" if version == 2 else "NPTS NPOLY SCALE"
        raise ShellFileError(
            path, f"the header '{lines.text[0].strip()}' must be '{wanted}'", lines.number[0]
        )
    if len(header) == 4:
        version = 2  # the fourth number exists only there
    num_points, num_polygons, *rest = (_count(lines, value) for value in header[:-1])
    num_normals = rest[0] if rest else 0
    scale = header[-1]
    if not (np.isfinite(scale) and scale > 0.0):
        raise ShellFileError(path, f"SCALE is {scale}; it must be positive", lines.number[0])
    if num_points < 3 or num_polygons < 1:
        raise ShellFileError(
            path,
            f"{num_points} points and {num_polygons} polygons make no surface",
            lines.number[0],
        )
    vertices, at = _rows_of_three(lines, 1, num_points, "points")
    offsets, corners, at = _polygons(lines, at, num_polygons, num_points)
    notes = []
    if lines.skipped is not None:
        notes.append(
            f"{lines.num_skipped} lines of text skipped, the first is line {lines.skipped[0]}: "
            f"{lines.skipped[1]!r}"
        )
    normals = None
    if num_normals and num_normals == num_points:
        table, at = _rows_of_three(lines, at, num_normals, "normals")
        normals = table[corners]
    elif num_normals:
        notes.append(
            f"{num_normals} normals for {num_points} points ignored: their meaning is not known"
        )
    raw = finish(path, vertices, offsets, corners, normals, tuple(notes))
    return ShlSurface(raw, float(scale), version)


def _version(path: Path, rows: list[str]) -> tuple[int, int]:
    """Version and the row after its line (or 0)."""
    for k, row in enumerate(rows):
        found = _VERSION.match(row)
        if found:
            if float(found[1].rstrip(".") or 0) not in (1.0, 2.0):
                raise ShellFileError(
                    path, f"version {found[1]} is not known; 1 and 2 can be read", k + 1
                )
            return int(float(found[1].rstrip("."))), k + 1
        if _NUMBERS.match(row):
            break
    return 1, 0


def _number_lines(path: Path, rows: list[str], start: int) -> _Lines:
    text, number = [], []
    skipped: tuple[int, str] | None = None
    num_skipped = 0
    for k in range(start, len(rows)):
        row = rows[k]
        if _NUMBERS.match(row) or _NOT_FINITE.search(row):
            text.append(row)
            number.append(k + 1)
        elif row.strip(" \t\x00\x1a"):
            skipped = skipped or (k + 1, row.strip()[:60])
            num_skipped += 1
    return _Lines(path, text, number, skipped, num_skipped)


def _floats(lines: _Lines, k: int) -> list[float]:
    try:
        return [float(token.translate(_FORTRAN_EXPONENT)) for token in lines.text[k].split()]
    except ValueError as error:
        raise ShellFileError(lines.path, str(error), lines.number[k]) from error


def _count(lines: _Lines, value: float) -> int:
    if not (value >= 0.0 and value == np.floor(value) and value < 2**31):
        raise ShellFileError(
            lines.path, f"the header counts {value}; a count is a whole number", lines.number[0]
        )
    return int(value)


def _rows_of_three(lines: _Lines, start: int, count: int, what: str) -> tuple[Floats, int]:
    stop = start + count
    if stop > len(lines.text):
        raise ShellFileError(
            lines.path,
            f"ends too early: the header promises {count} {what}, only "
            f"{max(len(lines.text) - start, 0)} are there" + lines.hint(),
            lines.number[-1],
        )
    tokens = " ".join(lines.text[start:stop]).translate(_FORTRAN_EXPONENT).split()
    if len(tokens) == 3 * count and all(
        # A line with two numbers beside one with four would shift all that follows.
        len(row.split()) == 3
        for row in lines.text[start:stop]
    ):
        try:
            return np.array(tokens, np.float64).reshape(count, 3), stop
        except ValueError:
            pass  # the row-wise reading below names the line
    for k in range(start, stop):
        row = _floats(lines, k)
        if len(row) != 3:
            raise ShellFileError(
                lines.path,
                f"one of the {count} {what} must be three numbers here, not "
                f"'{lines.text[k].strip()}'" + lines.hint(),
                lines.number[k],
            )
    raise ShellFileError(lines.path, f"the {what} cannot be read", lines.number[start])


def _polygons(lines: _Lines, start: int, count: int, num_points: int) -> tuple[Longs, Ints, int]:
    counts: list[int] = []
    corners: list[int] = []
    at = start
    for k in range(count):
        first = at
        values = _integers(lines, at, k, count)
        at += 1
        size = values[0]
        if size < 3:
            raise ShellFileError(
                lines.path,
                f"polygon {k + 1} has {size} corners; it needs at least three",
                lines.number[first],
            )
        while len(values) - 1 < size and at < len(lines.text):
            more = _integers(lines, at, k, count)
            if len(values) + len(more) - 1 > size:
                break
            values += more
            at += 1
        if len(values) - 1 != size:
            raise ShellFileError(
                lines.path,
                f"polygon {k + 1} says {size} corners, but {len(values) - 1} indices follow",
                lines.number[first],
            )
        for index in values[1:]:
            if not 1 <= index <= num_points:
                raise ShellFileError(
                    lines.path,
                    f"polygon {k + 1} uses point {index}, but the points are numbered 1 to "
                    f"{num_points}",
                    lines.number[first],
                )
        counts.append(size)
        corners += values[1:]
    offsets, flat = pack_polygons(counts, np.array(corners, np.int64) - 1)
    return offsets, flat, at


def _integers(lines: _Lines, at: int, polygon: int, count: int) -> list[int]:
    if at >= len(lines.text):
        raise ShellFileError(
            lines.path,
            f"ends too early: the header promises {count} polygons, only {polygon} are there"
            + lines.hint(),
            lines.number[-1],
        )
    tokens = lines.text[at].split()
    try:
        return [int(token) for token in tokens]
    except ValueError:
        values = _floats(lines, at)
        if not all(value.is_integer() for value in values):
            raise ShellFileError(
                lines.path,
                f"polygon {polygon + 1} must be whole numbers 'n i1 .. in', not "
                f"'{lines.text[at].strip()}'",
                lines.number[at],
            ) from None
        return [int(value) for value in values]
