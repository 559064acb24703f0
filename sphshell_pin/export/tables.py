"""A result as a folder of tables: rows, contacts, events, energy and sensors."""

from pathlib import Path
from typing import Literal

from sphshell_pin.base.atomic.files import write_folder
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.tables import Table, csv_text, parquet_bytes
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.scene import Scene

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
    folder: StrPath, result: Result, scene: Scene | None = None, *, format: Format = "csv"
) -> list[Path]:
    """Write the tables of `result` into `folder`, all or none; return the paths of the files.

    Numbers are read back exactly from both formats. The metadata of a .parquet file say which
    scenario ran. Tables of an earlier call are replaced.

    Raises
    ------
    MissingExtra
        "parquet" without pyarrow.
    ResultError
        The folder cannot be written.
    """
    about = {"scenario": "" if result.origin is None else result.origin.scenario}
    files = {
        f"{name}.{format}": csv_text(t).encode() if format == "csv" else parquet_bytes(t, about)
        for name, t in tables_of(result, scene).items()
    }
    return write_folder(folder, files, [f"{name}.{format}" for name in KINDS])
