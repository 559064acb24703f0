"""What MuJoCo makes of an MJCF: it gets numbers and names, of meshes their corners, and no file."""

import copy
import io
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import MOST_LINKS
from sphshell_pin.robots.packages import Folders

LEFT_OUT = "geoms of these kinds are left out"

# What MuJoCo is given: the tables, and the attributes of those that could name files.
_GIVEN = ("compiler", "default", "asset", "worldbody", "keyframe")
_COMPILER = {"angle", "autolimits", "coordinate", "eulerseq", "boundmass", "boundinertia"}
_COMPILER |= {"settotalmass", "balanceinertia", "inertiafromgeom", "inertiagrouprange"}
_MESH = {"name", "class", "scale", "refpos", "refquat", "inertia", "vertex", "face"}
_DROPPED = ("camera", "light")
_MOST_MESH = 1e9  # [B]
_POINT = "0 0 0 1 0 0 0 1 0 0 0 1"  # a mesh that nothing weighs
_MESH_GEOM = 7  # of mjtGeom
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

    ValueError says what MuJoCo cannot read.
    """

    def __init__(self, mujoco: Any, root: ET.Element, folders: Folders) -> None:
        self.mujoco, self.given, self.folders = mujoco, root, folders
        # What is not modeled: the names that each sentence is about.
        self.notes: defaultdict[str, list[str]] = defaultdict(list)
        self.files: dict[str, tuple[Path, str]] = {}
        with silent(mujoco):
            self.model = self._compiled(self._spec())

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
                    self.notes[LEFT_OUT].append("hfield")
                if one.tag in _DROPPED or "hfield" in one.attrib:
                    element.remove(one)
            if element.tag == "freejoint":
                element.attrib.pop("align", None)
        count = iter(range(MOST_LINKS))
        taken = {one.get("name", "") for one in root.iterfind("worldbody//joint")}
        taken |= {one.get("name", "") for one in root.iterfind("worldbody//freejoint")}
        for world in root.findall("worldbody"):
            _name_bodies(world, "world", count, taken)
        return self.mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))

    def _mesh(self, one: ET.Element, compiler: Mapping[str, str]) -> None:
        """Put a mesh that weighs nothing in the place of one of a file."""
        stated, file = one.attrib, one.get("file")
        one.attrib = {k: v for k, v in stated.items() if k in _MESH}
        if file is None:
            return
        if "refpos" in stated or "refquat" in stated:
            raise ValueError(f"mesh {file} states refpos or refquat: move its geoms instead")
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
                self.files[mesh.name] = (
                    self.files[mesh.name][0],
                    " ".join(map(repr, mesh.scale.tolist())),
                )
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


def _name_bodies(element: ET.Element, body: str, count: Iterator[int], taken: set[str]) -> None:
    """Give the bodies and joints below an element names, where they have none.

    Frames within a body hold joints of it, so that `taken` has all joints' names.
    """
    for one in element:
        if one.tag == "body":
            number = next(count)
            name = one.attrib.setdefault("name", f"{body}_body{number}")
            _name_bodies(one, name, count, taken)
        elif one.tag == "frame":
            _name_bodies(one, body, count, taken)
        elif one.tag in ("joint", "freejoint") and "name" not in one.attrib:
            free = one.tag == "freejoint" or one.get("type") == "free"
            stem = f"{body}_{'free' if free else 'joint'}"
            names = (f"{stem}{k or ''}" for k in range(len(taken) + 1))
            one.set("name", next(name for name in names if name not in taken))
            taken.add(one.attrib["name"])
