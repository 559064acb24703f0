"""Time and memory of a query, against other codes and the number of triangles.

All contacts of a 10 mm sphere pressed 0.5 mm into a wavy sheet, at random positions that the caches
do not know, on one core, by the default method, "smooth", unless another is named. Coal collects a
contact for every triangle that is touched; trimesh, libigl and fcpw (in single precision) answer
the smaller question of the one closest point. The sheet grows at equal size of its triangles, so
that the sphere always touches the same number of them. Every contestant has a process of its own,
and they are asked in turn, round by round; memory is what it holds after its first query.

python -m benchmarks.queries [--quick]    # prints the tables
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sphshell_pin.arrays import Array
from sphshell_pin.benchmarks import sizes
from sphshell_pin.benchmarks.sizes import Row
from sphshell_pin.benchmarks.timing import print_sections
from sphshell_pin.cases import drawing
from sphshell_pin.cases.contents import (
    TIME_COLUMNS,
    Column,
    Finding,
    Picture,
    Progress,
    Section,
    Table,
    about,
    columns,
    number,
)

KEY, TITLE = "queries", "Time and memory of a query"
COLORS = {
    "smooth": (drawing.BLUE, "o"),
    "facets": (drawing.GREEN, "s"),
    "coal::collide": (drawing.RED, "v"),
    "trimesh": (drawing.ORANGE, "^"),
    "libigl": (drawing.VIOLET, "D"),
    "fcpw": (drawing.GREY, "P"),
}
COMPARED = 199_712  # triangles of the sheet on which all are compared
GROWN = 2_000_000  # of the largest one to which ours may grow, from the second of `sizes.CELLS`
OTHERS = (
    ("query_libigl", sizes.LIBIGL, "libigl's AABB tree (closest point)"),
    ("query_fcpw", sizes.FCPW, "single-precision fcpw (closest point)"),
)
TEXT = about(__doc__)


def section(*, quick: bool, progress: Progress) -> Section:
    """Measure and return the section."""
    chosen = sizes.QUICK_CELLS if quick else sizes.CELLS
    rows, notes = sizes.measure(chosen, 5 if quick else 15, progress)
    if quick:
        notes.append("Sheets of more than 200 k triangles were left out (--quick).")
    found = assemble(rows, notes)
    large = f"query on {number(GROWN)} triangles (left out by --quick)"
    return replace(found, unmeasured=[*found.unmeasured, large]) if quick else found


def assemble(rows: list[Row], notes: list[str]) -> Section:
    """Return the section of what was measured."""
    compared = {row.name: row.times for row in rows if row.triangles == COMPARED}
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=findings_of(rows, compared) if compared else [],
        pictures=[picture(rows)] if rows else [],
        tables=[sizes_table(rows)],
        notes=notes,
        unmeasured=[
            f"query against {label}: not installed"
            for _, name, label in OTHERS
            if name not in compared
        ],
    )


def findings_of(rows: list[Row], compared: dict[str, Array]) -> list[Finding]:
    """Return the ratios that have aims; `compared`: times [s] on COMPARED triangles, by name."""
    this, flat, coal = (compared[name] for name in (sizes.OURS, sizes.OURS_FLAT, sizes.COAL))
    found = [
        Finding.of_rounds(
            "query_coal",
            "query, 200 k triangles: time of coal::collide with all contacts / ours",
            coal / this,
            aim=15.0,
            sense=">=",
            headline=True,
        ),
        Finding.of_rounds(
            "query_coal_facets",
            'the same with the method "facets" in place of "smooth", the default',
            coal / flat,
        ),
    ]
    for key, name, label in OTHERS:
        if name in compared:
            what = f"query, 200 k triangles: time of {label} / ours"
            ratio = compared[name] / this
            found.append(Finding.of_rounds(key, what, ratio, aim=1.0, sense=">="))
    grown = [
        row
        for row in rows
        if row.name == sizes.OURS and 2 * sizes.CELLS[1] ** 2 <= row.triangles <= GROWN
    ]
    few, many = grown[0], grown[-1]
    found += [
        Finding.of_rounds(
            "query_growth",
            f"query at equal contact patch: {number(many.triangles)} / {number(few.triangles)} "
            "triangles",
            many.times / np.median(few.times),
            aim=4.0,
        ),
        Finding.of_rounds(
            "query_smooth",
            "query, 200 k triangles: curved elements / flat ones",
            this / flat,
            aim=1.5,
        ),
    ]
    return found


def sizes_table(rows: list[Row]) -> Table:
    """Return times and memory of all contestants at all sizes."""
    return Table(
        "queries_sizes",
        "Every contestant in a process of its own: query, building, memory held.",
        (
            *columns("code", "question: answers", "triangles", TIME_COLUMNS),
            Column("build_s", "build [s]", number),
            Column("memory_bytes", "memory [MB]", lambda m: number(m / 1e6)),
            *columns("bytes_per_triangle: bytes / triangle"),
        ),
        [
            (row.name, row.question, row.triangles, *row.query)
            + (row.build, row.memory, row.memory / row.triangles)
            for row in rows
        ],
        folded=True,
    )


def picture(rows: list[Row]) -> Picture:
    """Draw time and memory against the number of triangles."""
    with drawing.canvas(7.8, 3.9) as figure:
        panels = figure.subplots(1, 2)
        values: tuple[tuple[str, Callable[[Row], float]], ...] = (
            ("time of a query [us]", lambda r: r.query.median * 1e6),
            ("memory held [MB]", lambda r: r.memory / 1e6),
        )
        for axis, (title, value) in zip(panels, values, strict=True):
            drawing.logarithmic(axis, counts=True)
            axis.set_title(title)
            axis.set_xlabel("triangles")
            ends = []
            for name, (color, marker) in COLORS.items():
                line = [r for r in rows if r.name == name and value(r) > 0]
                if not line:
                    continue
                x = [r.triangles for r in line]
                axis.plot(x, [value(r) for r in line], color=color, marker=marker)
                ends.append((x[-1], value(line[-1]), name, color))
            axis.margins(x=0.04, y=0.12)
            if axis is panels[0]:
                for row in rows:
                    low, high = row.query.low * 1e6, row.query.high * 1e6
                    axis.plot([row.triangles] * 2, [low, high], color=COLORS[row.name][0])
            else:
                count = [r.triangles for r in rows]
                start = (min(count) * 3, 0.4 * min(value(r) for r in rows if value(r) > 0))
                drawing.guide(axis, start, max(count) / 30, 1, "~ triangles")
            drawing.label_ends(axis, ends, gap=0.06)
        png = drawing.png_of(figure)
    largest = max(r.triangles for r in rows)
    return Picture(
        "queries",
        png,
        f"Query time and memory from a thousand to {number(largest)} triangles for "
        f"{', '.join(sorted({r.name for r in rows}, key=list(COLORS).index))}.",
        "Left: median time of a query, with quartiles. Right: memory held after the first query.",
    )


if __name__ == "__main__":
    print_sections(section)
