# %% [markdown]
"""What polishing removes: Preston's law over the patches of a run.

The scenario `polished_valve` draws a rubber ball over the barrel of a valve body in a raster of 16
strokes, with 8 N. Preston's law: the depth removed at a place is the integral over time of
coefficient x pressure x slip. The pressure is that of Hertz in the ellipse of each recorded patch.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

from sphshell_pin.scenario import build

COEFFICIENT = 1e-12  # Preston's [1/Pa]


def wear(points, result):
    """Return the depth (k,) [m] that the recorded contacts removed at `points` (k, 3) in the world.

    Rows should be closer together than the half axes of the patches.
    """
    log, patches, tree = result.contacts, result.patches, cKDTree(points)
    half = 0.5 * np.diff(result.t)
    time = (np.append(half, 0.0) + np.append(0.0, half))[log.row]  # trapezoid rule
    slid = np.linalg.norm(log.slip_velocity_world, axis=1) * time
    depth = np.zeros(len(points))
    for k, (a, b) in enumerate(patches["half_axes"]):
        near = tree.query_ball_point(log.point_world[k], a)
        along = patches["axis_world"][k]
        across = np.cross(log.normal_world[k], along)
        x, y = np.stack([along / a, across / b]) @ (points[near] - log.point_world[k]).T
        pressure = patches["peak_pressure"][k] * np.sqrt(np.maximum(0.0, 1.0 - x**2 - y**2))
        depth[near] += COEFFICIENT * pressure * slid[k]
    return depth


# %%
polished = build("polished_valve", {"run.dt": "1e-4"})
result = polished.simulation.run(
    polished.q0,
    polished.v0,
    polished.scenario.run.duration,
    polished.controller,
    polished.scenario.run.control_dt,
    record_dt=5e-3,  # 0.5 mm of the path
    record=("patch",),
)

# %% [markdown]
# Each stroke leaves a groove with the cross section coefficient x force. So the mean depth is that
# over the distance of strokes, 2.0246 mm: 3.951 nm.

# %%
angle, z = np.meshgrid(np.deg2rad(np.linspace(-34.0, 34.0, 137)), np.linspace(0.025, 0.119, 189))
barrel = 0.029 * np.stack([np.cos(angle), np.sin(angle), z / 0.029], axis=-1)
place = polished.scene.pairs[0].placement_j
points = barrel.reshape(-1, 3) @ place.rotation.T + place.translation
depth = wear(points, result).reshape(z.shape)
raster = (np.abs(angle) < np.deg2rad(20.0)) & (z > 0.035) & (z < 0.109)
mean = depth[raster].mean()
print(f"mean depth in the raster: {1e9 * mean:.3f} nm, deviation {depth[raster].std() / mean:.1%}")

# %%
figure, axis = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
mesh = axis.pcolormesh(1e3 * z, np.rad2deg(angle), 1e9 * depth, shading="nearest")
axis.set(xlabel="along the barrel [mm]", ylabel="about it [degrees]")
figure.colorbar(mesh, label="removed depth [nm]")
figure.savefig("wear.png", dpi=110)
figure
