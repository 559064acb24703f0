"""The data of docs/measured/ as Markdown.

benchmarks/measured.py writes them; the blocks of a report are those of quote.py.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import quote

DATA = Path(__file__).parents[1] / "measured"
PLAIN = str.maketrans({mark: f"\\{mark}" for mark in "\\|*_<"})


def measured(name: str) -> str:
    """Return the content of a file, or the block of that name of the report, as Markdown."""
    if not (DATA / f"{name}.json").is_file():
        return quote.blocks_of(quote.read(DATA / "report.json"))[name]
    data = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    head = f"*Measured by `{data['command']}`; [all data](measured/{name}.json).*"
    shown = SHORT.get(name, lambda whole: list(whole["sections"]))(data)
    return "\n\n".join([head, *(part for one in shown for part in parts(one))])


def parts(section: dict[str, Any]) -> Iterator[str]:
    """Yield the paragraphs of a section."""
    if "title" in section:
        yield f"## {section['title']}"
    if "text" in section:
        yield section["text"]
    for file, caption in section.get("pictures", ()):
        yield f"![{caption}](pictures/{file})"
    if section.get("table"):
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
        if one["reason"]:
            remarks.setdefault(one["reason"], []).append(one["name"])
    return [
        {"table": [["check", "what is compared", "allowed"], *allowed]},
        {"title": "Robots", "text": f"{passed} of {len(robots)} pass.", "table": rows},
        {
            "title": "Not checked",
            "notes": [f"{', '.join(names)}: {note}." for note, names in remarks.items()],
        },
    ]


def of_hard_cases(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the groups, and the verdict of each that comes nearest to its bound."""
    first, *groups = data["sections"]
    rows = [["group", "verdicts", "out of bounds", "nearest to its bound", "error", "bound"]]
    for group in groups:
        head, *cells = group["table"]
        verdicts = [dict(zip(head, row, strict=True)) for row in cells]
        nearest = max(verdicts, key=lambda one: float(one["error"]) / (float(one["bound"]) or 1.0))
        out = sum(one["verdict"] != "ok" for one in verdicts)
        what = f"{nearest['case']}: {nearest['what is tried']}"
        counts = [group["title"], str(len(verdicts)), str(out)]
        rows.append([*counts, what, nearest["error"], nearest["bound"]])
    return [{"text": first["text"], "table": rows}]


def of_contact_cases(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return how many cases hold, and those that are open."""
    (section,) = data["sections"]
    head, *rows = section["table"]
    opened = [row for row in rows if row[-1] != "held"]
    text = f"{section['text']} {len(rows) - len(opened)} of {len(rows)} hold; the others are open:"
    return [section | {"text": text, "table": [head, *opened]}]


def of_validation(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases, how many figures of each are within bounds, and their sources."""
    first, *sections = data["sections"]
    cases: dict[str, list[list[str]]] = {}
    for row in first["table"][1:]:
        cases.setdefault(row[0] or list(cases)[-1], []).append(row[1:])
    rows = [["case", "figures within bounds", "the first of them", "error", "bound"]]
    for title, figures in cases.items():
        judged = [verdict for *_, verdict in figures if verdict]
        what, error, bound, _ = figures[0]
        rows.append([title, f"{judged.count('within')} of {len(judged)}", what, error, bound])
    shown = [{"text": first["text"], "table": rows}]
    for one in sections[:-1]:  # the last lists what was not found
        source = [note for note in one["notes"] if note.startswith("**Source.")]
        # What is out of bounds, and the first sentence of why.
        out = [note.split(". ")[:2] for note in one["notes"] if note.startswith("Out of bounds")]
        notes = [*source, *(f"{'. '.join(two).rstrip('.')}." for two in out)]
        shown.append({**one, "notes": notes})
    return shown


def of_peers(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the ratios and what each scene is; its settings and errors are in the data."""
    first, ratios, *scenes = data["sections"]
    head, *rows = ratios["table"]
    short = {**ratios, "table": [row[:7] for row in (head, *rows)]}
    shown = {one["text"]: {**one, "table": ()} for one in reversed(scenes) if "text" in one}
    return [first, short, *reversed(shown.values())]


def of_gallery(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cards; what a picture shows stands below it, and need not be said twice."""
    (cards,) = data["sections"]
    notes = [re.sub(r"!\[(.*?)\](\(.*?\)<br>\*\*\1\*\*)", r"![]\2", one) for one in cards["notes"]]
    return [{**cards, "notes": notes}]


SHORT: dict[str, Callable[[dict[str, Any]], list[dict[str, Any]]]] = {
    "robots": of_robots,
    "hard_cases": of_hard_cases,
    "contact_cases": of_contact_cases,
    "validation": of_validation,
    "peers": of_peers,
    "gallery": of_gallery,
}
"""What is too long for a page: its summary."""
