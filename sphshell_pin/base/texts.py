"""Texts: what of strangers' may be printed, what is a number, which name is free, plurals."""

import json
import math
import re
from collections.abc import Container, Mapping
from itertools import chain, count

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


_ACTS = re.compile("[\0-\b\v-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")  # the last turn the writing
_NUMBER = re.compile(r"\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*")


def visible(text: str) -> str:
    r"""Return `text` with escapes such as "\x1b" for what a terminal acts on."""
    return _ACTS.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def free_name(wanted: str, taken: Container[str], numbered: str) -> str:
    """Return `wanted`; if that is `taken`, with the first free number, as "-{}" in `numbered`."""
    names = chain([wanted], (wanted + numbered.format(k) for k in count(2)))
    return next(name for name in names if name not in taken)


def counted(number: int, noun: str) -> str:
    """Return "1 noun", "2 nouns"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def number_of(text: str) -> float:
    """Return a finite number; ValueError for all else, as 1_0, which is one in Python alone."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"'{text[:40]}' is not a finite number")
    return value
