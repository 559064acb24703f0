"""Units of measured columns, as they stand in a header: `[mm]`, `[kN]`, `[deg/s]`."""

import math

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.units import METERS_PER_UNIT

_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}
_LENGTH = {**METERS_PER_UNIT, "µm": 1e-6}
_FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
_ANGLE = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0}

_UNITS: dict[str, dict[str, float]] = {
    "s": _TIME,
    "m": _LENGTH,
    "N": _FORCE,
    "rad": _ANGLE,
    "m/s": {f"{unit}/s": factor for unit, factor in _LENGTH.items()},
    "rad/s": {f"{unit}/s": factor for unit, factor in _ANGLE.items()} | {"rpm": math.pi / 30.0},
    "N m": {
        f"{force}{gap}{length}": _FORCE[force] * _LENGTH[length]
        for force in ("N", "mN", "kN")
        for length in ("m", "mm", "cm")
        for gap in (" ", "*", "")
    },
    "1": {"1": 1.0, "": 1.0, "%": 0.01},
}


def factor_to_si(name: str, given: str | None, unit: str) -> float:
    """Return what a value of the column `name` in the unit `given` is to be multiplied with.

    `unit` is the SI unit of the quantity; `given` is None where the header has no unit.

    Raises
    ------
    InvalidParameter
        No unit is given, or not one of this quantity; the text lists those.
    """
    known = _UNITS.get(unit or "1", {unit: 1.0})
    if given is None:
        if unit in ("", "1"):
            return 1.0
        raise InvalidParameter(
            "column", name, f"needs its unit in the header: '{name} [{unit}]'", given=f"'{name}'"
        )
    if given.strip() not in known:
        valid = [one for one in known if one]
        raise InvalidParameter(
            f"column '{name}'",
            given,
            f"must be in one of: {', '.join(valid)}",
            given=f"in [{given}]",
        )
    return known[given.strip()]
