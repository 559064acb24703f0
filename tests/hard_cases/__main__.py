"""Run the hard cases, print their table, and write docs/measured/hard_cases.json.

python -m tests.hard_cases [--quick] [--only WORD] [--write]
"""

from __future__ import annotations

import argparse
import importlib
import itertools
import sys
import time

from sphshell_pin.benchmarks import measured
from tests.hard_cases.verdict import CASES, Case, Verdict, failed

# In the order of the page. A module's docstring is the text above its table.
MODULES = (
    "analytic_impact",
    "analytic_rolling",
    "analytic_surfaces",
    "analytic_energy",
    "impacts",
    "under_stiff",
    "extremes",
    "resting",
    "starts",
    "repeats",
)
NAME = "hard_cases"
COLUMNS = ("case", "what is tried", "law", "expected", "measured", "error", "bound", "verdict")


def collect() -> list[Case]:
    """Import the modules and return their cases in the order of MODULES."""
    names = [f"{__package__ or 'tests.hard_cases'}.{name}" for name in MODULES]
    for name in names:
        importlib.import_module(name)
    return sorted(CASES, key=lambda known: names.index(known.module))


def run(chosen: Case) -> list[Verdict]:
    """Run a case; an error of its run is a verdict, too."""
    try:
        return chosen.run()
    except Exception as problem:
        return [failed(chosen.name, problem)]


def shown(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.7g}"


def row(verdict: Verdict) -> tuple[str, ...]:
    return (
        verdict.case,
        verdict.tried,
        verdict.law,
        shown(verdict.expected),
        shown(verdict.measured),
        f"{verdict.error:.1e}",
        f"{verdict.bound:.0e}",
        "ok" if verdict.ok else "FAILS",
    )


def sections(results: list[tuple[Case, list[Verdict]]]) -> list[measured.Measured]:
    """Return what the site shows: a section for each module."""
    found = [verdict for _, verdicts in results for verdict in verdicts]
    wrong = sum(not verdict.ok for verdict in found)
    parts = [measured.Measured(text=f"{len(found)} verdicts, {wrong} of them out of bounds.")]
    for module, group in itertools.groupby(results, key=lambda result: result[0].module):
        heading, _, text = (importlib.import_module(module).__doc__ or "").strip().partition(".")
        rows = [row(verdict) for _, verdicts in group for verdict in verdicts]
        parts.append(measured.Measured(heading, text.strip(), table=[COLUMNS, *rows]))
    return parts


def main() -> int:
    """Run, print and write; return 1 where a case fails."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.hard_cases", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="leave out the slow cases")
    parser.add_argument("--only", metavar="WORD", help="cases whose name or module has the word")
    parser.add_argument("--write", action="store_true", help=f"write docs/measured/{NAME}.json")
    options = parser.parse_args()
    if options.write and (options.quick or options.only):
        parser.error("--write needs all cases: leave out --quick and --only")
    results = []
    for known in collect():
        if options.only and options.only not in f"{known.module} {known.name}":
            continue
        if options.quick and known.slow:
            continue
        begin = time.perf_counter()
        verdicts = run(known)
        print(f"{known.name} ({time.perf_counter() - begin:.1f} s)", flush=True)
        for verdict in verdicts:
            name, tried, _, expected, measured, error, bound, word = row(verdict)
            figures = f"{expected:>13.30s} {measured:>13.40s} {error:>8s} <= {bound:>5s} {word}"
            print(f"  {name:34.34s} {tried:52.52s} {figures}", flush=True)
        results.append((known, verdicts))
    if options.write:
        command = "python -m tests.hard_cases --write"
        print(f"wrote {measured.write(NAME, command, sections(results))}")
    wrong = sum(not verdict.ok for _, verdicts in results for verdict in verdicts)
    print(f"{sum(len(verdicts) for _, verdicts in results)} verdicts, {wrong} of them fail")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
