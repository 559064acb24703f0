"""The table of a sweep: one row for each run, in their order; nothing in it depends on the time."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.tables import write_parquet
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.study.sweep.grid import Axis, Value
from sphshell_pin.study.sweep.job import Outcome, need

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, NDArray[np.generic]]

PARQUET = (".parquet", ".pq")
HDF5 = (".h5", ".hdf5")
DATASET = "sweep"
"""Name of the dataset in an HDF5 file, and of the description in either kind of file."""


_ATTRS = "PANDAS_ATTRS"  # where pandas looks for them

DESIGN = "design"
"""The column that says what each run of a sampled sweep is for."""


def check_suffix(path: Path) -> None:
    """Refuse a file whose kind is not known, and one that an optional package is missing for.

    Raises
    ------
    InvalidParameter, MissingExtra
    """
    suffix = path.suffix.lower()
    if suffix not in PARQUET + HDF5:
        raise InvalidParameter("out", str(path), "must end in .parquet or .h5")
    need("pyarrow" if suffix in PARQUET else "h5py")


def check_place(path: Path) -> None:
    """Refuse a folder, and a file that no sweep wrote: a table would take its place.

    Raises
    ------
    ResultError
    """
    if path.is_dir():
        raise ResultError(path, "is a folder: give another --out")
    if path.is_file() and path.stat().st_size and not _is_table(path):
        raise ResultError(path, "is a file that no sweep wrote: give another --out, or delete it")


def columns_of(
    axes: Sequence[Axis],
    points: Sequence[tuple[Value, ...]],
    digests: Sequence[str],
    outcomes: Mapping[int, Outcome],
    figures: Sequence[str],
    design: Sequence[str] = (),
) -> Columns:
    """Return the columns of the table by name, each (n,) for n runs.

    They are `run`, the varied keys, `status`, `error`, `design` if it is given, the figures
    (float64; NaN where a run has none), and `settings`, the digest of the run's settings. Columns
    of `figures` come first, then those that only some runs have (where robots or contacts vary).
    """
    rows = [outcomes[i] for i in range(len(points))]
    names = list(dict.fromkeys([*figures, *(name for row in rows for name in row.figures)]))
    columns: Columns = {"run": np.arange(len(points), dtype=np.int64)}
    columns |= varied_columns(axes, points)
    columns["status"] = _texts([row.status for row in rows])
    columns["error"] = _texts([row.error for row in rows])
    if design:
        columns[DESIGN] = _texts(design)
    for name in names:
        columns[name] = np.array([row.figures.get(name, np.nan) for row in rows], dtype=np.float64)
    columns["settings"] = _texts(digests)
    return columns


def varied_columns(axes: Sequence[Axis], points: Sequence[tuple[Value, ...]]) -> Columns:
    """Return what each run varies, (n,) by key: numbers where all values are, else texts."""
    return {axis.key: _varied([point[i] for point in points]) for i, axis in enumerate(axes)}


def varied_keys(table: pd.DataFrame) -> list[str]:
    """Return the names of the columns that were varied."""
    names = [str(name) for name in table.columns]
    return names[1 : names.index("status")]


def main_figures(figures: Iterable[str]) -> list[str]:
    """Return those of `figures` that are shown first: the scenario's own, then the peak forces."""
    names = [str(name) for name in figures]
    own = [name for name in names if name.startswith("figures.")]
    return own + [name for name in names if name.endswith(".peak_force")]


def frame_of(columns: Columns, units: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Return the table as a pandas.DataFrame; the `units` of columns are its attrs["units"]."""
    frame: pd.DataFrame = need("pandas").DataFrame(columns)
    if units:
        frame.attrs["units"] = {name: unit for name, unit in units.items() if name in columns}
    return frame


def write_table(
    path: Path,
    columns: Columns,
    description: Mapping[str, object],
    units: Mapping[str, str] | None = None,
) -> None:
    """Write the table to `path`, Parquet or HDF5 by its suffix, in place of an earlier one.

    pandas reads the `units` of a Parquet file as attrs["units"].

    The same columns and description give the same bytes.

    Raises
    ------
    ResultError
        It cannot be written; an earlier table stays as it was.
    """
    text = json.dumps(description, sort_keys=True)
    known = {name: unit for name, unit in sorted((units or {}).items()) if name in columns}
    try:
        with atomic_file(path) as file:
            if path.suffix.lower() in PARQUET:
                about = {_ATTRS: json.dumps({"units": known})} if known else {}
                write_parquet(file, columns, {DATASET: text} | about)
            else:
                _write_hdf5(file, columns, text, known)
    except OSError as fault:
        raise ResultError(path, f"cannot be written: {fault.strerror or fault}") from None


def _is_table(path: Path) -> bool:
    """Whether the file has the description that write_table leaves."""
    try:
        if path.suffix.lower() in PARQUET:
            return DATASET.encode() in (need("pyarrow.parquet").read_schema(path).metadata or {})
        with need("h5py").File(path) as file:
            return DATASET in file and "description" in file[DATASET].attrs
    except (OSError, ValueError):  # pyarrow's faults are ValueErrors
        return False


def _write_hdf5(
    file: IO[bytes], columns: Columns, description: str, units: Mapping[str, str]
) -> None:
    h5py = need("h5py")
    # One array of records: a column's name may hold the slash that would make it a folder.
    encoded: list[NDArray[np.generic]] = []
    kinds = []
    for values in columns.values():
        if values.dtype == object:
            # Texts have a fixed length: texts elsewhere in the file would leave gaps of unknown
            # bytes.
            encoded.append(np.array([one.encode() for one in values], dtype=np.bytes_))
            kinds.append(h5py.string_dtype("utf-8", max(encoded[-1].dtype.itemsize, 1)))
        else:
            encoded.append(values)
            kinds.append(values.dtype)
    records = np.rec.fromarrays(encoded, dtype=list(zip(columns, kinds, strict=True)))
    with h5py.File(file, "w") as table:
        dataset = table.create_dataset(DATASET, data=records, track_times=False)
        dataset.attrs["description"] = description
        if units:
            dataset.attrs["units"] = json.dumps(units)


def _varied(values: Sequence[Value]) -> NDArray[np.generic]:
    kinds = {type(value) for value in values}
    for known, dtype in (({bool}, np.bool_), ({int}, np.int64), ({int, float}, np.float64)):
        with contextlib.suppress(OverflowError):  # whole numbers of Python have no end
            if kinds <= known:
                return np.array(values, dtype=dtype)
    return _texts([str(value) for value in values])


def _texts(values: Sequence[str]) -> NDArray[np.generic]:
    return np.array(values, dtype=object)
