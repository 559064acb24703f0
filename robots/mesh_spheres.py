"""A closed mesh approximated by spheres inside it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_placement, check_type
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell

_PLACES = 800  # of the mesh, at each of which a sphere may touch it
_COVERED = 4000  # places whose distances from the spheres are made small
_MEASURED = 20_000  # places where the distance is measured in the end
_AROUND = 1000  # places of each sphere
_SMALLEST = 2e-3  # radius, as a share of the largest one
_BEND = 2e-3  # share of the mesh's size by which a ball may miss the place that it is made for
_MOST_SHRINKS = 60
_CHUNK = 2_000_000  # pairs of a point and a triangle at a time


@dataclass(frozen=True)
class MeshSpheres:
    """Spheres inside a mesh, and how far their union is from it.

    `mesh_to_spheres` is the largest distance of the mesh from the spheres [m]: contact may begin
    that much too late, and never begins too early, as no sphere reaches beyond the mesh.
    `spheres_to_mesh` is that of the surface of their union from the mesh [m]: the depth of the
    grooves between them, and of hollows inside. They are measured at 20000 places of the mesh and
    its vertices, and at 1000 of each sphere.
    """

    spheres: tuple[Sphere, ...]
    mesh_to_spheres: float
    spheres_to_mesh: float


def spheres_of_mesh(
    shell: Shell, frame: str, *, placement: pin.SE3 | None = None, count: int = 16
) -> MeshSpheres:
    """Approximate a closed mesh by at most `count` spheres that are inside it and touch it.

    `shell` is the mesh (a link's: Shell.from_geometry), at `placement` in `frame`, in which the
    spheres are; `scene.add_contacts` takes them. They are balls of the medial axis: at each of 800
    places of the mesh the largest ball inside that touches it about there (shrinking balls: Ma, Bae
    and Choi, The Visual Computer 28 (2012) 7). Of these one after the other is taken that most
    reduces the squared distances of the mesh from the spheres, until `count`, or until none does.
    The same mesh gives the same spheres.

    Raises
    ------
    InvalidParameter
        The mesh is open, so nothing is inside it, or `count` is no positive number.
    """
    check_type("shell", shell, Shell, "must be a Shell (of a link's mesh: Shell.from_geometry)")
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InvalidParameter("count", count, "must be a whole number, 1 at least")
    placement = check_placement("placement", placement)
    if not shell.is_closed:
        raise InvalidParameter(
            "shell",
            shell.name,
            "must be closed, to have an inside: give its convex hull, or state spheres by hand",
            "is open, but",
        )
    rng = np.random.default_rng(0)
    centers, radii = _inscribed(shell, *_places(shell, _PLACES, rng))
    chosen = _choose(_places(shell, _COVERED, rng)[0], centers, radii, count)
    centers, radii = centers[chosen], radii[chosen]
    spheres = [
        Sphere(radius, frame, tuple(placement.act(center).tolist()))
        for center, radius in zip(centers, radii.tolist(), strict=True)
    ]
    return MeshSpheres(tuple(spheres), *_distances(shell, centers, radii, rng))


def spheres_of_link(
    model: pin.Model, geometry_model: pin.GeometryModel, link: str, *, count: int = 16
) -> MeshSpheres:
    """Approximate the geometry of a link by spheres in its frame, at most `count` for each part.

    Spheres among it are taken as they are. The distances are the largest of all parts; see
    `spheres_of_mesh`, whose errors are raised as well.

    Raises
    ------
    FrameNotFound
        The model has no such frame.
    InvalidParameter
        The link has no geometry.
    """
    frame = find_frame(model, link)
    spheres: list[Sphere] = []
    distances = np.zeros(2)
    for part in geometry_model.geometryObjects:
        if part.parentFrame != frame:
            continue
        placement = model.frames[frame].placement.actInv(part.placement)
        if type(part.geometry).__name__ == "Sphere":
            x, y, z = placement.translation.tolist()
            spheres.append(Sphere(float(part.geometry.radius), link, (x, y, z)))
            continue
        shell = Shell.from_geometry(part)
        found = spheres_of_mesh(shell, link, placement=placement, count=count)
        spheres += found.spheres
        distances = np.maximum(distances, [found.mesh_to_spheres, found.spheres_to_mesh])
    if not spheres:
        raise InvalidParameter("link", link, "must have geometry in this geometry model")
    return MeshSpheres(tuple(spheres), *distances.tolist())


def _places(shell: Shell, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return random points (count, 3) of the mesh, evenly spread, and outward normals there."""
    corners = shell.vertices[shell.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    which = np.searchsorted(np.cumsum(area), (np.arange(count) + 0.5) / count * area.sum())
    which = np.minimum(which, len(area) - 1)
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = np.moveaxis(corners[which], 1, 0)
    return a + u * (b - a) + v * (c - a), across[which] / area[which, None]


def _inscribed(shell: Shell, points: Array, normals: Array) -> tuple[Array, Array]:
    """Return the balls inside the mesh that touch it at `points`: centers and radii."""
    radii = np.full(len(points), 0.5 * shell.size)
    shrinking = np.arange(len(points))
    # Facets bend where the surface that they stand for does not: that must not shrink a ball.
    slack = _BEND * shell.size
    for _ in range(_MOST_SHRINKS):
        p, inward = points[shrinking], -normals[shrinking]
        found = shell.closest_points(p + radii[shrinking, None] * inward, method="facets")
        too_large = np.abs(found.distances) < radii[shrinking] - slack
        away = found.points - p
        depth = np.einsum("ij,ij->i", away, inward)
        with np.errstate(divide="ignore", invalid="ignore"):
            smaller = np.einsum("ij,ij->i", away, away) / (2 * depth)
        too_large &= (depth > 0) & (smaller < radii[shrinking] * (1 - 1e-9))
        radii[shrinking[too_large]] = smaller[too_large]
        shrinking = shrinking[too_large]
        if not len(shrinking):
            break
    centers = points - radii[:, None] * normals
    # A ball whose center is inside the mesh, and no farther from it than the radius, is inside.
    radii = np.minimum(radii, np.abs(shell.closest_points(centers, method="facets").distances))
    kept = _inside(shell, centers) & (radii > _SMALLEST * radii.max(initial=0.0))
    kept &= radii < 0.5 * shell.size
    return centers[kept], radii[kept]


def _inside(shell: Shell, points: Array) -> npt.NDArray[np.bool_]:
    """Return whether `points` (k, 3) are inside, by the winding number of the mesh round them.

    Unlike the side of the closest triangle, that holds for meshes that cut themselves, too. The
    solid angle of a triangle: van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125.
    """
    corners = shell.vertices[shell.triangles]
    step = max(1, _CHUNK // len(corners))
    angle = np.empty(len(points))
    for k in range(0, len(points), step):
        a, b, c = np.moveaxis(corners[None] - points[k : k + step, None, None], 2, 0)
        volume = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        x, y, z = (np.linalg.norm(one, axis=2) for one in (a, b, c))
        below = x * y * z + np.einsum("ijk,ijk->ij", a, b) * z
        below += np.einsum("ijk,ijk->ij", b, c) * x + np.einsum("ijk,ijk->ij", c, a) * y
        angle[k : k + step] = 2 * np.arctan2(volume, below).sum(axis=1)
    return np.abs(angle) > 2 * np.pi


def _choose(points: Array, centers: Array, radii: Array, count: int) -> npt.NDArray[np.intp]:
    """Return which balls to take, of `count` at most."""
    away = np.stack(
        [
            np.maximum(np.linalg.norm(points - center, axis=1) - radius, 0.0)
            for center, radius in zip(centers, radii, strict=True)
        ]
    )
    squares = away**2
    left = np.full(len(points), np.inf)
    chosen: list[int] = []
    while len(chosen) < count:
        sums = np.minimum(squares, left).sum(axis=1)
        best = int(np.argmin(sums))
        if not sums[best] < left.sum() * (1 - 1e-9):
            break
        chosen.append(best)
        left = np.minimum(left, squares[best])
    return np.array(chosen, dtype=np.intp)


def _distances(
    shell: Shell, centers: Array, radii: Array, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the largest distances of the mesh from the spheres, and of their union from it."""
    places = np.concatenate([_places(shell, _MEASURED, rng)[0], np.asarray(shell.vertices)])
    heights = _heights(places, centers, radii)
    # Evenly spread over a sphere: Fibonacci's lattice.
    k = np.arange(_AROUND) + 0.5
    height, angle = 1 - 2 * k / _AROUND, np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - height**2)
    unit = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    around = (centers[:, None] + radii[:, None, None] * unit).reshape(-1, 3)
    free = around[_heights(around, centers, radii) > -1e-9 * radii.max()]
    found = shell.closest_points(free, method="facets")
    return float(heights.max()), float(np.abs(found.distances).max())


def _heights(points: Array, centers: Array, radii: Array) -> Array:
    """Return the heights (k,) of `points` over the union of spheres, negative inside."""
    least = np.full(len(points), np.inf)
    for center, radius in zip(centers, radii, strict=True):
        least = np.minimum(least, np.linalg.norm(points - center, axis=1) - radius)
    return least
