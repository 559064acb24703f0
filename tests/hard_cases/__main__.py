"""Run the hard cases, print their table, and write docs/measured/hard_cases.json.

python -m tests.hard_cases [--quick] [--only WORD] [--write]
"""

import argparse
import sys

from benchmarks.measured import Measured, write
from tests.hard_cases.verdict import CASES, Verdict, measure, table


def sections(found: list[Verdict]) -> list[Measured]:
    """Return the data of the page: a section for each module."""
    wrong = sum(not verdict.ok for verdict in found)
    parts = [Measured(text=f"{len(found)} verdicts, {wrong} of them out of bounds.")]
    for heading, text in dict.fromkeys(case.about for case in CASES.collect()):
        some = [verdict for verdict in found if verdict.group == heading]
        parts.append(Measured.of(table(some), heading, text))
    return parts


def main() -> int:
    """Run, print and write; return 1 where a case fails."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.hard_cases", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="leave out the slow cases")
    parser.add_argument("--only", metavar="WORD", help="cases whose name or module has the word")
    parser.add_argument("--write", action="store_true", help="write docs/measured/hard_cases.json")
    options = parser.parse_args()
    if options.write and (options.quick or options.only):
        parser.error("--write needs all cases: leave out --quick and --only")
    found = measure(options.quick, options.only)
    for name, tried, _, expected, measured, error, bound, word in table(found).cells:
        figures = f"{expected:>13.30s} {measured:>13.40s} {error:>8s} <= {bound:>5s} {word}"
        print(f"  {name:34.34s} {tried:52.52s} {figures}")
    if options.write:
        command = "python -m tests.hard_cases --write"
        print(f"wrote {write('hard_cases', command, sections(found))}")
    wrong = sum(not verdict.ok for verdict in found)
    print(f"{len(found)} verdicts, {wrong} of them fail")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
