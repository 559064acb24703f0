"""Commands that build a scenario: run and explain."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from sphshell_pin.cli import common
from sphshell_pin.errors import Interrupted, SimulationDiverged

if TYPE_CHECKING:
    from sphshell_pin.scenario import RunReport


@common.command("list")
def list_(context: typer.Context) -> None:
    """List the shipped scenarios, and the robots that scenarios can name.

    Example: sphshell-pin list
    """
    from sphshell_pin.robots import OWN, names
    from sphshell_pin.scenario import read_scenario, shipped_scenarios

    table = common.make_table("scenario")
    table.add_column("what it shows")
    for name, path in shipped_scenarios().items():
        table.add_row(name, common.plain(read_scenario(path).title))
    common.terminal().print(table)
    common.say(f": {', '.join(names())}", bold="robots")
    if len(names()) == len(OWN):
        common.say("More robots: pip install 'sphshell-pin[robots]'")


# A share of the exchanged energy that no sound run loses or gains.
SUSPICIOUS_RESIDUAL = 0.05
# Rows of the table of contacts.
MOST_PAIRS = 16


@common.command()
def run(
    *,
    scenario: str,
    out: Path | None = None,
    dt: float | None = None,
    duration: float | None = None,
    recording: bool = True,
    figures: bool = True,
    compiled: bool = False,
    set_: list[str] | None = None,
    package_dir: list[Path] | None = None,
) -> None:
    """Run a scenario and write its results folder.

    Example: sphshell-pin run fingertip_on_blade --duration 2 --set controller.normal_force=8

    Options
    -------
    out : Results folder; by default results/SCENARIO.
    recording : Write recording.html.
    figures : Draw the figures.
    """
    from sphshell_pin.scenario import build, explain_built, run_built

    changes = common.changes_of(set_, dt, duration, compiled)
    built = build(scenario, changes)
    for warning in explain_built(built).warnings:
        common.echo(f"warning: {warning}", err=True)
    with common.progress_bar(
        built.name, common.PERCENT, "TimeRemainingColumn", total=1.0
    ) as update:
        report = run_built(
            built,
            out,
            recording=recording,
            figures=figures,
            progress=lambda fraction: update(completed=fraction),
        )
    _print_report(report)
    code = _exit_code(report, changed=bool(changes))
    raise typer.Exit(code)


@common.command()
def explain(
    *,
    scenario: str,
    dt: float | None = None,
    set_: list[str] | None = None,
    package_dir: list[Path] | None = None,
) -> None:
    """Say what a scenario models: time scales, expected depths, a fitting dt, warnings.

    Example: sphshell-pin explain fingertip_on_blade --dt 1e-3
    """
    from sphshell_pin.scenario import build, explain_built

    built = build(scenario, common.changes_of(set_, dt))
    common.say(f": {built.scenario.title}", bold=built.name)
    common.say(str(explain_built(built)))


def _exit_code(report: RunReport, *, changed: bool) -> int:
    if report.stopped is not None:
        hint = ""
        if isinstance(report.stopped, SimulationDiverged):
            hint = "; sphshell-pin explain, with the same --set, names a fitting dt"
        common.echo(f"{report.stopped}{hint}\npartial results are in {report.folder}", err=True)
        return common.INTERRUPTED if isinstance(report.stopped, Interrupted) else common.ERROR
    if all(verdict.met for verdict in report.verdicts):
        return 0
    if changed:
        common.echo("the scenario was changed: missed expectations are not counted", err=True)
        return 0
    return common.MISSED


def _joint_rows(report: RunReport) -> Iterator[tuple[str, ...]]:
    """Yield the joints that came to a stop, or beyond a limit."""
    for name, joint in report.result.stats.joints.items():
        cut = fast = ""
        if joint.first_cut is not None:
            cut = f"{joint.cut_time:.4g} s, first at {joint.first_cut:.4g} s"
        if joint.first_too_fast is not None:
            fast = f"{joint.peak_speed:.4g}, too fast at {joint.first_too_fast:.4g} s"
        if joint.stops or cut or fast:
            yield name, f"{joint.stops}", f"{joint.stop_time:.4g} s", cut or "-", fast or "-"


def _print_report(report: RunReport) -> None:
    from sphshell_pin.scenario.running.figures import measure_energy

    stats = report.result.stats
    common.say(f": {report.built.scenario.title}", bold=report.built.name)
    shown = sorted(stats.pairs, key=lambda name: -stats.pairs[name].peak_force)[:MOST_PAIRS]
    rows = [
        (
            name,
            f"{pair.contact_time:.4g} s",
            f"{pair.touches}",
            f"{pair.peak_force:.4g} N",
            f"{pair.mean_force:.4g} N",
            f"{pair.max_depth * 1e3:.4g} mm",
        )
        for name, pair in stats.pairs.items()
        if name in shown
    ]
    titles = ("contact", "duration", "touches", "peak force", "mean force", "largest depth")
    common.print_table(titles, rows)
    others = [pair for name, pair in stats.pairs.items() if name not in shown]
    if others:
        touched = sum(1 for pair in others if pair.touches)
        common.say(
            f"{len(others)} more contacts with smaller peak forces, of which {touched} touched: "
            "all are in summary.json"
        )
    common.print_table(
        ("joint", "stops", "stop time", "torque cut", "peak speed"), _joint_rows(report)
    )
    energy = measure_energy(report.result)
    common.say(
        f"energy residual   {energy['residual']:.3g} J, {energy['relative_residual']:.2g} of the "
        f"{energy['exchanged']:.3g} J exchanged\n"
        f"real-time factor  {stats.real_time_factor:.3g} ({stats.duration:.4g} s simulated "
        f"in {stats.wall_time:.3g} s, {stats.steps} steps of {stats.dt:g} s)"
    )
    if energy["relative_residual"] > SUSPICIOUS_RESIDUAL:
        common.echo("warning: the energy does not add up: reduce dt (see explain)", err=True)
    for warning in report.warnings:
        common.echo(f"warning: {warning}", err=True)
    marks = {True: common.colored("as expected", "green"), False: common.colored("missed", "red")}
    judged = [(v.figure, v.expected, f"{v.measured:.6g}", marks[v.met]) for v in report.verdicts]
    common.print_table(("figure", "expected", "measured", "verdict"), judged)
    common.say(f"files in {report.folder}: {', '.join(file.name for file in report.files)}")
    for note in report.notes:
        common.echo(note, err=True)
