"""How an uncertain number is distributed: texts such as "normal(1e5,1e4)", or those of scipy."""

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from sphshell_pin.base.checks import stated_pairs
from sphshell_pin.errors import InvalidParameter, import_extra

Frozen: TypeAlias = Any
"""A distribution of scipy.stats with its parameters, which has no types."""
Dist = Mapping[str, "str | Frozen"]

FORMS = "normal(mean,deviation), uniform(low,high), lognormal(median,factor)"
_CALL = re.compile(r"\s*(\w+)\s*\(([^(),]*),([^(),]*)\)\s*")


def distributions_of(dist: Dist | Iterable[str]) -> dict[str, Frozen]:
    """Return scipy's distributions by key, of a mapping or of texts "KEY=normal(1e5,1e4)".

    Raises
    ------
    InvalidParameter
        A text that is no distribution, values that it cannot have, or a key given twice.
    MissingExtra
        scipy is not installed.
    """
    if not isinstance(dist, Iterable):
        raise InvalidParameter("dist", dist, "must map keys to distributions")
    found: dict[str, Frozen] = {}
    for key, given in stated_pairs("dist", dist, f"must be KEY=DISTRIBUTION, one of {FORMS}"):
        if key in found:
            raise InvalidParameter("dist", key, "is given twice: leave one of the two out")
        found[key] = given if hasattr(given, "ppf") else _parse(key, given)
    if not found:
        raise InvalidParameter(
            "dist", {}, f"what is uncertain: a key with one of {FORMS}", "must say"
        )
    return found


def _parse(key: str, text: object) -> Frozen:
    call = _CALL.fullmatch(text) if isinstance(text, str) else None
    stats, made = import_extra("scipy.stats", "sweep", "a sweep"), None
    try:
        kind, a, b = (call[1].lower(), float(call[2]), float(call[3])) if call else ("", 0.0, 0.0)
    except ValueError:
        kind = ""
    if kind == "normal":
        must, valid = "deviation > 0", b > 0
        made = stats.norm(a, b)
    elif kind == "uniform":
        must, valid = "low < high", a < b
        made = stats.uniform(a, b - a)
    elif kind == "lognormal":
        must, valid = "median > 0, factor > 1", a > 0 and b > 1
        made = stats.lognorm(math.log(b) if valid else 1.0, scale=a)
    if made is None:
        raise InvalidParameter(f"dist {key}", text, f"must be one of {FORMS}")
    if not valid:
        raise InvalidParameter(f"dist {key}", text, f"must have {must}")
    return made
