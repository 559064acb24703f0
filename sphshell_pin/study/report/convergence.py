"""Error of the contact force against the size of the elements, and cost, of every contact method.

A sphere of radius r lies 0.04 r deep in or on a surface whose elements have sides of the mean
length h, at 300 random places; its force of the law k depth^1.5 is compared, as a vector, with that
of the exact surface. Bowl and dome are the inside and the outside of a sphere of 4 r, the torus
(inside) has radii of 6 r and 3 r, the flat plate is made of random triangles. The method "smooth"
bends the elements to the normals of their vertices, exact ones or those estimated from the mesh;
"facets" is the exact polyhedron; "elements" sums over all elements, as SPHSHL3 did. On a faceted
bowl the sphere is pushed by both sides of every edge, and refinement does not help; the sum over
elements grows without limit.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report import contents
from sphshell_pin.study.report.surfaces import DEPTH, RADIUS, SURFACES
from sphshell_pin.study.report.timing import part, per_center, silent, take_turns

PLACES = 300
EXPONENT = 1.5
TIMED_PLACES = 2000


@dataclass(frozen=True)
class Row:
    """Errors of the force as a vector, over the exact one, of one rule on one mesh."""

    surface: str
    rule: str
    triangles: int
    side: float  # mean side of the elements / radius of the sphere
    mean: float
    largest: float
    query: float = math.nan  # median time [s], once it is measured


SMOOTH, ESTIMATED = "smooth, exact normals", "smooth, estimated normals"
# Method, and whether the shell is given the exact normals.
RULES = {
    SMOOTH: ("smooth", True),
    ESTIMATED: ("smooth", False),
    "facets": ("facets", False),
    "elements": ("elements", False),
}


def relative_forces(shell: Shell, method: str, centers: Array) -> Array:
    """Return the forces (n, 3) of the law k depth^1.5, divided by the exact magnitude."""
    forces = np.empty((len(centers), 3))
    for i, center in enumerate(centers):
        terms = shell.contacts(center, RADIUS, method=method).terms
        forces[i] = (terms.weight * (terms.depth / DEPTH) ** EXPONENT) @ terms.normal
    return forces


def measure(name: str, rounds: int, finest: int, progress: contents.Progress = silent) -> list[Row]:
    """Measure every rule on the first `finest` meshes of a surface; queries timed in `rounds`."""
    surface = SURFACES[name]
    centers, normals = surface.touching(0, PLACES)
    elsewhere, _ = surface.touching(1, TIMED_PLACES)
    rows, contestants = [], {}
    meshes = surface.meshes()[:finest]
    for k, mesh in enumerate(meshes):
        # Free shapes are meant: these would be recognized as spheres and tori, and be exact.
        estimated = Shell(mesh.vertices, mesh.triangles, faces=False)
        exact = Shell(mesh.vertices, mesh.triangles, normals=mesh.normals, faces=False)
        for label, (method, exact_normals) in RULES.items():
            shell = exact if exact_normals else estimated
            off = np.linalg.norm(relative_forces(shell, method, centers) - normals, axis=1)
            size = len(mesh.triangles), mesh.mean_side / RADIUS
            rows.append(Row(name, label, *size, float(off.mean()), float(off.max())))
            contestants[len(rows) - 1] = query_contestant(shell, elsewhere, RADIUS, method)
        progress(0.5 * (k + 1) / len(meshes))
    times = take_turns(contestants, rounds, part(progress, 0.5, 1.0))
    return [replace(row, query=float(np.median(times[k]))) for k, row in enumerate(rows)]


def query_contestant(
    shell: Shell, centers: Array, radius: float, method: str
) -> Callable[[], float]:
    """Return what asks the shell for the contacts of all spheres and times one of them."""
    return per_center(
        lambda: shell.contacts_batch(centers, radius, method=method, threads=1), len(centers)
    )


KEY, TITLE = "forces", "Error of the contact force"
CURVED = ("bowl", "dome", "torus")
AT = 0.3  # h / r at which errors are compared


def section(*, quick: bool, progress: contents.Progress) -> contents.Section:
    """Measure and return the section."""
    rows: list[Row] = []
    rounds, finest = (3, 4) if quick else (7, 5)
    for k, name in enumerate(SURFACES):
        share = part(progress, k / len(SURFACES), (k + 1) / len(SURFACES))
        rows += measure(name, rounds, finest, share)
    return assemble(rows)


def assemble(rows: list[Row]) -> contents.Section:
    """Return the section of measured rows."""
    findings, tables = findings_of(rows), [orders_table(rows)]
    return contents.Section(KEY, TITLE, contents.about(__doc__), findings, tables)


def of(rows: list[Row], surface: str, rule: str) -> list[Row]:
    """Return the rows of one line, coarse to fine."""
    return [row for row in rows if (row.surface, row.rule) == (surface, rule)]


def order(line: list[Row]) -> float:
    """Return the power of h that the mean error follows, by a fit over all meshes."""
    side, error = np.array([(row.side, row.mean) for row in line]).T
    return float(np.polyfit(np.log(side), np.log(error), 1)[0])


def error_at(line: list[Row], which: str = "mean") -> float:
    """Return the mean or largest error at h / r = AT, between two meshes by a power law."""
    sides = np.log([row.side for row in reversed(line)])
    errors = np.log([getattr(row, which) for row in reversed(line)])
    return float(np.exp(np.interp(np.log(AT), sides, errors)))


def findings_of(rows: list[Row]) -> list[contents.Finding]:
    """Return the figures that have aims."""
    lines = [of(rows, name, SMOOTH) for name in CURVED]
    estimated = min(order(of(rows, name, ESTIMATED)) for name in CURVED)
    flat = max(row.largest for row in of(rows, "flat plate", SMOOTH))
    error = (
        f"force error, mean: elements of {AT} sphere radii (h / r = {AT}), exact normals; "
        "worst of bowl, dome, torus"
    )
    largest = "the same, the largest error at any place"
    lowest = "order of the force error in h, exact normals: lowest of bowl, dome, torus"
    by_mesh = "the same with normals estimated from the mesh"
    on_flat = "force error on a flat plate, any refinement, side force included"
    worst = max(error_at(line, "largest") for line in lines)
    return [
        contents.Finding("force_error", error, max(map(error_at, lines)), aim=1e-4),
        contents.Finding("force_error_largest", largest, worst),
        contents.Finding("force_order", lowest, min(map(order, lines)), aim=3.5, sense=">="),
        contents.Finding("force_order_estimated", by_mesh, estimated, aim=2.0, sense=">="),
        contents.Finding("flat_error", on_flat, flat, aim=1e-12),
    ]


def orders_table(rows: list[Row]) -> contents.Table:
    """Return order and error at h / r = AT of every method on every surface."""
    cells = []
    for name, rule in product(SURFACES, RULES):
        line = of(rows, name, rule)
        exact = max(row.largest for row in line) < 1e-12
        errors = None if exact else order(line), error_at(line), error_at(line, "largest")
        finest = line[-1].triangles, line[-1].mean, line[-1].query
        cells.append((name, rule, *errors, *finest))
    return contents.Table(
        "forces_orders",
        "Orders by a fit over all meshes; none where the force is exact at any size.",
        contents.columns(
            "surface; method; order; mean_error_at_0.3: error at h/r = 0.3; largest_error_at_0.3: "
            "largest; finest_triangles: triangles of the finest mesh; finest_mean_error: error "
            "there; query_s: query [us]"
        ),
        cells,
    )
