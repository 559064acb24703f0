# %% [markdown]
"""A Panda draws a circle on a propeller blade with 5 N, by torques that an optimizer finds.

Differential dynamic programming, Crocoddyl's, finds the joint torques. The scene is that of the
scenario `fingertip_on_blade`: a CAD surface, a rubber-like tip, friction; it gives the optimizer
the derivatives of motion and contact force. The torques are then replayed in simulations.
"""

# %%
import crocoddyl
import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.adapters.crocoddyl import ContactForceResidual, ContactStep, FrameResidual
from sphshell_pin.scenario import build

built = build("fingertip_on_blade")
scene = built.scene
model, data = scene.model, scene.model.createData()
pair = scene.pair("tip-blade")
force, radius = 5.0, 0.03  # [N], [m]
dt, duration = 2e-3, 1.0  # [s]
steps = round(duration / dt)

# %% [markdown]
# The circle lies in the plane that touches the blade in its middle; its points are projected on
# the blade. The tip's center is to be above them, less the depth at which the law gives 5 N. It
# starts and ends at rest.

# %%
blade, world_from_blade = pair.side_j.shell, pair.placement_j
middle = blade.closest_points([[0.053, 0.012, -0.242]])
normal = middle.normals[0]
along = np.cross(normal, [0.0, 0.0, 1.0])
along /= np.linalg.norm(along)
s = np.linspace(0.0, 1.0, steps + 1)
angle = 2.0 * np.pi * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
circle = np.outer(np.cos(angle), along) + np.outer(np.sin(angle), np.cross(normal, along))
touched = blade.closest_points(middle.points + 0.01 * normal + radius * circle)
centers = touched.points + (pair.side_i.radius - pair.law.depth_at(force)) * touched.normals
centers = centers @ world_from_blade.rotation.T + world_from_blade.translation

# %% [markdown]
# The first guess: joint angles by inverse kinematics, with the hand as it is in the scenario, and
# torques that carry the arm's weight. It knows nothing of friction, inertia or contact force.

# %%
hand = model.getFrameId(pair.frame_i)
pin.framesForwardKinematics(model, data, built.q0)
placements = [pin.SE3(data.oMf[hand].rotation, center) for center in centers]


def inverse_kinematics(q, wanted):
    """Return the joint angles near q at which the hand is where it is wanted."""
    for _ in range(50):
        pin.framesForwardKinematics(model, data, q)
        off = data.oMf[hand].actInv(wanted)
        jacobian = pin.computeFrameJacobian(model, data, q, hand)
        q = pin.integrate(model, q, np.linalg.lstsq(jacobian, pin.log6(off).vector)[0])
        if np.abs(pin.log6(off).vector).max() < 1e-10:
            break
    return q


qs = [inverse_kinematics(built.q0, placements[0])]
for placement in placements[1:]:
    qs.append(inverse_kinematics(qs[-1], placement))
vs = np.vstack([np.zeros(model.nv), np.diff(qs, axis=0) / dt])
guess = [np.concatenate(state) for state in zip(qs, vs, strict=True)]
weights = [pin.computeGeneralizedGravity(model, data, q) for q in qs]

# %% [markdown]
# One node of the problem for each step of a simulation, by the Runge-Kutta method of order 4. The
# costs: 5 N, the hand's placement, and a little for speed and torques.

# %%
simulation = sp.Simulation(scene, sp.RungeKutta4(dt))
state = crocoddyl.StateMultibody(model)
actuation = crocoddyl.ActuationModelFull(state)
smooth = crocoddyl.ActivationModelWeightedQuad(np.repeat([1e-3, 1.0], model.nv))


def node(k):
    """Return the dynamics and costs at step k."""
    costs = crocoddyl.CostModelSum(state)

    def add(name, weight, residual, activation=None):
        parts = (state, residual) if activation is None else (state, activation, residual)
        costs.addCost(name, crocoddyl.CostModelResidual(*parts), weight)

    add("force", 1e2, ContactForceResidual(scene, state, pair.name, force))
    add("hand", 1e5, FrameResidual(scene, state, pair.frame_i, placements[k]))
    add("state", 1.0, crocoddyl.ResidualModelState(state, guess[k]), smooth)
    if k < steps:
        add("torques", 1e-3, crocoddyl.ResidualModelControl(state, weights[k]))
    return ContactStep(simulation, state, actuation, costs)


problem = crocoddyl.ShootingProblem(guess[0], [node(k) for k in range(steps)], node(steps))
solver = crocoddyl.SolverFDDP(problem)
solver.th_stop = 1e-6
converged = solver.solve(guess, weights[:-1], 50)
torques, planned = np.array(solver.us), np.array(solver.xs)
print(f"{'converged' if converged else 'stopped'} after {solver.iter} iterations")

# %% [markdown]
# The same torques in simulations: in that of the optimizer, and with steps as short as an error of
# 1e-8 demands.


# %%
def held(t, q, v, contacts):
    """Return the torques of the step that t is in."""
    return torques[min(round(t / dt), steps - 1)]


def force_of(result):
    """Return the normal force at each row."""
    return np.bincount(result.contacts.row, result.contacts.normal_force, len(result.t))


replays = {}
for one in (simulation, sp.Simulation(scene, sp.Adaptive(1e-8))):
    replays[one.integrator.kind] = one.run(
        planned[0, : model.nq],
        planned[0, model.nq :],
        duration,
        held,
        control_dt=dt,
        record_dt=dt,
    )
forces = {kind: force_of(result) for kind, result in replays.items()}
for kind, result in replays.items():
    apart = np.abs(result.q - planned[:, : model.nq]).max()
    worst = np.abs(forces[kind] - force).max() / force
    print(f"{kind}: {apart:.0e} rad from the plan, force within {100 * worst:.2f} % of 5 N")

# %%
replay = replays["adaptive"]
across = np.cross(normal, along)
axes = world_from_blade.rotation @ np.column_stack((along, across))
origin = world_from_blade.act(middle.points[0])
wanted = touched.points @ world_from_blade.rotation.T + world_from_blade.translation
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")
for points, style in (
    (wanted, {"lw": 5, "alpha": 0.3, "label": "wanted"}),
    (replay.contacts.point_world, {"color": "k", "lw": 1, "label": "drawn"}),
):
    left.plot(*(1e3 * (points - origin) @ axes).T, **style)
left.set(aspect="equal", xlabel="along the blade [mm]", ylabel="across [mm]")
left.legend(loc="center")
right.axhspan(0.99 * force, 1.01 * force, alpha=0.2, label="1 % of 5 N")
right.plot(replay.t, forces["adaptive"], "k", lw=1, label="replayed, Adaptive(1e-8)")
right.set(xlabel="time [s]", ylabel="normal force [N]", ylim=(4.9, 5.1))
right.legend()
figure.savefig("circle.png", dpi=110)
