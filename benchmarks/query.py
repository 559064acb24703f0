"""What answers queries of spheres on a mesh: ours, Coal, trimesh, libigl and fcpw."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import coal
import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.arrays import Array

RADIUS, DEPTH = 0.010, 0.0005  # [m]


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


def trimesh_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
) -> Callable[[], float]:
    import trimesh

    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    closest: Any = trimesh.proximity.closest_point
    return per_center(lambda: closest(mesh, centers), centers)


def libigl_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
) -> Callable[[], float]:
    import igl

    tree = igl.AABB()
    corners = triangles.astype(np.int64)
    tree.init(vertices, corners)
    return per_center(lambda: tree.squared_distance(vertices, corners, centers), centers)


def fcpw_contestant(
    vertices: Array, triangles: NDArray[np.int32], centers: Array
) -> Callable[[], float]:
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

    return per_center(ask, centers)
