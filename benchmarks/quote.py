"""Quote a report in README.md and docs/: the figures there come from measured data, never by hand.

python -m benchmarks.quote results/report

Copies the tables that are quoted to docs/measured/ and replaces what stands between
`<!-- measured: NAME -->` and `<!-- end measured -->` on the pages.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sphshell_pin.study.report.contents import number

ROOT = Path(__file__).parent.parent
PAGES = ("README.md", "docs/speed.md")
FOLDER = "docs/measured"
BLOCK = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end measured -->)", re.DOTALL)
Row = dict[str, str]

# What the README shows, by key of the finding, in its order.
SUMMARY = (
    "force_error",
    "flat_error",
    "query_coal",
    "query_libigl",
    "query_fcpw",
    "query_growth",
    "query_smooth",
    "step_touching",
    "step_control",
    "swing_period",
    "stiff_cost",
    "import",
    "hard_cases",
    "peers_press",
    "peers_swing",
)
# Tables that are quoted whole; all but the last two are in every report.
TABLES = (
    "forces_orders",
    "queries_peers",
    "queries_methods",
    "queries_growth",
    "queries_sizes",
    "integrators_costs",
    "steps",
    "steps_parts",
    "steps_ingredients",
    "peers_ratios",
)
HEADINGS = {
    "mean_error_at_0.3": "error at h/r = 0.3",
    "largest_error_at_0.3": "largest",
    "finest_triangles": "triangles of the finest mesh",
    "finest_mean_error": "error there",
    "median_s": "median [us]",
    "low_s": "lower quartile",
    "high_s": "upper quartile",
    "memory_bytes": "memory [MB]",
    "build_s": "build [s]",
}
SCALES = {"memory_bytes": 1e-6, "build_s": 1.0}


def heading(key: str) -> str:
    """Return the heading of a column of a table."""
    named = HEADINGS.get(key)
    if named is not None:
        return named
    if key.startswith("cpu_at_"):
        return f"CPU s/s at error {float(key.removeprefix('cpu_at_')):g}"
    if key.endswith("_s"):
        return f"{key.removesuffix('_s')} [us]".replace("_", " ")
    return key.replace("_", " ")


def cell(key: str, text: str) -> str:
    """Return a value of a table as the page shows it."""
    try:
        value = float(text)
    except ValueError:
        return text.replace("|", "\\|")
    if not math.isfinite(value):
        return "-"
    if re.fullmatch(r"-?\d+", text):
        return number(int(text))
    if key.endswith("_s"):
        scaled = value * SCALES.get(key, 1e6)
        return number(scaled) if key in SCALES or abs(value) >= 1e-9 else "0"
    return number(value * SCALES.get(key, 1.0))


def markdown(headings: list[str], rows: list[list[str]]) -> str:
    """Return a table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def read(folder: Path, name: str) -> list[Row]:
    """Return the rows of a table of docs/measured; none where the report had none."""
    path = folder / f"{name}.csv"
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def whole_table(folder: Path, name: str) -> str:
    """Return a table with all its columns."""
    rows = read(folder, name)
    if not rows:
        return "Not in this report.\n"
    keys = list(rows[0])
    return markdown([heading(k) for k in keys], [[cell(k, row[k]) for k in keys] for row in rows])


def findings(folder: Path, keys: tuple[str, ...] | None = None) -> str:
    """Return the findings, all of them or those of `keys` in that order."""
    found = {row["key"]: row for row in read(folder, "findings")}
    rows = [found[key] for key in keys if key in found] if keys else list(found.values())
    return markdown(
        ["what", "figure", "quartiles", "aim"],
        [[row["what"].replace("|", "\\|"), row["text"], quartiles(row), aim(row)] for row in rows],
    )


def quartiles(row: Row) -> str:
    """Return the quartiles of a finding; empty where it has none."""
    return f"{number(float(row['low']))} to {number(float(row['high']))}" if row["low"] else ""


def aim(row: Row) -> str:
    """Return aim and verdict of a finding; empty where it has none."""
    if not row["aim"]:
        return ""
    word = "at most" if row["sense"] == "<=" else "at least"
    met = "" if row["met"] == "True" else " (missed)"
    return f"{word} {number(float(row['aim']))}{met}"


def machine(folder: Path) -> str:
    """Return a paragraph on the machine and the run."""
    told = {row["what"]: row["text"] for row in read(folder, "machine")}
    keys = ("processor", "cores", "system", "Python", "packages", "date", "load before")
    parts = [
        f"{key} {told[key]}" if key in ("cores", "Python", "load before") else told[key]
        for key in keys
        if told.get(key)
    ]
    return f"`{told.get('command', 'sphshell-pin report')}` on {'; '.join(parts)}.\n"


def short_machine(folder: Path) -> str:
    """Return the processor and the date of the run."""
    told = {row["what"]: row["text"] for row in read(folder, "machine")}
    quick = ", with `--quick`" if "quick" in told.get("measured in", "") else ""
    day = told.get("date", "").partition(" ")[0]
    return f"On one core of {told.get('processor', 'a processor')}, {day}{quick}:\n"


BLOCKS: dict[str, Callable[[Path], str]] = {
    "summary": lambda folder: f"{short_machine(folder)}\n{findings(folder, SUMMARY)}",
    "machine": machine,
    "findings": findings,
    **{name: lambda folder, name=name: whole_table(folder, name) for name in TABLES},
}


def quoted(text: str, folder: Path) -> str:
    """Return a page with its blocks replaced by what the data in `folder` say."""

    def block(found: re.Match[str]) -> str:
        make = BLOCKS.get(found[2])
        if make is None:
            raise ValueError(f"no block is called {found[2]!r}: one of {', '.join(BLOCKS)}")
        return f"{found[1]}{make(folder)}{found[3]}"

    return BLOCK.sub(block, text)


def copy_data(report: Path, folder: Path) -> None:
    """Copy what is quoted of a report; raise ValueError where it is not whole."""
    data: dict[str, Any] = json.loads((report / "report.json").read_text(encoding="utf-8"))
    for section in data["sections"]:
        if section["error"]:
            raise ValueError(
                f"the section {section['title']!r} was not measured: {section['error']}"
            )
    folder.mkdir(parents=True, exist_ok=True)
    told = io.StringIO()
    csv.writer(told, lineterminator="\n").writerows([("what", "text"), *data["machine"].items()])
    replace(folder / "machine.csv", told.getvalue())
    for name in ("findings", *TABLES):
        source, target = report / f"{name}.csv", folder / f"{name}.csv"
        if source.exists():
            replace(target, source.read_text(encoding="utf-8"))
        else:
            target.unlink(missing_ok=True)


def replace(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    beside = path.with_name(f".{path.name}.new")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, path)


def main() -> int:
    """Copy the data, replace the blocks; return 2 where the report cannot be quoted."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.quote", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("report", type=Path, help="folder that sphshell-pin report wrote")
    options = parser.parse_args()
    try:
        copy_data(options.report, ROOT / FOLDER)
        for name in PAGES:
            page = ROOT / name
            replace(page, quoted(page.read_text(encoding="utf-8"), ROOT / FOLDER))
            print(f"wrote {name}")
    except (OSError, ValueError, LookupError) as error:
        print(f"error: {options.report}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
