"""Quote a report: the figures of README.md and the pages come from measured data, never by hand.

python -m benchmarks.quote results/report

Copies report.json to docs/measured/, from which docs/site/tables.py writes the pages.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from sphshell_pin.atomic import atomic_file
from sphshell_pin.cases.contents import Table, columns

Data = dict[str, Any]
ROOT = Path(__file__).parent.parent
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
    return tables | {
        "findings": findings(list(found.values())),
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
    rows = [line.strip("| ").split(" | ")[:3] for line in ratios.splitlines()[2:]]
    names = list(dict.fromkeys(peer for _, peer, _ in rows))
    cells = {(scene, peer): ratio for scene, peer, ratio in rows}
    lines = [
        (scene, *(cells.get((scene, name), "") for name in names))
        for scene in dict.fromkeys(scene for scene, _, _ in rows)
    ]
    return Table("", "", columns("scene", *names), lines).markdown()


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
        prog="python -m benchmarks.quote", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("report", type=Path, help="folder that sphshell-pin report wrote")
    options = parser.parse_args()
    try:
        data = read(options.report / "report.json")
        blocks_of(data)
        text = json.dumps(data, indent=1, ensure_ascii=False) + "\n"
        with atomic_file(ROOT / DATA) as file:
            file.write(text.encode())
        print(f"wrote {DATA}; python docs/site/tables.py writes the pages")
    except (OSError, ValueError, LookupError) as error:
        print(f"error: {options.report}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
