"""What MuJoCo makes of an MJCF: it gets numbers and names, of meshes their corners, and no file."""

import copy
import io
import itertools
import os
import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, MOST_LINKS, check_memory, check_size, parsed
from sphshell_pin.robots.packages import Folders

MOST_FILES = 1000
"""Files that an MJCF may include or attach, one as often as it is named."""

MOST_INCLUDED = 64e6
"""What they may have in all [B]."""


def include(root: ET.Element, files: list[Path], sizes: list[int] | None = None) -> None:
    """Put the content of included files in the place of <include>, attached models into <model>.

    Meshes get absolute paths. `files` are open, `root` is that of the last of them. `sizes` are
    those of the files so far [B]. The limits hold in total: of small files that include others
    twice, the whole doubles each time.
    """
    sizes = [] if sizes is None else sizes
    _include(root, files, sizes)
    compiler = {key: value for part in root.iter("compiler") for key, value in part.items()}
    folder = files[-1].parent / compiler.get("meshdir", compiler.get("assetdir", ""))
    for mesh in root.iterfind("asset/mesh[@file]"):
        path = Path(mesh.attrib["file"])
        mesh.attrib.setdefault("name", path.stem)
        mesh.set("file", str(folder / (path.name if compiler.get("strippath") == "true" else path)))
    for one in root.iterfind("asset/model"):
        inner, model = _read("attaches", one.get("file", ""), files, sizes)
        include(model, inner, sizes)
        one[:] = [model]


def _include(element: ET.Element, files: list[Path], sizes: list[int], deep: int = 1) -> None:
    if deep > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    for k in range(len(element) - 1, -1, -1):
        one = element[k]
        if one.tag != "include":
            _include(one, files, sizes, deep + 1)
            continue
        inner, root = _read("includes", one.get("file", ""), files, sizes)
        _include(root, inner, sizes, deep)
        element[k : k + 1] = list(root)


def _read(
    does: str, stated: str, files: list[Path], sizes: list[int]
) -> tuple[list[Path], ET.Element]:
    """Return the open files with the one that the last of them includes or attaches; its root."""
    homes = (files[0].parent, files[-1].parent, files[-1].resolve().parent)
    path = next((home / stated for home in homes if os.path.isfile(home / stated)), None)
    if path is None:
        raise ValueError(f"it {does} {stated}, which is not there")
    if path.resolve() in [one.resolve() for one in files]:
        raise ValueError(f"it {does} {stated}, which {does} itself")
    text = read_bytes(path, MOST_INCLUDED)
    sizes.append(len(text))
    if len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
        raise ValueError(
            f"it includes more than {MOST_FILES} files or {MOST_INCLUDED * 1e-6:g} MB in all, "
            "repeats counted: write each part once"
        )
    if len(files) >= DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    check_size(text)
    return [*files, path], parsed(text)


LEFT_OUT = "geoms of these kinds are left out"

FREE, BALL, SLIDE, HINGE = range(4)
"""Types of joints of MuJoCo's mjtJoint."""

MESH = 7
"""Of MuJoCo's mjtGeom."""

# What MuJoCo is given: the tables, and the attributes of those that could name files.
_GIVEN = ("compiler", "default", "asset", "worldbody", "keyframe", "equality", "tendon")
_ATTRIBUTES = {
    "compiler": {"angle", "autolimits", "coordinate", "eulerseq", "boundmass", "boundinertia"},
    "mesh": {"name", "class", "file", "scale", "refpos", "refquat", "inertia", "vertex", "face"},
    "model": {"name", "file"},
    "material": {"name", "class", "rgba"},
    "key": {"name", "qpos"},  # of actuators and speeds nothing is read
}
_ATTRIBUTES["compiler"] |= {"settotalmass", "balanceinertia", "inertiafromgeom"}
_ATTRIBUTES["compiler"] |= {"inertiagrouprange"}
_DROPPED = ("camera", "light")
# What makes bodies of its own, without end, or runs a plugin.
_UNKNOWN = ("composite", "flexcomp", "deformable", "flex", "plugin")
_MOST_MESH = 1e9  # [B]
_POINT = [0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]  # a mesh that nothing weighs
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
        self.mujoco = mujoco
        # What is not modeled: the names that each sentence is about.
        self.notes: defaultdict[str, list[str]] = defaultdict(list)
        self.files: dict[str, tuple[Path, Array]] = {}
        models: dict[str, bytes] = {}
        with silent(mujoco):
            spec = mujoco.MjSpec.from_string(self._given(root, models)[0], include=models)
            for mesh in spec.meshes:
                if mesh.file:
                    self.files[mesh.name] = folders.beside(mesh.file), mesh.scale.copy()
                    mesh.file, mesh.uservert = "", _POINT
            freedoms = {FREE: 6, BALL: 3}
            check_memory(sum(freedoms.get(int(joint.type), 1) for joint in spec.joints))
            if len(spec.bodies) < 2:
                raise ValueError("its <worldbody> has no <body>")
            _name_all(spec)
            if floats is not None:
                _set_base(spec, floats=floats)
            self._weigh(spec)
            self.model = spec.compile()

    def _given(
        self, stated: ET.Element, models: dict[str, bytes], *, whole: bool = True
    ) -> tuple[str, int]:
        """Return what MuJoCo reads of a model, and how many bodies and attached models it has.

        It names no file but those of meshes, which MuJoCo does not read, and of the models that it
        attaches, which are put into `models`. Of one that is attached, not `whole`, no keys: it has
        not all joints.
        """
        root = ET.Element("mujoco", model=stated.get("model", "robot"))
        given = [tag for tag in _GIVEN if whole or tag != "keyframe"]
        root[:] = [copy.deepcopy(one) for one in stated if one.tag in given]
        for tag in _UNKNOWN:  # plugins of actuators and sensors are not read
            if any(stated.find(path + tag) is not None for path in ("", "worldbody//", "asset//")):
                raise ValueError(
                    f"<{tag}> is not supported: let MuJoCo write the bodies out "
                    "(mujoco.MjSpec.from_file(...), compile(), to_xml())"
                )
        inside = dict[str | None, int]()
        for one in root.iterfind("asset/model"):
            name = one.get("name", one[0].get("model"))
            text, inside[name] = self._given(one[0], models, whole=False)
            one.set("file", f"{len(models)}.xml")
            models[one.attrib["file"]] = text.encode()
        links = sum(_links(one, inside) for one in root.iterfind("worldbody"))
        if links > MOST_LINKS:
            raise ValueError(f"it has {links} links; at most {MOST_LINKS} can be read")
        for element in root.iter():
            for one in list(element):
                if "hfield" in one.attrib:  # of a file
                    self.notes[LEFT_OUT].append("hfield")
                unread = element.tag == "asset" and one.tag not in _ATTRIBUTES
                if unread or one.tag in _DROPPED or "hfield" in one.attrib:
                    element.remove(one)
            file = element.get("file")
            if element.tag == "mesh" and file and {"refpos", "refquat"} & element.attrib.keys():
                raise ValueError(f"mesh {file} states refpos or refquat: move its geoms instead")
            if kept := _ATTRIBUTES.get(element.tag):
                element.attrib = {k: v for k, v in element.attrib.items() if k in kept}
                element[:] = []
            if element.tag == "freejoint":
                element.attrib.pop("align", None)
        return ET.tostring(root, encoding="unicode"), links

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


def _links(element: ET.Element, inside: Mapping[str | None, int], *, copied: bool = False) -> int:
    """Return the number of bodies and models in `element`, and of all that it has copies of."""
    copies = element.tag == "replicate"
    count = int(copied or element.tag in ("body", "attach"))
    count += inside.get(element.get("model"), 0) if element.tag == "attach" else 0
    count += sum(_links(one, inside, copied=copied or copies) for one in element)
    # What is no number MuJoCo refuses.
    times = re.match(r"\s*[-+]?(\d+)", element.get("count", "")) if copies else None
    return count * (int(times[1]) if times else 1)


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
