"""A ball that slides over a shell, held by a spring or its weight, with its patches recorded."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp

RADIUS = 0.01
LAW = sp.ImpactLaw(1e7, 1.5)


def slider(mass=1.0, placement=None):
    """A body, frame "ball", that moves along x, y, z without turning."""
    model = pin.Model()
    joint = model.addJoint(
        0, pin.JointModelTranslation(), placement or pin.SE3.Identity(), "slides"
    )
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(mass, RADIUS), pin.SE3.Identity())
    model.addFrame(pin.Frame("ball", joint, pin.SE3.Identity(), pin.FrameType.BODY))
    return model


def plate(half=0.05, cells=1, height=lambda x, y: 0.0):
    """A square of cells x cells quads, at height(x, y)."""
    at = np.linspace(-half, half, cells + 1)
    corners = [[x, y, height(x, y)] for y in at for x in at]
    first = [i + (cells + 1) * j for j in range(cells) for i in range(cells)]
    elements = [[k, k + 1, k + cells + 2, k + cells + 1] for k in first]
    return sp.Shell(corners, elements, name="plate")


def pressed(force=9.81):
    """How deep LAW is under a force [m]."""
    return (force / 1e7) ** (1 / 1.5)


def slide(shell=None, speed=0.2, duration=0.05, friction=None, record_dt=1e-3, law=LAW, **given):
    """Slide a ball of 1 kg over a plate, at rest on it but for its speed along x."""
    scene = sp.Scene(slider())
    scene.add_contact(
        sp.Sphere(RADIUS, "ball"), shell or plate(), law=law, friction=friction, name="tip"
    )
    q0 = [-0.01, 0.0, RADIUS - pressed()]
    return sp.Simulation(scene, sp.Adaptive()).run(
        q0, [speed, 0.0, 0.0], duration, record_dt=record_dt, record=("patch",), **given
    )


def total_force(result):
    """The sum of the normal forces at each row (rows,) [N]."""
    log = result.contacts
    return np.bincount(log.row, log.normal_force, len(result.t))
