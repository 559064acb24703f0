"""Section 1: error of the contact force, against the number of elements and the time of a query."""

from __future__ import annotations

import numpy as np

from sphshell_pin.benchmarks import convergence, timing
from sphshell_pin.benchmarks.convergence import Row
from sphshell_pin.study.report.contents import (
    Finding,
    Picture,
    Progress,
    Section,
    Table,
    columns,
    number,
)
from sphshell_pin.study.report.drawing import (
    BLUE,
    DASHED,
    GREEN,
    ORANGE,
    RED,
    SMALL,
    drawing,
    guide,
    label_ends,
    logarithmic,
    png_of,
)

KEY, TITLE = "forces", "Error of the contact force"
SMOOTH, ESTIMATED = "smooth, exact normals", "smooth, estimated normals"
# Name, color, marker, line: estimated normals are exact on a sphere, and one hides the other.
LOOKS = {
    SMOOTH: ("smooth", BLUE, "o", "-"),
    ESTIMATED: ("smooth, estimated", GREEN, "s", DASHED),
    "facets": ("facets", ORANGE, "^", "-"),
    "elements": ("elements", RED, "v", "-"),
}
CURVED = ("bowl", "dome", "torus")
AT = 0.3  # h / r at which errors are compared
TEXT = """\
A sphere of radius r lies 0.04 r deep in or on a surface whose elements have sides of the mean
length h, at 300 random places; its force of the law k depth^1.5 is compared, as a vector, with that
of the exact surface. Bowl and dome are the inside and the outside of a sphere of 4 r, the torus
(inside) has radii of 6 r and 3 r, the flat plate is made of random triangles. The method "smooth"
bends the elements to the normals of their vertices, exact ones or those estimated from the mesh;
"facets" is the exact polyhedron; "elements" sums over all elements, as SPHSHL3 did. On a faceted
bowl the sphere is pushed by both sides of every edge, and refinement does not help; the sum over
elements grows without limit."""


def section(*, quick: bool, progress: Progress) -> Section:
    """Measure and return the section."""
    names = convergence.REPORTED
    rows: list[Row] = []
    for k, name in enumerate(names):
        share = timing.part(progress, k / len(names), (k + 1) / len(names))
        surface, rounds, finest = convergence.SURFACES[name], 3 if quick else 7, 4 if quick else 5
        rows += convergence.measure(name, surface, rounds, share, finest)
    return assemble(names, rows)


def assemble(names: tuple[str, ...], rows: list[Row]) -> Section:
    """Return the section of measured rows."""
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=findings_of(rows),
        pictures=[
            picture(names, rows, against_time=False),
            picture(names, rows, against_time=True),
        ],
        tables=[orders_table(names, rows), errors_table(rows)],
    )


def of(rows: list[Row], surface: str, rule: str) -> list[Row]:
    """Return the rows of one line, coarse to fine."""
    return [row for row in rows if (row.surface, row.rule) == (surface, rule)]


def order(line: list[Row]) -> float:
    """Return the power of h that the mean error follows, by a fit over all meshes."""
    side, error = np.array([(row.side, row.mean) for row in line]).T
    return float(np.polyfit(np.log(side), np.log(error), 1)[0])


def error_at(line: list[Row], which: str = "mean", side: float = AT) -> float:
    """Return the mean or largest error at h / r, between two meshes by a power law."""
    sides = np.log([row.side for row in reversed(line)])
    errors = np.log([getattr(row, which) for row in reversed(line)])
    return float(np.exp(np.interp(np.log(side), sides, errors)))


def findings_of(rows: list[Row]) -> list[Finding]:
    """Return the figures that have aims."""
    lines = [of(rows, name, SMOOTH) for name in CURVED]
    estimated = [of(rows, name, ESTIMATED) for name in CURVED]
    error = (
        f"force error, mean: elements of {AT} sphere radii (h / r = {AT}), exact normals; "
        "worst of bowl, dome, torus"
    )
    lowest = "order of the force error in h, exact normals: lowest of bowl, dome, torus"
    flat = "force error on a flat plate, any refinement, side force included"
    return [
        Finding("force_error", error, max(map(error_at, lines)), aim=1e-4, headline=True),
        Finding(
            "force_error_largest",
            "the same, the largest error at any place",
            max(error_at(line, "largest") for line in lines),
        ),
        Finding("force_order", lowest, min(map(order, lines)), aim=3.5, sense=">="),
        Finding(
            "force_order_estimated",
            "the same with normals estimated from the mesh",
            min(map(order, estimated)),
            aim=2.0,
            sense=">=",
        ),
        Finding(
            "flat_error",
            flat,
            max(row.largest for row in of(rows, "flat plate", SMOOTH)),
            aim=1e-12,
            headline=True,
        ),
    ]


def orders_table(names: tuple[str, ...], rows: list[Row]) -> Table:
    """Return order and error at h / r = AT of every method on every surface."""
    cells = []
    for name in names:
        for rule in LOOKS:
            line = of(rows, name, rule)
            fine = line[-1]
            exact = max(row.largest for row in line) < 1e-12
            cells.append(
                (name, rule, None if exact else order(line), error_at(line))
                + (error_at(line, "largest"), fine.triangles, fine.mean, fine.time.median)
            )
    return Table(
        "forces_orders",
        "Orders by a fit over all meshes; none where the force is exact at any size.",
        columns(
            "surface",
            "method",
            "order",
            "mean_error_at_0.3: error at h/r = 0.3",
            "largest_error_at_0.3: largest",
            "finest_triangles: triangles of the finest mesh",
            "finest_mean_error: error there",
            "query_s: query [us]",
        ),
        cells,
    )


def errors_table(rows: list[Row]) -> Table:
    """Return every row that was measured."""
    return Table(
        "forces",
        "All meshes: errors of the force over the force, and time of a query.",
        columns(
            "surface",
            "method",
            "triangles",
            "side_over_radius: h/r",
            "mean_error",
            "largest_error: largest",
            "mean_magnitude_error: of the magnitude",
            "mean_direction_error_deg: of the direction [deg]",
            "query_s: query [us]",
            "query_low_s: lower quartile",
            "query_high_s: upper quartile",
        ),
        [
            (row.surface, row.rule, row.triangles, row.side, row.mean, row.largest)
            + (row.magnitude, row.direction, row.time.median, row.time.low, row.time.high)
            for row in rows
        ],
        folded=True,
    )


def picture(names: tuple[str, ...], rows: list[Row], *, against_time: bool) -> Picture:
    """Draw mean errors as lines, one panel per surface; against elements up to the largest, too."""
    looks = {rule: look for rule, look in LOOKS.items() if not against_time or rule != ESTIMATED}

    def abscissa(row: Row) -> float:
        return float(row.time.median * 1e6 if against_time else row.triangles)

    with drawing(7.8, 5.8) as figure:
        figure.set_layout_engine("constrained", h_pad=0.09)
        panels = figure.subplots(2, 2, sharex=True).ravel()
        for axis, name in zip(panels, names, strict=True):
            flat = name == "flat plate"
            logarithmic(axis, counts=True, every=(1, 3 if flat else 2))
            axis.set_ylim(*((1e-17, 1e3) if flat else (1e-10, 1e2)))
            axis.set_title(name)
            for rule, (_, color, marker, dashes) in looks.items():
                line = of(rows, name, rule)
                mean, x = [r.mean for r in line], [abscissa(r) for r in line]
                axis.plot(x, mean, color=color, marker=marker, linestyle=dashes)
                if not against_time:
                    largest = [r.largest for r in line]
                    axis.fill_between(x, mean, largest, color=color, alpha=0.15, linewidth=0)
            if not against_time and not flat:
                guide(axis, (350, 2e-7), 2500, -1, "order 2")
                guide(axis, (350, 2e-7), 2500, -2, "order 4")
        for axis, name in zip(panels, names, strict=True):  # now that all have their limits
            ends = []
            for rule, (label, color, _, _) in looks.items():
                last = of(rows, name, rule)[-1]
                ends.append((abscissa(last), last.mean, label, color))
            label_ends(axis, ends)
        figure.supxlabel("time of a query [us]" if against_time else "elements", fontsize=SMALL + 1)
        figure.supylabel("error of the force / force", fontsize=SMALL + 1)
        png = png_of(figure)
    if against_time:
        return Picture(
            "force_time",
            png,
            "Error of the force against the time of a query, three methods on four surfaces.",
            "What an error costs: mean error against the median time of a query on one core, from "
            "coarse to fine meshes along each line.",
        )
    best = number(error_at(of(rows, names[0], SMOOTH)))
    return Picture(
        "force_elements",
        png,
        f"Error of the force against the number of elements; smooth reaches {best} on the "
        f"{names[0]} at h/r = {AT}.",
        "Mean error (line) and up to the largest (band) against the number of elements, with the "
        "slopes of orders 2 and 4 in the size of the elements.",
    )
