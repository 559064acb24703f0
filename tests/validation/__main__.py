"""Runs the validation and writes what docs/validation.md shows: some minutes.

python -m tests.validation

That is docs/measured/validation.json and the pictures in docs/pictures/validation.
"""

import time

from benchmarks.measured import FOLDER, Measured, write
from tests.validation.cases import NOT_FOUND, Case, Figure, Outcome, collect
from tests.validation.pictures import draw

PICTURES = FOLDER.parent / "pictures" / "validation"


def judged(figure: Figure) -> tuple[str, str]:
    """Return the bound and whether the figure is within it."""
    return figure.aim_text.removeprefix("at most "), "within" if figure.met else "out of bounds"


def section(one: Case, found: Outcome) -> Measured:
    """Return the section of a case, and write its picture."""
    (PICTURES / f"{one.key}.png").write_bytes(draw(found.panels))
    texts = [f"**{heading}.** {text}" for heading, text in one.texts.items()]
    return Measured(
        one.title,
        pictures=[(f"validation/{one.key}.png", one.caption)],
        table=Measured.of(found.tables[0]).table if found.tables else (),
        notes=[*texts, *found.notes, *found.explanations],
    )


def main() -> None:
    """Run the cases, and write a table of all of them and a section for each."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    rows: list[list[str]] = []
    sections = []
    for one in collect():
        begin = time.perf_counter()
        found = one.run()
        titles = [one.title, *[""] * len(found.findings)]
        for title, figure in zip(titles, found.findings, strict=False):
            rows.append([title, figure.what, figure.text, *judged(figure)])
        sections.append(section(one, found))
        print(f"{one.key} ({time.perf_counter() - begin:.1f} s)", flush=True)
    within = [row[-1] for row in rows].count("within")
    text = f"{within} of {len(rows)} figures are within their bounds."
    first = Measured(text=text, table=[["case", "figure", "error", "bound", "verdict"], *rows])
    page = [first, *sections, Measured("Not found", notes=NOT_FOUND)]
    print(write("validation", "python -m tests.validation", page))


if __name__ == "__main__":
    main()
