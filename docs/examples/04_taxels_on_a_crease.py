# %% [markdown]
"""A fingertip crosses a crease, and what its taxels feel.

A rubber ball of 8 mm radius is pressed into a valley of two planes with 3 N and drawn across it. It
carries 24 x 24 taxels. While it is at the crease it touches both planes: there are two patches.
"""

# %%
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.plot.taxels import plot_taxels

slope, size = np.tan(np.deg2rad(25.0)), 0.03
corners = [[x, y, slope * abs(x)] for y in (-size, size) for x in (-size, 0.0, size)]
valley = sp.Shell(corners, [[0, 1, 4, 3], [1, 2, 5, 4]], name="valley")

model = pin.Model()
slides = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "slides")
model.appendBodyToJoint(slides, pin.Inertia.FromSphere(0.1, 0.008), pin.SE3.Identity())
model.addFrame(pin.Frame("tip", slides, pin.SE3.Identity(), pin.FrameType.BODY))

scene = sp.Scene(model)
law = sp.ImpactLaw.hertz(0.008, 2e6, 0.49, 70e9, 0.33, restitution=0.3, speed=0.1)
scene.add_contact(sp.Sphere(0.008, "tip"), valley, law=law, name="tip-valley")


def hand(t, q, v, contacts):
    """Move along x with 40 mm/s, held by springs; press down with 3 N."""
    target = np.array([-0.012 + 0.04 * t, 0.0, 0.0])
    pull = 400.0 * (target - q) - 8.0 * v
    return np.array([pull[0], pull[1], -3.0 + 9.81 * 0.1 - 8.0 * v[2]])


q0 = np.array([-0.012, 0.0, 0.012 * slope + 0.008 / np.cos(np.arctan(slope)) - 2e-4])
simulation = sp.Simulation(scene, sp.Adaptive(1e-6))
result = simulation.run(
    q0, duration=0.6, controller=hand, control_dt=1e-3, record_dt=5e-3, record=("patch",)
)

# %% [markdown]
# The grid sits around the lowest point of the tip and reaches over 110 degrees. The images add up
# to the normal forces of each row; what falls beside the grid would be in `outside`.

# %%
grid = sp.TaxelGrid("tip-valley", (24, 24), axis=(0, 0, -1), up=(0, 1, 0), extent=(1.92, 1.92))
images = grid.images(result)
felt = images.forces.sum(axis=(1, 2)) + images.outside
pressed = np.bincount(result.contacts.row, result.contacts.normal_force, len(result.t))
print(f"forces on taxels and on the tip differ by {np.abs(felt - pressed).max():.0e} N at most")
print(f"beside the grid: {np.abs(images.outside).max():.0e} N")
result

# %%
images.save("taxels.npz")
two = np.flatnonzero(np.bincount(result.contacts.row, minlength=len(result.t)) == 2)
middle = two[len(two) // 2]
rows = [middle - 40, two[0] - 1, two[0] + 1, middle, two[-1] - 1, two[-1] + 1, middle + 40]
figure = plot_taxels(images, rows)
figure.savefig("taxels.png", dpi=110)
figure
