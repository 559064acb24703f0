"""Units of measured columns, as they stand in a header: `[mm]`, `[kN]`, `[deg/s]`."""

import math

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.units import METERS_PER_UNIT

_UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "m": {**METERS_PER_UNIT, "µm": 1e-6},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0},
    "1": {"1": 1.0, "": 1.0, "%": 0.01},
}
_UNITS |= {
    f"{base}/s": {f"{unit}/s": factor for unit, factor in _UNITS[base].items()}
    for base in ("m", "rad")
}
_UNITS["rad/s"]["rpm"] = math.pi / 30.0
_UNITS["N m"] = {
    f"{force}{gap}{length}": _UNITS["N"][force] * _UNITS["m"][length]
    for force in ("N", "mN", "kN")
    for length in ("m", "mm", "cm")
    for gap in (" ", "*", "")
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
    if given is None and unit not in ("", "1"):
        must = f"needs its unit in the header: '{name} [{unit}]'"
        raise InvalidParameter("column", name, must, given=f"'{name}'")
    stated = (given or "").strip()
    if stated not in known:
        must = f"must be in one of: {', '.join(one for one in known if one)}"
        raise InvalidParameter(f"column '{name}'", given, must, given=f"in [{given}]")
    return known[stated]
