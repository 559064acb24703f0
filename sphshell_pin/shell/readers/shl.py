"""ADAMS shell files (.shl), versions 1 and 2.

Version 1 is `NPTS NPOLY SCALE`, the points, then polygons `n i1 .. in` with indices from 1. Version
2 starts with a line `Version: 2`, its header is `NPTS NPOLY NNORM SCALE`, and NNORM unit normals
follow the polygons, one per point (points repeat where normals differ). SCALE is meters per file
unit in the files seen. Winding cannot be trusted, and counts may be written as reals.
"""

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import RawSurface
from sphshell_pin.shell.readers.text import finish, pack_polygons, read_text

# No two neighbors in a pattern match the same text: a long line would cost its length squared.
_VERSION = re.compile(r"\s*version\s*(?:[:=]\s*)?([\d.]+)\s*$", re.IGNORECASE)
_FORTRAN_EXPONENT = str.maketrans("dD", "eE")
# The characters of a line of numbers; nan and inf are not among them.
_NUMBERS = re.compile(r"(?=[^0-9]*[0-9])[-+0-9.eEdD\s]*$")
_NOT_FINITE = re.compile(r"(?i)(?<![a-z])[-+]?(nan|inf|infinity)(?![a-z])")


@dataclass(frozen=True)
class ShlSurface:
    """What a .shl file holds: the surface in file units, and SCALE as written."""

    raw: RawSurface
    scale: float
    version: int


class _Lines:
    """Lines of a file that hold numbers only; `number` is their line in it (from 1)."""

    def __init__(self, path: Path, rows: list[str], start: int) -> None:
        self._path = path
        self.text: list[str] = []
        self.number: list[int] = []
        skipped = []
        for number, row in enumerate(rows[start:], start=start + 1):
            if _NUMBERS.match(row) or _NOT_FINITE.search(row):
                self.text.append(row)
                self.number.append(number)
            elif row.strip(" \t\x00\x1a"):
                skipped.append((number, row.strip()[:60]))
        self.skipped = ""
        if skipped:
            number, text = skipped[0]
            self.skipped = f"{len(skipped)} lines of text were skipped, the first is line {number}"
            self.skipped += f": {text!r}"

    def fault(self, k: int, reason: str, hint: bool = False) -> ShellFileError:
        """Return an error about line k; `hint` adds the lines that were skipped."""
        if hint and self.skipped:
            reason += f" ({self.skipped})"
        return ShellFileError(self._path, reason, self.number[k] if self.number else None)

    def floats(self, k: int) -> list[float]:
        try:
            return [float(token.translate(_FORTRAN_EXPONENT)) for token in self.text[k].split()]
        except ValueError as error:
            raise self.fault(k, str(error)) from error

    def integers(self, k: int, what: str) -> list[int]:
        """Whole numbers of line k, which may be written as reals."""
        try:
            return [int(token) for token in self.text[k].split()]
        except ValueError:
            values = self.floats(k)
        if not all(value.is_integer() for value in values):
            must = f"{what} must be whole numbers 'n i1 .. in', not '{self.text[k].strip()}'"
            raise self.fault(k, must)
        return [int(value) for value in values]

    def rows_of_three(self, start: int, count: int, what: str) -> tuple[Array, int]:
        """Return `count` rows (count, 3) from line `start` on, and the line after them."""
        stop = start + count
        if stop > len(self.text):
            there = max(len(self.text) - start, 0)
            raise self.fault(-1, _too_early(f"{count} {what}", there), hint=True)
        # A line with two numbers beside one with four would shift all that follows.
        if all(len(row.split()) == 3 for row in self.text[start:stop]):
            tokens = " ".join(self.text[start:stop]).translate(_FORTRAN_EXPONENT).split()
            with suppress(ValueError):  # the reading by lines names the line
                return np.array(tokens, np.float64).reshape(count, 3), stop
        for k in range(start, stop):
            if len(self.floats(k)) != 3:
                must = f"one of the {count} {what} must be three numbers here, not "
                raise self.fault(k, f"{must}'{self.text[k].strip()}'", hint=True)
        raise self.fault(start, f"the {what} cannot be read")


def _too_early(promised: str, there: int) -> str:
    return f"ends too early: the header promises {promised}, only {there} are there"


def read_shl(path: Path) -> ShlSurface:
    """Read a .shl file of version 1 or 2; coordinates stay in file units.

    Raises
    ------
    ShellFileError
        For a file that is truncated or does not follow the format; with the line.
    """
    rows = read_text(path).splitlines()
    version, start = _version(path, rows)
    lines = _Lines(path, rows, start)
    if not lines.text:
        raise lines.fault(0, "holds no numbers", hint=True)
    header = lines.floats(0)
    if len(header) not in (3, 4) or (version == 2 and len(header) != 4):
        wanted = "NPTS NPOLY NNORM SCALE" if version == 2 else "NPTS NPOLY SCALE"
        raise lines.fault(0, f"the header '{lines.text[0].strip()}' must be '{wanted}'")
    *counts, scale = header
    for value in counts:
        if not (value >= 0.0 and value == np.floor(value) and value < 2**31):
            raise lines.fault(0, f"the header counts {value}; a count is a whole number")
    num_points, num_polygons, num_normals = (*map(int, counts), 0)[:3]
    if not (np.isfinite(scale) and scale > 0.0):
        raise lines.fault(0, f"SCALE is {scale}; it must be positive")
    if num_points < 3 or num_polygons < 1:
        raise lines.fault(0, f"{num_points} points and {num_polygons} polygons make no surface")
    vertices, at = lines.rows_of_three(1, num_points, "points")
    offsets, corners, at = _polygons(lines, at, num_polygons, num_points)
    notes = [lines.skipped] if lines.skipped else []
    normals = None
    if num_normals and num_normals == num_points:
        table, at = lines.rows_of_three(at, num_normals, "normals")
        normals = table[corners]
    elif num_normals:
        notes.append(
            f"{num_normals} normals for {num_points} points ignored: their meaning is not known"
        )
    raw = finish(path, vertices, offsets, corners, normals, tuple(notes))
    # The fourth number exists only in version 2.
    return ShlSurface(raw, float(scale), 2 if len(header) == 4 else version)


def _version(path: Path, rows: list[str]) -> tuple[int, int]:
    """Version and the row after its line (or 0)."""
    for k, row in enumerate(rows):
        found = _VERSION.match(row)
        if found:
            number = float(found[1].rstrip(".") or 0)
            if number not in (1.0, 2.0):
                known = f"version {found[1]} is not known; 1 and 2 can be read"
                raise ShellFileError(path, known, k + 1)
            return int(number), k + 1
        if _NUMBERS.match(row):
            break
    return 1, 0


def _polygons(lines: _Lines, start: int, count: int, num_points: int) -> tuple[Longs, Ints, int]:
    counts: list[int] = []
    corners: list[int] = []
    at = start
    for k in range(count):
        if at >= len(lines.text):
            raise lines.fault(-1, _too_early(f"{count} polygons", k), hint=True)
        first, what = at, f"polygon {k + 1}"
        size, *values = lines.integers(at, what)
        at += 1
        if size < 3:
            raise lines.fault(first, f"{what} has {size} corners; it needs at least three")
        while len(values) < size and at < len(lines.text):
            more = lines.integers(at, what)
            if len(values) + len(more) > size:
                break
            values += more
            at += 1
        if len(values) != size:
            says = f"{what} says {size} corners, but {len(values)} indices follow"
            raise lines.fault(first, says)
        for index in values:
            if not 1 <= index <= num_points:
                numbered = f"but the points are numbered 1 to {num_points}"
                raise lines.fault(first, f"{what} uses point {index}, {numbered}")
        counts.append(size)
        corners += values
    offsets, flat = pack_polygons(counts, np.array(corners, np.int64) - 1)
    return offsets, flat, at
