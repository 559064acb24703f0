"""Writes docs/validation.md and its pictures: `python docs/site/validation.py`, some minutes."""

from __future__ import annotations

import re
import time
from pathlib import Path

from sphshell_pin.study.report.contents import Finding, Table, columns
from sphshell_pin.study.validation import Case, Outcome, collect
from sphshell_pin.study.validation.cases import NOT_FOUND, explanations

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "validation.md"
PICTURES = DOCS / "pictures" / "validation"
HEAD = """\
# Against published experiments

Measurements and solutions that others published, computed with the published materials and
geometry. Nothing is fitted. `error` is our distance from what was published, `bound` the scatter of
those data. Where an error is out of bounds, the case says which physics the theory leaves out.

`sphshell-pin report --validation` runs all of this from a checkout, and writes a page with the same
pictures; `--quick` leaves out the slow cases. The published data are in `tests/data/validation`,
with their sources; each case is a test, too (`tests/study/test_validation.py`). This page is
written by `python docs/site/validation.py`.
"""


def page(ran: list[tuple[Case, Outcome]]) -> str:
    """Return the whole page: a table of all cases, then a section for each."""
    rows = [
        (
            f"[{one.title}](#{anchor(one.title)})" if k == 0 else "",
            f.what,
            f.text,
            *judged(f),
        )
        for one, found in ran
        for k, f in enumerate(found.findings)
    ]
    names = ("case", "figure", "ours: error", "bound", "verdict")
    table = Table("validation", "", columns(*names), rows)
    parts = [HEAD, table.markdown(), *(section(*one) for one in ran)]
    missing = ["## Not found", "", *(f"- {text}" for text in NOT_FOUND), ""]
    return "\n".join([*parts, *missing])


def anchor(title: str) -> str:
    """Return the address of a heading on its page, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def judged(finding: Finding) -> tuple[str, str]:
    """Return the bound and whether the figure is within it; nothing where there is none."""
    if finding.met is None:
        return "", ""
    return finding.aim_text.removeprefix("at most "), "within" if finding.met else "out of bounds"


def section(one: Case, found: Outcome) -> str:
    """Return the section of a case."""
    lines = [f"## {one.title}", ""]
    for picture in found.pictures:
        (PICTURES / f"{picture.name}.png").write_bytes(picture.png)
        lines += [f"![{picture.caption}](pictures/validation/{picture.name}.png)", ""]
    lines += [f"- **{heading}.** {text}" for heading, text in one.texts.items()]
    lines += [f"- {text}" for text in [*found.notes, *explanations(found)]]
    return "\n".join([*lines, ""])


def main() -> None:
    """Run all cases and write the page."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    ran = []
    for one in collect():
        begin = time.perf_counter()
        ran.append((one, one.run()))
        print(f"{one.key} ({time.perf_counter() - begin:.1f} s)", flush=True)
    PAGE.write_text(page(ran), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
