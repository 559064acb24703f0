"""Query time, building time and memory against the number of triangles, ours and others'.

The queries are those of the report, on a sheet that grows at equal size of its triangles. trimesh,
libigl and fcpw (in single precision) answer the smaller question of the one closest point. Each
contestant runs in a process of its own, so that its memory can be measured; all on one core, asked
in turn to time their queries. One that gets too slow or too big is left out of larger sheets.

python -m benchmarks.growth [--quick]    # prints the table; needs libigl, fcpw, rtree
"""

import argparse
import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.processes import OwnProcess, resident
from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import (
    TIME_COLUMNS,
    TIMES,
    Column,
    Progress,
    Spread,
    Table,
    columns,
    number,
)
from sphshell_pin.study.report.convergence import query_contestant
from sphshell_pin.study.report.machine import machine
from sphshell_pin.study.report.queries import COAL, DEPTH, OURS, RADIUS, SIDE, coal_contestant
from sphshell_pin.study.report.queries import FLAT as OURS_FLAT
from sphshell_pin.study.report.surfaces import touching_centers, wavy_sheet
from sphshell_pin.study.report.timing import one_core, per_center, silent

# Cells along a side of the sheet, at equal size of the cells: 968 to 5 M triangles.
CELLS = (22, 32, 100, 316, 1000, 1581)
QUICK_CELLS = CELLS[:4]
LARGE = 1_000_000  # triangles from which three rounds are enough
LONGEST_BUILD, LONGEST_QUERY = 60.0, 5e-3  # [s]
MEMORY_PER_TRIANGLE = 1600  # bytes that building takes for a while, the most of all contestants
TRIMESH, LIBIGL, FCPW = "trimesh", "libigl", "fcpw"
QUESTIONS = {
    OURS: "all contacts, curved elements",
    OURS_FLAT: "all contacts, flat elements",
    COAL: "all contacts, flat elements",
    TRIMESH: "closest point",
    LIBIGL: "closest point",
    FCPW: "closest point, single precision",
}
NEEDS = {TRIMESH: "rtree", LIBIGL: "igl", FCPW: "fcpw"}  # modules of benchmarks/pyproject.toml
QUERIES = {COAL: 2000, TRIMESH: 200}  # in a round; 20 000 for the others


@dataclass(frozen=True)
class Row:
    """One contestant on one sheet: times [s] of a query (rounds,) and of building, memory [bytes].

    The memory is what is held after a query; NaN where it is less than the process held before.
    """

    name: str
    question: str
    triangles: int
    times: Array
    build: float
    memory: float

    @property
    def query(self) -> Spread:
        """Time of a query [s]."""
        return Spread.of(self.times)


def available() -> float:
    """Return the memory that is free for programs [bytes]; infinity where it is unknown."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            for line in file:
                if line.startswith("MemAvailable"):
                    return float(line.split()[1]) * 1024
    except OSError:
        pass
    return float("inf")


def trimesh_contestant(vertices: Array, triangles: Any, centers: Array) -> Callable[[], float]:
    import trimesh

    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    closest: Any = trimesh.proximity.closest_point
    return per_center(lambda: closest(mesh, centers), len(centers))


def libigl_contestant(vertices: Array, triangles: Any, centers: Array) -> Callable[[], float]:
    import igl

    tree = igl.AABB()
    corners = triangles.astype(np.int64)
    tree.init(vertices, corners)
    return per_center(lambda: tree.squared_distance(vertices, corners, centers), len(centers))


def fcpw_contestant(vertices: Array, triangles: Any, centers: Array) -> Callable[[], float]:
    import fcpw

    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(vertices, dtype=np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(triangles, dtype=np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True)
    points = np.asfortranarray(centers, dtype=np.float32)
    reach = np.full(len(centers), RADIUS**2, dtype=np.float32)

    def ask() -> None:
        scene.find_closest_points(points, reach, fcpw.interaction_3D_list())

    return per_center(ask, len(centers))


MAKERS: dict[str, Any] = {
    TRIMESH: trimesh_contestant,
    LIBIGL: libigl_contestant,
    FCPW: fcpw_contestant,
    COAL: coal_contestant,
}


def contestant(name: str, vertices: Array, triangles: Any, centers: Array) -> Callable[[], float]:
    """Build what answers the queries of `name`."""
    if name in (OURS, OURS_FLAT):
        return query_contestant(Shell(vertices, triangles), centers, RADIUS, name)
    made: Callable[[], float] = MAKERS[name](vertices, triangles, centers)
    return made


_served: list[Callable[[], float]] = []


def build(name: str, cells: int) -> tuple[float, float]:
    """Build in this process, for `time_round`; return the time [s] and the memory [bytes]."""
    size = cells * SIDE
    vertices, triangles = wavy_sheet(cells, size)
    centers = touching_centers(QUERIES.get(name, 20_000), size, RADIUS, DEPTH)
    contestant(name, *wavy_sheet(4, 4 * SIDE), centers[:1])()  # imports what it needs
    (before, _), start = resident(), time.perf_counter()
    run = contestant(name, vertices, triangles, centers)
    if name != COAL:
        run()  # some build at the first query
    cost = time.perf_counter() - start, resident()[0] - before
    _served[:] = [run]
    return cost


def time_round() -> float:
    """Return seconds per query of what was built in this process."""
    return _served[0]()


def installed() -> tuple[list[str], list[str]]:
    """Return the contestants that can start, and sentences on the others."""
    names, notes = [], []
    for name in QUESTIONS:
        module = NEEDS.get(name)
        if module is None or importlib.util.find_spec(module) is not None:
            names.append(name)
        else:
            notes.append(f"{name} is left out: {module} is missing.")
    return names, notes


def measure(
    cells: tuple[int, ...] = CELLS, rounds: int = 5, progress: Progress = silent
) -> tuple[list[Row], list[str]]:
    """Return the rows of all contestants that keep up, and sentences on those that do not."""
    names, notes = installed()
    rows: list[Row] = []
    whole = sum(c**2 for c in cells)
    for k, side in enumerate(cells):
        triangles = 2 * side**2
        needed, free = triangles * MEMORY_PER_TRIANGLE, available()
        if needed > free:
            notes.append(
                f"{triangles} triangles are left out: a contestant may take {needed / 1e9:.0f} GB "
                f"of memory, {free / 1e9:.0f} GB are free."
            )
            break
        found = measure_one(names, side, rounds if triangles < LARGE else 3, notes)
        rows += found
        for row in found:
            if row.build > LONGEST_BUILD or row.query.median > LONGEST_QUERY:
                names.remove(row.name)
                if k + 1 < len(cells):
                    notes.append(
                        f"{row.name} is left out above {triangles} triangles, where it takes "
                        f"{row.build:.2g} s to build and {row.query.median * 1e6:.2g} us a query."
                    )
        progress(sum(c**2 for c in cells[: k + 1]) / whole)
    return rows, notes


def measure_one(names: list[str], cells: int, rounds: int, notes: list[str]) -> list[Row]:
    """Return the rows of one sheet; who fails there leaves `names`, with a sentence in `notes`."""
    triangles, built = 2 * cells**2, {}
    processes = {name: OwnProcess() for name in names}
    times: dict[str, list[float]] = {name: [] for name in names}
    try:
        for name in list(names):
            try:
                # One after the other, so that none is built while another is.
                built[name] = processes[name].call(None, build, name, cells)
            except Exception as error:
                names.remove(name)
                notes.append(
                    f"{name} is left out from {triangles} triangles on: "
                    f"{type(error).__name__}: {error}."
                )
        for _ in range(rounds):
            for name in names:
                times[name].append(processes[name].call(None, time_round))
    finally:
        for process in processes.values():
            process.close()
    return [
        Row(
            name,
            QUESTIONS[name],
            triangles,
            np.array(times[name]),
            built[name][0],
            built[name][1] if built[name][1] > 0 else float("nan"),
        )
        for name in names
    ]


def sizes_table(rows: list[Row]) -> Table:
    """Return times and memory of all contestants at all sizes."""
    return Table(
        "queries_sizes",
        "Every contestant in a process of its own: query, building, memory held.",
        (
            *columns("code", "question: answers", "triangles", TIME_COLUMNS),
            Column("build_s", "build [s]", number),
            Column("memory_bytes", "memory [MB]", lambda m: number(m / 1e6)),
            *columns("bytes_per_triangle: bytes / triangle", f"over_ours: over ours [{TIMES}]"),
        ),
        [
            (row.name, row.question, row.triangles, *row.query, row.build, row.memory)
            + (row.memory / row.triangles, float(np.median(row.times / ours.times)))
            for row in rows
            for ours in rows
            if (ours.name, ours.triangles) == (OURS, row.triangles)
        ],
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth")
    parser.add_argument("--quick", action="store_true", help="up to 200 k triangles, fewer rounds")
    quick = parser.parse_args().quick
    one_core()
    print(machine())
    rows, notes = measure(QUICK_CELLS if quick else CELLS, 5 if quick else 15)
    print("\n".join([sizes_table(rows).markdown(), *notes]))


if __name__ == "__main__":
    main()
