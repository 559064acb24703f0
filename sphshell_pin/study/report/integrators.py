"""CPU time against error of every integrator.

Every integrator with many steps or tolerances, CPU seconds per simulated second against the largest
error at any instant, in motions with a closed form: a ball that bounces five times on a spring
(touches and lift-offs), and one that glides on a plate so stiff and damped that an explicit method
is bound to steps of 1e-5 s by a motion that has long died out.
"""

import math
import time
from dataclasses import dataclass

import numpy as np

from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.errors import SimulationDiverged
from sphshell_pin.study.report import closed_forms, contents, swing
from sphshell_pin.study.report.closed_forms import Case
from sphshell_pin.study.report.timing import silent

KEY, TITLE = "integrators", "Work and precision of the integrators"
EXPLICIT = ("SemiImplicitEuler", "RungeKutta4", "Adaptive")
ERRORS = {1e-2: "10⁻²", 1e-4: "10⁻⁴", 1e-6: "10⁻⁶"}


@dataclass(frozen=True)
class Row:
    """One setting of one integrator: its error, and CPU seconds per simulated second."""

    case: str
    integrator: str
    error: float
    cpu: float


def measure(case: Case, *, quick: bool, progress: contents.Progress = silent) -> list[Row]:
    """Run every setting, with `quick` once and without the finest; what diverges has no row."""
    settings = case.integrators
    if quick:
        settings = [
            one
            for one in settings
            if getattr(one, "dt", 1.0) >= 2 * min(case.dts) and getattr(one, "rtol", 1.0) > 0.9e-6
        ]
    # What a run of nothing takes: a second that is simulated costs the rest.
    setup = min(_timed(case, settings[0], 0.0)[0] for _ in range(5))
    rows = []
    for k, one in enumerate(settings):
        try:
            runs = [_timed(case, one) for _ in range(1 if quick else 3)]
        except SimulationDiverged:
            continue
        cpu = max(float(np.median([cpu for cpu, _ in runs])) - setup, 0.0) / case.duration
        rows.append(Row(case.title, type(one).__name__, runs[0][1], cpu))
        progress((k + 1) / len(settings))
    return rows


def _timed(case: Case, one: Integrator, duration: float | None = None) -> tuple[float, float]:
    """Return the CPU time [s] and the error of a run."""
    before = time.process_time()
    result = case.run(one, duration)
    return time.process_time() - before, case.error(result)


def section(*, quick: bool, progress: contents.Progress) -> contents.Section:
    """Measure and return the section."""
    rows = []
    for k, case in enumerate((closed_forms.bounces(), closed_forms.glide())):
        rows += measure(case, quick=quick)
        progress(0.45 * (k + 1))
    swings = swing.measure(swing.mesh_scene(swing.bowl(0.15)))
    return assemble(rows, swings)


def cheapest(rows: list[Row], case: str, integrators: tuple[str, ...], error: float) -> float:
    """Return the least CPU time per simulated second of a setting with at most this error."""
    fit = (r for r in rows if r.case == case and r.integrator in integrators)
    return min((r.cpu for r in fit if r.error <= error), default=math.nan)


def assemble(rows: list[Row], swings: swing.Row) -> contents.Section:
    """Return the section of what was measured: what an error costs, and the figures."""
    pairs = dict.fromkeys((row.case, row.integrator) for row in rows)
    costs = contents.Table(
        "integrators_costs",
        "CPU seconds per simulated second of the cheapest setting with at most this error; a "
        "dash where no setting that was tried gets there.",
        contents.columns(
            "case", "integrator", *(f"cpu_at_{e:.0e}: error {t}" for e, t in ERRORS.items())
        ),
        [
            [case, name, *(cheapest(rows, case, (name,), error) for error in ERRORS)]
            for case, name in pairs
        ],
    )
    glide, bounces = "Ball glides on a stiff plate", "Ball bounces five times"
    stiff = cheapest(rows, glide, EXPLICIT, 1e-4) / cheapest(rows, glide, ("Implicit",), 1e-4)
    bounce = [r.error for r in rows if (r.case, r.integrator) == (bounces, "Implicit")]
    period = "frictionless bowl swing, h / r = 0.15, 8 azimuths, 4 periods: error of the period"
    energy = "the same: largest change of energy / energy of the swing"
    cost = "stiff contact, error 1e-4: CPU time of the best explicit method / Implicit"
    least = "five bounces on a spring: least error reached"
    findings = [
        contents.Finding("swing_period", period, swings.rms, aim=5e-7),
        contents.Finding("swing_energy", energy, swings.energy, aim=1e-6),
        contents.Finding("stiff_cost", cost, stiff, contents.TIMES),
        contents.Finding("bounces_error", least, min(bounce, default=math.nan)),
    ]
    return contents.Section(KEY, TITLE, contents.about(__doc__), findings, tables=[costs])
