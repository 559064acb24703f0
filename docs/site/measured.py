"""The data of docs/measured/ as Markdown.

sphshell_pin/cases/measured.py writes them; the blocks of a report are those of benchmarks/quote.py.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from sphshell_pin.benchmarks import quote

DATA = Path(__file__).parents[1] / "measured"
PLAIN = str.maketrans({mark: f"\\{mark}" for mark in "\\|*_<"})


def measured(name: str) -> str:
    """Return the content of a file, or the block of that name of the report, as Markdown."""
    if not (DATA / f"{name}.json").is_file():
        return quote.blocks_of(quote.read(DATA / "report.json"))[name]
    data = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    head = f"*Measured by `{data['command']}`; [all data](measured/{name}.json).*"
    sections = of_robots(data) if name == "robots" else data["sections"]
    return "\n\n".join([head, *(part for one in sections for part in parts(one))])


def parts(section: dict[str, Any]) -> Iterator[str]:
    """Yield the paragraphs of a section."""
    if "title" in section:
        yield f"## {section['title']}"
    if "text" in section:
        yield section["text"]
    for file, caption in section.get("pictures", ()):
        yield f"![{caption}](pictures/{file})"
    if "table" in section:
        yield table(section["table"])
    if "notes" in section:
        yield "\n".join(f"- {note}" for note in section["notes"])


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows, headings first, as a table; but for code in it, a cell is plain text."""
    plain = [[cell if "`" in cell else cell.translate(PLAIN) for cell in row] for row in rows]
    plain.insert(1, ["---"] * len(rows[0]))
    return "\n".join(f"|{'|'.join(row)}|" for row in plain)


def of_robots(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what `check-robot --json` writes as sections."""
    checks, robots = data["checks"], data["robots"]
    passed = sum(one["verdict"] == "pass" for one in robots)
    allowed = [[one["title"], one["compares"], f"{one['tolerance']:g}"] for one in checks.values()]
    rows = [["robot", "frame", "nq/nv", *(one["title"] for one in checks.values()), "verdict"]]
    for one in robots:
        errors = (one["checks"].get(key, {}).get("error") for key in checks)
        cells = ["" if error is None else f"{error:.0e}" if error else "0" for error in errors]
        size = f"{one['nq']}/{one['nv']}" if one["nv"] else ""
        rows.append([one["name"], one["frame"] or "", size, *cells, one["verdict"]])
    remarks: dict[str, list[str]] = {}
    for one in robots:
        for note in filter(None, [one["reason"], *one["notes"]]):
            remarks.setdefault(note, []).append(one["name"])
    return [
        {"table": [["check", "what is compared", "allowed"], *allowed]},
        {"title": "Robots", "text": f"{passed} of {len(robots)} pass.", "table": rows},
        {
            "title": "Remarks",
            "notes": [f"{', '.join(names)}: {note}." for note, names in remarks.items()],
        },
    ]
