"""Tables of named columns, units in their names, and the files that hold them."""

import csv
import io
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin.errors import import_extra

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

    A number is written with the digits that give it back exactly, nan as an empty cell; a text or
    name that a spreadsheet would evaluate begins with an apostrophe.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(map(_cell, table))
    columns = (np.asarray(one).tolist() for one in table.values())
    for row in zip(*columns, strict=True):
        writer.writerow(map(_cell, row))
    return text.getvalue()


# Also the wide forms, which spreadsheets take for the same.
_FORMULA = tuple("=+-@\t\r\n\uff1d\uff0b\uff0d\uff20")


def _cell(value: object) -> object:
    if isinstance(value, str):
        return f"'{value}" if value.startswith(_FORMULA) else value
    return "" if isinstance(value, float) and math.isnan(value) else value


def parquet_bytes(table: Table, metadata: Mapping[str, str]) -> bytes:
    """Return `table` as a .parquet file with `metadata`; numbers are read back exactly.

    Lists, and arrays of objects, are texts. Raises MissingExtra without pyarrow.
    """
    arrow, parquet = (
        import_extra(name, "sweep", "a .parquet file") for name in ("pyarrow", "pyarrow.parquet")
    )
    columns = {}
    for name, values in table.items():
        array = np.asarray(values)
        text = isinstance(values, list) or array.dtype == object
        # The type of an empty list would be unknown.
        columns[name] = arrow.array(array.tolist(), arrow.string()) if text else values
    whole = arrow.table(columns).replace_schema_metadata(metadata)
    file = io.BytesIO()
    parquet.write_table(whole, file, compression="zstd", write_page_checksum=True)
    return file.getvalue()
