# %% [markdown]
"""A link as spheres: what its collision mesh holds inside.

Spheres touch shells, meshes do not. The hand of a Panda is approximated by balls of the medial axis
of its mesh: at many places of the mesh the largest ball inside that touches it there (shrinking
balls: Ma, Bae and Choi, The Visual Computer 28 (2012) 7).
"""

# %%
import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin
import trimesh

import sphshell_pin as sp
from sphshell_pin import robots

panda = robots.load("panda")
hand = panda.model.getFrameId("panda_hand", pin.FrameType.BODY)
(part,) = [one for one in panda.collision_model.geometryObjects if one.parentFrame == hand]
shell = sp.Shell.from_geometry(part)
mesh = trimesh.Trimesh(shell.vertices, shell.triangles)


# %%
def inscribed(count):
    """Return centers (k, 3) and radii (k,) [m] of balls inside the mesh, each touching it."""
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=0)
    normals, radii = mesh.face_normals[faces], np.full(count, 0.5 * shell.size)
    for _ in range(60):
        found = shell.closest_points(points - radii[:, None] * normals, method="facets")
        away = found.points - points
        depth = -np.einsum("ij,ij->i", away, normals)
        with np.errstate(divide="ignore", invalid="ignore"):
            smaller = np.einsum("ij,ij->i", away, away) / (2.0 * depth)
        # Facets bend where the surface that they stand for does not.
        large = (np.abs(found.distances) < radii - 2e-3 * shell.size) & (depth > 0.0)
        large &= smaller < radii * (1.0 - 1e-9)
        if not large.any():
            break
        radii[large] = smaller[large]
    centers = points - radii[:, None] * normals
    distances = shell.closest_points(centers, method="facets").distances  # negative inside
    inside = (distances < 0.0) & (radii < 0.5 * shell.size)
    return centers[inside], np.minimum(radii, -distances)[inside]


def heights(points, centers, radii):
    """Return the heights (k, n) [m] of points (n, 3) over each ball, zero inside."""
    away = np.linalg.norm(points - centers[:, None], axis=2) - radii[:, None]
    return np.maximum(away, 0.0)


# %% [markdown]
# One after the other the ball is taken that most reduces the squared distances of the mesh from
# the balls.

# %%
centers, radii = inscribed(800)
points = trimesh.sample.sample_surface(mesh, 4000, seed=1)[0]
squares, left, chosen = heights(points, centers, radii) ** 2, np.inf, []
for _ in range(32):
    chosen.append(int(np.minimum(squares, left).sum(axis=1).argmin()))
    left = np.minimum(left, squares[chosen[-1]])
centers, radii = centers[chosen], radii[chosen]
farthest = np.sqrt(left.max())
print(f"{len(chosen)} spheres; the mesh is nowhere farther from them than {1e3 * farthest:.1f} mm")

# %% [markdown]
# Contact begins at most that much too late, and never too early.

# %%
place = panda.model.frames[hand].placement.actInv(part.placement)
spheres = [
    sp.Sphere(radius, "panda_hand", tuple(place.act(center)))
    for center, radius in zip(centers, radii.tolist(), strict=True)
]
wall = sp.Shell([[1, -1, 0], [1, 1, 0], [1, 1, 2], [1, -1, 2]], [[0, 1, 2, 3]])
scene = sp.Scene(panda.model)
scene.add_contacts(spheres, wall, law=sp.ImpactLaw(1e6, damping=20.0), name="hand")

figure, axis = plt.subplots(figsize=(7.0, 3.5), layout="constrained")
for center, radius in zip(centers, radii, strict=True):
    axis.add_patch(plt.Circle(1e3 * center[1:], 1e3 * radius, color="C0", alpha=0.3))
axis.triplot(*1e3 * shell.vertices[:, 1:].T, shell.triangles, color="0.7", linewidth=0.3, zorder=0)
axis.set(xlabel="y [mm]", ylabel="z [mm]", aspect="equal")
figure.savefig("spheres.png", dpi=110)
figure
