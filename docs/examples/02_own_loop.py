# %% [markdown]
"""A fingertip on a wall, in your own loop.

The package finds the contacts and their wrenches; the controller, the dynamics and the time
stepping are plain Pinocchio. This is the way into an existing simulator, estimator or optimizer.
"""

# %%
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots

finger = robots.load("three_link_finger")
wall = sp.Shell(
    [[0.07, -0.1, 0.0], [0.07, 0.1, 0.0], [0.07, 0.1, 0.2], [0.07, -0.1, 0.2]],  # [m]
    elements=[[0, 1, 2, 3]],
)
scene = sp.Scene(finger.model)
scene.add_contact(
    sp.Sphere(0.010, frame="tip"),
    wall,
    law=sp.ImpactLaw(stiffness=1e6, exponent=1.5, damping=20.0, full_damping_depth=1e-4),
    friction=sp.CoulombFriction(mu_static=0.5, mu_dynamic=0.4, v_static=0.005, v_dynamic=0.05),
    name="tip-wall",
)

# %% [markdown]
# `scene.external_forces(q, v)` returns one `pinocchio.Force` per joint, in the joint's frame: what
# `pinocchio.aba` takes as its last argument. `scene.contacts(q, v)` says where and how hard.

# %%
model, data = scene.model, scene.model.createData()
kp, kd, dt = 0.5, 0.01, 2e-5
q = np.array([0.2, 0.6, 0.4])
v = np.zeros(3)
q_wanted = q + 0.2
touching = []
for step in range(15_000):
    tau = kp * (q_wanted - q) - kd * v
    a = pin.aba(model, data, q, v, tau, scene.external_forces(q, v))
    v = v + dt * a
    q = pin.integrate(model, q, dt * v)
    if step % 50 == 49:
        contacts = scene.contacts(q, v)
        touching.append([dt * (step + 1), contacts.normal_force.sum()])

time, force = np.array(touching).T
print(f"after {time[-1]:.2f} s the finger presses with {force[-1]:.3f} N")

# %% [markdown]
# The package's own loop takes the same steps, compiled: the same motion, some hundred times faster.

# %%
controller = sp.JointPD(kp, kd, q_ref=q_wanted, gravity_compensation=False)
result = sp.Simulation(scene, sp.SemiImplicitEuler(dt)).run(
    [0.2, 0.6, 0.4], duration=0.3, controller=controller, record_dt=1e-3
)
difference = np.abs(result.q[-1] - q).max()
print(f"the two differ by {difference:.1e} rad")
result

# %%
forces = result.plot("force")
axis = forces.axes[0]
axis.plot(time[::5], force[::5], "k.", markersize=3, label="own loop")
axis.legend()
forces.savefig("own_loop.png")
forces
