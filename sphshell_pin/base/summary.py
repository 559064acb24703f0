"""How an object shows itself: a line or two of text, and a small table in a notebook.

Both come from one list of facts, `Summarized._facts`. By default these are the fields of the
dataclass, arrays by their shapes; a class that knows better lists what matters.
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
MOST_ROWS = 10
"""Detail of a table that a notebook shows."""
# Styles of cells.
SIDE = "text-align: left; padding: 0.1em 0.7em; border: 0"
FAINT = "font-weight: normal; opacity: 0.7"
UNDERLINED = "border: 0; border-bottom: 1px solid rgba(128, 128, 128, 0.4)"


@dataclass(frozen=True)
class Fact:
    """A figure with its unit, or a word; one that is not `brief` is shown in notebooks alone."""

    label: str
    value: object
    unit: str = ""
    brief: bool = True
    one: str = ""
    """The label of a count of one; by default the label without its last "s"."""

    @property
    def shown(self) -> str:
        """The value with its unit."""
        return f"{show_value(self.value)} {self.unit}".rstrip()

    @property
    def text(self) -> str:
        """The fact in words: a count stands before its label, another value behind it."""
        counted = isinstance(self.value, int | np.integer) and not isinstance(self.value, bool)
        if counted and not self.unit:
            one = self.one or self.label.removesuffix("s")
            return f"{self.value} {one if self.value == 1 else self.label}"
        return f"{self.label} {self.shown}".strip()


@dataclass(frozen=True)
class Detail:
    """A table below the facts, in notebooks: at most MOST_ROWS of `count` rows.

    A heading states the unit of its column: "depth [m]".
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[object]]
    count: int


class Summarized:
    """Shows itself by `_facts`, in notebooks also by `_rows`."""

    @property
    def _title(self) -> str:
        """What stands before the facts."""
        return type(self).__name__

    def _facts(self) -> Iterable[Fact]:
        """Return what is worth knowing: here the fields of the dataclass."""
        if not dataclasses.is_dataclass(self):
            return []
        values = (
            (f.name.replace("_", " "), getattr(self, f.name)) for f in dataclasses.fields(self)
        )
        return [Fact(name, value) for name, value in values if value is not None]

    def _rows(self) -> Detail | None:
        """Return the table below the facts."""
        return None

    def __repr__(self) -> str:
        """Return what is worth knowing, with units."""
        facts = ", ".join(fact.text for fact in self._facts() if fact.brief)
        whole = f"<{self._title}: {facts}>" if facts else f"<{self._title}>"
        return "\n".join(textwrap.wrap(whole, WIDTH, subsequent_indent="  "))

    def _repr_html_(self) -> str:
        """Return the same, and more, as a table; it takes its colors from the page around it."""
        from html import escape

        def row(cells: Sequence[object], head: Sequence[str] = (), style: str = FAINT) -> str:
            shown = [f'<th style="{SIDE}; {style}">{escape(one)}</th>' for one in head]
            shown += [f'<td style="{SIDE}">{escape(show_value(one))}</td>' for one in cells]
            return f'<tr style="background: none">{"".join(shown)}</tr>'

        lines = "".join(row([fact.shown], [fact.label]) for fact in self._facts())
        html = f"<b>{escape(self._title)}</b>{_table(lines)}"
        rows = self._rows()
        if rows is None or not rows.rows:
            return f"<div>{html}</div>"
        body = "".join(map(row, rows.rows[:MOST_ROWS]))
        html += _table(row([], rows.headings, UNDERLINED) + body)
        if rows.count > MOST_ROWS:
            html += f'<div style="opacity: 0.7">and {rows.count - MOST_ROWS} more</div>'
        return f"<div>{html}</div>"


def _table(lines: str) -> str:
    style = "border-collapse: collapse; margin: 0.4em 0; width: auto; color: inherit"
    return (
        f'<div style="overflow-x: auto"><table style="{style}"><tbody>{lines}</tbody></table></div>'
    )


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
