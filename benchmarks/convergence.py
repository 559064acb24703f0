"""Error of the contact force against the size of the elements, and cost, of every contact method.

python -m benchmarks.convergence    # prints tables, draws docs/pictures/convergence.png
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.benchmarks.query import RADIUS as QUERY_RADIUS
from sphshell_pin.benchmarks.query import query_contestant
from sphshell_pin.benchmarks.surfaces import (
    SHEET,
    Mesh,
    ball_places,
    icosphere,
    on_sheet,
    on_torus,
    plate,
    sheet,
    torus,
    touching_centers,
    wavy_sheet,
)
from sphshell_pin.benchmarks.timing import (
    Progress,
    Spread,
    machine,
    median_us,
    one_core,
    part,
    ratio,
    silent,
    take_turns,
)

Array = NDArray[np.float64]
RADIUS = 0.010  # of the touching sphere [m]
DEPTH = 0.04 * RADIUS
EXPONENT = 1.5
PLACES = 300
BALL = 4 * RADIUS
RING, TUBE = 6 * RADIUS, 3 * RADIUS
PLATE = 6 * RADIUS  # half the side of the flat plate
TIMED_PLACES = 2000
PICTURE = Path(__file__).parent.parent / "docs" / "pictures" / "convergence.png"


@dataclass(frozen=True)
class Surface:
    """Meshes from coarse to fine, random places with outward normals, and where the sphere is."""

    meshes: Callable[[], list[Mesh]]
    places: Callable[[np.random.Generator, int], tuple[Array, Array]]
    inside: bool

    def touching(self, seed: int, count: int) -> tuple[Array, Array]:
        """Return centers (count, 3) of spheres DEPTH deep, and the exact unit forces (count, 3)."""
        points, outward = self.places(np.random.default_rng(seed), count)
        normals = -outward if self.inside else outward
        return points + (RADIUS - DEPTH) * normals, normals


@dataclass(frozen=True)
class Row:
    """Errors of one rule on one mesh, over all places.

    Of the force as a vector, divided by the exact one; of its magnitude alone; of its direction
    [deg], where there is a force.
    """

    surface: str
    rule: str
    triangles: int
    side: float  # mean side of the elements / radius of the sphere
    mean: float
    largest: float
    magnitude: float
    direction: float
    time: Spread | None = None  # of a query [s]


def on_ball(rng: np.random.Generator, count: int = PLACES) -> tuple[Array, Array]:
    return ball_places(BALL, rng, count)


def torus_places(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    return on_torus(RING, TUBE, *rng.uniform(0, 2 * np.pi, (2, count)))


def sheet_places(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = SHEET - 1.3  # of the borders
    points, normals = on_sheet(*rng.uniform(-clear, clear, (2, count)))
    return RADIUS * points, normals


def plate_places(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = PLATE - 1.3 * RADIUS
    xy = rng.uniform(-clear, clear, (count, 2))
    return np.c_[xy, np.zeros(count)], np.tile([0.0, 0.0, 1.0], (count, 1))


def balls() -> list[Mesh]:
    return [icosphere(level, BALL) for level in (2, 3, 4, 5, 6)]


def tori() -> list[Mesh]:
    return [torus(RING, TUBE, side * RADIUS) for side in (1.0, 0.5, 0.25, 0.125, 0.0625)]


def sheets() -> list[Mesh]:
    meshes = [sheet(side) for side in (1.2, 0.6, 0.3, 0.15, 0.075)]
    return [Mesh(RADIUS * m.vertices, m.triangles, m.normals) for m in meshes]


def plates() -> list[Mesh]:
    return [plate(side * RADIUS, PLATE) for side in (1.0, 0.5, 0.25, 0.125, 0.0625)]


SURFACES = {
    "bowl": Surface(balls, on_ball, inside=True),
    "dome": Surface(balls, on_ball, inside=False),
    "torus": Surface(tori, torus_places, inside=True),
    "wavy sheet": Surface(sheets, sheet_places, inside=False),
    "flat plate": Surface(plates, plate_places, inside=False),
}
REPORTED = ("bowl", "dome", "torus", "flat plate")
# Method, and whether the shell is given the exact normals.
RULES = {
    "smooth, exact normals": ("smooth", True),
    "smooth, estimated normals": ("smooth", False),
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


def measure(
    name: str, surface: Surface, rounds: int = 0, progress: Progress = silent, finest: int = 5
) -> list[Row]:
    """Measure every rule on the first `finest` meshes of a surface; queries timed in `rounds`."""
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
            rows.append(row_of(name, label, mesh, relative_forces(shell, method, centers), normals))
            contestants[str(len(rows) - 1)] = query_contestant(shell, elsewhere, method)
        progress(0.5 * (k + 1) / len(meshes))
    if rounds == 0:
        return rows
    times = take_turns(contestants, rounds, part(progress, 0.5, 1.0))
    return [replace(row, time=Spread.of(times[str(k)])) for k, row in enumerate(rows)]


def row_of(name: str, label: str, mesh: Mesh, forces: Array, normals: Array) -> Row:
    """Return the errors of relative forces (n, 3) whose exact values are the normals (n, 3)."""
    errors = np.linalg.norm(forces - normals, axis=1)
    magnitudes = np.linalg.norm(forces, axis=1)
    some = magnitudes > 0
    sines = np.linalg.norm(np.cross(forces, normals), axis=1)[some]
    angles = np.arctan2(sines, np.einsum("ij,ij->i", forces, normals)[some])
    return Row(
        surface=name,
        rule=label,
        triangles=len(mesh.triangles),
        side=mesh.mean_side / RADIUS,
        mean=float(errors.mean()),
        largest=float(errors.max()),
        magnitude=float(np.abs(magnitudes - 1).mean()),
        direction=float(np.degrees(angles).mean()),
    )


def measure_cost(rounds: int, progress: Progress = silent) -> dict[str, dict[str, Array]]:
    """Return the times of a query [s] of each method on 200 k triangles, wavy and flat."""
    depth = 0.0005
    vertices, triangles = wavy_sheet(316, 1.0)
    centers = touching_centers(20_000, 1.0, QUERY_RADIUS, depth)
    above = centers * [1.0, 1.0, 0.0] + [0.0, 0.0, QUERY_RADIUS - depth]
    surfaces = {"wavy sheet": (vertices, centers), "flat plate": (vertices * [1, 1, 0], above)}
    found = {}
    for k, (name, (corners, places)) in enumerate(surfaces.items()):
        shell = Shell(corners, triangles)
        methods = ("facets", "smooth", "elements")
        contestants = {m: query_contestant(shell, places, m) for m in methods}
        found[name] = take_turns(contestants, rounds, part(progress, k / 2, (k + 1) / 2))
    return found


def print_cost(rounds: int) -> None:
    """Print the time of a query of each method, as `benchmarks.query` measures it."""
    for name, times in measure_cost(rounds).items():
        print(f"Query, {name} of 199712 triangles, r = 10 mm, depth 0.5 mm, cold random positions")
        for method, t in times.items():
            print(f"  {method:25s} {median_us(t)}   {ratio(t, times['facets'])} x")


def main() -> None:
    """Measure, print the tables, draw the picture: those of the report, with the wavy sheet."""
    from sphshell_pin.study.report import forces

    one_core()
    print(machine())
    names = ("bowl", "dome", "torus", "wavy sheet")
    rows = [row for name in names for row in measure(name, SURFACES[name], rounds=5)]
    print(forces.orders_table(names, rows).markdown())
    print(forces.errors_table(rows).markdown())
    print_cost(rounds=15)
    PICTURE.write_bytes(forces.picture(names, rows, against_time=False).png)
    print(f"wrote {PICTURE}")


if __name__ == "__main__":
    main()
