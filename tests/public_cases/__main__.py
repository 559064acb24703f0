"""Measure the public cases and write their table into docs/cases.md.

python -m tests.public_cases [NAME ...] [--write]
"""

import argparse
import re
import sys
import warnings
from pathlib import Path

from tests.public_cases import CASES, machines, motion, surfaces  # noqa: F401  (registered by importing)

PAGE = Path(__file__).parents[2] / "docs" / "cases.md"
BEGIN, END = "<!-- table: python -m tests.public_cases --write -->\n", "<!-- end of table -->"


def listed(page: str) -> list[str]:
    """Return the names of the cases in the table of the page."""
    table = page.partition(BEGIN)[2].partition(END)[0]
    return re.findall(r"^\| `(\w+)` \|", table, re.M)


def main() -> int:
    """Measure, print, and write; return 1 where a figure is off."""
    parser = argparse.ArgumentParser(prog="python -m tests.public_cases", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="by default all")
    parser.add_argument("--write", action="store_true", help="write docs/cases.md")
    options = parser.parse_args()
    rows, missed = [], 0
    warnings.simplefilter("ignore")
    for name in options.names or CASES:
        one = CASES[name]
        figure = one.measure()
        missed += abs(figure - one.truth) > one.bound
        print(f"{name:36s} {figure:.6g}, truth {one.truth:g} +- {one.bound:g}", flush=True)
        cells = (f"`{name}`", one.links, one.wanted, one.figure, f"{figure:.6g}", f"{one.truth:g}")
        rows.append("| " + " | ".join(cells) + " |\n")
    if options.write and not options.names:
        head = "| case | reported in | what should happen | figure | measured | truth |\n"
        table = f"{BEGIN}{head}|---|---|---|---|---|---|\n{''.join(rows)}{END}"
        text = PAGE.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        PAGE.write_text(before + table + rest.partition(END)[2], encoding="utf-8")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
