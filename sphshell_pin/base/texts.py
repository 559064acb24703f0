"""Texts of strangers: what of them may be printed, and what is a number."""

import math
import re

_ACTS = re.compile("[\0-\b\v-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")  # the last turn the writing
_NUMBER = re.compile(r"\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*")


def visible(text: str) -> str:
    r"""Return `text` with escapes such as "\x1b" for what a terminal acts on."""
    return _ACTS.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def number_of(text: str) -> float:
    """Return a finite number; ValueError for all else, as 1_0, which is one in Python alone."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"'{text[:40]}' is not a finite number")
    return value
