"""Error of the contact force against the size of the elements, and cost, of every contact method.

python -m benchmarks.convergence [--out docs/pictures/convergence.png]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

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
    touching_centres,
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


@dataclass(frozen=True)
class Surface:
    """Meshes from coarse to fine, random places with outward normals, and where the sphere is."""

    meshes: Callable[[], list[Mesh]]
    places: Callable[[np.random.Generator, int], tuple[Array, Array]]
    inside: bool

    def touching(self, seed: int, count: int) -> tuple[Array, Array]:
        """Return centres (count, 3) of spheres DEPTH deep, and the exact unit forces (count, 3)."""
        points, outward = self.places(np.random.default_rng(seed), count)
        normals = -outward if self.inside else outward
        return points + (RADIUS - DEPTH) * normals, normals


@dataclass(frozen=True)
class Rule:
    """A way to find contacts: a method, and whether the shell is given the exact normals."""

    method: str
    exact_normals: bool
    color: str
    marker: str


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
    "bowl: inside a sphere, R = 4 r": Surface(balls, on_ball, inside=True),
    "dome: outside a sphere, R = 4 r": Surface(balls, on_ball, inside=False),
    "inside a torus, R = 6 r and 3 r": Surface(tori, torus_places, inside=True),
    "on a wavy sheet": Surface(sheets, sheet_places, inside=False),
}
# Those of the report, under short names.
REPORTED = {
    "bowl": SURFACES["bowl: inside a sphere, R = 4 r"],
    "dome": SURFACES["dome: outside a sphere, R = 4 r"],
    "torus": SURFACES["inside a torus, R = 6 r and 3 r"],
    "flat plate": Surface(plates, plate_places, inside=False),
}
RULES = {
    "smooth, exact normals": Rule("smooth", True, "#2f6fde", "o"),
    "smooth, estimated normals": Rule("smooth", False, "#1a9a5a", "s"),
    "facets": Rule("facets", False, "#f08a00", "^"),
    "elements": Rule("elements", False, "#d4202a", "v"),
}


def relative_forces(shell: Shell, method: str, centres: Array) -> Array:
    """Return the forces (n, 3) of the law k depth^1.5, divided by the exact magnitude."""
    forces = np.empty((len(centres), 3))
    for i, centre in enumerate(centres):
        terms = shell.contacts(centre, RADIUS, method=method).terms
        forces[i] = (terms.weight * (terms.depth / DEPTH) ** EXPONENT) @ terms.normal
    return forces


def measure(
    name: str, surface: Surface, rounds: int = 0, progress: Progress = silent, finest: int = 5
) -> list[Row]:
    """Measure every rule on the first `finest` meshes of a surface; queries timed in `rounds`."""
    centres, normals = surface.touching(0, PLACES)
    elsewhere, _ = surface.touching(1, TIMED_PLACES)
    rows, contestants = [], {}
    meshes = surface.meshes()[:finest]
    for k, mesh in enumerate(meshes):
        estimated = Shell(mesh.vertices, mesh.triangles)
        exact = Shell(mesh.vertices, mesh.triangles, normals=mesh.normals)
        for label, rule in RULES.items():
            shell = exact if rule.exact_normals else estimated
            rows.append(
                row_of(name, label, mesh, relative_forces(shell, rule.method, centres), normals)
            )
            contestants[str(len(rows) - 1)] = query_contestant(shell, elsewhere, rule.method)
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


def print_table(rows: list[Row]) -> None:
    """Print the errors, and the orders observed between one mesh and the next."""
    for name in SURFACES:
        print(f"{name}; depth / r = {DEPTH / RADIUS:g}, {PLACES} places; means [order]")
        print(f"  {'':26s} triangles    h/r          force  largest      magnitude  direction, deg")
        for label in RULES:
            coarser = None
            for row in (r for r in rows if (r.surface, r.rule) == (name, label)):
                columns = [
                    f"{getattr(row, key):8.1e} {order(coarser, row, key):6s}"
                    for key in ("mean", "magnitude", "direction")
                ]
                print(
                    f"  {label:25s} {row.triangles:10d}  {row.side:5.3f}  {columns[0]}  "
                    f"{row.largest:6.0e}  {columns[1]} {columns[2]}".rstrip()
                )
                coarser = row


def order(coarser: Row | None, finer: Row, key: str) -> str:
    """Return the exponent of the element size that a mean error followed, in brackets."""
    if coarser is None:
        return ""
    fall = getattr(coarser, key) / getattr(finer, key)
    return f"[{np.log(fall) / np.log(coarser.side / finer.side):.1f}]"


def measure_cost(rounds: int, progress: Progress = silent) -> dict[str, dict[str, Array]]:
    """Return the times of a query [s] of each method on 200 k triangles, wavy and flat."""
    depth = 0.0005
    vertices, triangles = wavy_sheet(316, 1.0)
    centres = touching_centres(20_000, 1.0, QUERY_RADIUS, depth)
    above = centres * [1.0, 1.0, 0.0] + [0.0, 0.0, QUERY_RADIUS - depth]
    surfaces = {"wavy sheet": (vertices, centres), "flat plate": (vertices * [1, 1, 0], above)}
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


def print_equal_error(rows: list[Row], rounds: int) -> None:
    """Print what an error of flat elements costs with curved ones: elements, and time."""
    name, flat = "dome: outside a sphere, R = 4 r", "facets"
    finest = [r for r in rows if (r.surface, r.rule) == (name, flat)][-1]
    curved = [r for r in rows if (r.surface, r.rule) == (name, "smooth, exact normals")]
    enough = next(r for r in curved if r.mean <= finest.mean)
    points, normals = on_ball(np.random.default_rng(1))
    centres = np.tile(points + (RADIUS - DEPTH) * normals, (20, 1))
    contestants = {}
    for row, method in ((finest, "facets"), (enough, "smooth")):
        mesh = next(m for m in balls() if len(m.triangles) == row.triangles)
        shell = Shell(mesh.vertices, mesh.triangles, normals=mesh.normals)
        contestants[method] = query_contestant(shell, centres, method)
    times = take_turns(contestants, rounds)
    print(
        f"Dome, mean error of the force at most {finest.mean:.1e}\n"
        f"  facets {finest.triangles:8d} triangles   {median_us(times['facets'])}\n"
        f"  smooth {enough.triangles:8d} triangles   {median_us(times['smooth'])}   "
        f"error {enough.mean:.1e}\n"
        f"  {finest.triangles / enough.triangles:.0f} times fewer, "
        f"{ratio(times['facets'], times['smooth'])} x faster"
    )


def figure_of(rows: list[Row]) -> Any:
    """Draw mean force errors as lines, up to the largest as bands, one panel per surface."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 8.6), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for axis, name in zip(panels.ravel(), SURFACES, strict=True):
        for label, rule in RULES.items():
            found = [r for r in rows if (r.surface, r.rule) == (name, label)]
            side, mean, largest = np.array([(r.side, r.mean, r.largest) for r in found]).T
            # On a sphere estimated normals are exact, and one line hides the other.
            look = "-" if rule.exact_normals or rule.method != "smooth" else "--"
            fill = "none" if look == "--" else rule.color
            axis.fill_between(side, mean, largest, color=rule.color, alpha=0.13, linewidth=0)
            axis.loglog(
                side, mean, look, color=rule.color, marker=rule.marker, label=label,
                markersize=8 if look == "--" else 5, markerfacecolor=fill,
            )  # fmt: skip
        for exponent in (2, 4):
            guide = np.array([0.35, 1.2])
            fall = 1e-6 * (guide / guide[1]) ** exponent
            axis.loglog(guide, fall, color="#6b7280", linestyle=":", linewidth=1)
            axis.annotate(
                f"order {exponent} ", (guide[0], fall[0]), color="#6b7280", fontsize=8,
                ha="right", va="center",
            )  # fmt: skip
        axis.set_title(name, fontsize=10)
        axis.grid(True, which="major", color="#e5e7eb")
        axis.set_axisbelow(True)
    figure.supxlabel("mean side of the elements / r", fontsize=10)
    figure.supylabel("error of the force / force (line: mean, band: to the largest)", fontsize=10)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(RULES), frameon=False)
    return figure


def main() -> None:
    """Measure, print the tables, draw the figure."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.convergence", description=(__doc__ or "").partition("\n")[0]
    )
    default = Path(__file__).parent.parent / "docs" / "pictures" / "convergence.png"
    parser.add_argument("--out", type=Path, default=default, help="the figure (.png)")
    out = parser.parse_args().out
    one_core()
    print(machine())
    rows = [row for name, surface in SURFACES.items() for row in measure(name, surface)]
    print_table(rows)
    print_equal_error(rows, rounds=15)
    print_cost(rounds=15)
    figure_of(rows).savefig(out, dpi=110)
    print(f"wrote {out}")


if __name__ == "__main__":
    main()
