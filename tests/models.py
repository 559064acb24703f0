"""Small models the dynamics tests share, built joint by joint."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin import CoulombFriction, ImpactLaw, Scene, Shell, Sphere
from tests import meshes

Vector = NDArray[np.float64]

JOINTS = {
    "free-flyer": pin.JointModelFreeFlyer,
    "continuous x": pin.JointModelRUBX,
    "continuous z": pin.JointModelRUBZ,
    "prismatic": pin.JointModelPZ,
    "spherical": pin.JointModelSpherical,
}


def every_integrator(dt: float, adaptive: float, implicit: float) -> pytest.MarkDecorator:
    """Parametrize a test by the steppers of fixed steps [s], and the two of these tolerances."""
    fixed = (sp.SemiImplicitEuler, sp.RungeKutta4, sp.LinearlyImplicitEuler)
    five = [*(one(dt) for one in fixed), sp.Adaptive(adaptive), sp.Implicit(implicit)]
    return pytest.mark.parametrize("integrator", five, ids=lambda one: type(one).__name__)


def composite() -> pin.JointModelComposite:
    """A hinge, and behind it three slides."""
    joint = pin.JointModelComposite(2)
    turn = pin.SE3(meshes.random_rotation(1), np.array([0.1, 0.2, 0.3]))
    joint.addJoint(pin.JointModelRX(), turn)
    joint.addJoint(pin.JointModelTranslation(), turn)
    return joint


# Their axes turn with the joint.
TURNING = {
    "spherical zyx": pin.JointModelSphericalZYX,
    "universal": lambda: pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]),
    "composite": composite,
    "planar": pin.JointModelPlanar,
}


def empty(gravity: float = 9.81) -> pin.Model:
    """Model without bodies; gravity along -z [m/s^2]."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    return model


def add_body(model, name, joint, parent=0, *, placement=None, inertia=None, frame=None) -> int:
    """Add a body on `joint` with a frame called `name` on it; return the joint's index."""
    here = pin.SE3.Identity()
    index = model.addJoint(parent, joint, placement or here, f"{name}_joint")
    model.addJointFrame(index)
    model.appendBodyToJoint(index, inertia or pin.Inertia.FromSphere(1.0, 0.05), here)
    model.addFrame(pin.Frame(name, index, frame or here, pin.FrameType.OP_FRAME))
    return int(index)


def ball(gravity=9.81, mass=1.0, radius=0.05, joint=None) -> pin.Model:
    """Ball whose center is the frame "ball"; free unless a joint is given."""
    model = empty(gravity)
    inertia = pin.Inertia.FromSphere(mass, radius)
    add_body(model, "ball", joint or pin.JointModelFreeFlyer(), inertia=inertia)
    return model


def slider(gravity: float = 9.81, mass: float = 1.0) -> pin.Model:
    """Mass on a vertical prismatic joint, frame "ball" at its center: q is the center's height."""
    return ball(gravity, mass, joint=pin.JointModelPZ())


def block(gravity=9.81, mass=1.0, radius=0.05, *, tilt=0.0) -> pin.Model:
    """Ball that slides without turning, q its center; gravity leans by `tilt` [rad] along x."""
    model = ball(gravity, mass, radius, pin.JointModelTranslation())
    model.gravity.linear = gravity * np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    return model


def run(scene: Scene, integrator, q, v=None, duration=0.1, **more) -> sp.Result:  # type: ignore[no-untyped-def]
    """Run a scene from rest, unless a velocity is given."""
    return sp.Simulation(scene, integrator).run(q, v, duration, **more)


def free_q(position: Vector) -> Vector:
    """Configuration of a free-flyer at `position`, unturned."""
    return np.concatenate([np.asarray(position, dtype=float), [0.0, 0.0, 0.0, 1.0]])


def pose_of(model: pin.Model, q: Vector, frame: str) -> pin.SE3:
    """Where a frame is at q (nq,)."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame)]


def jacobian_of(model: pin.Model, q: Vector, frame: str, offset=(0, 0, 0)) -> Vector:  # type: ignore[no-untyped-def]
    """Jacobian (6, nv) of a frame at q (nq,), or of a point in it, in the axes of the world."""
    data, index = model.createData(), model.getFrameId(frame)
    found = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL_WORLD_ALIGNED)
    arm = data.oMf[index].rotation @ np.array(offset, dtype=float)
    return np.vstack([found[:3] - pin.skew(arm) @ found[3:], found[3:]])


def plate(size: float = 1.0, count: int = 8, side: str = "both") -> Shell:
    """Flat plate z = 0."""
    return Shell(*meshes.random_plate(count, seed=count, size=size, slivers=False), side=side)


def square(size: float = 2.0) -> Shell:
    """Flat square z = 0 of one element."""
    return Shell(*meshes.grid_plate(size=size, quads=True))


def linear_law(stiffness: float, damping: float = 0.0) -> ImpactLaw:
    """Spring and dashpot whose damping is constant from a micrometer of depth on."""
    return ImpactLaw(stiffness, 1.0, damping, 1e-6)


def on_shell(model, shell, law, friction=None, *, radius=0.05, offset=(0, 0, 0), **more) -> Scene:
    """Scene of a sphere at the frame "ball" and a shell, a fixed one unless `more` has a frame."""
    scene = Scene(model)
    more = {"name": "ball", **more}
    scene.add_contact(Sphere(radius, "ball", offset), shell, law=law, friction=friction, **more)
    return scene


def on_plate(model: pin.Model, law, friction=None, *, shell=None, **more) -> Scene:  # type: ignore[no-untyped-def]
    """The same on a fixed plate z = 0, by its facets."""
    more = {"method": "facets", "name": "ball-plate", **more}
    return on_shell(model, shell or plate(), law, friction, **more)


def two_free_bodies(law, friction=None, *, radius: float = 0.05) -> Scene:  # type: ignore[no-untyped-def]
    """Free ball ("ball") and free plate ("table", its shell turned in it), no gravity."""
    model = empty(gravity=0.0)
    add_body(model, "ball", pin.JointModelFreeFlyer(), inertia=pin.Inertia.FromSphere(1.0, radius))
    lump = pin.Inertia(2.0, np.array([0.02, -0.03, 0.01]), np.diag([0.03, 0.02, 0.04]))
    add_body(model, "table", pin.JointModelFreeFlyer(), inertia=lump)
    more = {"frame": "table", "placement": TABLE, "method": "facets", "name": "ball-table"}
    return on_shell(model, plate(size=2.0), law, friction, radius=radius, **more)


TABLE = pin.SE3(pin.utils.rpyToMatrix(0.3, -0.4, 0.5), np.array([0.05, 0.02, -0.03]))


def two_free_state(depth: float = 0.01, radius: float = 0.05) -> tuple[Vector, Vector]:
    """State of `two_free_bodies`: both spin fast, the ball `depth` deep in the plate."""
    table = pin.SE3(pin.utils.rpyToMatrix(-0.7, 0.2, 0.9), np.array([0.3, -0.2, 0.5]))
    center = table * TABLE * np.array([0.1, 0.07, radius - depth])
    q = np.concatenate([pin.SE3ToXYZQUAT(pin.SE3(np.eye(3), center)), pin.SE3ToXYZQUAT(table)])
    v_ball = np.array([0.3, -0.2, 0.1, 40.0, -30.0, 50.0])
    v_table = np.array([-0.1, 0.2, 0.1, 3.0, -4.0, 12.0])
    # The ball's center rides along with the table, but for a small velocity of its own.
    world = table.act(pin.Motion(v_table))
    v_ball[:3] += world.linear + np.cross(world.angular, center)
    return q, np.concatenate([v_ball, v_table])


LAW = linear_law(4000.0, 20.0)
FRICTION = CoulombFriction(0.3, 0.1, 0.1, 1.0)


def arm() -> pin.Model:
    """Three-joint arm over the plate, frame "ball" at its tip."""
    model = empty()
    reach = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.2]))
    lump = pin.Inertia(1.0, np.array([0.0, 0.0, 0.1]), np.diag([0.01, 0.01, 0.002]))
    base = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.1]))
    joint = add_body(model, "one", pin.JointModelRZ(), placement=base, inertia=lump)
    joint = add_body(model, "two", pin.JointModelRY(), joint, placement=reach, inertia=lump)
    add_body(model, "ball", pin.JointModelRY(), joint, placement=reach, inertia=lump, frame=reach)
    return model


ARM_Q = np.array([0.3, 1.6, 0.9])  # the tip a few centimeters over the plate
