"""Query time, building time and memory against the number of triangles, ours and others'.

Each contestant runs in a process of its own, so that its memory can be measured; all on one core,
asked in turn to time their queries. One that gets too slow or too big is left out of larger
sheets.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sphshell_pin.arrays import Array
from sphshell_pin.benchmarks.processes import OwnProcess, resident
from sphshell_pin.benchmarks.query import (
    DEPTH,
    RADIUS,
    coal_contestant,
    fcpw_contestant,
    libigl_contestant,
    query_contestant,
    trimesh_contestant,
)
from sphshell_pin.benchmarks.surfaces import touching_centers, wavy_sheet
from sphshell_pin.benchmarks.timing import silent
from sphshell_pin.cases.contents import Progress, Spread

# Cells along a side of the sheet, at equal size of the cells: 968 to 5 M triangles.
CELLS = (22, 32, 100, 316, 1000, 1581)
QUICK_CELLS = CELLS[:4]
SIDE = 1 / 316  # of a cell [m]
LARGE = 1_000_000  # triangles from which three rounds are enough
LONGEST_BUILD, LONGEST_QUERY = 60.0, 5e-3  # [s]
MEMORY_PER_TRIANGLE = 1600  # bytes that building takes for a while, the most of all contestants
OURS, OURS_FLAT, COAL, TRIMESH = "smooth", "facets", "coal::collide", "trimesh"
LIBIGL, FCPW = "libigl", "fcpw"
QUESTIONS = {
    OURS: "all contacts, curved elements",
    OURS_FLAT: "all contacts, flat elements",
    COAL: "all contacts, flat elements",
    TRIMESH: "closest point",
    LIBIGL: "closest point",
    FCPW: "closest point, single precision",
}
NEEDS = {TRIMESH: "rtree", LIBIGL: "igl", FCPW: "fcpw"}  # modules, all of the extra `bench`
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


def contestant(name: str, vertices: Array, triangles: Any, centers: Array) -> Callable[[], float]:
    """Build what answers the queries of `name`."""
    if name in (OURS, OURS_FLAT):
        from sphshell_pin import Shell

        return query_contestant(Shell(vertices, triangles), centers, name)
    makers: dict[str, Any] = {
        TRIMESH: trimesh_contestant,
        LIBIGL: libigl_contestant,
        FCPW: fcpw_contestant,
        COAL: coal_contestant,
    }
    made: Callable[[], float] = makers[name](vertices, triangles, centers)
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
            notes.append(
                f"{name} is left out: {module} is missing (pip install 'sphshell-pin[bench]')."
            )
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
        groups = [names]
        if needed * len(names) > free:
            groups = [[name] for name in names]
            notes.append(
                f"{triangles} triangles: one contestant after another, not in turn, since all "
                f"together may take {needed * len(names) / 1e9:.0f} GB of memory."
            )
        found = []
        for group in groups:
            before = set(group)
            found += measure_one(group, side, rounds if triangles < LARGE else 3, notes)
            names = [name for name in names if name not in before - set(group)]
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
