"""Writes what docs/validation.md shows: `python docs/site/validation.py`, some minutes.

That is docs/measured/validation.json and the pictures in docs/pictures/validation.
"""

from __future__ import annotations

import time
from pathlib import Path

from sphshell_pin.cases.contents import Finding
from sphshell_pin.cases.measured import Measured, write
from sphshell_pin.study.validation import Case, Outcome, collect
from sphshell_pin.study.validation.cases import NOT_FOUND, explanations

PICTURES = Path(__file__).parents[1] / "pictures" / "validation"


def sections(ran: list[tuple[Case, Outcome]]) -> list[Measured]:
    """Return what the page shows: a table of all cases, then a section for each."""
    rows = [
        [one.title if k == 0 else "", f.what, f.text, *judged(f)]
        for one, found in ran
        for k, f in enumerate(found.findings)
    ]
    within = [row[-1] for row in rows].count("within")
    text = f"{within} of {len(rows)} figures are within their bounds."
    names = ["case", "figure", "error", "bound", "verdict"]
    missing = Measured("Not found", notes=NOT_FOUND)
    return [Measured(text=text, table=[names, *rows]), *(section(*one) for one in ran), missing]


def judged(finding: Finding) -> tuple[str, str]:
    """Return the bound and whether the figure is within it; nothing where there is none."""
    if finding.met is None:
        return "", ""
    return finding.aim_text.removeprefix("at most "), "within" if finding.met else "out of bounds"


def section(one: Case, found: Outcome) -> Measured:
    """Return the section of a case."""
    for picture in found.pictures:
        (PICTURES / f"{picture.name}.png").write_bytes(picture.png)
    pictures = [(f"validation/{one.name}.png", one.caption) for one in found.pictures]
    texts = [f"**{heading}.** {text}" for heading, text in one.texts.items()]
    return Measured(
        one.title,
        pictures=pictures,
        table=Measured.of(found.tables[0]).table if found.tables else (),
        notes=[*texts, *found.notes, *explanations(found)],
    )


def main() -> None:
    """Run all cases and write what they found."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    ran = []
    for one in collect():
        begin = time.perf_counter()
        ran.append((one, one.run()))
        print(f"{one.key} ({time.perf_counter() - begin:.1f} s)", flush=True)
    print(write("validation", "python docs/site/validation.py", sections(ran)))


if __name__ == "__main__":
    main()
