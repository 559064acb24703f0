"""How an object shows itself: a line or two of text, from a list of facts, `Summarized._facts`.

By default these are the fields of the dataclass, arrays by their shapes; a class that knows better
lists what matters.
"""

import dataclasses
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np

WIDTH = 88  # of a line of text
MOST_NAMES = 4


@dataclass(frozen=True)
class Fact:
    """A figure with its unit, or a word."""

    label: str
    value: object
    unit: str = ""
    one: str = ""
    """The label of a count of one; by default the label without its last "s"."""

    @property
    def text(self) -> str:
        """The fact in words: a count stands before its label, another value behind it."""
        counted = isinstance(self.value, int | np.integer) and not isinstance(self.value, bool)
        if counted and not self.unit:
            one = self.one or self.label.removesuffix("s")
            return f"{self.value} {one if self.value == 1 else self.label}"
        return f"{self.label} {show_value(self.value)} {self.unit}".strip()


class Summarized:
    """Shows itself by `_facts`."""

    @property
    def _title(self) -> str:
        """What stands before the facts."""
        return type(self).__name__

    def _facts(self) -> Iterable[Fact]:
        """Return what is worth knowing: here the fields of the dataclass."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}  # type: ignore[arg-type]
        return [Fact(k.replace("_", " "), one) for k, one in values.items() if one is not None]

    def __repr__(self) -> str:
        """Return what is worth knowing, with units."""
        facts = ", ".join(fact.text for fact in self._facts())
        whole = f"<{self._title}: {facts}>" if facts else f"<{self._title}>"
        return "\n".join(textwrap.wrap(whole, WIDTH, subsequent_indent="  "))


def show_value(value: object) -> str:
    """Return a value as a summary shows it: numbers in four digits, arrays by their shapes."""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, float | np.floating):
        return f"{value:.4g}" if math.isfinite(value) else "none" if math.isnan(value) else "inf"
    if isinstance(value, np.ndarray):
        if value.ndim == 1 and len(value) <= MOST_NAMES and value.dtype.kind in "if":
            return f"({', '.join(f'{one:.4g}' for one in value)})"
        return " x ".join(map(str, value.shape)) or show_value(value.item())
    if isinstance(value, str | int | np.integer | PathLike):
        return str(value)
    if isinstance(value, Summarized):
        return value._title
    if isinstance(value, Mapping):
        return names(value)
    if isinstance(value, Sequence):
        return names(value) if all(isinstance(one, str) for one in value) else str(len(value))
    return type(value).__name__ if dataclasses.is_dataclass(value) else str(value)


def names(of: Iterable[object]) -> str:
    """Return names as a list, of many the first ones: "'a', 'b', ... (12)"."""
    listed = [f"'{one}'" for one in of]
    if not listed:
        return "none"
    more = f", ... ({len(listed)})" if len(listed) > MOST_NAMES else ""
    return ", ".join(listed[:MOST_NAMES]) + more
