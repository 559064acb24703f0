# %% [markdown]
"""A parameter study: friction and stiffness.

A ball lands on a plane without spin, sliding; friction spins it up until it rolls. How long that
takes depends on friction alone, and the speed at which it ends does not: 5/7 of the first.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.results import PairFigures

RADIUS, SPEED, GRAVITY = 0.012, 1.0, 9.81
ball = robots.load("ball")
plane = sp.Shell([[-1, -1, 0], [9, -1, 0], [9, 1, 0], [-1, 1, 0]], elements=[[0, 1, 2, 3]])
mass = ball.model.inertias[1].mass


def roll(mu: float, stiffness: float = 1e5) -> sp.Result:
    """Let the ball slide on the plane until it rolls, with friction `mu`."""
    scene = sp.Scene(ball.model)
    scene.add_contact(
        sp.Sphere(RADIUS, "ball"),
        plane,
        law=sp.ImpactLaw(stiffness, exponent=1.0, damping=2.0, full_damping_depth=1e-6),
        friction=sp.CoulombFriction(mu, mu, v_static=1e-3, v_dynamic=2e-3),
        name="ball-plane",
    )
    depth = mass * GRAVITY / stiffness  # it starts where it rests
    q0 = np.array([0, 0, RADIUS - depth, 0, 0, 0, 1])
    v0 = np.array([SPEED, 0, 0, 0, 0, 0])
    return sp.Simulation(scene, sp.Adaptive()).run(q0, v0, duration=1.0, record_dt=1e-3)


# %% [markdown]
# Slip ends where the surface of the ball stands still on the plane. Closed forms to compare with:
# time `2 v / (7 mu g)`, speed `5 v / 7`.

# %%
coefficients = np.array([0.04, 0.06, 0.1, 0.2, 0.4])
times, speeds = [], []
for mu in coefficients:
    result = roll(mu)
    contacts = result.contacts
    slip = np.linalg.norm(contacts.slip_velocity_world, axis=1)
    times.append(contacts.t[np.argmax(slip < 2e-3)])
    # The velocity of a body that flies freely stands in its own frame: its size tells.
    speeds.append(np.linalg.norm(result.v[-1, :3]))
    print(f"mu = {mu:4.2f}: rolls after {times[-1]:.3f} s with {speeds[-1]:.4f} m/s")

# %%
figure, (slides, rolls) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
line = np.linspace(coefficients[0], coefficients[-1], 200)
slides.plot(line, 2 * SPEED / (7 * line * GRAVITY), color="0.6", label="2 v / (7 mu g)")
slides.plot(coefficients, times, "o", label="simulated")
slides.set(xlabel="friction coefficient [1]", ylabel="time until it rolls [s]")
rolls.axhline(5 / 7 * SPEED, color="0.6", label="5 v / 7")
rolls.plot(coefficients, speeds, "o", label="simulated")
rolls.set(xlabel="friction coefficient [1]", ylabel="speed at which it rolls [m/s]", ylim=(0, 1))
for axis in (slides, rolls):
    axis.grid(alpha=0.3)
    axis.legend()
figure.savefig("friction.png", dpi=120)

# %% [markdown]
# Now the stiffness. The ball is dropped: a softer contact sinks in deeper, lasts longer and pushes
# less. For a linear spring without damping the impact is half a swing: it lasts `pi sqrt(m / k)`
# and pushes with `v sqrt(k m)` at most (weight left aside).


# %%
def drop(stiffness: float) -> PairFigures:
    """Let the ball hit the plane at SPEED, once; return the figures of the contact."""
    scene = sp.Scene(ball.model)
    law = sp.ImpactLaw(stiffness, exponent=1.0, damping=0.0, full_damping_depth=1e-6)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), plane, law=law, name="ball-plane")
    q0 = np.array([0, 0, RADIUS + 1e-6, 0, 0, 0, 1])
    v0 = np.array([0, 0, -SPEED, 0, 0, 0])
    result = sp.Simulation(scene, sp.Adaptive()).run(q0, v0, duration=0.02)
    return result.stats.pairs["ball-plane"]


stiffnesses = np.geomspace(1e4, 1e7, 7)  # [N/m]
study = [drop(stiffness) for stiffness in stiffnesses]
for stiffness, one in zip(stiffnesses, study, strict=True):
    print(f"k = {stiffness:8.2e} N/m: {one.peak_force:6.1f} N, {one.contact_time * 1e3:.3f} ms")

# %%
figure, (pushes, lasts) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
pushes.loglog(stiffnesses, SPEED * np.sqrt(stiffnesses * mass), color="0.6", label="v sqrt(k m)")
pushes.loglog(stiffnesses, [one.peak_force for one in study], "o", label="simulated")
pushes.set(xlabel="stiffness [N/m]", ylabel="peak force [N]")
lasts.loglog(
    stiffnesses, 1e3 * np.pi * np.sqrt(mass / stiffnesses), color="0.6", label="pi sqrt(m / k)"
)
lasts.loglog(stiffnesses, [1e3 * one.contact_time for one in study], "o", label="simulated")
lasts.set(xlabel="stiffness [N/m]", ylabel="duration of the impact [ms]")
for axis in (pushes, lasts):
    axis.grid(alpha=0.3, which="both")
    axis.legend()
figure.savefig("stiffness.png", dpi=120)
