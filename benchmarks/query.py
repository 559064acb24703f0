"""Cost of one contact query, against Coal, libigl and fcpw, and against the number of elements."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell, _core
from sphshell_pin.benchmarks.surfaces import touching_centres, wavy_sheet
from sphshell_pin.benchmarks.timing import median_us, ratio, take_turns

Array = NDArray[np.float64]
RADIUS, DEPTH = 0.010, 0.0005


def query_contestant(shell: Shell, centres: Array, method: str = "facets") -> Callable[[], float]:
    radii = np.full(len(centres), RADIUS)

    def run() -> float:
        start = time.perf_counter()
        shell.contacts_batch(centres, radii, method=method, threads=1)
        return (time.perf_counter() - start) / len(centres)

    return run


def libigl_contestant(
    vertices: Array, triangles: NDArray[np.int32], centres: Array
) -> Callable[[], float] | None:
    try:
        import igl
    except ImportError:
        return None
    tree = igl.AABB()
    corners = triangles.astype(np.int64)
    tree.init(vertices, corners)

    def run() -> float:
        start = time.perf_counter()
        tree.squared_distance(vertices, corners, centres)
        return (time.perf_counter() - start) / len(centres)

    return run


def fcpw_contestant(
    vertices: Array, triangles: NDArray[np.int32], centres: Array
) -> Callable[[], float] | None:
    try:
        import fcpw
    except ImportError:
        return None
    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(vertices, dtype=np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(triangles, dtype=np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True)
    points = np.asfortranarray(centres, dtype=np.float32)
    reach = np.full(len(centres), RADIUS**2, dtype=np.float32)

    def run() -> float:
        found = fcpw.interaction_3D_list()
        start = time.perf_counter()
        scene.find_closest_points(points, reach, found)
        return (time.perf_counter() - start) / len(centres)

    return run


def against_peers(rounds: int) -> None:
    """200 k triangles: all contacts of a touching sphere at cold, random positions."""
    vertices, triangles = wavy_sheet(316, 1.0)
    shell = Shell(vertices, triangles)
    centres = touching_centres(20_000, 1.0, RADIUS, DEPTH)

    def coal() -> float:
        seconds, _ = _core.coal_collide_all(vertices, triangles, centres[:2000], RADIUS)
        return float(seconds)

    contestants = {"this": query_contestant(shell, centres), "coal::collide, all contacts": coal}
    peers = {
        "libigl AABB, closest point": libigl_contestant(vertices, triangles, centres),
        "fcpw, closest point, single precision": fcpw_contestant(vertices, triangles, centres),
    }
    contestants |= {name: run for name, run in peers.items() if run is not None}
    times = take_turns(contestants, rounds)
    print(f"Query, {len(triangles)} triangles, r = 10 mm, depth 0.5 mm, cold random positions")
    for name, t in times.items():
        print(f"  {name:40s} {median_us(t)}   {ratio(t, times['this'])} x")
    for name, run in peers.items():
        if run is None:
            print(f"  {name:40s} not installed (pip install 'sphshell-pin[bench]')")


def against_size(rounds: int) -> None:
    """Time the same contact patch on sheets of 2 k to 2 M triangles."""
    contestants = {}
    for cells, size in ((32, 0.1), (100, 0.316), (316, 1.0), (1000, 3.16)):
        shell = Shell(*wavy_sheet(cells, size))
        centres = touching_centres(20_000, size, RADIUS, DEPTH)
        contestants[f"{len(shell.elements):8d} triangles"] = query_contestant(shell, centres)
    times = take_turns(contestants, rounds)
    smallest = next(iter(times.values()))
    print("Query at equal contact patch")
    for name, t in times.items():
        print(f"  {name:40s} {median_us(t)}   {ratio(t, smallest)} x")
