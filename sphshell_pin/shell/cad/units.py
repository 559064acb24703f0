"""The unit of length a CAD file states, and the one that is taken."""

import math
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

from OCP.STEPConstruct import STEPConstruct_UnitContext
from OCP.StepRepr import StepRepr_GlobalUnitAssignedContext

from sphshell_pin.errors import InvalidParameter, ShellFileError, UnitMissing, UnitWarning
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.units import METERS_PER_UNIT, meters_per_unit

MILLIMETER = 1e-3
"""OpenCASCADE's tolerances are meant for numbers in millimeters: STEP and IGES are read in them."""

SAME = 1e-9
"""Units whose lengths differ by less than this share are one."""

NAMED = 3
"""Flag of an IGES header whose unit is a name. OpenCASCADE changes it for the names it knows."""


@dataclass(frozen=True)
class HeaderUnit:
    """What the header of a file says about its unit of length.

    Attributes
    ----------
    names : of the units stated: none, one, or several, each applied to its own part of the file
    meters : per unit of the file; of several, and of none, per unit of the shape
    shape_meters : meters per unit of the shape as it was read, 1 if no unit is known
    """

    names: tuple[str, ...]
    meters: float
    shape_meters: float


NO_UNIT = HeaderUnit((), 1.0, 1.0)


def step_unit(model: Occ) -> HeaderUnit:
    """Return the unit in which a STEP file (StepData_StepModel) gives its lengths.

    OpenCASCADE has brought the lengths to millimeters, each by the unit of its own context; where
    there is none it has left them.
    """
    found: list[float] = []
    for row in range(1, model.NbEntities() + 1):
        context = model.Entity(row)
        if hasattr(context, "GlobalUnitAssignedContext"):
            context = context.GlobalUnitAssignedContext()
        if not isinstance(context, StepRepr_GlobalUnitAssignedContext):
            continue
        factors = STEPConstruct_UnitContext()
        factors.ComputeFactors(context)
        meters = factors.LengthFactor() * MILLIMETER
        if factors.LengthDone() and not any(math.isclose(meters, one) for one in found):
            found.append(meters)
    if not found:
        return NO_UNIT
    meters = found[0] if len(found) == 1 else MILLIMETER
    return HeaderUnit(tuple(map(_called, found)), meters, MILLIMETER)


def iges_unit(path: Path, header: Occ) -> HeaderUnit:
    """Return the unit an IGES header (IGESData_GlobalSection) states.

    Raises
    ------
    ShellFileError
        If its flag is none that IGES has: OpenCASCADE would read everything as points.
    """
    meters = float(header.UnitValue()) * MILLIMETER
    if meters == 0.0:
        raise ShellFileError(
            path, f"states a unit of length by flag {header.UnitFlag()}, which IGES does not have"
        )
    if header.UnitFlag() == NAMED:
        return NO_UNIT
    return HeaderUnit((_called(meters),), meters, MILLIMETER)


def take_unit(
    path: Path, header: HeaderUnit, unit: str | None, size: float
) -> tuple[HeaderUnit, str, str]:
    """Return the unit that is valid, its name, and a sentence about it.

    unit : as stated, it wins over that of the header; size : of the shape [its units]

    Raises
    ------
    UnitMissing
        If neither the header nor the user states one.
    InvalidParameter
        If one is stated in place of several.
    """
    names = header.names
    if unit is None:
        if not names:
            raise UnitMissing(path, size, METERS_PER_UNIT)
        if len(names) > 1:
            note = f"units {_listed(names)} from the file's header, each for its own part"
            return header, "mm", note
        return header, names[0], f"unit '{names[0]}' from the file's header"
    stated = meters_per_unit(unit)
    if not names:
        return HeaderUnit((unit,), stated, stated), unit, ""
    if len(names) > 1:
        raise InvalidParameter(
            "unit",
            unit,
            f"cannot take the place of the {len(names)} units {_listed(names)} that {path.name} "
            "states, each for its own part: leave it out",
        )
    if math.isclose(stated, header.meters, rel_tol=SAME):
        return header, unit, f"unit '{unit}', as the file's header has it"
    # The header's factor taken back: these are the numbers of the file.
    meters = header.shape_meters / header.meters * stated
    note = (
        f"unit '{unit}' as stated, though the file's header says '{names[0]}': the surface "
        f"measures {size * meters:.4g} m, not {size * header.shape_meters:.4g} m"
    )
    warnings.warn(f"{path.name}: {note}", UnitWarning, stacklevel=2)
    return replace(header, meters=stated, shape_meters=meters), unit, note


def _called(meters: float) -> str:
    """Name of a unit, its length if it has none."""
    known = (name for name, one in METERS_PER_UNIT.items() if math.isclose(one, meters))
    return next(known, f"{meters:.9g} m")


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"'{name}'" for name in names)
