"""A surface file in meters: its reader, its unit, and the SCALE of .shl files."""

import math
import os
from pathlib import Path

from sphshell_pin.errors import InvalidParameter, InvalidShell, UnitMissing, UnitWarning
from sphshell_pin.shell.cad import CAD_SUFFIXES, CadOptions
from sphshell_pin.shell.cad.framing import check_frame
from sphshell_pin.shell.cad.kept_surface import KeptSurface, Read
from sphshell_pin.shell.cad.process import run_in_child, warn_caller
from sphshell_pin.shell.cleaning import box_diagonal, clean_surface
from sphshell_pin.shell.raw import RawSurface
from sphshell_pin.shell.readers import READERS, read_shl, reader_for
from sphshell_pin.units import METERS_PER_UNIT, meters_per_unit

Scale = str | float | None


def load_surface(
    path: str | os.PathLike[str],
    unit: str | None,
    scale: Scale,
    cad: CadOptions,
    crease_angle: float,
) -> Read:
    """Read and clean a surface file.

    With a crease angle above 0 the sides that curvature would take off the faces of a CAD file are
    marked as straight.

    Returns the surface in meters, the unit taken, and meters per file unit.

    Raises as `Shell.from_file` does.
    """
    if unit is not None:
        meters_per_unit(unit)  # an unknown unit is reported before a long file is read
    number = _check_scale(scale)
    file, suffix = reader_for(path)
    if suffix not in CAD_SUFFIXES:
        cad.check_unused(suffix)
    elif not isinstance(scale, str):
        return _load_cad(file, unit, number, cad, crease_angle)
    raw, taken, factor = _load_raw(file, suffix, unit, scale, number)
    try:
        return clean_surface(raw), taken, factor
    except InvalidShell as error:
        raise InvalidShell(f"{path}: {error}") from error


def _load_cad(
    file: Path, unit: str | None, number: float, cad: CadOptions, crease_angle: float
) -> Read:
    check_frame(file)
    arguments = (file, unit, cad, number, crease_angle, _scaled(number))
    purpose = f"reading {file.suffix.lower()} files"
    kept = KeptSurface.of(file, cad, (unit, number, crease_angle))
    known = kept.load()
    if known is not None:
        for text in known[1]:
            warn_caller(UnitWarning(text))
        return known[0]
    heard: list[Warning] = []
    read: Read = run_in_child("read", arguments, file, purpose, cad, heard=heard)
    # Unless the file was saved anew meanwhile.
    if KeptSurface.of(file, cad, (unit, number, crease_angle)) == kept:
        kept.save(read, heard)
    return read


def _load_raw(
    file: Path, suffix: str, unit: str | None, scale: Scale, number: float
) -> tuple[RawSurface, str, float]:
    if suffix == ".shl":
        return _load_shl(file, unit, scale, number)
    if isinstance(scale, str):
        raise InvalidParameter("scale", scale, f"must be a number for {suffix} files (no SCALE)")
    raw = READERS[suffix](file)
    if unit is None:
        size = box_diagonal(raw.vertices[raw.corners.ravel()])
        raise UnitMissing(file, size, METERS_PER_UNIT)
    factor = meters_per_unit(unit) * number
    return raw.scaled(factor).noting(*_scaled(number)), unit, factor


def _scaled(number: float) -> tuple[str, ...]:
    return () if number == 1.0 else (f"scaled by {number:.6g} as asked",)


def _load_shl(
    file: Path, unit: str | None, scale: Scale, number: float
) -> tuple[RawSurface, str, float]:
    found = read_shl(file)
    written = found.scale
    if scale is None:
        scale = "apply" if unit is None else "ignore"
    length = meters_per_unit(unit) if unit is not None else 1.0
    taken = f"unit '{unit}'" if unit is not None else "meters"
    if scale == "apply":
        factor = length * written
        note = f"SCALE {written:.9g} of the file applied to its numbers, as {taken} per file unit"
        if unit is not None:
            note = f"SCALE {written:.9g} of the file applied to its numbers, then taken in {taken}"
    elif scale == "ignore":
        factor = length
        note = f"SCALE {written:.9g} of the file ignored, its numbers taken in {taken}"
    else:
        factor = length * number
        note = f"scale {number:.9g} used in place of SCALE {written:.9g}, result taken in {taken}"
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
