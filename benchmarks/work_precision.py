"""CPU time against error of every integrator.

python -m benchmarks.work_precision [--quick] [--write]
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin.benchmarks.analytic_cases import Exact
from sphshell_pin.benchmarks.timing import Progress, machine, one_core, silent
from sphshell_pin.benchmarks.work_precision_cases import (
    FAST_CREEP,
    SLOW_CREEP,
    Array,
    Case,
    bowl,
    press,
    stick_slip,
)
from sphshell_pin.dynamics import Result
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.errors import SimulationDiverged

PICTURE = Path(__file__).parent.parent / "docs" / "pictures" / "work_precision.png"
TARGET = 1e-4  # error at which costs are compared
ROUNDS = 5
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
    if hasattr(integrator, "rtol"):
        return f"rtol {integrator.rtol:.1e}"
    return f"dt {integrator.dt:.1e} s"


def difference(a: list[Array], b: list[Array]) -> float:
    """Return the largest length of a difference of the figures at any row."""
    return max(float(np.linalg.norm(x - y, axis=1).max()) for x, y in zip(a, b, strict=True))


class Judge:
    """Knows the reference solutions of a case."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.known = [(type(i), case.figures(case.run(i))) for i in case.references]

    def disagreement(self) -> float:
        """Return the difference between the references."""
        return difference(self.known[0][1], self.known[1][1])

    def error(self, integrator: Integrator, result: Result) -> float:
        """Return the error against the reference that another kind of method made."""
        own = isinstance(integrator, self.known[0][0])
        return difference(self.case.figures(result), self.known[own][1])


def cpu_of(case: Case, integrator: Integrator, duration: float | None = None) -> tuple[float, Any]:
    """Run; return the CPU time [s] and the result."""
    before = time.process_time()
    result = case.run(integrator, duration)
    return time.process_time() - before, result


def measure(
    case: Case, judge: Judge | Exact, rounds: int, progress: Progress = silent
) -> list[Row]:
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


def cost_at(rows: list[Row], integrator: str, what: str = "cpu", error: float = TARGET) -> float:
    """Return the cost at which an integrator reaches `error`, and stays below it from there on.

    Between two settings by a power law; nan where no two settings enclose the error.
    """
    curve = [(row.error, getattr(row, what)) for row in rows if row.integrator == integrator]
    for (above, cheap), (below, dear) in zip(curve[-2::-1], curve[:0:-1], strict=True):
        if below > error:
            return math.nan
        if above > error:
            share = math.log(above / error) / math.log(above / below)
            return float(cheap * (dear / cheap) ** share)
    return math.nan


def thinned(case: Case) -> Case:
    """Return the case with the settings of --quick."""
    kept = [
        i
        for i in case.integrators
        if getattr(i, "dt", 1.0) >= case.quick_dt and getattr(i, "rtol", 1.0) > 0.9e-6
    ]
    return replace(case, integrators=tuple(kept))


def main() -> None:
    """Measure, print the tables, draw the picture: those of the report."""
    from sphshell_pin.study.report import integrators

    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.work_precision", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="one round, no fine settings")
    parser.add_argument("--write", action="store_true", help=f"write {PICTURE.name}")
    arguments = parser.parse_args()
    one_core()
    print(machine())
    # Two presses: how much of the implicit methods' advantage the regularized friction makes.
    cases = [bowl(), press(SLOW_CREEP), stick_slip(), press(FAST_CREEP)]
    rows = []
    for k, case in enumerate(cases):
        cases[k] = chosen = thinned(case) if arguments.quick else case
        judge = Judge(chosen)
        print(f"{case.name}: references differ by {judge.disagreement():.0e}", flush=True)
        rows += measure(chosen, judge, 1 if arguments.quick else ROUNDS)
    print(integrators.rows_table(rows).markdown())
    print(integrators.costs_table(cases, rows).markdown())
    if arguments.write:
        PICTURE.write_bytes(integrators.picture(cases, rows).png)
        print(f"wrote docs/pictures/{PICTURE.name}")


if __name__ == "__main__":
    main()
