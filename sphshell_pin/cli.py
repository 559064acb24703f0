"""The command line: parses, calls, prints. Heavy imports wait inside the commands."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from sphshell_pin.scenario import RunReport

app = typer.Typer(
    name="sphshell-pin",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

# Exit codes: 1 an expectation was missed, 2 an error, 130 interrupted (as shells have it).
MISSED, ERROR, INTERRUPTED = 1, 2, 130
# A share of the exchanged energy that no sound run loses or gains.
SUSPICIOUS_RESIDUAL = 0.05

ScenarioArgument = Annotated[
    str, typer.Argument(help="Name of a shipped scenario, or path of a .toml file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value; may be given several times."),
]
DtOption = Annotated[float | None, typer.Option(help="Time step \\[s] in place of run.dt.")]


@app.callback()
def options(
    context: typer.Context,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
) -> None:
    """Exact contact of spheres with CAD surfaces, for Pinocchio's robots.

    Example: sphshell-pin run fingertip_on_blade
    """
    context.obj = debug


@app.command()
def run(
    *,
    context: typer.Context,
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None, typer.Option(help="Results folder.", show_default="results/<scenario>")
    ] = None,
    dt: DtOption = None,
    duration: Annotated[
        float | None, typer.Option(help="Time to simulate \\[s] in place of run.duration.")
    ] = None,
    recording: Annotated[
        bool, typer.Option("--recording/--no-recording", help="Write recording.html.")
    ] = True,
    set_: SetOption = None,
) -> None:
    """Run a scenario and write its results folder.

    Example: sphshell-pin run fingertip_on_blade --duration 2 --set controller.normal_force=8
    """
    with _faults(context):
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        from sphshell_pin.scenario import build, explain_built, run_built

        changes = _changes(set_, dt, duration)
        built = build(scenario, changes)
        bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeRemainingColumn(),
            console=_console(err=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )
        for warning in explain_built(built).warnings:
            typer.echo(f"warning: {warning}", err=True)
        with bar:
            task = bar.add_task(built.name, total=1.0)
            report = run_built(
                built,
                out,
                recording=recording,
                progress=lambda fraction: bar.update(task, completed=fraction),
            )
        _print_report(report)
        code = _exit_code(report, changed=bool(changes))
    raise typer.Exit(code)


@app.command()
def explain(
    context: typer.Context, scenario: ScenarioArgument, dt: DtOption = None, set_: SetOption = None
) -> None:
    """Say what a scenario models: time scales, expected depths, a fitting dt, warnings.

    Example: sphshell-pin explain fingertip_on_blade --dt 1e-3
    """
    with _faults(context):
        from sphshell_pin.scenario import build, explain_built

        built = build(scenario, _changes(set_, dt, None))
        console = _console()
        console.print(f"[bold]{built.name}[/bold]: {_plain(built.scenario.title)}")
        console.print(str(explain_built(built)), markup=False, highlight=False)


@app.command()
def check(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A surface file: .stl .obj .ply .off .shl")],
    unit: Annotated[
        str | None, typer.Option(help="Length unit of the file: mm, cm, m, inch, ...")
    ] = None,
    side: Annotated[
        str, typer.Option(help="Where spheres may be: both, outside, inside.")
    ] = "both",
    scale: Annotated[
        str | None,
        typer.Option(help="Use of the SCALE of a .shl file: apply, ignore, or a number instead."),
    ] = None,
) -> None:
    """Print the health of a surface file: what was found in it, and what was repaired.

    Example: sphshell-pin check blade.stl --unit mm
    """
    with _faults(context):
        from sphshell_pin import Shell
        from sphshell_pin.errors import SphshellError, UnitMissing

        try:
            shell = Shell.from_file(file, unit, _number_or_word(scale), side=_side(side))
        except UnitMissing as error:
            raise SphshellError(f"the unit {error.must('--unit {}')}") from error
        _console().print(str(shell.health), markup=False, highlight=False)


@app.command("list")
def list_(context: typer.Context) -> None:
    """List the shipped scenarios, and the robots that scenarios can name.

    Example: sphshell-pin list
    """
    with _faults(context):
        import importlib

        from sphshell_pin.scenario import read_scenario, shipped_scenarios

        robots = importlib.import_module("sphshell_pin.robots")
        console = _console()
        table = _table("scenario")
        table.add_column("what it shows")
        for name, path in shipped_scenarios().items():
            table.add_row(name, _plain(read_scenario(path).title))
        console.print(table)
        console.print(f"[bold]robots[/bold]: {', '.join(robots.names())}", highlight=False)
        if len(robots.names()) == len(robots.OWN):
            console.print("More robots: pip install 'sphshell-pin\\[robots]'", highlight=False)


def main() -> None:
    """Run the command line."""
    app()


@contextlib.contextmanager
def _faults(context: typer.Context) -> Iterator[None]:
    """Turn faults into one sentence on stderr and an exit code, unless --debug asks for more."""
    debug = bool(context.find_root().obj)
    try:
        yield
    except (typer.Exit, typer.Abort):
        raise
    except KeyboardInterrupt as error:
        typer.echo(f"interrupted{f': {error}' if str(error) else ''}", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except Exception as error:
        from sphshell_pin.errors import SphshellError

        if debug:
            raise
        known = isinstance(error, SphshellError)
        # Any other fault is a defect, or comes from the user's routines: say where to look.
        told = str(error) if known else f"{type(error).__name__}: {error}"
        told = ", ".join([told, *getattr(error, "__notes__", ())])
        typer.echo(f"error: {told}{'' if known else ' (see it with --debug)'}", err=True)
        raise typer.Exit(ERROR) from None


def _changes(set_: list[str] | None, dt: float | None, duration: float | None) -> dict[str, str]:
    from sphshell_pin.errors import InvalidParameter

    changes: dict[str, str] = {}
    for one in set_ or []:
        key, equals, value = one.partition("=")
        if not equals or not key:
            raise InvalidParameter("--set", one, "must be KEY=VALUE, for instance run.dt=1e-4")
        changes[key.strip()] = value.strip()
    if dt is not None:
        changes["run.dt"] = repr(dt)
    if duration is not None:
        changes["run.duration"] = repr(duration)
    return changes


def _number_or_word(text: str | None) -> str | float | None:
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def _side(side: str) -> Any:
    from sphshell_pin.errors import InvalidParameter

    if side not in ("both", "outside", "inside"):
        raise InvalidParameter("--side", side, "must be both, outside or inside")
    return side


def _exit_code(report: RunReport, *, changed: bool) -> int:
    from sphshell_pin.errors import Interrupted, SimulationDiverged

    if report.stopped is not None:
        hint = ""
        if isinstance(report.stopped, SimulationDiverged):
            hint = "; sphshell-pin explain, with the same --set, names a fitting dt"
        typer.echo(f"{report.stopped}{hint}\npartial results are in {report.folder}", err=True)
        return INTERRUPTED if isinstance(report.stopped, Interrupted) else ERROR
    if all(verdict.met for verdict in report.verdicts):
        return 0
    if changed:
        typer.echo("the scenario was changed: missed expectations are not counted", err=True)
        return 0
    return MISSED


def _print_report(report: RunReport) -> None:
    from sphshell_pin.scenario.figures import measure_energy

    console = _console()
    stats, title = report.result.stats, report.built.scenario.title
    console.print(f"[bold]{report.built.name}[/bold]: {_plain(title)}", highlight=False)
    table = _table("contact", "duration", "touches", "peak force", "mean force", "largest depth")
    for name, pair in stats["pairs"].items():
        table.add_row(
            _plain(name),
            f"{pair['contact_time']:.4g} s",
            f"{pair['touches']}",
            f"{pair['peak_force']:.4g} N",
            f"{pair['mean_force']:.4g} N",
            f"{pair['max_depth'] * 1e3:.4g} mm",
        )
    console.print(table)
    energy = measure_energy(report.result)
    console.print(
        f"energy residual   {energy['residual']:.3g} J, {energy['relative_residual']:.2g} of the "
        f"{energy['exchanged']:.3g} J exchanged\n"
        f"real-time factor  {stats['real_time_factor']:.3g} ({stats['duration']:.4g} s simulated "
        f"in {stats['wall_time']:.3g} s, {stats['steps']} steps of {stats['dt']:g} s)",
        highlight=False,
    )
    if energy["relative_residual"] > SUSPICIOUS_RESIDUAL:
        typer.echo("warning: the energy does not add up: reduce dt (see explain)", err=True)
    if report.verdicts:
        expected = _table("figure", "expected", "measured", "verdict")
        for verdict in report.verdicts:
            mark = "[green]as expected[/green]" if verdict.met else "[red]missed[/red]"
            measured = f"{verdict.measured:.6g}"
            expected.add_row(_plain(verdict.figure), verdict.expected, measured, mark)
        console.print(expected)
    names = ", ".join(file.name for file in report.files)
    console.print(f"files in {report.folder}: {names}", markup=False, highlight=False)
    for note in report.notes:
        typer.echo(note, err=True)


def _table(*columns: str) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for i, column in enumerate(columns):
        table.add_column(column, overflow="fold", justify="left" if i == 0 else "right")
    return table


def _console(*, err: bool = False) -> Any:
    from rich.console import Console

    # A pipe has no width of its own: tables would fold at 80 columns.
    stream = sys.stderr if err else sys.stdout
    return Console(stderr=err, soft_wrap=not err, width=None if stream.isatty() else 120)


def _plain(text: str) -> str:
    """Return `text` so that rich prints its brackets as they are."""
    from rich.markup import escape

    return escape(text)
