"""MJCF in a plain form, which pinocchio's reader takes as MuJoCo does.

MuJoCo reads the file: every class, frame, unit and default is resolved, and what geoms weigh. Of
what it compiles the plain form is written, in which every body states its inertia and has one
joint, which keeps its name. Pinocchio's own reader (4.1) of the file as it is drops all bodies of
the world but the first, includes, ranges' `limited`, visual geoms' masses, orientations of geoms
without `pos`, damping of ball joints and equalities, and makes one nameless joint of several.

MuJoCo gets numbers and names, of meshes their corners; it opens no file itself.
"""

from __future__ import annotations

import copy
import io
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.arrays import Array
from sphshell_pin.errors import import_extra
from sphshell_pin.regular_file import read_bytes
from sphshell_pin.robots.description import MOST_LINKS, Description, check_memory
from sphshell_pin.robots.mjcf_additions import Extras, Site
from sphshell_pin.robots.mjcf_couplings import couplings
from sphshell_pin.robots.mjcf_includes import include
from sphshell_pin.robots.packages import Folders

# What makes bodies of its own, without end, or runs a plugin.
_UNKNOWN = ("composite", "flexcomp", "replicate", "attach", "deformable", "flex", "plugin")
# What MuJoCo is given: the tables, and the attributes of those that could name files.
_GIVEN = ("compiler", "default", "asset", "worldbody", "keyframe")
_COMPILER = {"angle", "autolimits", "coordinate", "eulerseq", "boundmass", "boundinertia"}
_COMPILER |= {"settotalmass", "balanceinertia", "inertiafromgeom", "inertiagrouprange"}
_MESH = {"name", "class", "scale", "refpos", "refquat", "inertia", "vertex", "face"}
_DROPPED = ("camera", "light")
_MOST_MESH = 1e9  # [B]
_POINT = "0 0 0 1 0 0 0 1 0 0 0 1"  # a mesh that nothing weighs
_KINDS = {2: ("sphere", 1), 3: ("capsule", 2), 4: ("ellipsoid", 3), 5: ("cylinder", 2)}
_KINDS |= {6: ("box", 3), 7: ("mesh", 0)}
_MESH_GEOM, _GRAY = 7, (0.5, 0.5, 0.5, 1.0)
_OTHERS = {0: "plane"}
_FREE, _BALL, _SLIDE, _HINGE = range(4)
_JOINTS = ("free", "ball", "slide", "hinge")
_LEFT_OUT = "geoms of these kinds are left out"
_HULLS = "masses of meshes that are not closed are those of their convex hulls"


def plain(root: ET.Element, folders: Folders, *, floats: bool | None = None) -> Description:
    """Return an MJCF in the plain form; ValueError says what in it cannot be read.

    What it includes is put into `root`, whose base `floats` or is fixed; None: as it states.
    Raises MissingExtra without mujoco.
    """
    with interrupts_delayed():
        mujoco = import_extra("mujoco", "mujoco", "an MJCF file")
    if folders.kept is None:
        include(root, [folders.file.resolve()])
    elif root.find(".//include") is not None:
        raise ValueError("it includes other files")
    links = sum(1 for _ in root.iter("body"))
    if links > MOST_LINKS:
        raise ValueError(f"it has {links} links; at most {MOST_LINKS} can be read")
    if floats is not None:
        _set_base(root, floats=floats)
    for tag in _UNKNOWN:
        if root.find(f".//{tag}") is not None:
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


def _set_base(root: ET.Element, *, floats: bool) -> None:
    """Give the only body of the world a free joint, or take it; its keys lose what was of it."""
    bodies = root.findall("worldbody/body")
    if len(bodies) != 1:
        raise ValueError(f"its world has {len(bodies)} bodies: state in it which of them are free")
    (body,) = bodies
    free = [one for one in body if one.tag == "freejoint" or one.get("type") == "free"]
    if not floats:
        for joint in free:
            body.remove(joint)
    elif not free:
        if body.find("joint") is not None:
            raise ValueError(f"body '{body.get('name')}' has a joint already: it cannot float")
        body.insert(0, ET.Element("freejoint"))
    if floats != bool(free):
        for key in root.iterfind("keyframe/key"):
            qpos = key.get("qpos", "").split()
            place = [*body.get("pos", "0 0 0").split(), "1", "0", "0", "0"]
            key.set("qpos", " ".join(place + qpos if floats else qpos[7:]))


@contextmanager
def _silent(mujoco: Any) -> Iterator[None]:
    """Make MuJoCo's faults ValueErrors; it writes no file of its warnings meanwhile."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    except (MemoryError, mujoco.FatalError) as error:
        raise ValueError(str(error) or "it needs too much memory") from None
    finally:
        mujoco.set_mju_user_warning(before)


class _Reader:
    """What MuJoCo makes of one MJCF, and the plain form of it."""

    def __init__(self, mujoco: Any, root: ET.Element, folders: Folders) -> None:
        self.mujoco, self.given, self.folders = mujoco, root, folders
        # What is not modeled: the names that each sentence is about.
        self.notes: defaultdict[str, list[str]] = defaultdict(list)
        self.files: dict[str, tuple[Path, str]] = {}
        with _silent(mujoco):
            self.model = m = self._compiled(self._spec())
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
        extras, start = self._extras(), self._start()
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
        sites = tuple(
            Site(
                m.site(s).name,
                self.bodies[m.site_bodyid[s]],
                _pose(m.site_pos[s], m.site_quat[s]),
            )
            for s in range(m.nsite)
            if m.site(s).name
        )
        notes = tuple(
            f"{text}: {', '.join(map(repr, dict.fromkeys(names)))}"
            for text, names in self.notes.items()
        )
        file, folders = self.folders.file, self.folders
        return Description(
            file, folders, made, mimics, loops, notes, start, extras, sites, self.given
        )

    def _spec(self) -> Any:
        """Return what MuJoCo reads: nothing that names a file, all bodies and joints with names."""
        root = ET.Element("mujoco", model="robot")
        for one in copy.deepcopy(self.given):
            if one.tag in _GIVEN:
                root.append(one)
        compiler = {k: v for one in root.findall("compiler") for k, v in one.attrib.items()}
        for one in root.findall("compiler"):
            one.attrib = {k: v for k, v in one.attrib.items() if k in _COMPILER}
            one[:] = []
        for one in root.iterfind("keyframe/key"):  # of actuators and speeds nothing is read
            one.attrib = {k: v for k, v in one.attrib.items() if k in ("name", "qpos")}
        for asset in root.findall("asset"):
            for one in list(asset):
                if one.tag == "mesh":
                    self._mesh(one, compiler)
                elif one.tag == "material" and "name" in one.attrib:
                    color = {k: v for k, v in one.attrib.items() if k in ("name", "class", "rgba")}
                    one.attrib = color
                    one[:] = []
                else:
                    asset.remove(one)
        for default in root.iter("default"):
            for one in default:
                if one.tag in ("material", "mesh"):
                    one.attrib.pop("texture", None)
                    one.attrib.pop("file", None)
        for element in root.iter():
            for one in list(element):
                if "hfield" in one.attrib:  # of a file
                    self.notes[_LEFT_OUT].append("hfield")
                if one.tag in _DROPPED or "hfield" in one.attrib:
                    element.remove(one)
            if element.tag == "freejoint":
                element.attrib.pop("align", None)
        count = iter(range(MOST_LINKS))
        for world in root.findall("worldbody"):
            _name_bodies(world, "world", count)
        return self.mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))

    def _mesh(self, one: ET.Element, compiler: Mapping[str, str]) -> None:
        """Put a mesh that weighs nothing in the place of one of a file."""
        stated, file = one.attrib, one.get("file")
        one.attrib = {k: v for k, v in stated.items() if k in _MESH}
        if file is None:
            return
        strip = compiler.get("strippath") == "true"
        path = Path(Path(file).name if strip else file)
        name = one.attrib.setdefault("name", path.stem)
        folder = Path(compiler.get("meshdir", compiler.get("assetdir", "")))
        self.files[name] = self.folders.beside(str(folder / path)), "1 1 1"
        one.set("vertex", _POINT)

    def _compiled(self, spec: Any) -> Any:
        """Return the compiled model; meshes are read where something weighs what they hold."""
        moves = {"world": False}
        total = spec.compiler.settotalmass > 0.0
        always = int(spec.compiler.inertiafromgeom) == 1
        needed: dict[str, str] = {}
        for body in spec.bodies:
            if body.name != "world":
                moves[body.name] = bool(body.joints) or moves[body.parent.name]
            weighs = always or not body.explicitinertial
            if weighs and int(spec.compiler.inertiafromgeom) == 0 and body.joints:
                raise ValueError(f"body '{body.name}' moves, and states no <inertial>")
            weighs = weighs and (moves[body.name] or total)
            low, high = spec.compiler.inertiagrouprange
            for geom in body.geoms:
                if geom.meshname not in self.files:
                    continue
                own = low <= geom.group <= high and geom.mass != 0.0 and geom.density != 0.0
                if int(geom.type) != _MESH_GEOM or (weighs and own):
                    needed[geom.meshname] = body.name
                else:
                    geom.mass = 0.0
        for mesh in spec.meshes:
            if mesh.name in self.files:
                self.files[mesh.name] = self.files[mesh.name][0], _text(mesh.scale)
        for name, body in needed.items():
            self._read_mesh(spec.mesh(name), body)
        return spec.compile()

    def _read_mesh(self, mesh: Any, body: str) -> None:
        """Let `mesh` have the corners of its file; one that is open weighs as its hull."""
        with interrupts_delayed():
            import trimesh
        path = self.files[mesh.name][0]
        try:
            data, kind = io.BytesIO(read_bytes(path, _MOST_MESH)), path.suffix.lower()[1:]
            found: Any = trimesh.load(data, file_type=kind, force="mesh")
            found.merge_vertices()
            mesh.uservert, mesh.userface = found.vertices.ravel(), found.faces.ravel()
            if not found.is_watertight:
                mesh.inertia = self.mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
                self.notes[_HULLS].append(mesh.name)
        except Exception as error:  # of readers of many formats, and of packages not there
            reason = " ".join(str(error).split()) or type(error).__name__
            raise ValueError(
                f"the mass of body '{body}' would be that of mesh '{mesh.name}', which cannot be "
                f"read ({reason}): state <inertial>"
            ) from None

    def _extras(self) -> dict[str, Extras]:
        """Return damping and dry friction of joints of several degrees of freedom."""
        m = self.model
        several = (j for j in range(m.njnt) if m.jnt_type[j] in (_FREE, _BALL))
        return {
            self.joints[j]: Extras(
                float(np.ravel(m.dof_damping[m.jnt_dofadr[j]])[0]),
                float(m.dof_frictionloss[m.jnt_dofadr[j]]),
            )
            for j in several
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
            self.notes[_LEFT_OUT].append(kind)
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


def _name_bodies(element: ET.Element, body: str, count: Iterator[int]) -> None:
    """Give the bodies and joints below an element names, where they have none."""
    joints = 0
    for one in element:
        if one.tag == "body":
            number = next(count)
            name = one.attrib.setdefault("name", f"{body}_body{number}")
            _name_bodies(one, name, count)
        elif one.tag == "frame":
            _name_bodies(one, body, count)
        elif one.tag in ("joint", "freejoint"):
            free = one.tag == "freejoint" or one.get("type") == "free"
            one.attrib.setdefault("name", f"{body}_{'free' if free else f'joint{joints or str()}'}")
            joints += 1


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
