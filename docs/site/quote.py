"""Quote a report: the figures of README.md and the pages come from measured data, never by hand.

python docs/site/quote.py results/report results/peers

Copies the sections of these folders' report.json to docs/measured/report.json, from which
docs/site/tables.py writes the pages.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.study.report.contents import Table, columns

Data = dict[str, Any]
ROOT = Path(__file__).parents[2]
DATA = "docs/measured/report.json"

# What the README shows, by key of the finding, in its order.
SUMMARY = (
    "force_error",
    "query_coal",
    "step_touching",
    "swing_period",
    "peers_press",
    "peers_swing",
)


def blocks_of(data: Data) -> dict[str, str]:
    """Return every block by its name, from a report.json: tables, findings, machine."""
    tables = {name: text for one in data["sections"] for name, text in one["tables"].items()}
    found = {f["key"]: f["row"] for one in data["sections"] for f in one["findings"]}
    machine = data["machine"]
    quick = ", with `--quick`" if "quick" in machine.get("measured in", "") else ""
    day = machine.get("date", "").partition(" ")[0]
    head = f"On one core of {machine.get('processor', 'a processor')}, {day}{quick}:\n\n"
    keys = ("processor", "cores", "system", "Python", "packages", "date", "load before")
    parts = [
        f"{key} {machine[key]}" if key in ("cores", "Python", "load before") else machine[key]
        for key in keys
        if machine.get(key)
    ]
    if "peers_ratios" in tables:
        tables["peers_by_scene"] = peers(tables["peers_ratios"])
    shown = {
        "forces_orders": lambda rows: [
            [*row[:5], row[7]] for row in rows if "estimated" not in row[1]
        ],
        "queries": lambda rows: pivot(rows, row=(0,), column=1, value=2),
        "integrators_costs": lambda rows: pivot(rows, row=(0,), column=1, value=3),
        "steps": lambda rows: [[row[0], row[1], row[4]] for row in rows],
    }
    for name in shown.keys() & tables.keys():
        tables[name] = markdown(shown[name](cells_of(tables[name])))
    return tables | {
        "findings": findings([row for row in found.values() if not row[0].startswith("the same")]),
        "summary": head + findings([found[key] for key in SUMMARY if key in found]),
        "machine": f"`{machine.get('command', 'sphshell-pin report')}` on {'; '.join(parts)}.\n",
    }


def findings(rows: list[list[str]]) -> str:
    """Return findings as a table: what, figure, quartiles, aim; a missed aim says so."""
    words = {"missed": " (this aim is missed)"}
    cells = [(*row, f"{aim}{words.get(verdict, '')}") for *row, aim, verdict in rows]
    return Table("", "", columns("what", "figure", "quartiles", "aim"), cells).markdown()


def peers(ratios: str) -> str:
    """Return the ratios of "peers_ratios" alone: a row for each scene, a column for each peer."""
    return markdown(pivot(cells_of(ratios), row=(0,), column=1, value=2))


def cells_of(text: str) -> list[list[str]]:
    """Return the rows of a table of Markdown, headings first."""
    head, _, *rows = text.splitlines()
    return [[cell.strip() for cell in line.strip()[1:-1].split(" | ")] for line in (head, *rows)]


def markdown(rows: list[list[str]]) -> str:
    """Return rows, headings first, as a table of Markdown."""
    return Table("", "", columns(*rows[0]), rows[1:]).markdown()


def pivot(rows: list[list[str]], row: tuple[int, ...], column: int, value: int) -> list[list[str]]:
    """Return a row for each value of the columns `row`, a column for each value of `column`."""
    head, *body = rows
    names = list(dict.fromkeys(one[column] for one in body))
    cells = {(*(one[k] for k in row), one[column]): one[value] for one in body}
    keys = dict.fromkeys(tuple(one[k] for k in row) for one in body)
    lines = [[*key, *(cells.get((*key, name), "") for name in names)] for key in keys]
    return [[*(head[k] for k in row), *names], *lines]


def read(path: Path) -> Data:
    """Return the data of a report; raise ValueError where a section was not measured."""
    data: Data = json.loads(path.read_text(encoding="utf-8"))
    for section in data["sections"]:
        if section["error"]:
            raise ValueError(f"section {section['title']!r} was not measured: {section['error']}")
    return data


def main() -> int:
    """Copy the data; return 2 where the report cannot be quoted."""
    parser = argparse.ArgumentParser(
        prog="python docs/site/quote.py", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument(
        "reports", type=Path, nargs="+", help="folders of sphshell-pin report and benchmarks.peers"
    )
    folder = Path()
    try:
        found = []
        for folder in parser.parse_args().reports:
            found.append(read(folder / "report.json"))
        sections = [section for one in found for section in one["sections"]]
        data = found[0] | {"sections": sections}
        data.pop("files", None)  # they are not beside it
        blocks_of(data)
        text = json.dumps(data, indent=1, ensure_ascii=False) + "\n"
        with atomic_file(ROOT / DATA) as file:
            file.write(text.encode())
        print(f"wrote {DATA}; python docs/site/tables.py writes the pages")
    except (OSError, ValueError, LookupError) as error:
        print(f"error: {folder}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
