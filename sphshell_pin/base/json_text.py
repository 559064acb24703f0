"""Values as JSON, which has no infinity and no nan: null stands for them."""

import json
import math
from collections.abc import Mapping

import numpy as np


def plain(value: object, digits: int | None = None) -> object:
    """Return `value` made of what JSON knows, numbers with at most so many `digits` if given.

    Of other objects than numbers, arrays, mappings, lists and tuples it is the text.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        return value if digits is None else float(f"{value:.{digits}g}")
    if isinstance(value, Mapping):
        return {str(key): plain(one, digits) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one, digits) for one in value]
    return value if value is None or isinstance(value, str | int) else str(value)


def json_text(value: object, indent: int = 1, *, ensure_ascii: bool = True) -> str:
    """Return `value` as lines of JSON; options as of `json.dumps`."""
    text = json.dumps(plain(value), indent=indent, ensure_ascii=ensure_ascii, allow_nan=False)
    return text + "\n"
