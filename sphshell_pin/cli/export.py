"""The command export: a finished run in the formats of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.cli import common
from sphshell_pin.cli.common import command
from sphshell_pin.errors import InvalidParameter, ResultError

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene


FORMATS = ("mcap", "csv", "parquet")


@command()
def export(*, run: Path, to: str | None = None, out: Path | None = None) -> None:
    """Write a finished run as messages for Foxglove, RViz and Rerun, or as tables.

    An MCAP file has joint states, transforms, wrenches, contacts, energies and sensors as ROS 2
    messages, and needs no ROS. Tables are rows, contacts, events, energy and sensors.

    Example: sphshell-pin export results/fingertip_on_blade --to mcap

    Options
    -------
    to FORMAT : mcap (ROS 2 messages), csv or parquet (tables); by default as --out ends.
    out : The .mcap file, or the folder of the tables; by default beside the run: RUN.mcap, RUN_csv,
        RUN_parquet.
    """
    from sphshell_pin.scenario.running.replay import Replay

    if to is None:
        to = out.suffix.removeprefix(".") if out is not None else ""
    if to not in FORMATS:
        must = f"must be one of {', '.join(FORMATS)}"
        if to == "rrd":
            must += "; Rerun's viewer opens .mcap files"
        raise InvalidParameter("--to", to, must)
    if to == "mcap":
        from sphshell_pin.export.mcap import write_mcap

        replay = Replay(file_of(run))
        files = [write_mcap(out or beside(run, ".mcap"), replay.result, replay.scene)]
    else:
        from sphshell_pin.export.tables import write_tables

        place = out or beside(run, f"_{to}")
        files = write_tables(place, *with_scene(run), format=to)  # type: ignore[arg-type]
    for file in files:
        common.echo(file)


def file_of(run: Path) -> Path:
    """Return the file of a run: `run` itself, or that in the results folder `run`."""
    return run / "run.npz" if run.is_dir() else run


def beside(run: Path, ending: str) -> Path:
    """Return the path beside a run's folder, or beside its file, that has its name and `ending`."""
    if run.name == "run.npz":
        run = run.parent
    run = run if run.name else run.absolute()  # "." has no name
    named = run if run.is_dir() else run.with_suffix("")
    return named.with_name(named.name + ending)


def with_scene(run: Path) -> tuple[Result, Scene | None]:
    """Return a run and its scene; without one, say that joints have numbers instead of names."""
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.scenario.running.replay import Replay

    try:
        replay = Replay(file_of(run))
        return replay.result, replay.scene
    except ResultError as fault:
        result = Result.load(file_of(run))
        common.echo(f"warning: joints have numbers instead of names: {fault}", err=True)
        return result, None
