"""MJCF in a plain form, which pinocchio's reader takes as MuJoCo does.

That reader (4.1) drops all bodies of the world but the first, includes, ranges' `limited`, visual
geoms' masses, orientations of geoms without `pos`, damping of ball joints and equalities, and makes
one nameless joint of several in a body. The plain form has none of these: every class, include,
frame and unit is resolved, every body states its inertia and has one joint, which keeps its name.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping

import numpy as np
import pinocchio as pin

from sphshell_pin.arrays import Array
from sphshell_pin.robots.description import MOST_LINKS, Description
from sphshell_pin.robots.mjcf_additions import Extras, Site
from sphshell_pin.robots.mjcf_couplings import couplings
from sphshell_pin.robots.mjcf_geoms import Meshes, geom_inertia, plain_geom, plain_place
from sphshell_pin.robots.mjcf_values import (
    add_inertial,
    include,
    limited,
    number,
    numbers,
    overlaid,
    posed,
    rotation,
    text_of,
    unit_of_angles,
)
from sphshell_pin.robots.packages import Folders

_SCALARS = ("damping", "frictionloss", "armature", "stiffness")
# What makes bodies that this reader does not make.
_UNKNOWN = ("composite", "flexcomp", "replicate", "attach", "deformable", "flex", "plugin")
_MOST_JOINTS = 6  # of a body; each becomes a body in the plain form, inside that of the one before
_COUNT = {"free": 7, "ball": 4, "slide": 1, "hinge": 1}


def plain(root: ET.Element, folders: Folders, *, floats: bool | None = None) -> Description:
    """Return an MJCF in the plain form; ValueError says what in it cannot be read.

    What it includes is put into `root`, whose base `floats` or is fixed; None: as it states.
    """
    return _Reader(root, folders, floats=floats).read()


def _check_name(what: str, name: str, known: Collection[str]) -> None:
    """Raise ValueError for a name that is known, or that Pinocchio takes for the world."""
    if name in known:
        raise ValueError(f"its name '{name}' is that of more than one {what}")
    if name == "universe":
        raise ValueError(
            f"a {what} is called 'universe', as Pinocchio calls the world: give it another name"
        )


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


class _Reader:
    """What one MJCF says, gathered body by body."""

    def __init__(self, root: ET.Element, folders: Folders, *, floats: bool | None) -> None:
        file = folders.file
        if folders.kept is None:
            include(root, [file.resolve()])
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
        self.given, self.folders = root, folders
        self.compiler = {k: v for one in root.findall("compiler") for k, v in one.attrib.items()}
        if self.compiler.get("coordinate") == "global":
            raise ValueError('coordinate="global" is not supported: MuJoCo 2.3.3 converts it')
        self.angle = unit_of_angles(self.compiler)
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for one in root.findall("default"):
            self._read_class(one, "main", self.classes["main"])
        # What is not modeled: the names that each sentence is about.
        self.notes: defaultdict[str, list[str]] = defaultdict(list)
        self.meshes = Meshes(root, folders, self.compiler, self._with_defaults, self.notes)
        self.extras: dict[str, Extras] = {}
        self.parents: dict[str, str] = {}
        self.joints_of: dict[str, list[str]] = {"world": []}
        self.nq = 0
        self.sites: list[Site] = []
        # Where the file draws the joints that are not at zero there.
        self.start: dict[str, Array] = {}

    def read(self) -> Description:
        made = ET.Element("mujoco", model=self.given.get("model") or "robot")
        ET.SubElement(made, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        made.append(self.meshes.asset())
        world = ET.SubElement(made, "worldbody")
        bodies: list[ET.Element] = []
        for one in self.given.findall("worldbody"):
            held = ET.Element("body", name="world")
            for element, pose, childclass in self._inside(one, pin.SE3.Identity(), "main"):
                if element.tag == "body":
                    self._body(held, element, pose, childclass, "world")
                elif element.tag == "site":
                    self._site(element, pose, childclass, "world")
                elif element.tag == "geom":
                    geom = self._with_defaults(element, childclass)
                    if (geom.get("contype"), geom.get("conaffinity")) != ("0", "0"):
                        text = "geoms of the world are no part of the robot, add them as shells"
                        self.notes[text].append(geom.get("name", geom.get("type", "sphere")))
            bodies += list(held)
        if len(bodies) == 1 and bodies[0].find("joint") is not None:
            world.append(bodies[0])
        elif bodies:
            # The reader takes one tree only, and a root that is fixed at the origin.
            base = ET.SubElement(world, "body", name="world_base")
            add_inertial(base, pin.Inertia.Zero())
            base.extend(bodies)
        else:
            raise ValueError("its <worldbody> has no <body>")
        self._weigh(made)
        self._keys(made)
        for one in self.given.iterfind("tendon/*"):
            self.notes["tendons are not modeled"].append(one.get("name", one.tag))
        mimics, loops = couplings(self.given, self.start, self.parents, self.joints_of)
        return Description(
            self.folders.file,
            self.folders,
            made,
            mimics,
            loops,
            tuple(
                f"{text}: {', '.join(map(repr, dict.fromkeys(names)))}"
                for text, names in self.notes.items()
            ),
            self.start,
            self.extras,
            tuple(self.sites),
            self.given,
        )

    def _read_class(
        self, element: ET.Element, name: str, inherited: Mapping[str, Mapping[str, str]]
    ) -> None:
        own = {tag: dict(attributes) for tag, attributes in inherited.items()}
        for one in element:
            if one.tag != "default":
                own[one.tag] = overlaid(own.get(one.tag, {}), one.attrib)
        self.classes[name] = own
        if "class" in element.attrib:
            self.classes[element.attrib["class"]] = own
        for one in element.findall("default"):
            if "class" not in one.attrib:
                raise ValueError("a <default> inside another has no class")
            self._read_class(one, one.attrib["class"], own)

    def _with_defaults(self, element: ET.Element, childclass: str) -> dict[str, str]:
        """Return all attributes of an element, those of its class first."""
        name = element.get("class", childclass)
        if name not in self.classes:
            raise ValueError(f"<{element.tag}> is of the class '{name}', which has no <default>")
        return overlaid(self.classes[name].get(element.tag, {}), element.attrib)

    def _inside(
        self, element: ET.Element, pose: pin.SE3, childclass: str
    ) -> Iterator[tuple[ET.Element, pin.SE3, str]]:
        """Yield the children of a body, those inside <frame> too, with the frame's pose."""
        for one in element:
            if one.tag == "frame":
                inner = one.get("childclass", childclass)
                yield from self._inside(one, pose * self._pose(one.attrib), inner)
            else:
                yield one, pose, childclass

    def _body(
        self, into: ET.Element, body: ET.Element, pose: pin.SE3, childclass: str, parent: str
    ) -> None:
        """Add a body, and those on it: one for each of its joints, the last is the body itself."""
        name = body.get("name") or f"{parent}_body{len(self.parents)}"
        _check_name("body", name, self.parents)
        childclass = body.get("childclass", childclass)
        self.parents[name], self.joints_of[name] = parent, []
        if number(body.get("gravcomp"), 0.0):
            self.notes["gravity acts on bodies with gravcomp too"].append(name)
        place = pose * self._pose(body.attrib)
        parts = list(self._inside(body, pin.SE3.Identity(), childclass))
        joints = [part for part in parts if part[0].tag in ("joint", "freejoint")]
        if len(joints) > _MOST_JOINTS:
            raise ValueError(
                f"body '{name}' has {len(joints)} joints, MuJoCo takes at most {_MOST_JOINTS}"
            )
        here = into
        for k, (joint, at, cls) in enumerate(joints):
            made = self._joint(joint, at, cls, name, k)
            if made.get("type") == "free":
                # Its coordinates are the pose in the world, whatever the body's place is.
                self.start[made.attrib["name"]] = pin.SE3ToXYZQUAT(place)
                place = pin.SE3.Identity()
            last = k + 1 == len(joints)
            of_joint = {"name": name if last else f"{name}/{made.get('name')}"}
            here = ET.SubElement(here, "body", of_joint | posed(place))
            here.append(made)
            if not last:
                add_inertial(here, pin.Inertia.Zero())
            place = pin.SE3.Identity()
        if not joints:
            here = ET.SubElement(here, "body", {"name": name} | posed(place))
        self._fill(here, parts, name)
        for part, at, cls in parts:
            if part.tag == "body":
                self._body(here, part, at, cls, name)

    def _fill(
        self, here: ET.Element, parts: list[tuple[ET.Element, pin.SE3, str]], name: str
    ) -> None:
        """Give a body its inertia, geoms and sites."""
        stated: pin.Inertia | None = None
        summed = pin.Inertia.Zero()
        use = self.compiler.get("inertiafromgeom", "auto")
        needs = use == "true" or not any(part.tag == "inertial" for part, *_ in parts)
        # The mass of what is fixed to the world acts on nothing, but counts in a stated sum.
        needs = needs and (self._moves(name) or "settotalmass" in self.compiler)
        if needs and use == "false" and self.joints_of[name]:
            raise ValueError(f"body '{name}' moves, and states no <inertial>")
        low, high = numbers(self.compiler.get("inertiagrouprange", "0 5"), 2)
        for part, at, cls in parts:
            if part.tag == "inertial":
                stated = self._inertia(part, name).se3Action(at)
            if part.tag == "site":
                self._site(part, at, cls, name)
            if part.tag != "geom":
                continue
            geom = self._with_defaults(part, cls)
            made, pose = plain_geom(geom, self.meshes, self._pose)
            pose = at * pose
            if needs and low <= number(geom.get("group"), 0) <= high:
                summed += geom_inertia(geom, made, self.meshes, name).se3Action(pose)
            if made is not None:
                made.attrib.update(posed(pose))
                here.append(made)
        inertia = stated if stated is not None and not needs else summed
        least_mass = number(self.compiler.get("boundmass"), 0.0)
        least = number(self.compiler.get("boundinertia"), 0.0)
        if name != "world" and (inertia.mass < least_mass or least > 0.0):
            moments, axes = np.linalg.eigh(inertia.inertia)
            bound = axes @ np.diag(np.maximum(moments, least)) @ axes.T
            inertia = pin.Inertia(max(inertia.mass, least_mass), inertia.lever, bound)
        add_inertial(here, inertia)

    def _moves(self, body: str) -> bool:
        return body != "world" and (bool(self.joints_of[body]) or self._moves(self.parents[body]))

    def _site(self, element: ET.Element, at: pin.SE3, childclass: str, body: str) -> None:
        stated = self._with_defaults(element, childclass)
        if "name" in stated:
            place = at * plain_place(stated, self._pose)[0]
            self.sites.append(Site(stated["name"], body, place))

    def _joint(
        self, element: ET.Element, at: pin.SE3, childclass: str, body: str, order: int
    ) -> ET.Element:
        if element.tag == "freejoint":
            stated = {"type": "free", **element.attrib}
        else:
            stated = self._with_defaults(element, childclass)
        kind = stated.get("type", "hinge")
        if kind not in _COUNT:
            raise ValueError(f"a joint of body '{body}' is of an unknown type, '{kind}'")
        usual = f"{body}_joint{order or ''}" if kind != "free" else f"{body}_free"
        name = stated.get("name", usual)
        known = [one for joints in self.joints_of.values() for one in joints]
        _check_name("joint", name, known)
        self.nq += _COUNT[kind]
        self.joints_of[body].append(name)
        made = ET.Element("joint", name=name, type=kind)
        scalar = {key: number(" ".join(stated.get(key, "0").split()[:1]), 0.0) for key in _SCALARS}
        if scalar["stiffness"] or "springdamper" in stated:
            self.notes["springs of joints (stiffness, springdamper) are not modeled"].append(name)
        if kind == "free":
            made.set("pos", "0 0 0")
        else:
            made.set("pos", text_of(at.act(numbers(stated.get("pos", "0 0 0"), 3))))
            made.set("axis", text_of(at.rotation @ numbers(stated.get("axis", "0 0 1"), 3)))
        made.set("armature", repr(scalar["armature"]))
        is_limited = limited(stated, "limited", "range", self.compiler)
        if kind in ("free", "ball"):
            self.extras[name] = Extras(scalar["damping"], scalar["frictionloss"])
            if is_limited and kind == "ball":
                self.notes["ranges of ball joints are not modeled"].append(name)
            return made
        unit = self.angle if kind == "hinge" else 1.0
        made.set("damping", repr(scalar["damping"]))
        made.set("frictionloss", repr(scalar["frictionloss"]))
        ref = unit * number(stated.get("ref"), 0.0)
        if ref:
            made.set("ref", repr(ref))
            self.start[name] = np.array([ref])
        if is_limited:
            # Pinocchio subtracts ref from the range, but counts positions as MuJoCo does.
            made.set("range", text_of(unit * numbers(stated["range"], 2) + ref))
        if limited(stated, "actuatorfrclimited", "actuatorfrcrange", self.compiler):
            made.set("actuatorfrcrange", text_of(numbers(stated["actuatorfrcrange"], 2)))
        return made

    def _inertia(self, element: ET.Element, body: str) -> pin.Inertia:
        if "mass" not in element.attrib or "pos" not in element.attrib:
            raise ValueError(f"the <inertial> of body '{body}' states no mass or no pos")
        pose = self._pose(element.attrib)
        moments = np.zeros((3, 3))
        if "fullinertia" in element.attrib:
            xx, yy, zz, xy, xz, yz = numbers(element.attrib["fullinertia"], 6)
            moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        elif "diaginertia" in element.attrib:
            moments = np.diag(numbers(element.attrib["diaginertia"], 3))
        turned = pose.rotation @ moments @ pose.rotation.T
        mass, even = number(element.attrib["mass"], 0.0), 0.5 * (turned + turned.T)
        if not np.isfinite(even).all():
            raise ValueError(f"the <inertial> of body '{body}' is too large to compute with")
        return pin.Inertia(mass, pose.translation, even)

    def _pose(self, stated: Mapping[str, str]) -> pin.SE3:
        return pin.SE3(rotation(stated, self.compiler), numbers(stated.get("pos", "0 0 0"), 3))

    def _weigh(self, made: ET.Element) -> None:
        """Scale all masses to what the file states as their sum."""
        total = number(self.compiler.get("settotalmass"), -1.0)
        parts = list(made.iter("inertial"))
        now = sum(float(one.attrib["mass"]) for one in parts)
        if total <= 0.0 or not now:
            return
        for one in parts:
            for key in ("mass", "fullinertia"):
                one.set(key, text_of(total / now * numbers(one.attrib[key])))

    def _keys(self, made: ET.Element) -> None:
        keys = ET.SubElement(made, "keyframe")
        for key in self.given.iterfind("keyframe/key"):
            qpos = key.get("qpos", "")
            if key.get("name") and len(qpos.split()) == self.nq:
                ET.SubElement(keys, "key", name=key.attrib["name"], qpos=qpos)
