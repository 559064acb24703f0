"""Runs the validation and writes what docs/validation.md shows: some minutes.

python -m tests.validation [CASE ...]

That is docs/measured/validation.json and the pictures in docs/pictures/validation.
"""

import json
import sys
import time

from benchmarks.measured import FOLDER, Measured, write
from sphshell_pin.study.report.contents import Finding
from tests.validation.cases import NOT_FOUND, Case, Outcome, collect
from tests.validation.pictures import draw

PICTURES = FOLDER.parent / "pictures" / "validation"


# What the table of all cases says of one, and its section.
Part = tuple[list[list[str]], Measured]


def part(one: Case, found: Outcome) -> Part:
    """Return what the page shows of a case."""
    rows = [
        [one.title if k == 0 else "", f.what, f.text, *judged(f)]
        for k, f in enumerate(found.findings)
    ]
    return rows, section(one, found)


def kept() -> dict[str, Part]:
    """Return what the page shows now, by the title of the case."""
    first, *sections = json.loads((FOLDER / "validation.json").read_text("utf-8"))["sections"]
    rows: dict[str, list[list[str]]] = {}
    for row in first["table"][1:]:
        rows.setdefault(row[0] or list(rows)[-1], []).append(row)
    made = {one["title"]: Measured(**one) for one in sections}
    return {title: (rows[title], made[title]) for title in rows}


def page(parts: list[Part]) -> list[Measured]:
    """Return what the page shows: a table of all cases, then a section for each."""
    rows = [row for of_case, _ in parts for row in of_case]
    within = [row[-1] for row in rows].count("within")
    text = f"{within} of {len(rows)} figures are within their bounds."
    names = ["case", "figure", "error", "bound", "verdict"]
    missing = Measured("Not found", notes=NOT_FOUND)
    return [Measured(text=text, table=[names, *rows]), *(one for _, one in parts), missing]


def judged(finding: Finding) -> tuple[str, str]:
    """Return the bound and whether the figure is within it; nothing where there is none."""
    if finding.met is None:
        return "", ""
    return finding.aim_text.removeprefix("at most "), "within" if finding.met else "out of bounds"


def section(one: Case, found: Outcome) -> Measured:
    """Return the section of a case."""
    (PICTURES / f"{one.key}.png").write_bytes(draw(found.panels))
    texts = [f"**{heading}.** {text}" for heading, text in one.texts.items()]
    return Measured(
        one.title,
        pictures=[(f"validation/{one.key}.png", one.caption)],
        table=Measured.of(found.tables[0]).table if found.tables else (),
        notes=[*texts, *found.notes, *found.explanations],
    )


def main(*names: str) -> None:
    """Run the cases with these names, by default all, and write what they found."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    if unknown := set(names) - {one.key for one in collect()}:
        sys.exit(f"no case called {', '.join(unknown)}: see tests/validation/cases.toml")
    before = kept() if names else {}
    parts = []
    for one in collect():
        if names and one.key not in names:
            parts.append(before[one.title])
            continue
        begin = time.perf_counter()
        parts.append(part(one, one.run()))
        print(f"{one.key} ({time.perf_counter() - begin:.1f} s)", flush=True)
    print(write("validation", "python -m tests.validation", page(parts)))


if __name__ == "__main__":
    main(*sys.argv[1:])
