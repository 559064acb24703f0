"""CPU time against error of every integrator, on three cases.

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

import sphshell_pin as sp
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
from sphshell_pin.dynamics.integrators import Integrator
from sphshell_pin.errors import SimulationDiverged

PICTURE = Path(__file__).parent.parent / "docs" / "pictures" / "work_precision.png"
TARGET = 1e-4  # error at which costs are compared
ROUNDS = 5
LONG = 0.5  # [s]: runs that take longer are made once
LOOKS = {
    "SemiImplicitEuler": ("#f08a00", "^"),
    "RungeKutta4": ("#1a9a5a", "s"),
    "LinearlyImplicitEuler": ("#d4202a", "v"),
    "Adaptive": ("#2f6fde", "o"),
    "Implicit": ("#7a3fc4", "D"),
}


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


def print_table(case: Case, judge: Judge, rows: list[Row]) -> None:
    print(f"{case.name}, {case.duration:g} s; {case.judged}; references differ by "
          f"{judge.disagreement():.0e}")  # fmt: skip
    print(
        f"  {'integrator':22s} {'setting':14s}   error   CPU s/s     steps  rejected  "
        "evaluations / s"
    )
    for row in rows:
        print(
            f"  {row.integrator:22s} {row.setting:14s} {row.error:7.1e}  {row.cpu:8.4f}  "
            f"{row.steps:8d}  {row.rejected:8d}  {row.evaluations:15.0f}"
        )


def print_ratios(rows: list[Row]) -> None:
    """Print what every integrator costs at the error of the comparison, against Implicit."""
    base = {what: cost_at(rows, "Implicit", what) for what in ("cpu", "evaluations")}
    print(f"  at error {TARGET:g}, and over Implicit's:")
    for name in LOOKS:
        cpu, evaluations = (cost_at(rows, name, what) for what in ("cpu", "evaluations"))
        if math.isfinite(cpu):
            print(
                f"    {name:22s} {cpu:8.4f} CPU s/s {cpu / base['cpu']:7.1f} x   "
                f"{evaluations:9.0f} evaluations / s {evaluations / base['evaluations']:7.1f} x"
            )


def figure_of(cases: list[Case], rows: list[Row]) -> Any:
    """Draw cost against error, one panel per case."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullLocator

    figure = Figure(figsize=(10.0, 4.3), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(cases), sharey=True)
    for axis, case in zip(panels, cases, strict=True):
        for name, (color, marker) in LOOKS.items():
            found = [r for r in rows if (r.case, r.integrator) == (case.name, name)]
            axis.loglog(
                [r.error for r in found], [r.cpu for r in found], color=color, marker=marker,
                markersize=5, label=name,
            )  # fmt: skip
        axis.axhline(1.0, color="#6b7280", linestyle=":", linewidth=1)
        axis.set_title(case.title, fontsize=11)
        axis.set_xlabel(case.judged, fontsize=9.5)
        axis.xaxis.set_major_locator(LogLocator(numticks=6))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.grid(True, which="major", color="#e5e7eb")
        axis.set_axisbelow(True)
    panels[0].annotate(
        "real time", (0.02, 1.0), xycoords=("axes fraction", "data"), color="#6b7280", fontsize=9,
        va="bottom", xytext=(0, 2), textcoords="offset points",
    )  # fmt: skip
    mark_ratio(panels[1], [r for r in rows if r.case == cases[1].name])
    figure.supylabel("CPU s / simulated s", fontsize=10)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(LOOKS), frameon=False, fontsize=10
    )
    return figure


def mark_ratio(axis: Any, rows: list[Row]) -> None:
    """Mark how far apart the semi-implicit and the implicit method are at the error compared."""
    low, high = cost_at(rows, "Implicit"), cost_at(rows, "SemiImplicitEuler")
    if not math.isfinite(low * high):
        return
    axis.annotate(
        "", (TARGET, high), xytext=(TARGET, low),
        arrowprops={"arrowstyle": "<->", "color": "#111827", "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axis.annotate(
        f"{high / low:.0f} x", (TARGET, 0.55 * math.sqrt(low * high)), fontsize=11, ha="right",
        va="center", color="#111827", xytext=(-5, 0), textcoords="offset points",
    )  # fmt: skip


def thinned(case: Case) -> Case:
    """Return the case with the settings of --quick."""
    kept = [
        i
        for i in case.integrators
        if getattr(i, "dt", 1.0) >= case.quick_dt and getattr(i, "rtol", 1.0) > 0.9e-6
    ]
    return replace(case, integrators=tuple(kept))


def main() -> None:
    """Measure, print the tables, draw the figure."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.work_precision", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="one round, no fine settings")
    parser.add_argument("--write", action="store_true", help=f"write {PICTURE.name}")
    arguments = parser.parse_args()
    one_core()
    print(machine())
    drawn = [bowl(), press(SLOW_CREEP), stick_slip()]
    # How much of the advantage the friction's regularisation makes.
    other = press(FAST_CREEP)
    compared = (sp.SemiImplicitEuler, sp.Implicit)
    other = replace(
        other, integrators=tuple(i for i in other.integrators if isinstance(i, compared))
    )
    rows = []
    for case in [*drawn, other]:
        chosen = thinned(case) if arguments.quick else case
        judge = Judge(chosen)
        found = measure(chosen, judge, 1 if arguments.quick else ROUNDS)
        print_table(chosen, judge, found)
        print_ratios(found)
        rows += found
    if arguments.write:
        figure_of(drawn, rows).savefig(PICTURE, dpi=110)
        print(f"wrote docs/pictures/{PICTURE.name}")


if __name__ == "__main__":
    main()
