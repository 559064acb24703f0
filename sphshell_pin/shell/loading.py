"""A surface file in metres: its reader, its unit, and the SCALE of .shl files."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

from sphshell_pin.errors import InvalidParameter, InvalidShell, UnitMissing
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions, require_kernel
from sphshell_pin.shell.cleaning import CleanedSurface, box_diagonal, clean_surface
from sphshell_pin.shell.raw import RawSurface
from sphshell_pin.shell.readers import READERS, read_shl, reader_for
from sphshell_pin.units import METRES_PER_UNIT, metres_per_unit

if TYPE_CHECKING:
    from sphshell_pin.shell.cad.surface import CadSurface

Scale = str | float | None


def load_surface(
    path: str | os.PathLike[str], unit: str | None, scale: Scale, cad: CadOptions
) -> tuple[CleanedSurface, str, float, CadSurface | None]:
    """Read and clean a surface file.

    Returns the surface in metres, the unit taken, metres per file unit, and of CAD the faces.

    Raises
    ------
    InvalidShell
        If no surface can be made of what the file holds.
    UnitMissing
        If `unit` is not stated where the format has none.
    InvalidParameter
        If unit, scale or suffix is unknown, or an option is out of range or not for this format.
    NameNotFound
        If a body or face is not in the file.
    ShellFileError
        If the file is missing, empty, truncated or damaged.
    MissingExtra
        If the library that reads CAD files is not installed.
    """
    raw, taken, factor, faces = _load_raw(path, unit, scale, cad)
    try:
        return clean_surface(raw), taken, factor, faces
    except InvalidShell as error:
        raise InvalidShell(f"{path}: {error}") from error


def _load_raw(
    path: str | os.PathLike[str], unit: str | None, scale: Scale, cad: CadOptions
) -> tuple[RawSurface, str, float, CadSurface | None]:
    if unit is not None:
        metres_per_unit(unit)  # an unknown unit is said before a long file is read
    number = _check_scale(scale)
    file, suffix = reader_for(path)
    if suffix not in CAD_SUFFIXES:
        cad.check_unused(suffix)
    if suffix == ".shl":
        return *_load_shl(file, unit, scale, number), None
    if isinstance(scale, str):
        raise InvalidParameter("scale", scale, f"must be a number for {suffix} files (no SCALE)")
    notes = [] if number == 1.0 else [f"scaled by {number:.6g} as asked"]
    if suffix in CAD_SUFFIXES:
        require_kernel(f"reading {suffix} files")
        from sphshell_pin.shell.cad.surface import read_cad

        raw, faces = read_cad(file, unit, cad)
        return raw.scaled(number).noting(*notes), faces.unit, faces.factor * number, faces
    raw = READERS[suffix](file)
    if unit is None:
        size = box_diagonal(raw.vertices[raw.corners.ravel()])
        raise UnitMissing(file, size, METRES_PER_UNIT)
    factor = metres_per_unit(unit) * number
    return raw.scaled(factor).noting(*notes), unit, factor, None


def _load_shl(
    file: os.PathLike[str], unit: str | None, scale: Scale, number: float
) -> tuple[RawSurface, str, float]:
    found = read_shl(file)  # type: ignore[arg-type]
    written = found.scale
    if scale is None:
        scale = "apply" if unit is None else "ignore"
    length = metres_per_unit(unit) if unit is not None else 1.0
    said = f"unit '{unit}'" if unit is not None else "metres"
    if scale == "apply":
        factor = length * written
        note = f"SCALE {written:.9g} of the file applied to its numbers, as {said} per file unit"
        if unit is not None:
            note = f"SCALE {written:.9g} of the file applied to its numbers, then taken in {said}"
    elif scale == "ignore":
        factor = length
        note = f"SCALE {written:.9g} of the file ignored, its numbers taken in {said}"
    else:
        factor = length * number
        note = f"scale {number:.9g} used in place of SCALE {written:.9g}, result taken in {said}"
    version = f".shl version {found.version}"
    return found.raw.scaled(factor).noting(version, note), unit or "m", factor


def _check_scale(scale: Scale) -> float:
    """Return the number a `scale` stands for, 1 for its words."""
    if scale is None or scale in ("apply", "ignore"):
        return 1.0
    try:
        number = math.nan if isinstance(scale, (str, bool)) else float(scale)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise InvalidParameter("scale", scale, 'must be "apply", "ignore" or a positive number')
    return number
