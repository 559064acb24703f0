"""Cost of one contact query, against Coal, libigl and fcpw, and against the number of elements."""

from __future__ import annotations

import time
from collections.abc import Callable

import coal
import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.benchmarks.surfaces import touching_centers, wavy_sheet
from sphshell_pin.benchmarks.timing import silent, take_turns
from sphshell_pin.cases.contents import Progress

Array = NDArray[np.float64]
RADIUS, DEPTH = 0.010, 0.0005


def per_center(ask: Callable[[], object], centers: Array) -> Callable[[], float]:
    """Return what asks of all centers and returns the seconds of one of them."""

    def run() -> float:
        start = time.perf_counter()
        ask()
        return (time.perf_counter() - start) / len(centers)

    return run


def query_contestant(shell: Shell, centers: Array, method: str = "smooth") -> Callable[[], float]:
    radii = np.full(len(centers), RADIUS)
    return per_center(
        lambda: shell.contacts_batch(centers, radii, method=method, threads=1), centers
    )


def coal_tree(vertices: Array, triangles: NDArray[np.int32]) -> coal.BVHModelOBBRSS:
    """Return Coal's tree of a mesh."""
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(triangles), len(vertices))
    tree.addVertices(vertices)
    tree.addTriangles(triangles.astype(np.uint32))
    tree.endModel()
    return tree


def coal_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
) -> Callable[[], float]:
    """Time coal.collide, called from Python, which adds about 1 us to some 100 us."""
    tree, sphere = coal_tree(vertices, triangles), coal.Sphere(RADIUS)
    request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, 1_000_000)
    result, there, place = coal.CollisionResult(), coal.Transform3s(), coal.Transform3s()

    def ask() -> None:
        for center in centers:
            place.setTranslation(center)
            result.clear()
            coal.collide(sphere, place, tree, there, request, result)

    return per_center(ask, centers)


def libigl_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
) -> Callable[[], float] | None:
    try:
        import igl
    except ImportError:
        return None
    tree = igl.AABB()
    corners = triangles.astype(np.int64)
    tree.init(vertices, corners)

    return per_center(lambda: tree.squared_distance(vertices, corners, centers), centers)


def fcpw_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
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
    points = np.asfortranarray(centers, dtype=np.float32)
    reach = np.full(len(centers), RADIUS**2, dtype=np.float32)

    def ask() -> None:
        scene.find_closest_points(points, reach, fcpw.interaction_3D_list())

    return per_center(ask, centers)


THIS, FACETS, COAL = "this", "this, method facets", "coal::collide, all contacts"
LIBIGL, FCPW = "libigl AABB, closest point", "fcpw, closest point, single precision"


def measure_peers(rounds: int, progress: Progress = silent) -> dict[str, Array]:
    """Return times [s] of a query on 200 k triangles at cold, random positions, by name.

    A sphere that touches, all its contacts by the default method and by "facets"; libigl and fcpw,
    where installed, look for the closest point alone.
    """
    vertices, triangles = wavy_sheet(316, 1.0)
    shell = Shell(vertices, triangles)
    centers = touching_centers(20_000, 1.0, RADIUS, DEPTH)
    contestants = {
        THIS: query_contestant(shell, centers),
        FACETS: query_contestant(shell, centers, "facets"),
        COAL: coal_contestant(vertices, triangles, centers[:2000]),
    }
    peers = {
        LIBIGL: libigl_contestant(vertices, triangles, centers),
        FCPW: fcpw_contestant(vertices, triangles, centers),
    }
    contestants |= {name: run for name, run in peers.items() if run is not None}
    return take_turns(contestants, rounds, progress)


SHEETS = ((32, 0.1), (100, 0.316), (316, 1.0), (1000, 3.16))  # cells along a side, side [m]


def measure_sizes(
    rounds: int, progress: Progress = silent, sheets: tuple[tuple[int, float], ...] = SHEETS
) -> dict[int, Array]:
    """Return times [s] at equal contact patch on sheets of all sizes, by their triangles."""
    contestants = {}
    for cells, size in sheets:
        shell = Shell(*wavy_sheet(cells, size))
        centers = touching_centers(20_000, size, RADIUS, DEPTH)
        contestants[str(shell.num_elements)] = query_contestant(shell, centers)
    return {int(n): t for n, t in take_turns(contestants, rounds, progress).items()}
