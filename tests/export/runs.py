"""Short runs to export: a finger with sensors, and a free ball on a turntable."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots

WALL = ([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]], [[0, 1, 2, 3]])
LAW = sp.HuntCrossleyLaw(1e6, 1.5, dissipation=2.0)
FRICTION = sp.CoulombFriction(0.3, 0.25, 1e-3, 1e-2)


def finger_run():
    """A finger that bends on a wall, with a sensor of each kind; the wall's name is taken twice."""
    finger = robots.load("three_link_finger")
    wall = sp.Shell(*WALL, name="wall")
    upright = pin.SE3(pin.rpy.rpyToMatrix(0.0, -np.pi / 2, 0.0), np.array([0.07, 0.0, 0.1]))
    scene = sp.Scene(finger.model)
    tip, placed = sp.Sphere(0.010, "tip"), {"placement": upright, "friction": FRICTION}
    scene.add_contact(tip, wall, law=LAW, name="tip-wall", **placed)
    other = sp.Shell(*WALL, name="wall")
    away = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.5, 0.0, -0.5]))
    scene.add_contact(tip, other, placement=away, law=LAW, name="never-there")
    sensors = [
        sp.ForceTorqueSensor(name="fingertip", frame="tip", rate=500, delay=2e-3),
        sp.JointTorqueSensor(name="knuckle", joint="knuckle", rate=500),
        sp.ContactSwitch(name="touch", contact="tip-wall", threshold=0.1, rate=500),
    ]

    def bend(t, q, v, contacts):
        return 0.1 * (np.array([0.2, 0.6, 0.5]) + 0.6 * t - q) - 0.004 * v

    simulation = sp.Simulation(scene, sp.RungeKutta4(2e-4), sensors)
    q0 = np.array([0.2, 0.6, 0.5])
    return simulation.run(q0, duration=0.08, controller=bend, control_dt=1e-3, record_dt=1e-3)


def turntable_run():
    """A ball that rolls on a turning disc: a joint without end, a free one, a shell that moves."""
    model = pin.Model()
    inertia = pin.Inertia.FromSphere(0.05, 0.02)
    axle = model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "axle")
    model.appendBodyToJoint(axle, pin.Inertia.FromCylinder(1.0, 0.1, 0.01), pin.SE3.Identity())
    tilted = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0.2, 0.1), np.array([0.0, 0.0, -0.01]))
    model.addBodyFrame("disc", axle, tilted, 0)
    ball = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball_moves")
    model.appendBodyToJoint(ball, inertia, pin.SE3.Identity())
    model.addBodyFrame("ball", ball, pin.SE3.Identity(), 0)
    model.addBodyFrame("cap", ball, pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.01])), 0)
    scene = sp.Scene(model)
    placed = {"frame": "disc", "placement": tilted.inverse(), "friction": FRICTION}
    disc = sp.Shell(*WALL, name="disc")
    scene.add_contact(sp.Sphere(0.02, "ball"), disc, law=LAW, name="1st ball/disc", **placed)
    q0 = np.array([1.0, 0.0, 0.05, 0.01, 0.0201, 0.0, 0.0, 0.0, 1.0])
    v0 = np.array([3.0, 0.1, 0.0, 0.0, 0.5, 0.0, 0.0])
    return sp.Simulation(scene, sp.RungeKutta4(1e-4)).run(q0, v0, 0.05, record_dt=1e-3)


def linkless_run():
    """A ball on two joints of which the first has no link, at rest beside a plate."""
    model = pin.Model()
    away = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.1, 0.0, 0.3]))
    moves = model.addJoint(0, pin.JointModelTranslation(), away, "moves")
    turns = model.addJoint(moves, pin.JointModelSpherical(), away, "turns")
    model.appendBodyToJoint(turns, pin.Inertia.FromSphere(0.05, 0.02), pin.SE3.Identity())
    model.addBodyFrame("moves", turns, pin.SE3.Identity(), 0)  # the link is called as the joint
    scene = sp.Scene(model)
    scene.add_contact(sp.Sphere(0.02, "moves"), sp.Shell(*WALL), law=LAW, name="ball")
    q0 = np.array([0.01, 0.02, 0.03, 0.0, 0.0, 0.0, 1.0])
    v0 = np.array([0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
    return sp.Simulation(scene, sp.RungeKutta4(1e-3)).run(q0, v0, 0.01, record_dt=1e-3)
