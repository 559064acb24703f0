"""Contacts in MuJoCo's steps beside the scene's own: forces, time and energy. For docs/mujoco.md.

Run it with `python -m benchmarks.in_mujoco`.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.adapters.mujoco import attach
from sphshell_pin.arrays import Array
from sphshell_pin.benchmarks.peers.merged import text
from sphshell_pin.benchmarks.surfaces import Mesh, icosphere, torus
from sphshell_pin.scenario import build

STATES, ROUNDS, CALLS = 1000, 15, 2000


def mjcf_of(model: pin.Model, sphere: sp.Sphere) -> str:
    """Return an arm of Pinocchio, of revolute joints about z, with a sphere site, as MJCF."""
    frame = model.frames[model.getFrameId(sphere.frame)]
    place = frame.placement.act(np.array(sphere.offset))
    out = []
    for j in range(1, model.njoints):
        pose, inertia = model.jointPlacements[j], model.inertias[j]
        x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
        i = inertia.inertia
        full = text(i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        out.append(
            f'<body name="{model.names[j]}" pos="{text(pose.translation)}" '
            f'quat="{text(w, x, y, z)}"><inertial pos="{text(inertia.lever)}" '
            f'mass="{inertia.mass!r}" fullinertia="{full}"/><joint axis="0 0 1"/>'
        )
        if j == frame.parentJoint:
            out.append(f'<site name="tip" size="{sphere.radius!r}" pos="{text(place)}"/>')
    ends = "</body>" * (model.njoints - 1)
    return f"<mujoco><worldbody>{''.join(out)}{ends}</worldbody></mujoco>"


def generalized(scene: sp.Scene, q: Array, v: Array) -> Array:
    """Return the sum of J^T f (nv,) over the scene's own external forces."""
    data = scene.model.createData()
    pin.computeJointJacobians(scene.model, data, q)
    out = np.zeros(scene.model.nv)
    for joint, force in enumerate(scene.external_forces(q, v)):
        if joint:
            out += pin.getJointJacobian(scene.model, data, joint, pin.LOCAL).T @ force.vector
    return out


def ball(radius: float, mass: float, options: str = "", more: str = "") -> str:
    """Return a free ball, and `more`, as MJCF."""
    inertia = text(np.full(3, 0.4 * mass * radius**2))
    return f"""<mujoco><option {options}/><worldbody>
      <body name="ball"><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>
      <geom name="ball" type="sphere" size="{radius}"/></body>{more}</worldbody></mujoco>"""


def shell_of(mesh: Mesh) -> sp.Shell:
    """Return a surface with its exact normals."""
    return sp.Shell(mesh.vertices, mesh.triangles, normals=mesh.normals)


def panda(rng: np.random.Generator) -> None:
    """Print the largest difference of forces, and what a step takes longer."""
    built = build("fingertip_on_blade")
    pair = built.scene.pairs[0]
    assert pair.shell is not None
    assert pair.sphere is not None
    model = mujoco.MjModel.from_xml_string(mjcf_of(built.scene.model, pair.sphere))
    data = mujoco.MjData(model)
    for stiffness in (5e6, 5e4):
        law = sp.ImpactLaw(stiffness, 1.5, 300.0, 5e-5)
        scene = sp.Scene(built.scene.model)
        placed = {"placement": pair.placement_j, "law": law, "friction": pair.friction}
        scene.add_contact(pair.sphere, pair.shell, **placed)
        worst, touched = 0.0, 0
        with attach(model, pair.shell, ["tip"], **placed) as contacts:
            while touched < STATES:
                q = built.q0 + 0.02 * rng.standard_normal(7)
                v = 0.5 * rng.standard_normal(7)
                data.qpos, data.qvel = q, v
                wanted = generalized(scene, q, v)
                if np.any(wanted):
                    touched += 1
                    touching = q
                    mujoco.mj_forward(model, data)
                    apart = np.abs(data.qfrc_passive - wanted).max() / np.abs(wanted).max()
                    worst = max(worst, apart)
            print(f"Panda, {STATES} states, {stiffness:.0e} N/m^1.5: {worst:.1e} of the force")

            step = partial(step_from, model, data, touching)
            with_contact = median(step)
            mujoco.set_mjcb_passive(lambda _, data: contacts.apply(data))
            in_python = median(step)
            mujoco.set_mjcb_passive(None)
        without = median(step)
        print(
            f"a step: {without:.2f} us, with the contact {with_contact - without:+.2f} us, by a "
            f"Python callback {in_python - without:+.2f} us"
        )


def step_from(model: mujoco.MjModel, data: mujoco.MjData, q: Array) -> None:
    """Make one step, from rest at q."""
    data.qpos, data.qvel[:] = q, 0.0
    mujoco.mj_step(model, data)


def median(call: Callable[[], None]) -> float:
    """Return the median of ROUNDS times of a call [us]."""
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(CALLS):
            call()
        times.append((time.perf_counter() - begin) / CALLS * 1e6)
    return float(np.median(times))


def ball_in_torus(rng: np.random.Generator) -> None:
    """Print the largest difference of forces on two free bodies that touch."""
    inertia = text(0.1, 0.12, 0.2, 0.0, 0.01, 0.0)
    other = f"""<body name="torus"><freejoint/>
      <inertial pos="0 0 0" mass="2" fullinertia="{inertia}"/></body>"""
    radius, shell = 0.095, shell_of(torus(0.3, 0.1, 0.02))
    model = mujoco.MjModel.from_xml_string(ball(radius, 0.3, more=other))
    data = mujoco.MjData(model)
    free = pin.Model()
    for name in ("ball", "torus"):
        joint = free.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
        free.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
        free.addBodyFrame(name, joint, pin.SE3.Identity(), 0)
    scene = sp.Scene(free)
    settings = {"law": sp.HuntCrossleyLaw(1e4, 1.5, 0.3), "friction": sp.CoulombFriction(0.4, 0.3)}
    scene.add_contact(sp.Sphere(radius, "ball"), shell, "torus", **settings)  # type: ignore[arg-type]
    worst, touched = 0.0, 0
    with attach(model, shell, ["ball"], body="torus", **settings):  # type: ignore[arg-type]
        while touched < STATES:
            q, v = pin.neutral(free), rng.standard_normal(12)
            q[7:10] = 0.1 * rng.standard_normal(3)
            turn = pin.Quaternion(pin.exp3(rng.standard_normal(3)))
            angle = rng.uniform(0, 2 * np.pi)
            middle = 0.3 * np.array([np.cos(angle), np.sin(angle), 0.0])
            q[10:] = turn.coeffs()
            q[:3] = q[7:10] + turn.matrix() @ (middle + rng.uniform(-6e-3, 6e-3, 3))
            wanted = scene.external_forces(q, v)
            if not np.any(wanted[1].vector):
                continue
            touched += 1
            for first in (0, 7):
                data.qpos[first : first + 7] = q[first + np.array([0, 1, 2, 6, 3, 4, 5])]
            # A free joint of MuJoCo has its velocity and force in the world, its turns in the body.
            rotations = np.eye(3), turn.matrix()
            for k, rotation in enumerate(rotations):
                data.qvel[6 * k : 6 * k + 3] = rotation @ v[6 * k : 6 * k + 3]
                data.qvel[6 * k + 3 : 6 * k + 6] = v[6 * k + 3 : 6 * k + 6]
            mujoco.mj_forward(model, data)
            for k, rotation in enumerate(rotations):
                force = wanted[k + 1]
                own = np.hstack((rotation @ force.linear, force.angular))
                apart = np.abs(data.qfrc_passive[6 * k : 6 * k + 6] - own).max()
                worst = max(worst, apart / np.abs(own).max())
    print(f"ball in a torus, {STATES} states: {worst:.1e} of the force")


def bowl(seconds: float = 60.0, dt: float = 1e-4) -> None:
    """Print by how much the energy of a ball that swings in a bowl changes."""
    radius, mass, law = 0.05, 0.2, sp.HuntCrossleyLaw(1e5, 1.5)
    shell = shell_of(icosphere(5, 2.0))
    options = f'timestep="{dt}" integrator="RK4"'
    model = mujoco.MjModel.from_xml_string(ball(radius, mass, options))
    data = mujoco.MjData(model)
    depth = law.depth_at(mass * 9.81)
    along = np.array([np.sin(0.15), 0.0, -np.cos(0.15)])
    data.qpos[:3] = (2.0 - radius + depth * np.cos(0.15)) * along

    energies, sides = [], []
    with attach(model, shell, ["ball"], law=law) as contacts:
        for step in range(round(seconds / dt)):
            if step % 1000 == 0:
                mujoco.mj_forward(model, data)
                v = data.qvel[:3]
                energy = 0.5 * mass * v @ v + mass * 9.81 * data.qpos[2]
                depths = contacts.contacts(data).depth
                assert len(depths) == 1
                energies.append(energy + law.energy(depths[0]))
                sides.append(data.qpos[0])
            mujoco.mj_step(model, data)
    assert min(sides) < -0.9 * max(sides) < 0.0
    swing = mass * 9.81 * (2.0 - radius) * (1 - np.cos(0.15))
    change = np.ptp(energies) / swing
    print(f"energy of {seconds:.0f} s in a bowl, RK4 at {dt:.0e} s: {change:.1e} of the swing's")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    panda(np.random.default_rng(1))
    ball_in_torus(np.random.default_rng(2))
    bowl()
