"""A result as a folder of tables: rows, contacts, events, energy and sensors."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Literal

from sphshell_pin.atomic import AtomicFolder, FolderInUse
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import ResultError, import_extra
from sphshell_pin.tables import Table, csv_text

Format = Literal["csv", "parquet"]

KINDS = ("rows", "contacts", "events", "energy", "sensors")
"""The tables of a run; `sensors` only of one that has some."""


def tables_of(result: Result, scene: Scene | None = None) -> dict[str, Table]:
    """Return the tables of `result` by their names; `scene` names the joints in the rows."""
    tables: dict[str, Table] = {
        "rows": result.row_columns(scene),
        "contacts": result.contact_columns(),
        "events": result.event_columns(),
        "energy": result.energy_columns(),
    }
    return tables | ({"sensors": result.sensor_columns()} if result.sensors else {})


def write_tables(
    folder: str | PathLike[str],
    result: Result,
    scene: Scene | None = None,
    *,
    format: Format = "csv",
    command: str = "",
) -> list[Path]:
    """Write the tables of `result` into `folder`, all or none; return the paths of the files.

    Numbers are read back exactly from both formats. A .parquet file also says, in its metadata,
    which scenario ran and which `command` wrote it. Tables of an earlier call are replaced.

    Raises
    ------
    MissingExtra
        "parquet" without pyarrow.
    ResultError
        The folder cannot be written.
    """
    tables = tables_of(result, scene)
    if format == "csv":
        data = {f"{name}.csv": csv_text(table).encode() for name, table in tables.items()}
    else:
        scenario = "" if result.origin is None else result.origin.scenario
        about = {"scenario": scenario, "command": command}
        data = {f"{name}.parquet": _parquet(table, about) for name, table in tables.items()}
    return write_folder(folder, data, [f"{name}.{format}" for name in KINDS])


def write_folder(
    folder: str | PathLike[str],
    files: Mapping[str, bytes] | Iterable[tuple[str, bytes]],
    every: Sequence[str],
) -> list[Path]:
    """Write `files`, names and contents, into `folder`, all or none; return their paths.

    `every` are the names of all that an earlier call may have left there, which are replaced; the
    first of them is written in any case. ResultError where the folder cannot be written.
    """
    folder = Path(folder)
    try:
        with AtomicFolder(folder, last=every[0]) as place:
            staging, names = place.staging(), []
            for name, content in files.items() if isinstance(files, Mapping) else files:
                (staging / name).write_bytes(content)
                names.append(name)
            place.replace(staging, every)
    except FolderInUse as busy:
        raise ResultError(folder, f"{busy}: wait until it ends, or give another folder") from None
    except OSError as error:
        raise ResultError(folder, f"cannot be written: {error.strerror or error}") from error
    return [folder / name for name in names]


def _parquet(table: Table, about: dict[str, str]) -> bytes:
    pyarrow = import_extra("pyarrow", "sweep", "a .parquet file")
    parquet = import_extra("pyarrow.parquet", "sweep", "a .parquet file")
    text = pyarrow.string()  # of an empty list it would be unknown
    columns = {
        name: pyarrow.array(one, text if isinstance(one, list) else None)
        for name, one in table.items()
    }
    whole = pyarrow.table(columns).replace_schema_metadata({"sphshell_pin": json.dumps(about)})
    stream = io.BytesIO()
    parquet.write_table(whole, stream, compression="zstd")
    return stream.getvalue()
