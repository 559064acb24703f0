"""Commands that build a scenario: run and explain."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli.app import (
    ERROR,
    INTERRUPTED,
    MISSED,
    PERCENT,
    CompiledOption,
    DtOption,
    DurationOption,
    PackageDirOption,
    ScenarioArgument,
    SetOption,
    changes_of,
    colored,
    command,
    echo,
    option,
    print_table,
    progress_bar,
    say,
)
from sphshell_pin.errors import Interrupted, SimulationDiverged

if TYPE_CHECKING:
    from sphshell_pin.scenario import RunReport

# A share of the exchanged energy that no sound run loses or gains.
SUSPICIOUS_RESIDUAL = 0.05
# Rows of the table of contacts.
MOST_PAIRS = 16


@command()
def run(
    *,
    scenario: ScenarioArgument,
    out: Annotated[Path | None, option("Results folder; by default results/SCENARIO.")] = None,
    dt: DtOption = None,
    duration: DurationOption = None,
    recording: Annotated[
        bool, option("Write recording.html.", "--recording/--no-recording")
    ] = True,
    figures: Annotated[bool, option("Draw the figures.", "--figures/--no-figures")] = True,
    audit_cad: Annotated[
        bool,
        option(
            "Compare every contact with that on the exact faces of the CAD file.", "--audit-cad"
        ),
    ] = False,
    compiled: CompiledOption = False,
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
) -> None:
    """Run a scenario and write its results folder.

    Example: sphshell-pin run fingertip_on_blade --duration 2 --set controller.normal_force=8
    """
    from sphshell_pin.scenario import build, explain_built, run_built

    changes = changes_of(set_, dt, duration, compiled)
    built = build(scenario, changes)
    for warning in explain_built(built).warnings:
        echo(f"warning: {warning}", err=True)
    with progress_bar(built.name, PERCENT, "TimeRemainingColumn", total=1.0) as update:
        report = run_built(
            built,
            out,
            recording=recording,
            figures=figures,
            audit_cad=audit_cad,
            progress=lambda fraction: update(completed=fraction),
        )
    _print_report(report)
    code = _exit_code(report, changed=bool(changes))
    raise typer.Exit(code)


@command()
def explain(
    scenario: ScenarioArgument,
    dt: DtOption = None,
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
) -> None:
    """Say what a scenario models: time scales, expected depths, a fitting dt, warnings.

    Example: sphshell-pin explain fingertip_on_blade --dt 1e-3
    """
    from sphshell_pin.scenario import build, explain_built

    built = build(scenario, changes_of(set_, dt))
    say(f": {built.scenario.title}", bold=built.name)
    say(str(explain_built(built)))


def _exit_code(report: RunReport, *, changed: bool) -> int:
    if report.stopped is not None:
        hint = ""
        if isinstance(report.stopped, SimulationDiverged):
            hint = "; sphshell-pin explain, with the same --set, names a fitting dt"
        echo(f"{report.stopped}{hint}\npartial results are in {report.folder}", err=True)
        return INTERRUPTED if isinstance(report.stopped, Interrupted) else ERROR
    if all(verdict.met for verdict in report.verdicts):
        return 0
    if changed:
        echo("the scenario was changed: missed expectations are not counted", err=True)
        return 0
    return MISSED


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
    say(f": {report.built.scenario.title}", bold=report.built.name)
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
    print_table(titles, rows)
    others = [pair for name, pair in stats.pairs.items() if name not in shown]
    if others:
        touched = sum(1 for pair in others if pair.touches)
        say(
            f"{len(others)} more contacts with smaller peak forces, of which {touched} touched: "
            "all are in summary.json"
        )
    print_table(("joint", "stops", "stop time", "torque cut", "peak speed"), _joint_rows(report))
    energy = measure_energy(report.result)
    say(
        f"energy residual   {energy['residual']:.3g} J, {energy['relative_residual']:.2g} of the "
        f"{energy['exchanged']:.3g} J exchanged\n"
        f"real-time factor  {stats.real_time_factor:.3g} ({stats.duration:.4g} s simulated "
        f"in {stats.wall_time:.3g} s, {stats.steps} steps of {stats.dt:g} s)"
    )
    if energy["relative_residual"] > SUSPICIOUS_RESIDUAL:
        echo("warning: the energy does not add up: reduce dt (see explain)", err=True)
    for warning in report.warnings:
        echo(f"warning: {warning}", err=True)
    if report.audit is not None:
        audited = [
            (
                one.name,
                f"{one.contacts}",
                f"{one.unmatched}",
                f"{one.depth_largest:.3g} m",
                f"{one.depth_rms:.3g} m",
                f"{one.normal_largest:.3g} rad",
                f"{one.normal_rms:.3g} rad",
            )
            for one in report.audit.pairs
        ]
        say("contacts beside those on the exact CAD faces, largest and rms difference")
        heads = ("contact", "recorded", "on no face", "depth off", "rms", "normal off", "rms")
        print_table(heads, audited)
    marks = {True: colored("as expected", "green"), False: colored("missed", "red")}
    judged = [(v.figure, v.expected, f"{v.measured:.6g}", marks[v.met]) for v in report.verdicts]
    print_table(("figure", "expected", "measured", "verdict"), judged)
    say(f"files in {report.folder}: {', '.join(file.name for file in report.files)}")
    for note in report.notes:
        echo(note, err=True)
