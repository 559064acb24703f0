"""From arrays to the first contact: computing time and memory, beside libigl's tree.

`python -m benchmarks.building [--quick]`; every figure is of a process of its own.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.benchmarks.processes import OwnProcess, resident
from sphshell_pin.benchmarks.surfaces import height, touching_centers, wavy_sheet

Array = NDArray[np.float64]

RADIUS, DEPTH = 0.010, 0.0005
SHEETS = ((316, 1.0), (1000, 3.16))  # cells along a side, side [m]
THIS, GIVEN, LIBIGL = "this, curved contact", "this, normals given", "libigl AABB, closest point"


@dataclass(frozen=True)
class Cost:
    """What building took: triangles, CPU time [s], bytes kept and at the highest, above the arrays.

    Memory is NaN where it is unknown (elsewhere than on Linux).
    """

    triangles: int
    cpu: float
    kept: float
    peak: float


def build_ours(vertices: Array, triangles: NDArray[np.int32], center: Array) -> object:
    from sphshell_pin import Shell

    shell = Shell(vertices, triangles)
    return shell, shell.contacts(center, RADIUS)


def build_with_normals(vertices: Array, triangles: NDArray[np.int32], center: Array) -> object:
    from sphshell_pin import Shell

    x, y, _ = vertices.T
    by_x = (height(x + 1e-6, y) - height(x - 1e-6, y)) / 2e-6
    by_y = (height(x, y + 1e-6) - height(x, y - 1e-6)) / 2e-6
    normals = np.c_[-by_x, -by_y, np.ones(len(x))]
    shell = Shell(vertices, triangles, normals)
    return shell, shell.contacts(center, RADIUS)


def build_libigl(vertices: Array, triangles: NDArray[np.int32], center: Array) -> object:
    import igl

    corners = triangles.astype(np.int64)
    tree = igl.AABB()
    tree.init(vertices, corners)
    return corners, tree, tree.squared_distance(vertices, corners, center[None])


BUILDERS = {THIS: build_ours, GIVEN: build_with_normals, LIBIGL: build_libigl}


def forget_highest() -> None:
    """Let the highest memory start anew from here, where the system can do that."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def measure_here(name: str, cells: int, size: float) -> Cost:
    """Build once in this process, in which nothing was built before."""
    build = BUILDERS[name]
    build(*wavy_sheet(2, 0.1), np.zeros(3))  # imports
    vertices, triangles = wavy_sheet(cells, size)
    center = touching_centers(1, size, RADIUS, DEPTH)[0]
    forget_highest()
    before, _ = resident()
    start = time.process_time()
    built = build(vertices, triangles, center)
    cpu = time.process_time() - start
    now, highest = resident()
    del built
    return Cost(len(triangles), cpu, now - before, highest - before)


def measure(name: str, cells: int, size: float) -> Cost:
    """Build once in a fresh process."""
    process = OwnProcess()
    try:
        return process.call(None, measure_here, name, cells, size)
    finally:
        process.close()


def building(rounds: int, sheets: tuple[tuple[int, float], ...] = SHEETS) -> None:
    """Print medians over `rounds` for each size."""
    print("From arrays to the first contact, CPU seconds of all threads, bytes a triangle")
    names = [name for name in BUILDERS if name != LIBIGL or importlib.util.find_spec("igl")]
    for cells, size in sheets:
        costs: dict[str, list[Cost]] = {name: [] for name in names}
        for _ in range(rounds):
            for name in names:
                costs[name].append(measure(name, cells, size))
        for name, several in costs.items():
            count = several[0].triangles
            cpu = np.median([c.cpu for c in several])
            kept, peak = (np.median([getattr(c, k) for c in several]) for k in ("kept", "peak"))
            print(
                f"  {count:8d} triangles  {name:28s} {cpu:7.2f} s  {kept / count:6.0f} kept  "
                f"{peak / count:6.0f} at most ({peak / 1e9:.2f} GB)"
            )
        if LIBIGL in costs:
            ratios = [a.cpu / b.cpu for a, b in zip(costs[THIS], costs[LIBIGL], strict=True)]
            print(f"  {'':18s}  this / libigl, CPU time {np.median(ratios):6.2f} x")
    if LIBIGL not in names:
        print(f"  {LIBIGL} not installed (pip install 'sphshell-pin[bench]')")


def main() -> None:
    """Print all sizes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="200 k triangles only, once")
    if parser.parse_args().quick:
        building(1, SHEETS[:1])
    else:
        building(3)


if __name__ == "__main__":
    main()
