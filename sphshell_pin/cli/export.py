"""The command export: a finished run in the formats of other tools."""

from __future__ import annotations

import contextlib
import shlex
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
def export(
    *,
    run: common.RunArgument,
    to: str | None = None,
    out: Path | None = None,
    start: str = "0",
    of: common.OfOption = None,
) -> None:
    """Write a finished run as messages for Foxglove, RViz and Rerun, or as tables.

    An MCAP file has joint states, transforms, wrenches, contacts, energies and sensors as ROS 2
    messages, and needs no ROS. Tables are rows, contacts, events, energy and sensors.

    Example: sphshell-pin export results/fingertip_on_blade --to mcap

    Options
    -------
    to FORMAT : mcap (ROS 2 messages), csv or parquet (tables); by default as --out ends.
    out : The .mcap file, or the folder of the tables; by default beside the run: RUN.mcap, RUN_csv,
        RUN_parquet.
    start SECONDS : Of mcap: when t = 0 was, in seconds since 1970.
    """
    from sphshell_pin.scenario.running.replay import Replay

    if to is None:
        to = out.suffix.removeprefix(".") if out is not None else ""
    if to not in FORMATS:
        must = f"must be one of {', '.join(FORMATS)}"
        if to == "rrd":
            must += "; Rerun's viewer opens .mcap files"
        raise InvalidParameter("--to", to, must)
    begin = nanoseconds(start)
    if begin and to != "mcap":
        raise InvalidParameter("--start", start, "is for --to mcap: tables have the run's own t")
    words = ["export", str(run), "--to", to]
    words += [] if out is None else ["--out", str(out)]
    words += ["--start", start] if begin else []
    words += [] if of is None else ["--scenario", of]
    command = shlex.join(["sphshell-pin", *words])
    if to == "mcap":
        from sphshell_pin.export.mcap import write_mcap

        replay, place = Replay(file_of(run), of), out or beside(run, ".mcap")
        made = write_mcap(place, replay.result, replay.scene, start=begin, command=command)
        files = [made]
    else:
        from sphshell_pin.export.tables import write_tables

        result, scene = with_scene(run, of)
        place = out or beside(run, f"_{to}")
        files = write_tables(place, result, scene, format=to, command=command)  # type: ignore[arg-type]
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


def nanoseconds(text: str) -> int:
    """Return the time that --start states, in nanoseconds since 1970."""
    from decimal import Decimal, InvalidOperation

    with contextlib.suppress(InvalidOperation):
        seconds = Decimal(text)
        # Larger ones are not written out in digits.
        if seconds.is_finite() and seconds.adjusted() <= 12:
            return round(seconds * 10**9)
    raise InvalidParameter("--start", text, "must be seconds since 1970")


def with_scene(run: Path, scenario: str | None = None) -> tuple[Result, Scene | None]:
    """Return a run and its scene; without one, say that joints have numbers instead of names."""
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.scenario.running.replay import Replay

    try:
        replay = Replay(file_of(run), scenario)
        return replay.result, replay.scene
    except ResultError as fault:
        if scenario is not None:
            raise
        result = Result.load(file_of(run))
        common.echo(f"warning: joints have numbers instead of names: {fault}", err=True)
        return result, None
