"""MJCF: MuJoCo reads the file, and what it compiles becomes models of Pinocchio.

Pinocchio's own reader (4.1) drops all bodies of the world but the first, includes, ranges'
`limited`, visual geoms' masses, orientations of geoms without `pos`, damping of ball joints and
equalities, and makes one nameless joint of several.
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import Mimic
from sphshell_pin.errors import import_extra
from sphshell_pin.robots import mjcf_compile
from sphshell_pin.robots.description import Description
from sphshell_pin.robots.mesh_faults import mesh_fault
from sphshell_pin.robots.packages import Folders

_KINDS = ("connect", "weld", "joint", "tendon")
_SITE = 6  # of mjtObj


def couplings(m: Any, joints: Sequence[str]) -> tuple[tuple[Mimic, ...], tuple[str, ...]]:
    """Return the equalities that are mimic joints, and a sentence on each of the others.

    m : MuJoCo's model; joints : their names
    """
    mimics, loops = [], []
    for e in range(m.neq):
        if not m.eq_active0[e]:
            continue
        kind, one, two = int(m.eq_type[e]), int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
        tag = _KINDS[kind] if kind < len(_KINDS) else "flex"
        label = f"<{tag}>" + (f" '{m.eq(e).name}'" if m.eq(e).name else "")
        terms = m.eq_data[e, :5].tolist()
        if tag == "joint" and two < 0:
            loops.append(f"{label} holds joint '{joints[one]}' at {terms[0]:g} (lock it instead)")
        elif tag == "joint" and any(terms[2:]):
            of = f"'{joints[one]}' follow '{joints[two]}'"
            loops.append(f"{label} makes joint {of} by a polynomial")
        elif tag == "joint":
            # It is of the distances from ref.
            ref, of_ref = (float(m.qpos0[m.jnt_qposadr[j]]) for j in (one, two))
            offset = terms[0] + ref - terms[1] * of_ref
            mimics.append(Mimic(joints[one], joints[two], terms[1], offset))
        elif tag in ("connect", "weld"):
            ends = [one, two]
            if m.eq_objtype[e] == _SITE:
                ends = [int(m.site_bodyid[site]) for site in ends]
            bodies = " and ".join(f"'{m.body(end).name}'" for end in ends)
            names = ", ".join(repr(joints[j]) for j in _between(m, *ends))
            of = f", of the joints {names}" if names else ""
            loops.append(f"the kinematic loop that {label} closes between {bodies}{of}")
        else:
            loops.append(f"{label} of <equality>")
    return tuple(mimics), tuple(loops)


def _between(m: Any, one: int, other: int) -> list[int]:
    """Return the joints on the way from one body to another."""
    ways = [[one], [other]]
    for way in ways:
        while way[0]:
            way.insert(0, int(m.body_parentid[way[0]]))
    apart = [body for body in ways[0] + ways[1] if (body in ways[0]) != (body in ways[1])]
    return [m.body_jntadr[body] + k for body in apart for k in range(m.body_jntnum[body])]


_SHAPES: dict[int, tuple[str, Callable[..., Any]]] = {
    2: ("sphere", lambda r, *_: coal.Sphere(r)),
    3: ("capsule", lambda r, half, _: coal.Capsule(r, 2 * half)),
    4: ("ellipsoid", coal.Ellipsoid),
    5: ("cylinder", lambda r, half, _: coal.Cylinder(r, 2 * half)),
    6: ("box", lambda *half: coal.Box(*(2 * one for one in half))),
}
"""Names and shapes by MuJoCo's mjtGeom."""

_OTHERS = {0: "plane", mjcf_compile.MESH: "mesh"}
_GRAY = (0.5, 0.5, 0.5, 1.0)
_SHOWN_GROUPS = 3
_NUMBERS = ["body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"]
_NUMBERS += ["jnt_pos", "jnt_axis", "jnt_range", "dof_armature", "dof_damping", "dof_frictionloss"]
_NUMBERS += ["geom_pos", "geom_quat", "geom_size", "site_pos", "site_quat", "qpos0", "key_qpos"]


def read_mjcf(root: ET.Element, folders: Folders, *, floats: bool | None = None) -> Description:
    """Return an MJCF; ValueError says what in it cannot be read.

    What it includes is put into `root`. Its base `floats` or is fixed; None: as it states. Raises
    MissingExtra without mujoco.
    """
    with interrupts_delayed():
        mujoco = import_extra("mujoco", "mujoco", "an MJCF file")
    if folders.kept is None:
        mjcf_compile.include(root, [folders.file.absolute()])
    elif root.find(".//include") is not None:
        raise ValueError("it includes other files")
    made = mjcf_compile.Compiled(mujoco, root, folders, floats)
    robot = MjcfRobot(made, root.get("model") or "robot")
    mimics, loops = couplings(robot.m, robot.joints)
    notes = tuple(
        f"{text}: {', '.join(map(repr, dict.fromkeys(names)))}"
        for text, names in made.notes.items()
    )
    return Description(folders.file, folders, root, mimics, loops, notes, robot.start(), robot)


class MjcfRobot:
    """What MuJoCo compiled, as Pinocchio's models."""

    def __init__(self, made: mjcf_compile.Compiled, name: str) -> None:
        m = self.m = made.model
        for part in _NUMBERS:
            if not np.isfinite(getattr(m, part)).all():
                raise ValueError(f"a number of its {part} is not finite")
        self.name = name
        self.bodies = [m.body(i).name for i in range(m.nbody)]
        self.joints = [m.joint(j).name for j in range(m.njnt)]
        for what, names in (("body", self.bodies), ("joint", self.joints)):
            if "universe" in names:
                raise ValueError(
                    f"a {what} is called 'universe', as Pinocchio calls the world: give it another "
                    "name"
                )
        self.files = made.files
        self.geoms: list[int] = []
        for g in np.flatnonzero(m.geom_bodyid).tolist():
            if self.mesh(g) is not None or m.geom_type[g] in _SHAPES:
                self.geoms.append(g)
            else:
                made.notes[mjcf_compile.LEFT_OUT].append(_kind(m.geom_type[g]))
        self._note(made)

    def model(self) -> pin.Model:
        """Return the model; keys are its reference configurations."""
        m, model = self.m, pin.Model()
        model.name = self.name
        # The joint of each body, its frame, and its place there.
        at = [(0, 0, pin.SE3.Identity())]
        for i, name in enumerate(self.bodies[1:], 1):
            joint, frame, place = at[m.body_parentid[i]]
            place = place * _pose(m.body_pos[i], m.body_quat[i])
            first, count = m.body_jntadr[i], m.body_jntnum[i]
            for j in range(first, first + count):
                anchor, drawn = pin.SE3(np.eye(3), m.jnt_pos[j]), self._drawn(j)
                if m.jnt_type[j] == mjcf_compile.FREE:  # its coordinates are the pose in the world
                    place = anchor = pin.SE3.Identity()
                there = place * anchor * drawn.inverse()
                made = model.addJoint(joint, self._joint(j), there, self.joints[j])
                joint, frame = made, model.addJointFrame(made, int(frame))
                place = anchor.inverse()
            turn = _pose(m.body_ipos[i], m.body_iquat[i])
            moments = turn.rotation @ np.diag(m.body_inertia[i]) @ turn.rotation.T
            inertia = pin.Inertia(float(m.body_mass[i]), turn.translation, moments)
            if count:
                model.appendBodyToJoint(joint, inertia, place)
            else:
                kind = pin.FrameType.FIXED_JOINT
                fixed = pin.Frame(f"{name}_fixed", joint, int(frame), place, kind, inertia)
                frame = model.addFrame(fixed, True)
            at.append((joint, model.addBodyFrame(name, joint, place, int(frame)), place))
        self._limit(model)
        for s in range(m.nsite):
            if m.site(s).name:
                joint, frame, place = at[m.site_bodyid[s]]
                place = place * _pose(m.site_pos[s], m.site_quat[s])
                kind = pin.FrameType.OP_FRAME
                site = pin.Frame(m.site(s).name, joint, int(frame), place, kind)
                model.addFrame(site, False)
        for k in range(m.nkey):
            if m.key(k).name:
                model.referenceConfigurations[m.key(k).name] = self._configuration(m.key_qpos[k])
        return model

    def body(self, g: int) -> str:
        """Return the body of a geom."""
        return str(self.bodies[self.m.geom_bodyid[g]])

    def mesh(self, g: int) -> tuple[Path, Array] | None:
        """Return the file and the scale of the mesh of a geom that has one."""
        is_mesh = self.m.geom_type[g] == mjcf_compile.MESH
        return self.files.get(self.m.mesh(self.m.geom_dataid[g]).name) if is_mesh else None

    def touches(self, g: int) -> bool:
        """Whether a geom is not drawn alone."""
        return bool(self.m.geom_contype[g] or self.m.geom_conaffinity[g])

    def is_sphere(self, g: int) -> bool:
        """Whether a geom is a sphere."""
        return _kind(self.m.geom_type[g]) == "sphere"

    def geometry(self, model: pin.Model, *, visual: bool) -> tuple[pin.GeometryModel, list[str]]:
        """Return what is drawn, or what touches, and the mesh files that cannot be read."""
        m, made, missing = self.m, pin.GeometryModel(), dict[str, None]()
        for g in self.geoms:
            mesh, body = self.mesh(g), self.body(g)
            drawn = m.geom_group[g] < _SHOWN_GROUPS or not self.touches(g)
            if not (drawn if visual else self.touches(g)):
                continue
            place, path, scale = _pose(m.geom_pos[g], m.geom_quat[g]), "", np.ones(3)
            if mesh is None:
                path = _kind(m.geom_type[g]).upper()
                shape = _SHAPES[m.geom_type[g]][1](*m.geom_size[g].tolist())
            else:
                path, scale = str(mesh[0]), mesh[1]
                try:
                    if mesh_fault(mesh[0]):
                        raise ValueError
                    shape = coal.MeshLoader(coal.BV_OBBRSS).load(path, scale)
                except (ValueError, RuntimeError):
                    missing[path] = None
                    continue
                # MuJoCo counts from the center of mass and the principal axes of a mesh.
                k = m.geom_dataid[g]
                place = place * _pose(m.mesh_pos[k], m.mesh_quat[k]).inverse()
            color, material = m.geom_rgba[g], m.geom_matid[g]
            if np.allclose(color, _GRAY):
                color = np.ones(4) if material < 0 else m.mat_rgba[material]
            frame = int(model.getFrameId(body, pin.FrameType.BODY))
            joint, place = model.frames[frame].parentJoint, model.frames[frame].placement * place
            name = m.geom(g).name or f"{body}Geom_{g - m.body_geomadr[m.geom_bodyid[g]]}"
            color = np.array(color, dtype=float)
            made.addGeometryObject(
                pin.GeometryObject(name, joint, frame, place, shape, path, scale, False, color)
            )
        return made, list(missing)

    def start(self) -> dict[str, Array]:
        """Return where the file draws the joints that are not at zero there."""
        drawn = self._configuration(self.m.qpos0)
        found = {}
        for j, name in enumerate(self.joints):
            at, kind = self.m.jnt_qposadr[j], self.m.jnt_type[j]
            values = drawn[at : at + (7 if kind == mjcf_compile.FREE else 1)]
            if kind == mjcf_compile.FREE or (kind != mjcf_compile.BALL and values.any()):
                found[name] = values
        return found

    def _configuration(self, qpos: Array) -> Array:
        """Return q (nq,) of Pinocchio, whose quaternions have w last."""
        q = qpos.copy()
        for at, kind in zip(self.m.jnt_qposadr, self.m.jnt_type, strict=True):
            if kind in (mjcf_compile.FREE, mjcf_compile.BALL):
                begin = at + (3 if kind == mjcf_compile.FREE else 0)
                turn = np.roll(qpos[begin : begin + 4], -1)
                q[begin : begin + 4] = turn / np.linalg.norm(turn)
        return q

    def _drawn(self, j: int) -> pin.SE3:
        """Return the motion of a joint from zero to where the file draws it."""
        kind, moved = self.m.jnt_type[j], self.m.qpos0[self.m.jnt_qposadr[j]] * self.m.jnt_axis[j]
        turned = pin.exp3(moved) if kind == mjcf_compile.HINGE else np.eye(3)
        return pin.SE3(turned, moved if kind == mjcf_compile.SLIDE else np.zeros(3))

    def _joint(self, j: int) -> Any:
        kind, axis = int(self.m.jnt_type[j]), self.m.jnt_axis[j]
        if kind < mjcf_compile.SLIDE:
            made = pin.JointModelFreeFlyer, pin.JointModelSpherical
            return made[kind]()
        along, name = np.flatnonzero(axis), ("P", "R")[kind - mjcf_compile.SLIDE]
        if len(along) == 1 and axis[along] == 1.0:
            return getattr(pin, f"JointModel{name}{'XYZ'[along[0]]}")()
        kinds = pin.JointModelPrismaticUnaligned, pin.JointModelRevoluteUnaligned
        return kinds[kind - mjcf_compile.SLIDE](axis)

    def _limit(self, model: pin.Model) -> None:
        """Put ranges, damping, dry friction, armature and limits of forces into `model`.

        Its coordinates and velocities are numbered as MuJoCo's.
        """
        m, endless = self.m, np.array([-np.inf, np.inf])
        single = m.jnt_type >= mjcf_compile.SLIDE
        limits = np.full((m.nq, 2), [-1.01, 1.01])  # of free and ball joints as Pinocchio has them
        efforts = np.full((m.nv, 2), endless)
        for into, at, limited, ranges in (
            (limits, m.jnt_qposadr, m.jnt_limited, m.jnt_range),
            (efforts, m.jnt_dofadr, m.jnt_actfrclimited, m.jnt_actfrcrange),
        ):
            into[at[single]] = np.where(limited[single, None], ranges[single], endless)
        model.damping, model.armature = m.dof_damping.T.ravel()[: m.nv], m.dof_armature
        model.upperDryFrictionLimit = m.dof_frictionloss
        model.lowerDryFrictionLimit = -m.dof_frictionloss
        model.lowerPositionLimit, model.upperPositionLimit = limits.T
        model.lowerEffortLimit, model.upperEffortLimit = efforts.T
        model.upperVelocityLimit = np.full(m.nv, np.inf)
        model.lowerVelocityLimit = -model.upperVelocityLimit

    def _note(self, made: mjcf_compile.Compiled) -> None:
        """Note what the file states that is not modeled."""
        m, notes = self.m, made.notes
        for j, name in enumerate(self.joints):
            if np.any(m.jnt_stiffness[j]):
                notes["springs of joints (stiffness, springdamper) are not modeled"].append(name)
            if m.jnt_limited[j] and m.jnt_type[j] == mjcf_compile.BALL:
                notes["ranges of ball joints are not modeled"].append(name)
        for i in np.flatnonzero(m.body_gravcomp).tolist():
            notes["gravity acts on bodies with gravcomp too"].append(self.bodies[i])
        for g in range(m.body_geomnum[0]):
            if m.geom_contype[g] or m.geom_conaffinity[g]:
                text = "geoms of the world are no part of the robot, add them as shells"
                notes[text].append(m.geom(g).name or _kind(m.geom_type[g]))
        for k in range(m.ntendon):
            notes["tendons are not modeled"].append(m.tendon(k).name or "tendon")


def _kind(kind: int) -> str:
    return _SHAPES[kind][0] if kind in _SHAPES else _OTHERS.get(kind, "geom")


def _pose(position: Array, quaternion: Array) -> pin.SE3:
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized().toRotationMatrix(), np.array(position))
