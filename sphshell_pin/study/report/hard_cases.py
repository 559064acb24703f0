"""Section 5: the hard cases, each against a closed form or a bound of physics."""

from __future__ import annotations

import math

from sphshell_pin.benchmarks import hard_cases
from sphshell_pin.benchmarks.hard_cases import Found, Row
from sphshell_pin.study.report.contents import (
    Column,
    Finding,
    Picture,
    Progress,
    Section,
    Table,
    columns,
)
from sphshell_pin.study.report.drawing import (
    BLUE,
    INK,
    RED,
    SMALL,
    drawing,
    png_of,
    power_of_ten,
)

KEY, TITLE = "hard_cases", "Hard cases"
TEXT = """\
Runs that are compared with a closed form, or with a bound that physics sets: impacts, rolling,
surfaces, energy, impact tests, under-stiff laws, extreme numbers, rest on slopes. Each verdict has
a bound for its error."""
ABSENT = """\
The hard cases are part of the checkout (tests/hard_cases), and this package is installed without
it: run the report from a checkout to have them here."""
LEAST = 1e-16  # errors below, zero among them, are drawn here


def section(*, quick: bool, progress: Progress) -> Section:
    """Run the cases where there is a checkout, and return the section."""
    root = hard_cases.checkout()
    if root is None:
        absent = ABSENT.replace("\n", " ")
        without = "hard cases (this package is no checkout)"
        return Section(KEY, TITLE, TEXT, notes=[absent], unmeasured=[without])
    return assemble(hard_cases.measure(root, quick=quick, progress=progress), quick=quick)


def assemble(found: Found, *, quick: bool) -> Section:
    """Return the section of the verdicts."""
    missed = [row for row in found.rows if not row.ok]
    held = len(found.rows) - len(missed)
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=[
            Finding(
                "hard_cases",
                f"verdicts of {found.cases} hard cases that are out of bounds",
                float(len(missed)),
                aim=0.0,
                headline=True,
                shown=f"{len(missed)} of {len(found.rows)}",
            )
        ],
        pictures=[picture(found.rows)] if found.rows else [],
        tables=[table(found.rows)],
        notes=[
            f"{held} of {len(found.rows)} verdicts are within their bounds, in "
            f"{found.seconds:.0f} s."
            + (" The slow cases were left out (--quick)." if quick else ""),
            *(f"Out of bounds: {row.case}, {row.tried}: {row.measured}." for row in missed),
        ],
        unmeasured=["the slow ones of the hard cases (left out by --quick)"] if quick else [],
    )


def table(rows: list[Row]) -> Table:
    """Return all verdicts."""
    return Table(
        "hard_cases",
        "All verdicts.",
        (
            *columns("group", "case", "tried: what is tried", "law"),
            Column("expected", "expected", seven_digits),
            Column("measured", "measured", seven_digits),
            *columns("error", "bound"),
            Column("ok", "verdict", lambda ok: "ok" if ok else "FAILS"),
        ),
        [
            (r.group, r.case, r.tried, r.law, r.expected, r.measured, r.error, r.bound, r.ok)
            for r in rows
        ],
        folded=True,
    )


def seven_digits(value: float | str) -> str:
    """Return a figure as docs/hard_cases.md shows it."""
    return value if isinstance(value, str) else f"{value:.7g}"


def picture(rows: list[Row]) -> Picture:
    """Draw each verdict as a dot: its error over its bound, in the row of its group."""
    groups = list(dict.fromkeys(row.group for row in rows))
    with drawing(7.8, 0.3 * len(groups) + 0.9) as figure:
        axis = figure.subplots()
        axis.set_xscale("log")
        for k, row in enumerate(rows):
            share = row.error / row.bound if row.bound > 0 else (0.0 if row.ok else math.inf)
            x = min(max(share, LEAST), 1e3) if math.isfinite(share) else 1e3
            jitter = 0.5 * ((k * 0.618034) % 1 - 0.5)
            color = BLUE if row.ok else RED
            axis.plot(x, groups.index(row.group) + jitter, "o", color=color, alpha=0.55, ms=3.4)
        axis.axvline(1.0, color=INK, linewidth=1.0)
        axis.annotate(
            "bound", (1.0, -0.6), xytext=(4, 0), textcoords="offset points", fontsize=SMALL,
            va="bottom", annotation_clip=False,
        )  # fmt: skip
        axis.set_yticks(range(len(groups)), groups)
        axis.set_ylim(len(groups) - 0.4, -0.6)
        axis.set_xlim(LEAST / 2, 1e1 if all(row.ok for row in rows) else 2e3)
        from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

        axis.xaxis.set_major_locator(LogLocator(base=1e4, numticks=10))
        axis.xaxis.set_major_formatter(FuncFormatter(power_of_ten))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.tick_params(axis="y", length=0)
        axis.grid(visible=True, axis="x")
        axis.set_xlabel("error / bound")
        png = png_of(figure)
    return Picture(
        "hard_cases",
        png,
        f"Error over bound of {len(rows)} verdicts in {len(groups)} groups.",
        "A dot is a verdict: its error over what bounds it; no error at all is at the left edge.",
    )
