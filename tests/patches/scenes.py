"""A ball that slides over a shell, held by a spring or its weight, with its patches recorded."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from tests import meshes, models

RADIUS = 0.01
LAW = sp.ImpactLaw(1e7, 1.5)


def slider(mass=1.0, placement=None):
    """A body, frame "ball", that moves along x, y, z without turning."""
    model = models.ball(mass=mass, radius=RADIUS, joint=pin.JointModelTranslation())
    model.jointPlacements[1] = placement or pin.SE3.Identity()
    return model


def plate(half=0.05, cells=1, height=lambda x, y: 0.0):
    """A square of cells x cells quads, at height(x, y)."""
    corners, elements = meshes.grid_plate(cells, cells, 2 * half, quads=True)
    corners[:, 2] = [height(x, y) for x, y, _ in corners]
    return sp.Shell(corners, elements, name="plate")


def pressed(force=9.81):
    """How deep LAW is under a force [m]."""
    return (force / 1e7) ** (1 / 1.5)


def slide(shell=None, speed=0.2, duration=0.05, friction=None, record_dt=1e-3, law=LAW, **given):
    """Slide a ball of 1 kg over a plate, at rest on it but for its speed along x."""
    scene = sp.Scene(slider())
    pair = sp.Sphere(RADIUS, "ball"), shell or plate()
    scene.add_contact(*pair, law=law, friction=friction, name="tip")
    q0, given = [-0.01, 0.0, RADIUS - pressed()], {"record": ("patch",), **given}
    simulation = sp.Simulation(scene, sp.Adaptive())
    return simulation.run(q0, [speed, 0.0, 0.0], duration, record_dt=record_dt, **given)


def total_force(result):
    """The sum of the normal forces at each row (rows,) [N]."""
    log = result.contacts
    return np.bincount(log.row, log.normal_force, len(result.t))
