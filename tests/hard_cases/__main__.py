"""Run the hard cases, print their table, and write docs/measured/hard_cases.json.

python -m tests.hard_cases [--quick] [--only WORD] [--write]
"""

from __future__ import annotations

import argparse
import importlib
import itertools
import sys
import time

from sphshell_pin.cases.contents import Verdict, verdicts_table
from sphshell_pin.cases.measured import Measured, write
from sphshell_pin.cases.register import Case
from tests.hard_cases.verdict import CASES

NAME = "hard_cases"
collect = CASES.collect


def row(verdict: Verdict) -> list[str]:
    return verdicts_table([verdict], grouped=False).cells[0]


def sections(results: list[tuple[Case, list[Verdict]]]) -> list[Measured]:
    """Return what the site shows: a section for each module."""
    found = [verdict for _, verdicts in results for verdict in verdicts]
    wrong = sum(not verdict.ok for verdict in found)
    parts = [Measured(text=f"{len(found)} verdicts, {wrong} of them out of bounds.")]
    for module, group in itertools.groupby(results, key=lambda result: result[0].module):
        heading, _, text = (importlib.import_module(module).__doc__ or "").strip().partition(".")
        verdicts = [verdict for _, some in group for verdict in some]
        parts.append(Measured.of(verdicts_table(verdicts, grouped=False), heading, text.strip()))
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
    for known in collect(quick=options.quick, only=options.only):
        begin = time.perf_counter()
        verdicts = known.verdicts()
        print(f"{known.name} ({time.perf_counter() - begin:.1f} s)", flush=True)
        for verdict in verdicts:
            name, tried, _, expected, measured, error, bound, word = row(verdict)
            figures = f"{expected:>13.30s} {measured:>13.40s} {error:>8s} <= {bound:>5s} {word}"
            print(f"  {name:34.34s} {tried:52.52s} {figures}", flush=True)
        results.append((known, verdicts))
    if options.write:
        command = "python -m tests.hard_cases --write"
        print(f"wrote {write(NAME, command, sections(results))}")
    wrong = sum(not verdict.ok for _, verdicts in results for verdict in verdicts)
    print(f"{sum(len(verdicts) for _, verdicts in results)} verdicts, {wrong} of them fail")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
