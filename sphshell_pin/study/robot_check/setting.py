"""The scene of a check: a sphere on the robot, a curved patch where it touches, a fitting law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, frame_along
from sphshell_pin.base.summary import names
from sphshell_pin.contact import CoulombFriction, ImpactLaw, NormalLaw, Sphere
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.scene.mimic import mimics, with_mimics
from sphshell_pin.dynamics.scene.models import find_frame, mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots.inertia import lacks_masses, mass_fault
from sphshell_pin.shell import Shell
from sphshell_pin.study.report.surfaces import wavy_sheet
from sphshell_pin.study.robot_check import probe_spheres
from sphshell_pin.study.robot_check.models import Subject
from sphshell_pin.study.robot_check.postures import massless_joints, random_posture, regularity
from sphshell_pin.testing.forces import point_jacobian

PLATE, BASE = "sphshell_check_plate", "sphshell_check_base"

# The patch, in radii of the sphere: half its side, height and length of its waves.
_HALF, _HEIGHT, _WAVE = 12.0, 0.3, 12.0
_CELLS = 20
# Deepest indentation the law is made for, in radii.
_DEEPEST = 0.2
_TRIES = 60


@dataclass(frozen=True)
class Setting:
    """A robot with its sphere: `model` without the joints that are held, the patch, and notes."""

    model: pin.Model
    sphere: Sphere
    shell: Shell
    notes: tuple[str, ...]

    @property
    def radius(self) -> float:
        """Radius of the sphere [m]."""
        return float(self.sphere.radius)


@dataclass(frozen=True)
class Touch:
    """A scene and a state (q, v) in which the sphere is about to touch, or touches."""

    scene: Scene
    q: Array
    v: Array
    speed: float
    """Speed of the sphere's center against the patch [m/s]."""
    mass: float
    """That the contact feels along its normal [kg]."""


def setting_of(
    subject: Subject, rng: np.random.Generator, frame: str | None, radius: float | None
) -> Setting:
    """Put a sphere on the robot: at `frame`, at a tip that is known, or at the longest limb's end.

    Joints that move no mass are held, with a note. SphshellError if no joint is left that moves the
    sphere, FrameNotFound if there is no such frame.
    """
    model, notes = subject.robot.model, [*subject.notes]
    if model.nv == 0:
        bare = lacks_masses(model, subject.robot.description, floating=True)
        raise SphshellError(
            f"the robot '{subject.name}' has no joint that moves: let its root float, --free-flyer"
            + (" --density 2700" if bare else "")
        )
    postures = [random_posture(model, rng) for _ in range(5)]
    held = massless_joints(model, postures)
    if held:
        model = Scene(model, lock=held, q_lock=postures[0]).model
        notes.append(
            "joints that move no mass are held here, as `lock` does it in a scene, because forward "
            f"dynamics has no answer for them: {names(held)}"
        )
    try:
        sphere, said = probe_spheres.find_sphere(subject, model, rng, frame, radius)
    except SphshellError:
        robot = subject.robot
        fault = mass_fault(robot.model, postures[0], robot.description) if held else None
        if fault is None:
            raise
        raise SphshellError(fault) from None
    notes += said
    if any(model.armature[one.idx_v] for one in model.joints if _flies(one)):
        notes.append(
            "the file gives its free joint an armature, an inertia without momentum, which is left "
            "out where momentum is checked: make it a <freejoint/>, which takes no defaults"
        )
    return Setting(model, sphere, patch(sphere.radius), tuple(notes))


def patch(radius: float) -> Shell:
    """Return a wavy patch (800 triangles, exact normals) round the origin, z up, for `radius`."""
    vertices, triangles = wavy_sheet(_CELLS, 2.0 * _HALF * radius)
    x, y, _ = vertices.T
    z, normals = _wave(x, y, radius)
    return Shell(np.stack([x, y, z], 1), triangles, normals=normals, name="patch")


def touch_of(
    setting: Setting,
    rng: np.random.Generator,
    gap: float,
    speed: float,
    *,
    free: bool = False,
    least: bool = False,
) -> Touch:
    """Put the patch into the world, `gap` [radii] before the sphere that comes with `speed` [m/s].

    A negative gap is a depth. If it is `free`, the robot's root and the patch float without
    gravity; the patch is as heavy as the robot is in the contact, and turns a little. With `least`
    the joints move no faster than they must.
    """
    sphere = setting.sphere
    model = _floating(setting.model, sphere) if free else setting.model
    q, v, way = _motion(model, sphere, rng, speed)
    if least:
        v = np.linalg.pinv(probe_spheres.center_jacobian(model, model.createData(), q, sphere)) @ (
            speed * way
        )
    contact = _Contact.facing(way, rng, gap, setting)
    data = probe_spheres.placed_data(model, q)
    mass, pose = contact.mass(model, data, q, sphere), contact.pose(model, data, sphere)
    frame = "universe"
    if free:
        plate, width = model.joints[model.getJointId(PLATE)], 2.0 * _HALF * setting.radius
        model.inertias[plate.id] = pin.Inertia.FromBox(mass, width, width, 0.1 * width)
        q[plate.idx_q : plate.idx_q + 7] = pin.SE3ToXYZQUAT(pose)
        v[plate.idx_v : plate.idx_v + 3] = 0.0
        v[plate.idx_v + 3 : plate.idx_v + 6] = 0.1 * speed / width * rng.normal(size=3)
        mass = contact.mass(model, probe_spheres.placed_data(model, q, data), q, sphere, plate.id)
        frame, pose = PLATE, None
    scene = Scene(model)
    law, friction = _law(mass, speed, setting.radius)
    scene.add_contact(
        sphere, setting.shell, frame, placement=pose, law=law, friction=friction, name="touch"
    )
    return Touch(scene, q, v, speed, mass)


def meeting_posture(
    model: pin.Model, data: pin.Data, setting: Setting, rng: np.random.Generator, gap: float
) -> Array:
    """Return a random posture (nq,) of a free touch's model, the patch `gap` [radii] away."""
    q = random_posture(model, rng)
    probe_spheres.placed_data(model, q, data)
    way = rng.normal(size=3)
    contact = _Contact.facing(way / np.linalg.norm(way), rng, gap, setting)
    plate = model.joints[model.getJointId(PLATE)]
    q[plate.idx_q : plate.idx_q + 7] = pin.SE3ToXYZQUAT(contact.pose(model, data, setting.sphere))
    return q


def random_torques(model: pin.Model, q: Array, rng: np.random.Generator) -> Array:
    """Return random torques (nv,) that move light and heavy joints alike."""
    weight = np.diag(mass_matrix(model, q))
    return np.asarray(np.sqrt(weight) * rng.normal(size=model.nv))


def stopping_law(mass: float, speed: float, depth: float) -> ImpactLaw:
    """Return the lossless law that stops `mass` [kg] at `speed` [m/s] within `depth` [m]."""
    return ImpactLaw(1.25 * mass * speed**2 / depth**2.5, 1.5)


@dataclass(frozen=True)
class _Contact:
    """Where on the patch, and from where, the sphere meets it: all lengths in meters."""

    normal: Array
    """In the world, from the patch to the sphere (3,)."""
    gap: float
    place: pin.SE3
    """SE3 in the patch: origin at the place, z along its normal, turned at random."""
    radius: float

    @classmethod
    def facing(cls, way: Array, rng: np.random.Generator, gap: float, setting: Setting) -> _Contact:
        """Meet a sphere that comes along `way` (3,), up to half a radian askew."""
        radius = setting.radius
        askew = rng.normal(size=3)
        askew -= (askew @ way) * way
        normal = -way + rng.uniform(0.1, 0.5) * askew / np.linalg.norm(askew)
        xy = rng.uniform(-0.25, 0.25, 2) * _HALF * radius
        z, up = _wave(xy[0], xy[1], radius)
        turn = frame_along(up) @ pin.AngleAxis(rng.uniform(0, 2 * np.pi), np.eye(3)[2]).matrix()
        place = pin.SE3(turn, np.array([*xy, z]))
        return cls(normal / np.linalg.norm(normal), gap * radius, place, radius)

    def pose(self, model: pin.Model, data: pin.Data, sphere: Sphere) -> pin.SE3:
        """Return where the patch is in the world (SE3)."""
        point = self._point(model, data, sphere)[1]
        return pin.SE3(frame_along(self.normal), point) * self.place.inverse()

    def mass(
        self, model: pin.Model, data: pin.Data, q: Array, sphere: Sphere, other: int = 0
    ) -> float:
        """Return the mass [kg] that the contact feels along its normal, against joint `other`."""
        joint, point = self._point(model, data, sphere)
        pin.computeJointJacobians(model, data, q)
        jacobian = point_jacobian(model, data, joint, point)
        row = self.normal @ (jacobian - point_jacobian(model, data, other, point))
        return 1.0 / float(row @ np.linalg.solve(mass_matrix(model, q), row))

    def _point(self, model: pin.Model, data: pin.Data, sphere: Sphere) -> tuple[int, Array]:
        joint, center = probe_spheres.center_of(model, data, sphere)
        return joint, center - (self.radius + self.gap) * self.normal


def _motion(
    model: pin.Model, sphere: Sphere, rng: np.random.Generator, speed: float
) -> tuple[Array, Array, Array]:
    """Return q, v and the direction (3,) in which the sphere's center moves with `speed` [m/s]."""
    data = model.createData()
    # A posture where two axes are nearly one is legal, but its accelerations run away: a last way.
    for wanted in (1e-3, 1e-4, 1e-9):
        for _ in range(_TRIES):
            q = random_posture(model, rng)
            jacobian = probe_spheres.center_jacobian(model, data, q, sphere)
            v = rng.normal(size=model.nv)
            way = jacobian @ v
            fast = float(np.linalg.norm(way))
            # A limb stretched out hardly moves its end: another posture says more.
            moves = fast > 0.05 * np.linalg.norm(jacobian) > 0.0
            if moves and regularity(model, q) > wanted:
                carries = np.abs(jacobian).max(axis=0) > 0.0
                v *= np.where(carries, speed / fast, min(speed / fast, 1.0))
                return q, v, way / fast
    raise SphshellError(
        f"none of {3 * _TRIES} random postures moves frame '{sphere.frame}' and has a regular mass "
        "matrix"
    )


def _law(mass: float, speed: float, radius: float) -> tuple[NormalLaw, CoulombFriction]:
    deepest = _DEEPEST * radius
    lossless = stopping_law(mass, speed, deepest)
    law = ImpactLaw(lossless.stiffness, 1.5, 0.3 * mass * speed / deepest, 0.8 * deepest)
    return law, CoulombFriction(0.3, 0.2, 0.2 * speed, speed)


def _floating(model: pin.Model, sphere: Sphere) -> pin.Model:
    """Return the robot with a free root, and a free plate, without gravity.

    Of its frames only that of the sphere is kept. The links that are fixed to the world are not in
    a model: a body as heavy as the rest stands for them. pinocchio.appendModel refuses models with
    two frames of one name, or with limits that exclude everything.
    """
    whole = pin.Model()
    whole.gravity.vector = np.zeros(6)
    joints = range(1, model.njoints)
    anew = {0: 0}
    rules = mimics(model)
    kinds = _kinds(model)
    if any(model.parents[j] == 0 and not _flies(model.joints[j]) for j in joints):
        mass = max(float(sum(model.inertias[j].mass for j in joints)), 1e-3)
        anew[0] = _add_free(whole, BASE, pin.Inertia.FromSphere(mass, 0.2))
    for j in joints:
        parent = anew[int(model.parents[j])] if not _flies(model.joints[j]) else 0
        placed = model.jointPlacements[j], model.names[j]
        anew[j] = int(whole.addJoint(parent, kinds[j], *placed))
        whole.appendBodyToJoint(anew[j], model.inertias[j], pin.SE3.Identity())
    frame = model.frames[find_frame(model, sphere.frame)]
    whole.addFrame(
        pin.Frame(sphere.frame, anew[frame.parentJoint], 0, frame.placement, pin.FrameType.OP_FRAME)
    )
    _add_free(whole, PLATE, pin.Inertia.FromSphere(1.0, 1.0))
    if rules:
        whole = with_mimics(whole, rules.values())
    for name in ("lowerPositionLimit", "upperPositionLimit", "armature"):
        values = np.array(getattr(whole, name))
        of = np.asarray(getattr(model, name))
        for j in joints:
            if name == "armature" and _flies(model.joints[j]):
                continue  # an inertia that no body has: it conserves no momentum
            old, new = model.joints[j], whole.joints[anew[j]]
            at, to, n = old.idx_q, new.idx_q, old.nq
            if len(of) == model.nv and name == "armature":
                at, to, n = old.idx_v, new.idx_v, old.nv
            values[to : to + n] = of[at : at + n]
        setattr(whole, name, values)
    return whole


def _kinds(model: pin.Model) -> list[pin.JointModel]:
    """Return the joints of `model`, in place of a mimic joint what it would be if it moved freely.

    Pinocchio keeps that to itself, but the joint's axis times the ratio is in its Data.
    """
    kinds, data = list(model.joints), model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    for name, rule in mimics(model).items():
        j = model.getJointId(name)
        axis = np.array(data.joints[j].S).ravel() / rule.ratio
        continuous = model.joints[model.getJointId(rule.of)].nq == 2
        if not axis[3:].any():
            kinds[j] = pin.JointModelPrismaticUnaligned(axis[:3])
        elif continuous:
            kinds[j] = pin.JointModelRevoluteUnboundedUnaligned(axis[3:])
        else:
            kinds[j] = pin.JointModelRevoluteUnaligned(axis[3:])
    return kinds


def _flies(joint: pin.JointModel) -> bool:
    return bool(joint.shortname() == "JointModelFreeFlyer")


def _add_free(model: pin.Model, name: str, inertia: pin.Inertia) -> int:
    """Add a free body called `name`, with a frame; return its joint."""
    joint = int(model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name))
    model.addJointFrame(joint)
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    return joint


def _wave(x: Array, y: Array, radius: float) -> tuple[Array, Array]:
    """Return the height of the patch at x, y [m], and its unit normal, pointing up."""
    k = 2.0 * np.pi / (_WAVE * radius)
    z = 0.5 * _HEIGHT * radius * (np.sin(k * x) + np.cos(k * y))
    slope = 0.5 * _HEIGHT * radius * k
    normal = np.stack(np.broadcast_arrays(-slope * np.cos(k * x), slope * np.sin(k * y), 1.0), -1)
    return z, normal / np.linalg.norm(normal, axis=-1, keepdims=True)
