# %% [markdown]
"""A peg in a round hole, in MuJoCo.

A block with a bore of 20.2 mm, and a peg of 20 mm that gravity draws into it, tilted by 20 degrees
so that the peg slides along the wall: three ways in MuJoCo, with one inertia and one friction.
"""

# %%
import matplotlib.pyplot as plt
import mujoco
import numpy as np
import trimesh

import sphshell_pin as sp
from sphshell_pin.adapters.mujoco import attach

bore, radius, depth, outside, sides = 10.1e-3, 10e-3, 60e-3, 30e-3, 48  # [m], and facets
angle = 2 * np.pi * np.arange(sides) / sides
rings = [
    np.column_stack((r * np.cos(angle), r * np.sin(angle), np.full(sides, z)))
    for r, z in ((bore, -depth), (bore, 0.0), (outside, 0.0), (outside, -depth))
]
i, j = np.arange(sides), np.roll(np.arange(sides), -1)
strips = [(0, 1), (1, 2), (2, 3), (3, 0)]
quads = np.vstack(
    [
        np.column_stack((a * sides + j, a * sides + i, b * sides + i, b * sides + j))
        for a, b in strips
    ]
)
block = sp.Shell(np.vstack(rings), quads, name="block")
for face in block.faces:
    print(face.kind, face.radius)

# %% [markdown]
# The vertices lie on cylinders and planes to the last digit: the shell is exactly round. MuJoCo's
# mesh has the same facets. The peg is three spheres in a row, and its joints hold it upright.

# %%
mu, tilt, dt, start = 0.1, np.radians(20.0), 1e-5, -0.005
gravity = 9.81 * np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
corners = block.vertices[block.elements]
triangles = np.vstack((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))
stl = trimesh.exchange.stl.export_stl(trimesh.Trimesh(block.vertices, triangles, process=False))
SLIDES = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))


def peg_and(block_geoms, assets="", contact="1"):
    """Return a MuJoCo model of the peg, its end 5 mm deep in the bore, and a block."""
    spheres = "".join(
        f'<geom name="{k}" type="sphere" size="{radius}" pos="0 0 {0.015 * k}" condim="3" '
        f'friction="{mu} 0 0" contype="{contact}"/>'
        for k in range(3)
    )
    text = f"""<mujoco><option timestep="{dt}" gravity="{" ".join(map(str, gravity))}"/>{assets}
      <worldbody>{block_geoms}<body name="peg" pos="0 0 {start}">{SLIDES}
      <inertial pos="0 0 0.015" mass="0.1" diaginertia="1e-5 1e-5 1e-5"/>{spheres}</body>
      </worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(text, {"block.stl": stl})


def fall(model, steps=12000):
    """Return times [s] and heights of the lowest sphere's center [m], every 100 steps."""
    data, out = mujoco.MjData(model), []
    for step in range(steps):
        if step % 100 == 0:
            out.append((data.time, data.qpos[2] + start))
        mujoco.mj_step(model, data)
    return np.array(out).T


# %% [markdown]
# 1. A mesh geom collides as its convex hull: the bore is filled, and the peg stands on top of it.
# 2. The block in convex pieces, as MuJoCo's manual advises: one box for each facet.
# 3. The shell, attached to the peg's spheres.

# %%
mesh = '<asset><mesh name="block" file="block.stl"/></asset>'
hull = fall(peg_and('<geom type="mesh" mesh="block"/>', mesh))
width = outside * np.tan(np.pi / sides)
middle = bore * np.cos(np.pi / sides) + 0.5 * (outside - bore)
pieces = "".join(
    f'<geom type="box" size="{0.5 * (outside - bore)} {width} {depth / 2}" '
    f'pos="{middle * np.cos(a)} {middle * np.sin(a)} {-depth / 2}" euler="0 0 {np.degrees(a)}" '
    f'friction="{mu} 0 0"/>'
    for a in angle + np.pi / sides
)
boxes = fall(peg_and(pieces))
model = peg_and("")
law = sp.HuntCrossleyLaw(1e7, 1.5, 5.0)
friction = sp.CoulombFriction(mu, mu, v_static=5e-3, v_dynamic=1e-2)
with attach(model, block, ["0", "1", "2"], law=law, friction=friction):
    round_bore = fall(model)

# %% [markdown]
# On the wall Coulomb's law gives an acceleration of g (cos 20 - 0.1 sin 20 degrees) along the bore.

# %%
along = gravity[2] + mu * gravity[0]
time, height = round_bore
settled = (time > 0.01) & (height > -0.04)
measured = 2 * np.polyfit(time[settled], height[settled], 2)[0]
print(f"along the bore {measured:.4f} m/s^2, by Coulomb {along:.4f} m/s^2")

figure, axis = plt.subplots(figsize=(6.5, 3.6))
for name, (t, z) in {"convex hull": hull, "48 boxes": boxes, "shell": round_bore}.items():
    axis.plot(1e3 * t, 1e3 * z, label=name)
axis.axhline(-1e3 * depth, color="0.7", linewidth=0.8)
axis.set(xlabel="time [ms]", ylabel="height of the peg's end [mm]", ylim=(-65, 15), xlim=(0, 120))
axis.legend()
figure.tight_layout()
figure.savefig("peg.png", dpi=110)
