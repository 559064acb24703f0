"""Length units of surface files, and ADAMS contact parameters in SI.

The package uses meters, kilograms, seconds, newtons and radians. A file's unit is stated by
its user, never guessed.
"""

from sphshell_pin.errors import InvalidParameter

METERS_PER_UNIT: dict[str, float] = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 1e-3,
    "um": 1e-6,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
    "mil": 2.54e-5,
}
"""Meters in one unit of length."""

_SPELLINGS = {
    "m": "meter metre meters metres",
    "mm": "millimeter millimetre millimeters millimetres",
    "cm": "centimeter centimetre",
    "um": "micrometer micrometre micron µm",
    "in": "inch inches",
    "ft": "foot feet",
    "yd": "yard",
}
_ALIASES = {one: unit for unit, names in _SPELLINGS.items() for one in names.split()}

ADAMS_UNITS: dict[str, tuple[float, float]] = {
    "mm-N-s": (1e-3, 1.0),
    "m-N-s": (1.0, 1.0),
    "cm-N-s": (1e-2, 1.0),
    "cm-dyn-s": (1e-2, 1e-5),
    "in-lbf-s": (0.0254, 4.4482216152605),
    "ft-lbf-s": (0.3048, 4.4482216152605),
}
"""Meters per length unit and newtons per force unit of ADAMS's unit systems."""

SUSPICIOUS_RATIO = 1000.0
"""A surface this many times larger than what touches it was probably not given in meters."""


def meters_per_unit(unit: str) -> float:
    """Meters in one `unit` of length ("m", "mm", "in", ...).

    Raises InvalidParameter for an unknown unit; the message lists the valid ones.
    """
    if isinstance(unit, str):
        name = unit.strip()
        name = _ALIASES.get(name.lower(), name)
        for known in (name, name.lower()):
            if known in METERS_PER_UNIT:
                return METERS_PER_UNIT[known]
    raise InvalidParameter("unit", unit, f"must be one of: {', '.join(METERS_PER_UNIT)}")


def adams_stiffness_to_si(stiffness: float, exponent: float, units: str = "mm-N-s") -> float:
    """ADAMS stiffness K [force/length^exponent] in [N/m^exponent].

    K converts by (1 / meters per unit)^exponent, which is 1000^2.2 = 3.98e6 for ADAMS's default
    exponent in millimeters, not by 1000.
    """
    length, force = adams_units(units)
    return float(stiffness * force / length**exponent)


def adams_damping_to_si(damping: float, units: str = "mm-N-s") -> float:
    """ADAMS damping [force s/length] in [N s/m]."""
    length, force = adams_units(units)
    return damping * force / length


def adams_length_to_si(value: float, units: str = "mm-N-s") -> float:
    """ADAMS length or speed [length or length/s] in [m] or [m/s]."""
    return value * adams_units(units)[0]


def adams_units(units: str) -> tuple[float, float]:
    """Return meters per length unit and newtons per force unit of an ADAMS unit system.

    InvalidParameter for an unknown one lists the valid ones.
    """
    try:
        return ADAMS_UNITS[units]
    except (KeyError, TypeError):
        raise InvalidParameter(
            "units", units, f"must be one of: {', '.join(ADAMS_UNITS)}"
        ) from None


def size_warning(surface_size: float, reference_size: float, what: str) -> str | None:
    """Tell, in a sentence, that a surface is suspiciously large; None if it is not.

    surface_size : box diagonal of the surface [m]; reference_size : radius of the sphere or size of
    the robot [m]; what : what that is, e.g. "sphere 'tip' (radius)".
    """
    if not reference_size > 0.0 or surface_size < SUSPICIOUS_RATIO * reference_size:
        return None
    return (
        f"the surface measures {surface_size:.4g} m, {surface_size / reference_size:.3g} times the "
        f"{what} of {reference_size:.4g} m: if its file is in millimeters, load it with unit='mm' "
        f"(it then measures {surface_size * 1e-3:.4g} m)"
    )
