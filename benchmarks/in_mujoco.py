"""Contacts in MuJoCo's steps beside the scene's own: forces and time. For docs/mujoco.md.

Run it with `python -m benchmarks.in_mujoco`.
"""

import timeit
import warnings
from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from benchmarks.peers.merged import text
from sphshell_pin.adapters.mujoco import attach
from sphshell_pin.base.arrays import Array
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


def panda(rng: np.random.Generator) -> None:
    """Print the largest difference of forces, and what a step takes longer."""
    built = build("fingertip_on_blade")
    pair = built.scene.pairs[0]
    ((on_sphere, on_shell),) = pair.sphere_on_shell
    model = mujoco.MjModel.from_xml_string(mjcf_of(built.scene.model, on_sphere.sphere))
    data = mujoco.MjData(model)
    for stiffness in (5e6, 5e4):
        law = sp.ImpactLaw(stiffness, 1.5, 300.0, 5e-5)
        scene = sp.Scene(built.scene.model)
        placed = {"placement": pair.placement_j, "law": law, "friction": pair.friction}
        scene.add_contact(on_sphere.sphere, on_shell.shell, **placed)
        worst, touched = 0.0, 0
        with attach(model, on_shell.shell, ["tip"], **placed) as contacts:
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
    times = timeit.repeat(call, number=CALLS, repeat=ROUNDS)
    return float(np.median(times)) / CALLS * 1e6


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    panda(np.random.default_rng(1))
