"""Time of a query, against Coal's and against the number of triangles.

All contacts of a 10 mm sphere pressed 0.5 mm into a wavy sheet, at random positions that the caches
do not know, on one core, by the default method, "smooth", unless another is named. Coal collects a
contact for every triangle that is touched. The sheet grows at equal size of its triangles, so that
the sphere always touches the same number of them.
"""

from collections.abc import Callable

import coal
import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.shell.primitives import coal_tree
from sphshell_pin.study.report import contents
from sphshell_pin.study.report.convergence import query_contestant
from sphshell_pin.study.report.surfaces import touching_centers, wavy_sheet
from sphshell_pin.study.report.timing import part, per_center, take_turns

KEY, TITLE = "queries", "Time of a query"
RADIUS, DEPTH = 0.010, 0.0005  # [m]
# Cells along a side of the sheet, at equal size of the cells: 2048 to 2 M triangles.
FEW, COMPARED, MANY = 32, 316, 1000
SIDE = 1 / 316  # of a cell [m]
CENTERS, COAL_CENTERS = 20_000, 2000
OURS, FLAT, COAL = "smooth", "facets", "coal::collide"
Times = dict[tuple[str, int], Array]
"""Times of a query [s] (rounds,) by the code and the number of triangles."""


def coal_contestant(vertices: Array, triangles: Ints, centers: Array) -> Callable[[], float]:
    """Time coal.collide, called from Python, which adds about 1 us to some 100 us."""
    tree, sphere = coal_tree(vertices, triangles), coal.Sphere(RADIUS)
    request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, 1_000_000)
    result, there, place = coal.CollisionResult(), coal.Transform3s(), coal.Transform3s()

    def ask() -> None:
        for center in centers:
            place.setTranslation(center)
            result.clear()
            coal.collide(sphere, place, tree, there, request, result)

    return per_center(ask, len(centers))


def measure(cells: tuple[int, ...], rounds: int, progress: contents.Progress) -> Times:
    """Return the times of a query on sheets of so many cells; Coal's on COMPARED alone."""
    contestants = {}
    for k, count in enumerate(cells):
        mesh, triangles = wavy_sheet(count, count * SIDE), 2 * count**2
        centers = touching_centers(CENTERS, count * SIDE, RADIUS, DEPTH)
        shell = Shell(*mesh)
        for method in (OURS, FLAT):
            contestants[method, triangles] = query_contestant(shell, centers, RADIUS, method)
        if count == COMPARED:
            contestants[COAL, triangles] = coal_contestant(*mesh, centers[:COAL_CENTERS])
        progress(0.5 * (k + 1) / len(cells))
    return take_turns(contestants, rounds, part(progress, 0.5, 1.0))


def section(*, quick: bool, progress: contents.Progress) -> contents.Section:
    """Measure and return the section; `quick` leaves out the largest sheet."""
    cells = (FEW, COMPARED) if quick else (FEW, COMPARED, MANY)
    return assemble(measure(cells, 5 if quick else 15, progress))


def assemble(times: Times) -> contents.Section:
    """Return the section of what was measured."""
    sizes = sorted({triangles for _, triangles in times})
    compared = 2 * COMPARED**2
    ours, flat, theirs = (times[name, compared] for name in (OURS, FLAT, COAL))
    grown = times[OURS, sizes[-1]] / np.median(times[OURS, sizes[0]])
    what = "query, 200 k triangles: "
    coal_collide = f"{what}time of coal::collide with all contacts / ours"
    facets = 'the same with the method "facets" in place of "smooth", the default'
    grew = " / ".join(map(contents.number, (sizes[-1], sizes[0])))
    growth = f"query at equal contact patch: {grew} triangles"
    ratio = contents.Finding.of_rounds
    findings = [
        ratio("query_coal", coal_collide, theirs / ours, 15.0, ">="),
        ratio("query_coal_facets", facets, theirs / flat),
        ratio("query_growth", growth, grown, aim=4.0),
        ratio("query_smooth", f"{what}curved elements / flat ones", ours / flat, aim=1.5),
    ]
    table = contents.Table(
        "queries",
        "Time of a query.",
        contents.columns("code", "triangles", contents.TIME_COLUMNS),
        [(name, triangles, *contents.Spread.of(t)) for (name, triangles), t in times.items()],
    )
    left_out = f"--quick leaves out {contents.number(2 * MANY**2)} triangles."
    notes = [] if sizes[-1] == 2 * MANY**2 else [left_out]
    return contents.Section(KEY, TITLE, contents.about(__doc__), findings, [table], notes)
