"""MJCF in a plain form, which pinocchio's reader takes as MuJoCo does.

MuJoCo reads the file: every class, frame, unit and default is resolved, and what geoms weigh. Of
what it compiles the plain form is written, in which every body states its inertia and has one
joint, which keeps its name. Pinocchio's own reader (4.1) of the file as it is drops all bodies of
the world but the first, includes, ranges' `limited`, visual geoms' masses, orientations of geoms
without `pos`, damping of ball joints and equalities, and makes one nameless joint of several.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import import_extra
from sphshell_pin.robots.description import MOST_LINKS, Description, check_memory
from sphshell_pin.robots.mjcf_attach import attach
from sphshell_pin.robots.mjcf_compile import LEFT_OUT, Compiled, silent
from sphshell_pin.robots.mjcf_couplings import couplings
from sphshell_pin.robots.mjcf_includes import include
from sphshell_pin.robots.packages import Folders

# What makes bodies of its own, without end, or runs a plugin.
_UNKNOWN = ("composite", "flexcomp", "replicate", "deformable", "flex", "plugin")
_KINDS = {2: ("sphere", 1), 3: ("capsule", 2), 4: ("ellipsoid", 3), 5: ("cylinder", 2)}
_KINDS |= {6: ("box", 3), 7: ("mesh", 0)}
_GRAY = (0.5, 0.5, 0.5, 1.0)
_OTHERS = {0: "plane"}
_FREE, _BALL = 0, 1
_JOINTS = ("free", "ball", "slide", "hinge")


def plain(root: ET.Element, folders: Folders, *, floats: bool | None = None) -> Description:
    """Return an MJCF in the plain form; ValueError says what in it cannot be read.

    What it includes is put into `root`, whose base `floats` or is fixed; None: as it states.
    Raises MissingExtra without mujoco.
    """
    with interrupts_delayed():
        mujoco = import_extra("mujoco", "mujoco", "an MJCF file")
    if folders.kept is None:
        include(root, [folders.file.resolve()])
        attach(root, [folders.file.resolve()])
    elif root.find(".//include") is not None:
        raise ValueError("it includes other files")
    links = sum(1 for _ in root.iter("body"))
    if links > MOST_LINKS:
        raise ValueError(f"it has {links} links; at most {MOST_LINKS} can be read")
    if floats is not None:
        _set_base(mujoco, root, floats=floats)
    for tag in _UNKNOWN:  # plugins of actuators and sensors are not read
        if any(root.find(path + tag) is not None for path in ("", "worldbody//", "asset//")):
            raise ValueError(
                f"<{tag}> is not supported: let MuJoCo write the bodies out "
                "(mujoco.MjSpec.from_file(...), compile(), to_xml())"
            )
    freedoms = {"free": 6, "ball": 3}
    joints = (
        freedoms.get(one.get("type", "hinge"), 1) for one in root.iterfind("worldbody//joint")
    )
    check_memory(sum(joints) + 6 * len(root.findall("worldbody//freejoint")))
    if root.find("worldbody/body") is None and root.find("worldbody//body") is None:
        raise ValueError("its <worldbody> has no <body>")
    return _Reader(mujoco, root, folders).read()


def _set_base(mujoco: Any, root: ET.Element, *, floats: bool) -> None:
    """Give the only body of the world a free joint, or take it; its keys lose what was of it."""
    worlds = root.findall("worldbody")
    bodies = [one for world in worlds for _, one in _inside(world) if one.tag == "body"]
    if len(bodies) != 1:
        raise ValueError(f"its world has {len(bodies)} bodies: state in it which of them are free")
    (body,) = bodies
    joints = [one for one in _inside(body) if one[1].tag in ("joint", "freejoint")]
    free = [one for one in joints if one[1].tag == "freejoint" or one[1].get("type") == "free"]
    if not floats:
        for holder, joint in free:
            holder.remove(joint)
    elif not free:
        if joints:
            raise ValueError(f"body '{body.get('name')}' has a joint already: it cannot float")
        body.insert(0, ET.Element("freejoint"))
    if floats != bool(free):
        place = _place(mujoco, root)
        for key in root.iterfind("keyframe/key"):
            if qpos := key.get("qpos", "").split():  # a key without is as drawn
                key.set("qpos", " ".join([place, *qpos] if floats else qpos[7:]))


def _inside(element: ET.Element) -> Iterator[tuple[ET.Element, ET.Element]]:
    """Yield the elements of a body, and what each is in: frames within it hold some."""
    for one in element:
        yield from _inside(one) if one.tag == "frame" else [(element, one)]


def _place(mujoco: Any, root: ET.Element) -> str:
    """Return pos and quat of the only body of the world, in whatever way they are stated."""
    bare = ET.Element("mujoco")
    for one in root.findall("compiler"):
        units = {k: v for k, v in one.attrib.items() if k in ("angle", "eulerseq")}
        ET.SubElement(bare, "compiler", units)
    bare.extend(_emptied(one) for one in root.findall("worldbody"))
    with silent(mujoco):
        model = mujoco.MjModel.from_xml_string(ET.tostring(bare, encoding="unicode"))
    return _text(*model.body_pos[1], *model.body_quat[1])


def _emptied(element: ET.Element) -> ET.Element:
    """Return frames and bodies in `element`, and nothing in the bodies."""
    made = ET.Element(element.tag, {k: v for k, v in element.attrib.items() if k != "childclass"})
    if element.tag != "body":
        made.extend(_emptied(one) for one in element if one.tag in ("frame", "body"))
    return made


class _Reader(Compiled):
    """The plain form of what MuJoCo makes of one MJCF."""

    def __init__(self, mujoco: Any, root: ET.Element, folders: Folders) -> None:
        super().__init__(mujoco, root, folders)
        m = self.model
        self.bodies = [m.body(i).name or "world" for i in range(m.nbody)]
        self.joints = [m.joint(j).name for j in range(m.njnt)]
        for what, names in (("body", self.bodies), ("joint", self.joints)):
            if "universe" in names:
                raise ValueError(
                    f"a {what} is called 'universe', as Pinocchio calls the world: give it another "
                    "name"
                )

    def read(self) -> Description:
        m = self.model
        joints_of: dict[str, list[str]] = {name: [] for name in self.bodies}
        for j, name in enumerate(self.joints):
            joints_of[self.bodies[m.jnt_bodyid[j]]].append(name)
        parents = {self.bodies[i]: self.bodies[m.body_parentid[i]] for i in range(1, m.nbody)}
        start = self._start()
        made = ET.Element("mujoco", model=self.given.get("model") or "robot")
        ET.SubElement(made, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        asset = ET.SubElement(made, "asset")
        for name, (path, scale) in self.files.items():
            ET.SubElement(asset, "mesh", name=name, file=str(path), scale=scale)
        made.append(self._world())
        keys = ET.SubElement(made, "keyframe")
        for k in range(m.nkey):
            if m.key(k).name:
                ET.SubElement(keys, "key", name=m.key(k).name, qpos=_text(m.key_qpos[k]))
        self._note()
        mimics, loops = couplings(self.given, start, parents, joints_of)
        notes = tuple(
            f"{text}: {', '.join(map(repr, dict.fromkeys(names)))}"
            for text, names in self.notes.items()
        )
        file, folders = self.folders.file, self.folders
        finish = partial(_finish, self._several(), self._sites())
        return Description(file, folders, made, mimics, loops, notes, start, finish, self.given)

    def _several(self) -> dict[str, tuple[float, float]]:
        """Return damping and dry friction of joints of several degrees of freedom."""
        m = self.model
        several = (j for j in range(m.njnt) if m.jnt_type[j] in (_FREE, _BALL))
        return {
            self.joints[j]: (
                float(np.ravel(m.dof_damping[m.jnt_dofadr[j]])[0]),
                float(m.dof_frictionloss[m.jnt_dofadr[j]]),
            )
            for j in several
        }

    def _sites(self) -> dict[str, tuple[str, pin.SE3]]:
        """Return the bodies of the sites, and the places there."""
        m = self.model
        return {
            m.site(s).name: (
                self.bodies[m.site_bodyid[s]],
                _pose(m.site_pos[s], m.site_quat[s]),
            )
            for s in range(m.nsite)
            if m.site(s).name
        }

    def _start(self) -> dict[str, Array]:
        """Return where the file draws the joints that are not at zero there."""
        m, found = self.model, {}
        for j, name in enumerate(self.joints):
            at = m.jnt_qposadr[j]
            if m.jnt_type[j] == _FREE:
                x, y, z, *quat = m.qpos0[at : at + 7]
                found[name] = pin.SE3ToXYZQUAT(_pose(np.array([x, y, z]), np.array(quat)))
            elif m.jnt_type[j] != _BALL and m.qpos0[at]:
                found[name] = m.qpos0[at : at + 1].copy()
        return found

    def _world(self) -> ET.Element:
        """Return the plain <worldbody>: a body for each joint, the last is the body itself."""
        m, world = self.model, ET.Element("worldbody")
        made: list[ET.Element] = []
        roots = [i for i in range(1, m.nbody) if m.body_parentid[i] == 0]
        base = world
        if len(roots) > 1 or not m.body_jntnum[roots[0]]:
            # The reader takes one tree only, and a root that is fixed at the origin.
            base = ET.SubElement(world, "body", name="world_base")
            _add_inertial(base, pin.Inertia.Zero())
        made.append(base)
        for i in range(1, m.nbody):
            here, place = made[m.body_parentid[i]], _pose(m.body_pos[i], m.body_quat[i])
            joints = range(m.body_jntadr[i], m.body_jntadr[i] + m.body_jntnum[i])
            for j in joints:
                last = j == joints[-1]
                name = self.bodies[i] if last else f"{self.bodies[i]}/{self.joints[j]}"
                if m.jnt_type[j] == _FREE:  # its coordinates are the pose in the world
                    place = pin.SE3.Identity()
                here = ET.SubElement(here, "body", {"name": name} | _posed(place))
                here.append(self._joint(j))
                if not last:
                    _add_inertial(here, pin.Inertia.Zero())
                place = pin.SE3.Identity()
            if not joints:
                here = ET.SubElement(here, "body", {"name": self.bodies[i]} | _posed(place))
            turn = _pose(m.body_ipos[i], m.body_iquat[i])
            inertia = turn.rotation @ np.diag(m.body_inertia[i]) @ turn.rotation.T
            _add_inertial(here, pin.Inertia(float(m.body_mass[i]), turn.translation, inertia))
            for g in range(m.body_geomadr[i], m.body_geomadr[i] + m.body_geomnum[i]):
                self._geom(here, g)
            made.append(here)
        return world

    def _joint(self, j: int) -> ET.Element:
        m, kind = self.model, int(self.model.jnt_type[j])
        dof, at = m.jnt_dofadr[j], m.jnt_qposadr[j]
        made = ET.Element("joint", name=self.joints[j], type=_JOINTS[kind])
        made.set("pos", "0 0 0" if kind == _FREE else _text(m.jnt_pos[j]))
        made.set("armature", _text(m.dof_armature[dof]))
        if kind == _FREE:
            return made
        made.set("axis", _text(m.jnt_axis[j]))
        if kind == _BALL:
            return made
        made.set("damping", _text(np.ravel(m.dof_damping[dof])[0]))
        made.set("frictionloss", _text(m.dof_frictionloss[dof]))
        ref = float(m.qpos0[at])
        if ref:
            made.set("ref", _text(ref))
        if m.jnt_limited[j]:
            # Pinocchio subtracts ref from the range, but counts positions as MuJoCo does.
            made.set("range", _text(m.jnt_range[j] + ref))
        if m.jnt_actfrclimited[j]:
            made.set("actuatorfrcrange", _text(m.jnt_actfrcrange[j]))
        return made

    def _geom(self, into: ET.Element, g: int) -> None:
        m, pose = self.model, _pose(self.model.geom_pos[g], self.model.geom_quat[g])
        kind, count = _KINDS.get(int(m.geom_type[g]), (_OTHERS.get(int(m.geom_type[g]), "geom"), 0))
        mesh = m.mesh(m.geom_dataid[g]).name if kind == "mesh" else ""
        if int(m.geom_type[g]) not in _KINDS or (mesh and mesh not in self.files):
            self.notes[LEFT_OUT].append(kind)
            return
        made = ET.SubElement(into, "geom", type=kind)
        if mesh:
            made.set("mesh", mesh)
            # MuJoCo counts from the center of mass and the principal axes of a mesh.
            k = m.geom_dataid[g]
            pose = pose * _pose(m.mesh_pos[k], m.mesh_quat[k]).inverse()
        else:
            made.set("size", _text(m.geom_size[g][:count]))
        for key in ("contype", "conaffinity", "group"):
            made.set(key, str(getattr(m, f"geom_{key}")[g]))
        if m.geom(g).name:
            made.set("name", m.geom(g).name)
        color, material = m.geom_rgba[g], int(m.geom_matid[g])
        if material >= 0 and np.allclose(color, _GRAY):
            color = m.mat_rgba[material]
        if material >= 0 or not np.allclose(color, _GRAY):
            made.set("rgba", _text(color))
        made.attrib.update(_posed(pose))

    def _note(self) -> None:
        """Note what the file states that is not modeled."""
        m = self.model
        for j, name in enumerate(self.joints):
            if np.any(m.jnt_stiffness[j]):
                self.notes["springs of joints (stiffness, springdamper) are not modeled"].append(
                    name
                )
            if m.jnt_limited[j] and m.jnt_type[j] == _BALL:
                self.notes["ranges of ball joints are not modeled"].append(name)
        for i in np.flatnonzero(m.body_gravcomp).tolist():
            self.notes["gravity acts on bodies with gravcomp too"].append(self.bodies[i])
        for g in range(m.body_geomnum[0]):
            if m.geom_contype[g] or m.geom_conaffinity[g]:
                kind = int(m.geom_type[g])
                name = m.geom(g).name or _KINDS.get(kind, (_OTHERS.get(kind, "geom"),))[0]
                text = "geoms of the world are no part of the robot, add them as shells"
                self.notes[text].append(name)
        for one in self.given.iterfind("tendon/*"):
            self.notes["tendons are not modeled"].append(one.get("name", one.tag))


def _finish(
    several: Mapping[str, tuple[float, float]],
    sites: Mapping[str, tuple[str, pin.SE3]],
    model: pin.Model,
) -> None:
    """Put into `model` what pinocchio's reader leaves out of MJCF."""
    values = {
        name: np.array(getattr(model, name))
        for name in ("damping", "lowerDryFrictionLimit", "upperDryFrictionLimit")
    }
    for name, (damping, friction) in several.items():
        joint = model.joints[model.getJointId(name)]
        span = slice(joint.idx_v, joint.idx_v + joint.nv)
        for array, value in zip(values.values(), (damping, -friction, friction), strict=True):
            array[span] = value
    for name, array in values.items():
        setattr(model, name, array)
    for name, (body, place) in sites.items():
        # It reads sites on bodies with joints only.
        frame = 0 if body == "world" else model.getFrameId(body, pin.FrameType.BODY)
        inside, joint = model.frames[frame].placement * place, model.frames[frame].parentJoint
        made = pin.Frame(name, joint, frame, inside, pin.FrameType.OP_FRAME)
        model.addFrame(made, False)


def _pose(position: Array, quaternion: Array) -> pin.SE3:
    w, x, y, z = quaternion
    turn = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
    return pin.SE3(turn, np.array(position))


def _posed(pose: pin.SE3) -> dict[str, str]:
    x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
    return {"pos": _text(pose.translation), "quat": _text(w, x, y, z)}


def _add_inertial(body: ET.Element, inertia: pin.Inertia) -> None:
    i = inertia.inertia
    full = _text(i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    stated = {"mass": _text(inertia.mass), "pos": _text(inertia.lever), "fullinertia": full}
    ET.SubElement(body, "inertial", stated)


def _text(*values: Any) -> str:
    numbers = np.ravel(values)
    if not np.isfinite(numbers).all():
        raise ValueError("it has numbers that are not finite")
    return " ".join(map(repr, numbers.tolist()))
