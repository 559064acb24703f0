"""Tables of named columns, units in their names, and the files that hold them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

Table = Mapping[str, ArrayLike]
"""Columns of equal length by their names, such as "depth [m]"."""


def column(name: str, unit: str = "") -> str:
    """Return the name of a column that holds the quantity `name` in `unit`."""
    return f"{name} [{unit}]" if unit else name


def quantity_of(title: str) -> tuple[str, str]:
    """Return the quantity and the unit that the name of a column states, as `column` writes it."""
    name, bracket, unit = title.rpartition(" [")
    return (name, unit.removesuffix("]")) if bracket and unit.endswith("]") else (title, "")


def csv_text(table: Table) -> str:
    """Return `table` as comma-separated values, the names of the columns in the first line.

    A number is written with the digits that give it back exactly, nan as an empty cell.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(table)
    columns = (np.asarray(one).tolist() for one in table.values())
    for row in zip(*columns, strict=True):
        writer.writerow(["" if isinstance(x, float) and math.isnan(x) else x for x in row])
    return text.getvalue()
