"""The table of a sweep: one row for each run, in their order; nothing in it depends on the time."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.tables import write_parquet
from sphshell_pin.errors import InvalidParameter, ResultError, SweepError
from sphshell_pin.study.sweep.grid import Axis, Value
from sphshell_pin.study.sweep.job import Outcome, need

if TYPE_CHECKING:
    import pandas as pd

    from sphshell_pin.study.sweep.plan import Plan

Columns = dict[str, NDArray[np.generic]]

HEAD = "sweep"
"""Name of the description of the sweep among the attrs of its table."""
_ATTRS = "PANDAS_ATTRS"  # where pandas looks for them
DESIGN = "design"
"""The column that says what each run of a sampled sweep is for."""
_MUST_AGREE = {
    "scenario": "another scenario",
    "files": "other contents of the files",
    "versions": "other versions of the libraries",
    "verdicts": "other columns (--verdicts)",
}


def check_place(path: Path) -> None:
    """Make the folder of a table, and prove that the table can be written and read.

    Raises
    ------
    InvalidParameter, MissingExtra, ResultError
    """
    if path.suffix.lower() != ".parquet":
        raise InvalidParameter("out", str(path), "must end in .parquet")
    need("pyarrow")
    if path.is_dir():
        raise ResultError(path, "is a folder: give another --out")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / f".{path.name}.try").touch()
        (path.parent / f".{path.name}.try").unlink()
    except OSError as fault:
        why = f"the folder cannot be written: {fault.strerror}; give another with --out"
        raise ResultError(path.parent, why) from None


def table_of(plan: Plan, outcomes: Mapping[int, Outcome]) -> pd.DataFrame:
    """Return the table of the runs that have an outcome, their numbers in order.

    Its columns are `run`, the varied keys, `status`, `error`, `design` of a sample, the figures
    (float64; NaN where a run has none; those that only some runs have, where robots or contacts
    vary, come last), and `settings`, the digest of the run's settings.
    """
    numbers = sorted(outcomes)
    rows = [outcomes[i] for i in numbers]
    others = {name for row in rows for name in row.figures} - set(plan.figures)
    columns: Columns = {"run": np.array(numbers, dtype=np.int64)}
    columns |= {
        name: values[numbers] for name, values in varied_columns(plan.axes, plan.points).items()
    }
    columns["status"] = _texts([row.status for row in rows])
    columns["error"] = _texts([row.error for row in rows])
    if plan.design is not None:
        columns[DESIGN] = _texts([plan.design.parts[i] for i in numbers])
    for name in (*plan.figures, *sorted(others)):
        columns[name] = np.array([row.figures.get(name, np.nan) for row in rows], dtype=np.float64)
    columns["settings"] = _texts([plan.digests[i] for i in numbers])
    frame: pd.DataFrame = need("pandas").DataFrame(columns)
    frame.attrs["units"] = {name: one for name, one in plan.units.items() if name in columns}
    frame.attrs[HEAD] = dict(plan.head)
    return frame


def varied_columns(axes: Sequence[Axis], points: Sequence[tuple[Value, ...]]) -> Columns:
    """Return what each run varies, (n,) by key: numbers where all values are, else texts."""
    return {axis.key: _varied([point[i] for point in points]) for i, axis in enumerate(axes)}


def varied_keys(table: pd.DataFrame) -> list[str]:
    """Return the names of the columns that were varied."""
    names = [str(name) for name in table.columns]
    return names[1 : names.index("status")]


def figures_of(table: pd.DataFrame) -> list[str]:
    """Return the figures of a table."""
    names = [str(name) for name in table.columns]
    return [name for name in names[names.index("error") + 1 :] if name not in (DESIGN, "settings")]


def main_figures(figures: Iterable[str]) -> list[str]:
    """Return those of `figures` that are shown first: the scenario's own, then the peak forces."""
    names = [str(name) for name in figures]
    own = [name for name in names if name.startswith("figures.")]
    return own + [name for name in names if name.endswith(".peak_force")]


def write_table(path: Path, table: pd.DataFrame) -> None:
    """Write the table to `path` in place of an earlier one; the same table gives the same bytes.

    Raises
    ------
    ResultError
        It cannot be written; an earlier table stays as it was.
    """
    columns = {str(name): table[name].to_numpy() for name in table.columns}
    try:
        with atomic_file(path) as file:
            write_parquet(file, columns, {_ATTRS: json.dumps(table.attrs, sort_keys=True)})
    except OSError as fault:
        raise ResultError(path, f"cannot be written: {fault.strerror or fault}") from None


def read_outcomes(path: Path, head: Mapping[str, object]) -> dict[str, Outcome]:
    """Return what the table at `path` holds, by the digests of the runs' settings.

    Raises
    ------
    ResultError
        It is no table of a sweep, or it is damaged.
    SweepError
        It is the table of a sweep that differs from `head`.
    """
    if not path.exists() or not path.stat().st_size:
        return {}
    try:
        table = need("pandas").read_parquet(path, page_checksum_verification=True)
        pairs = [(table.attrs[HEAD][name], head[name]) for name in _MUST_AGREE]
        names = figures_of(table)
        figures = table[names].to_numpy(float)
        rows = table[["run", "status", "error", "settings"]].itertuples(index=False)
        found = {
            settings: Outcome(number, status, error, dict(zip(names, own, strict=True)))
            for (number, status, error, settings), own in zip(rows, figures.tolist(), strict=True)
        }
    except (OSError, ValueError, KeyError, TypeError):  # pyarrow's faults are ValueErrors
        why = "is a file that no sweep wrote, or a damaged one: give another --out, or delete it"
        raise ResultError(path, why) from None
    for words, (old, new) in zip(_MUST_AGREE.values(), pairs, strict=True):
        # A file that only one of the two names does not matter to the runs of both.
        both = isinstance(old, dict) and isinstance(new, dict)
        if (old | new != new | old) if both else old != new:
            raise SweepError(
                f"{path} is the table of a sweep with {words}: delete it to start again, or give "
                "another --out"
            )
    return found


def _varied(values: Sequence[Value]) -> NDArray[np.generic]:
    kinds = {type(value) for value in values}
    for known, dtype in (({bool}, np.bool_), ({int}, np.int64), ({int, float}, np.float64)):
        with contextlib.suppress(OverflowError):  # whole numbers of Python have no end
            if kinds <= known:
                return np.array(values, dtype=dtype)
    return _texts([str(value) for value in values])


def _texts(values: Sequence[str]) -> NDArray[np.generic]:
    return np.array(values, dtype=object)
