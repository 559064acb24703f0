# %% [markdown]
"""A gripper whose fingers are closed loops holds a part.

Each finger of a Robotiq 2F-85 is a linkage of five bars. Pinocchio keeps its loops closed with
`constraintDynamics`, which takes no external forces: those of a scene go in as joint torques.
"""

# %%
import tempfile
from pathlib import Path

import coal
import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots

# %% [markdown]
# Lengths, masses and moments of inertia are those of MuJoCo Menagerie's model (BSD-2-Clause). A
# tree has no loops: coupler and follower of a finger, which a pin joins, both end freely in it.

# %%
FINGER = """
<body name="{side}_driver" pos="0 {y0} 0.054904" quat="{turn}">
  <inertial mass="0.009" pos="0 0.017755 0.001073" diaginertia="1.72e-6 1.61e-6 3.22e-7"/>
  <joint name="{side}_driver" axis="1 0 0" range="0 0.8" armature="0.005" damping="0.1"/>
  <body name="{side}_coupler" pos="0 0.0315 -0.0041">
    <inertial mass="0.014097" pos="0 0.003012 0.023218" diaginertia="4.16e-6 3.52e-6 8.88e-7"/>
    <joint name="{side}_coupler" axis="1 0 0" range="-1.57 0"/>
  </body>
</body>
<body name="{side}_spring_link" pos="0 {y1} 0.0609" quat="{turn}">
  <inertial mass="0.022164" pos="0 0.018162 0.021266" diaginertia="8.97e-6 6.72e-6 2.64e-6"/>
  <joint name="{side}_spring_link" axis="1 0 0" range="-0.2967 0.8" damping="0.00125"/>
  <body name="{side}_follower" pos="0 0.055 0.0375">
    <inertial mass="0.016022" pos="0 -0.011046 0.012479" diaginertia="2.67e-6 2.46e-6 6.02e-7"/>
    <joint name="{side}_follower" axis="1 0 0" pos="0 -0.018 0.0065" range="-0.8727 0.8727"/>
  </body>
</body>"""
PART = """<body name="part"><freejoint name="part"/>
  <inertial mass="0.1" pos="0 0 0" diaginertia="6e-5 6e-5 6e-5"/></body>"""
SIDES = ("right", "left")
fingers = "".join(
    FINGER.format(side=side, y0=0.0306011 * sign, y1=0.0132 * sign, turn=turn)
    for side, sign, turn in (("right", 1, "1 0 0 0"), ("left", -1, "0 0 0 1"))
)
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "gripper.xml"
    file.write_text(
        f'<mujoco><compiler angle="radian" autolimits="true"/><worldbody>{fingers}{PART}'
        "</worldbody></mujoco>"
    )
    model = robots.load_file(file).model

# %% [markdown]
# Two spheres on each pad touch the part, a box of 50 mm. The stops of the couplers keep the pads
# parallel.

# %%
PAD = np.array([0.0, -0.0209, 0.032])  # in the follower's frame [m]
stop = sp.HuntCrossleyLaw.with_restitution(200.0, exponent=1.0, restitution=0.1, speed=1.0)
joints = sp.JointComponents.from_model(model, ["limits", "damping"])
for name, ends in joints.limits.items():
    joints = joints.replaced(name, limits=sp.JointLimits(ends.lower, ends.upper, stop))
scene = sp.Scene(model, joints=joints)
part = sp.Shell.from_geometry(coal.Box(0.05, 0.05, 0.05), side="outside")
for side in SIDES:
    for x in (-0.008, 0.008):
        scene.add_contact(
            sp.Sphere(0.006, f"{side}_follower", offset=PAD + [x, 0.0, 0.0]),
            part,
            "part",
            law=sp.ImpactLaw(1e5, 1.5, damping=20.0, full_damping_depth=1e-5),
            friction=sp.BristleFriction(0.8, 0.7, stiffness=2e4, damping=20.0),
        )
model = scene.model
data = model.createData()


# %% [markdown]
# A loop is a `RigidConstraintModel` between the joints of two bodies: the follower's origin is a
# point of both, where the robot's file draws it. Positions are put back on the loops at each step.


# %%
def closed_at(one, other):
    """Return the constraint that holds the origin of body `one` to body `other`, as drawn."""
    first, second = (model.frames[model.getFrameId(name, pin.BODY)] for name in (one, other))
    point = data.oMi[first.parentJoint] * first.placement
    return pin.RigidConstraintModel(
        pin.ContactType.CONTACT_3D,
        model,
        first.parentJoint,
        first.placement,
        second.parentJoint,
        data.oMi[second.parentJoint].actInv(point),
        pin.LOCAL,
    )


pin.framesForwardKinematics(model, data, pin.neutral(model))
loops, loop_data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
for side in SIDES:
    loops.append(closed_at(f"{side}_follower", f"{side}_coupler"))
    loop_data.append(loops[-1].createData())
pin.initConstraintDynamics(model, data, loops, loop_data)


def index(joint):
    """Return where the velocity of `joint` is in v."""
    return model.joints[model.getJointId(joint)].idx_v


def gaps_of(q):
    """Return the gaps (6,) of the loops at q [m], in the world, and their derivatives by q."""
    pin.computeJointJacobians(model, data, q)
    gaps, rows = np.zeros((2, 3)), np.zeros((2, 3, model.nv))
    for k, loop in enumerate(loops):
        for sign, joint, place in (
            (1, loop.joint1_id, loop.joint1_placement),
            (-1, loop.joint2_id, loop.joint2_placement),
        ):
            arm = data.oMi[joint].rotation @ place.translation
            jacobian = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)
            gaps[k] += sign * (data.oMi[joint].translation + arm)
            rows[k] += sign * (jacobian[:3] - pin.skew(arm) @ jacobian[3:])
    return gaps.ravel(), rows.reshape(6, -1)


def close(q, moved=slice(None)):
    """Return q with its loops closed by a step of Newton in the joints `moved`."""
    gaps, rows = gaps_of(q)
    step = np.zeros(model.nv)
    step[moved] = -np.linalg.pinv(rows[:, moved], rcond=1e-6) @ gaps
    return pin.integrate(model, q, step)


# %% [markdown]
# The fingers close around the part, with the couplers at their stops; then each motor turns with
# 0.5 N m.

# %%
drivers, springs = ([index(f"{side}_{one}") for side in SIDES] for one in ("driver", "spring_link"))
follow = [*springs, *(index(f"{side}_follower") for side in SIDES)]


def posture(angle):
    """Return q with the drivers at `angle` [rad], and the pads' points (2, 3) in the world."""
    q = pin.neutral(model)
    for part_of_it in np.linspace(0.0, angle, 10):
        q[drivers] = part_of_it
        for _ in range(4):
            q = close(q, follow)
    pin.framesForwardKinematics(model, data, q)
    frames = [model.getFrameId(f"{side}_follower", pin.BODY) for side in SIDES]
    return q, np.array([data.oMf[frame].act(PAD) for frame in frames])


low, high = 0.0, 0.8
while high - low > 1e-6:
    middle = 0.5 * (low + high)
    low, high = (middle, high) if posture(middle)[1][0, 1] > 0.031 else (low, middle)
q, pads = posture(low)
q[8:11] = [0.0, 0.0, pads[0, 2]]
v = np.zeros(model.nv)


def springs_torque(q):
    """Return the torques of the fingers' springs [N m]."""
    return -0.05 * (q[springs] - 2.62)


state, dt, motor, zero = scene.state(q, v), 1e-4, 0.5, np.zeros(model.nv)
settings = pin.ProximalSettings(1e-14, 1e-10, 50)
times, forces, gaps, heights = [], [], [], []
for k in range(4000):
    fext = scene.external_forces(q, v, state=state)
    torque = scene.joint_forces(q, v, state=state)
    torque[drivers] += motor
    torque[springs] += springs_torque(q)
    # Of the contacts, as torques: what inverse dynamics asks for less of with them.
    torque += pin.rnea(model, data, q, v, zero) - pin.rnea(model, data, q, v, zero, fext)
    v = v + dt * pin.constraintDynamics(model, data, q, v, torque, loops, loop_data, settings)
    q = close(pin.integrate(model, q, dt * v))
    state.advance(q, v, dt)
    times.append((k + 1) * dt)
    gaps.append(np.abs(gaps_of(q)[0]).max())
    forces.append(scene.contacts(q, v, state=state).normal_force.sum() / 2)
    heights.append(q[10])

# %% [markdown]
# At rest the pads' forces follow from virtual work, without any solver: when the drivers turn, they
# do the work of motors, springs and weights; the part goes with the pads.

# %%
h = 1e-4
(before, one), (after, other) = posture(q[drivers[0]] - h), posture(q[drivers[0]] + h)
work = 4 * h * motor + 2 * springs_torque(q)[0] * (after[springs[0]] - before[springs[0]])
for ended, points, sign in ((before, one, 1), (after, other, -1)):
    ended[10] = points[0, 2]
    work += sign * pin.computePotentialEnergy(model, data, ended)
expected = work / (2 * (one[0, 1] - other[0, 1]))
print(f"force of a pad {forces[-1]:.3f} N, by virtual work {expected:.3f} N")
print(f"largest gap of a loop {max(gaps):.1e} m")

figure, axis = plt.subplots(figsize=(6.5, 3.2))
axis.plot(1e3 * np.array(times), forces)
axis.axhline(expected, color="0.6", linewidth=0.8)
axis.set(xlabel="time [ms]", ylabel="force of a pad [N]")
figure.tight_layout()
figure.savefig("gripper.png", dpi=110)
