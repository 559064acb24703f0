"""What MuJoCo makes of an MJCF: it gets numbers and names, of meshes their corners, and no file."""

import copy
import io
import itertools
import os
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, MOST_LINKS, check_memory, check_size, parsed
from sphshell_pin.robots.packages import Folders

MOST_FILES = 1000
"""Files that an MJCF may include or attach, one as often as it is named."""

MOST_INCLUDED = 64e6
"""What they may have in all [B]."""


def include(root: ET.Element, open_files: list[Path], sizes: list[int] | None = None) -> None:
    """Put the content of included files in the place of <include>, attached models into <model>.

    `sizes` are those of the files so far [B]. The limits hold in total: of small files that include
    others twice, the whole doubles each time.
    """
    sizes = [] if sizes is None else sizes
    _include(root, open_files, sizes)
    for one in root.iterfind("asset/model"):
        path = open_files[-1].parent / one.get("file", "")
        if not os.path.isfile(path):
            raise ValueError(f"it attaches {one.get('file')}, which is not there")
        files = [*open_files, path.resolve()]
        model = _read(path, files, sizes)
        include(model, files, sizes)
        compiler = {key: value for part in model.iter("compiler") for key, value in part.items()}
        folder = path.absolute().parent / compiler.get("meshdir", compiler.get("assetdir", ""))
        for mesh in model.iterfind("asset/mesh[@file]"):
            mesh.set("name", mesh.get("name", Path(mesh.attrib["file"]).stem))
            mesh.set("file", str(folder / mesh.attrib["file"]))
        one[:] = [model]


def _include(element: ET.Element, files: list[Path], sizes: list[int], deep: int = 1) -> None:
    if deep > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    for k in range(len(element) - 1, -1, -1):
        one = element[k]
        if one.tag != "include":
            _include(one, files, sizes, deep + 1)
            continue
        stated = one.get("file", "")
        places = [files[0].parent / stated, files[-1].parent / stated]
        found = next((place for place in places if os.path.isfile(place)), None)
        if found is None:
            raise ValueError(f"it includes {stated}, which is not there")
        if found.resolve() in files:
            raise ValueError(f"it includes {stated}, which includes itself")
        inner = [*files, found.resolve()]
        root = _read(found, inner, sizes)
        _include(root, inner, sizes, deep)
        element[k : k + 1] = list(root)


def _read(path: Path, files: list[Path], sizes: list[int]) -> ET.Element:
    """Return the root of one more file; `files` are open, it is the last of them."""
    text = read_bytes(path, MOST_INCLUDED)
    sizes.append(len(text))
    if len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
        raise ValueError(
            f"it includes more than {MOST_FILES} files or {MOST_INCLUDED * 1e-6:g} MB in all, "
            "repeats counted: write each part once"
        )
    if len(files) > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    check_size(text)
    return parsed(text)


LEFT_OUT = "geoms of these kinds are left out"

FREE, BALL, SLIDE, HINGE = range(4)
"""Types of joints of MuJoCo's mjtJoint."""

MESH = 7
"""Of MuJoCo's mjtGeom."""

# What MuJoCo is given: the tables, and the attributes of those that could name files.
_GIVEN = ("compiler", "default", "asset", "worldbody", "keyframe", "equality", "tendon")
_ATTRIBUTES = {
    "compiler": {"angle", "autolimits", "coordinate", "eulerseq", "boundmass", "boundinertia"},
    "mesh": {"name", "class", "scale", "refpos", "refquat", "inertia", "vertex", "face"},
    "material": {"name", "class", "rgba"},
    "key": {"name", "qpos"},  # of actuators and speeds nothing is read
}
_ATTRIBUTES["compiler"] |= {"settotalmass", "balanceinertia", "inertiafromgeom"}
_ATTRIBUTES["compiler"] |= {"inertiagrouprange"}
_DROPPED = ("camera", "light")
# What makes bodies of its own, without end, or runs a plugin.
_UNKNOWN = ("composite", "flexcomp", "replicate", "deformable", "flex", "plugin")
_MOST_MESH = 1e9  # [B]
_POINT = "0 0 0 1 0 0 0 1 0 0 0 1"  # a mesh that nothing weighs
_HULLS = "masses of meshes that are not closed are those of their convex hulls"


@contextmanager
def silent(mujoco: Any) -> Iterator[None]:
    """Make MuJoCo's faults ValueErrors; it writes no file of its warnings meanwhile."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    except (MemoryError, mujoco.FatalError) as error:
        raise ValueError(str(error) or "it needs too much memory") from None
    finally:
        mujoco.set_mju_user_warning(before)


class Compiled:
    """An MJCF as MuJoCo compiles it: `model`, `files` of its meshes with their scales, `notes`.

    `floats` frees the only body of the world or fixes it; None: as it states. ValueError says what
    MuJoCo cannot read.
    """

    def __init__(self, mujoco: Any, root: ET.Element, folders: Folders, floats: bool | None):
        self.mujoco, self.folders = mujoco, folders
        # What is not modeled: the names that each sentence is about.
        self.notes: defaultdict[str, list[str]] = defaultdict(list)
        self.files: dict[str, tuple[Path, Array]] = {}
        self._links, self._attached = 0, itertools.count()
        with silent(mujoco):
            spec = self._spec(root)
            freedoms = {FREE: 6, BALL: 3}
            check_memory(sum(freedoms.get(int(joint.type), 1) for joint in spec.joints))
            if len(spec.bodies) < 2:
                raise ValueError("its <worldbody> has no <body>")
            _name_all(spec)
            if floats is not None:
                _set_base(spec, floats=floats)
            self._weigh(spec)
            self.model = spec.compile()

    def _spec(self, given: ET.Element, prefix: str = "") -> Any:
        """Return what MuJoCo reads of a model: nothing that names a file; models are attached."""
        models = {one.get("name"): one for one in given.iterfind("asset/model")}
        root = ET.Element("mujoco", model="robot")
        for one in given:
            # Of a model that is attached no keys: it has not all joints.
            if one.tag in _GIVEN and not (prefix and one.tag == "keyframe"):
                root.append(copy.deepcopy(one))
        for tag in _UNKNOWN:  # plugins of actuators and sensors are not read
            if any(given.find(path + tag) is not None for path in ("", "worldbody//", "asset//")):
                raise ValueError(
                    f"<{tag}> is not supported: let MuJoCo write the bodies out "
                    "(mujoco.MjSpec.from_file(...), compile(), to_xml())"
                )
        self._links += sum(1 for _ in root.iterfind("worldbody//body"))
        if self._links > MOST_LINKS:
            raise ValueError(f"it has {self._links} links; at most {MOST_LINKS} can be read")
        self._drop_files(root, prefix)
        attached = []
        for one in list(root.iter("attach")):
            frame, stated = f"attached {next(self._attached)}", dict(one.attrib)
            attached.append((frame, stated))
            one.tag, one.attrib = "frame", {"name": frame}
        spec = self.mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
        for frame, stated in attached:
            self._attach(spec, spec.frame(frame), stated, models, prefix)
        return spec

    def _attach(
        self,
        spec: Any,
        frame: Any,
        stated: Mapping[str, str],
        models: Mapping[str | None, ET.Element],
        prefix: str,
    ) -> None:
        """Put a model that <attach> names, or one body of it, into a frame."""
        name, own, body = (stated.get(key, "") for key in ("model", "prefix", "body"))
        inside = models[name].find("mujoco") if name in models else None
        if inside is None:
            raise ValueError(f"it attaches the model '{name}', which no <asset> names")
        if next(self._attached) > 2 * MOST_FILES:
            raise ValueError(f"it attaches more than {MOST_FILES} models")
        child = self._spec(inside, f"{prefix}{own}")
        if not body:
            spec.attach(child, prefix=own, frame=frame)
        elif child.body(body) is None:
            raise ValueError(f"it attaches the body '{body}', which the model '{name}' has not")
        else:
            frame.attach_body(child.body(body), own, "")

    def _drop_files(self, root: ET.Element, prefix: str) -> None:
        """Take out of a model what names files; stand-ins that weigh nothing are its meshes."""
        compiler = {k: v for one in root.findall("compiler") for k, v in one.attrib.items()}
        for mesh in root.iterfind("asset/mesh[@file]"):
            if "refpos" in mesh.attrib or "refquat" in mesh.attrib:
                file = mesh.get("file")
                raise ValueError(f"mesh {file} states refpos or refquat: move its geoms instead")
            path = Path(mesh.attrib["file"])
            path = Path(path.name) if compiler.get("strippath") == "true" else path
            name = mesh.attrib.setdefault("name", path.stem)
            path = Path(compiler.get("meshdir", compiler.get("assetdir", ""))) / path
            self.files[prefix + name] = self.folders.beside(str(path)), np.ones(3)
            mesh.set("vertex", _POINT)
        for element in root.iter():
            for one in list(element):
                if "hfield" in one.attrib:  # of a file
                    self.notes[LEFT_OUT].append("hfield")
                unread = element.tag == "asset" and one.tag not in ("mesh", "material")
                if unread or one.tag in _DROPPED or "hfield" in one.attrib:
                    element.remove(one)
            if kept := _ATTRIBUTES.get(element.tag):
                element.attrib = {k: v for k, v in element.attrib.items() if k in kept}
                element[:] = []
            if element.tag == "freejoint":
                element.attrib.pop("align", None)

    def _weigh(self, spec: Any) -> None:
        """Read meshes where something weighs what they hold."""
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
                if int(geom.type) != MESH or (weighs and own):
                    needed[geom.meshname] = body.name
                else:
                    geom.mass = 0.0
        for mesh in spec.meshes:
            if mesh.name in self.files:
                self.files[mesh.name] = self.files[mesh.name][0], mesh.scale.copy()
        for name, body in needed.items():
            self._read_mesh(spec.mesh(name), body)

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


def _name_all(spec: Any) -> None:
    """Give bodies and joints names where they have none, beside those that are stated."""
    taken = {joint.name for joint in spec.joints}
    for k, body in enumerate(spec.bodies):
        body.name = body.name or f"{body.parent.name}_body{k - 1}"
        for joint in body.joints:
            if not joint.name:
                stem = f"{body.name}_{'free' if int(joint.type) == FREE else 'joint'}"
                names = (f"{stem}{n or ''}" for n in itertools.count())
                joint.name = next(name for name in names if name not in taken)
                taken.add(joint.name)


def _set_base(spec: Any, *, floats: bool) -> None:
    """Give the only body of the world a free joint, or take it; its keys lose what was of it.

    The only body that is free is taken for it, beside others that are fixed or on joints.
    """
    bodies = [body for body in spec.bodies[1:] if body.parent.name == "world"]
    if not floats:
        bodies = [one for one in bodies if any(int(j.type) == FREE for j in one.joints)] or bodies
    if len(bodies) != 1:
        raise ValueError(f"its world has {len(bodies)} bodies: state in it which of them are free")
    (body,) = bodies
    free = [joint for joint in body.joints if int(joint.type) == FREE]
    if floats and body.joints and not free:
        raise ValueError(f"body '{body.name}' has a joint already: it cannot float")
    if floats == bool(free):
        return
    drawn = spec.copy().compile()  # meshes that change cannot be compiled twice
    if floats:
        body.add_freejoint(name=f"{body.name}_free")
    at = 0 if floats else int(drawn.joint(free[0].name).qposadr[0])
    for joint in free:
        spec.delete(joint)
    for key in spec.keys:
        if len(key.qpos):  # a key without is as drawn
            place = [*drawn.body_pos[1], *drawn.body_quat[1]]
            stated = list(key.qpos)
            key.qpos = [*place, *stated] if floats else [*stated[:at], *stated[at + 7 :]]
