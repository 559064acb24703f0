"""CPU time against error of every integrator.

Every integrator with many steps or tolerances, CPU seconds per simulated second against the largest
error at any instant. Three cases have a closed form: a ball that bobs on a spring without leaving
it (order of convergence), one that bounces five times (touches and lift-offs), and one that glides
on a plate so stiff and damped that an explicit method is bound to steps of 1e-5 s by a motion that
has long died out. The others are judged by a much finer run of a method of another kind: a ball
that swings in a bowl of curved elements, a Panda that slides a steel ball on steel, a block that
sticks and slips on a belt.
"""

import math
import time
from dataclasses import astuple, dataclass, replace

import numpy as np

from sphshell_pin.dynamics import Result
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.errors import SimulationDiverged
from sphshell_pin.study.report import closed_forms, drawing, swing
from sphshell_pin.study.report.contents import (
    TIMES,
    Finding,
    Picture,
    Progress,
    Section,
    Table,
    Value,
    about,
    columns,
)
from sphshell_pin.study.report.motions import Case, Judge, bowl, press, stick_slip
from sphshell_pin.study.report.timing import part, silent

KEY, TITLE = "integrators", "Work and precision of the integrators"
COLORS = {
    "SemiImplicitEuler": (drawing.ORANGE, "^", "semi-implicit"),
    "LinearlyImplicitEuler": (drawing.RED, "v", "linearly implicit"),
    "RungeKutta4": (drawing.GREEN, "s", "Runge-Kutta 4"),
    "Adaptive": (drawing.BLUE, "o", "adaptive"),
    "Implicit": (drawing.VIOLET, "D", "implicit"),
}
LARGEST_DRAWN = 0.3
EXPLICIT = ("SemiImplicitEuler", "RungeKutta4", "Adaptive")
ERRORS = (1e-2, 1e-4, 1e-6)
TEXT = about(__doc__)
LONG = 0.5  # [s]: runs that take longer are made once


@dataclass(frozen=True)
class Row:
    """One setting of one integrator: error, CPU s and force evaluations per simulated second."""

    case: str
    integrator: str
    setting: str
    error: float
    cpu: float
    evaluations: float
    steps: int
    rejected: int


def setting_of(integrator: Integrator) -> str:
    """Return the step or the tolerance of an integrator in words."""
    rtol, dt = (getattr(integrator, name, None) for name in ("rtol", "dt"))
    return f"dt {dt:.1e} s" if rtol is None else f"rtol {rtol:.1e}"


def cpu_of(
    case: Case, integrator: Integrator, duration: float | None = None
) -> tuple[float, Result]:
    """Run; return the CPU time [s] and the result."""
    before = time.process_time()
    result = case.run(integrator, duration)
    return time.process_time() - before, result


def measure(case: Case, judge: Judge, rounds: int, progress: Progress = silent) -> list[Row]:
    """Run every setting; a setting that diverges has no row."""
    # What a run of nothing takes: a second that is simulated costs the rest.
    setup = float(np.median([cpu_of(case, case.integrators[0], 0.0)[0] for _ in range(5)]))
    times: dict[Integrator, list[float]] = {}
    rows: dict[Integrator, Row] = {}
    for turn in range(rounds):
        for k, integrator in enumerate(case.integrators):
            progress((turn + k / len(case.integrators)) / rounds)
            if turn > 0 and (integrator not in rows or times[integrator][0] > LONG):
                continue
            try:
                spent, result = cpu_of(case, integrator)
            except SimulationDiverged:
                continue
            times.setdefault(integrator, []).append(spent)
            if turn == 0:
                stats = result.stats
                rows[integrator] = Row(
                    case=case.name,
                    integrator=type(integrator).__name__,
                    setting=setting_of(integrator),
                    error=judge.error(integrator, result),
                    cpu=math.nan,
                    evaluations=stats.evaluations / case.duration,
                    steps=stats.steps,
                    rejected=stats.rejected,
                )
    return [
        replace(row, cpu=max(float(np.median(times[i])) - setup, 0.0) / case.duration)
        for i, row in rows.items()
    ]


def thinned(case: Case) -> Case:
    """Return the case with the settings of --quick."""
    kept = [
        i
        for i in case.integrators
        if getattr(i, "dt", 1.0) >= case.quick_dt and getattr(i, "rtol", 1.0) > 0.9e-6
    ]
    return replace(case, integrators=tuple(kept))


def section(*, quick: bool, progress: Progress) -> Section:
    """Measure and return the section."""
    known = [closed_forms.bob(), closed_forms.bounces(), closed_forms.glide(), bowl()]
    if not quick:
        known += [press(), stick_slip()]
    judges = [Judge(case) for case in known]
    rows, cases = [], []
    for k, judge in enumerate(judges):
        case = thinned(judge.case) if quick else judge.case
        cases.append(case)
        share = part(progress, 0.9 * k / len(judges), 0.9 * (k + 1) / len(judges))
        rows += measure(case, judge, 1 if quick else 3, share)
    swings = swing.measure(swing.mesh_scene(swing.bowl(0.15)), swing.reference_period())
    progress(1.0)
    notes = ["The Panda, the block and the finest settings were left out (--quick)."]
    return assemble(cases, rows, swings, notes if quick else [])


def assemble(
    cases: list[Case], rows: list[Row], swings: swing.Row, notes: list[str] | None = None
) -> Section:
    """Return the section of what was measured."""
    tables = [costs_table(cases, rows), rows_table(rows)]
    drawn_now = [picture(cases, rows)]
    return Section(KEY, TITLE, TEXT, findings_of(rows, swings), drawn_now, tables, notes or [])


def cheapest(rows: list[Row], case: str, integrators: tuple[str, ...], error: float) -> float:
    """Return the least CPU time per simulated second of a setting with at most this error."""
    fit = (r for r in rows if r.case == case and r.integrator in integrators)
    return min((r.cpu for r in fit if r.error <= error), default=math.nan)


def findings_of(rows: list[Row], swings: swing.Row) -> list[Finding]:
    """Return the figures of the section."""
    stiff = cheapest(rows, "glide", EXPLICIT, 1e-4) / cheapest(rows, "glide", ("Implicit",), 1e-4)
    bounce = [r.error for r in rows if (r.case, r.integrator) == ("bounces", "Implicit")]
    period = "frictionless bowl swing, h / r = 0.15, 8 azimuths, 4 periods: error of the period"
    energy = "the same: largest change of energy / energy of the swing"
    cost = "stiff contact, error 1e-4: CPU time of the best explicit method / Implicit"
    least = "five bounces on a spring: least error reached"
    return [
        Finding("swing_period", period, swings.rms, aim=5e-7, headline=True),
        Finding("swing_energy", energy, swings.energy, aim=1e-6),
        Finding("stiff_cost", cost, stiff, TIMES, headline=True),
        Finding("bounces_error", least, min(bounce, default=math.nan)),
    ]


def costs_table(cases: list[Case], rows: list[Row]) -> Table:
    """Return what an error costs: the cheapest setting of each integrator."""
    cells: list[list[Value]] = [
        [case.title, name, *(cheapest(rows, case.name, (name,), error) for error in ERRORS)]
        for case in cases
        for name in COLORS
    ]
    errors = (f"cpu_at_{error:.0e}: error {drawing.power_of_ten(error)}" for error in ERRORS)
    return Table(
        "integrators_costs",
        "CPU seconds per simulated second of the cheapest setting with at most this error; a "
        "dash where no setting that was tried gets there.",
        columns("case", "integrator", *errors),
        cells,
    )


def rows_table(rows: list[Row]) -> Table:
    """Return every setting."""
    return Table(
        "integrators",
        "All settings.",
        columns(
            "case; integrator; setting; error; cpu_s_per_s: CPU s/s; evaluations_per_s: "
            "evaluations / s; steps; rejected"
        ),
        [astuple(row) for row in rows],
        folded=True,
    )


def picture(cases: list[Case], rows: list[Row]) -> Picture:
    """Draw cost against error, one panel per case."""
    lines = -(-len(cases) // 2)
    with drawing.canvas(7.8, 2.75 * lines) as figure:
        figure.set_layout_engine("constrained", h_pad=0.12)
        panels = figure.subplots(lines, 2, sharey=True, squeeze=False).ravel()
        for axis, case in zip(panels, cases, strict=False):
            drawing.logarithmic(axis, every=(2, 1))
            axis.set_title(case.title)
            axis.set_xlabel(case.judged, fontsize=drawing.SMALL)
            for name, (color, marker, _) in COLORS.items():
                found = drawn(rows, case, name)
                axis.plot(
                    [r.error for r in found], [r.cpu for r in found], color=color, marker=marker
                )
            axis.axhline(1.0, color=drawing.FAINT, linewidth=0.8, linestyle=drawing.DASHED)
            axis.invert_xaxis()
        drawing.guide(panels[0], (1e-4, 1.5e-3), 1e-7, -0.25, "order 4")
        panels[0].annotate(
            "real time", (0.99, 1.0), xycoords=("axes fraction", "data"), xytext=(0, 3),
            textcoords="offset points", color=drawing.FAINT, fontsize=drawing.SMALL, ha="right",
        )  # fmt: skip
        for axis, case in zip(panels, cases, strict=False):  # now that all have their limits
            ends = []
            for name, (color, _, label) in COLORS.items():
                found = drawn(rows, case, name)
                if found:
                    ends.append((found[-1].error, found[-1].cpu, label, color))
            drawing.label_ends(axis, ends)
        for axis in panels[len(cases) :]:
            axis.set_visible(False)
        figure.supylabel("CPU seconds per simulated second", fontsize=drawing.SMALL + 1)
        png = drawing.png_of(figure)
    return Picture(
        "integrators",
        png,
        "CPU time against error of five integrators, one panel per case.",
        "More precise to the right, dearer upwards; every line goes from coarse to fine settings. "
        f"Settings with an error above {LARGEST_DRAWN} are left to the table.",
    )


def drawn(rows: list[Row], case: Case, integrator: str) -> list[Row]:
    """Return the rows of a line of the picture."""
    return [
        r
        for r in rows
        if (r.case, r.integrator) == (case.name, integrator)
        and r.error <= LARGEST_DRAWN
        and r.cpu > 0
    ]
