"""Descriptions of robots, and what pinocchio may read: its parser calls itself for every link."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.texts import counted, number_of, visible
from sphshell_pin.dynamics.scene.mimic import Mimic
from sphshell_pin.robots.packages import Folders

if TYPE_CHECKING:
    from sphshell_pin.robots.mjcf import MjcfRobot

_ZEROS = re.compile(r"[\s.]*0[\s.0]*")
INCLUDED = "name the file of the robot that includes this one"


def frames_without_link(root: ET.Element) -> list[str]:
    """Return the links that fixed joints name and a URDF with links does not have.

    A joint may place any of them, and start from the ground, `world`.
    """
    links = {link.get("name") for link in root.findall("link")}
    fixed = root.findall("joint[@type='fixed']")
    names = [one.get("link", "") for joint in fixed for one in joint.findall("child")]
    if any(one.get("link") == "world" for joint in fixed for one in joint.findall("parent")):
        names.append("world")
    return [name for name in names if name and name not in links] if links else []


def drop_loose_links(root: ET.Element) -> list[str]:
    """Take out the links that no joint holds to those that move; return their names.

    Where two trees have joints that move, or none has one, all stays.
    """
    joints, links = root.findall("joint"), root.findall("link")
    held_by = {one.get("link") for one in root.iterfind("joint/child")}
    if sum(one.get("name") not in held_by for one in links) < 2:
        return []
    tree = {one.get("name"): {one.get("name")} for one in links}
    for joint in joints:
        ends = [tree.get(one.get("link"), set()) for one in joint if one.tag in ("parent", "child")]
        whole = set().union(*ends)
        tree.update(dict.fromkeys(whole, whole))
    moved = [one for one in joints if one.get("type") != "fixed"]
    kept = [tree.get(one.get("link"), set()) for joint in moved for one in joint.findall("child")]
    if not kept or any(one != kept[0] for one in kept):
        return []
    for joint in joints:
        if not kept[0] & {one.get("link") for one in joint}:
            root.remove(joint)
    loose = [one for one in links if one.get("name") not in kept[0]]
    for link in loose:
        root.remove(link)
    return [str(one.get("name")) for one in loose]


def drop_empty_shapes(root: ET.Element) -> None:
    """Take out shapes of size 0, which keep a place: nothing touches them."""
    for link in root.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            shape = part.find("geometry/*")
            plain = shape is not None and shape.tag in ("box", "cylinder", "sphere")
            if shape is not None and plain and _ZEROS.fullmatch(" ".join(shape.attrib.values())):
                link.remove(part)


def check_tree(root: ET.Element) -> None:
    """Raise ValueError if two joints move one link (a closed kinematic chain), or one none."""
    movers = defaultdict(list)
    links = {link.get("name") for link in root.findall("link")}
    if not links:
        raise ValueError(f"it has no <link>: {INCLUDED}")
    for joint in root.findall("joint"):
        for end in ("parent", "child"):
            elements = joint.findall(end)
            if len(elements) > 1:
                # Readers take different ones of several: what was checked would not be read.
                raise ValueError(
                    f"joint '{joint.get('name')}' has {len(elements)} <{end}> elements: leave one"
                )
            link = elements[0].get("link") if elements else None
            if link is not None and link not in links:
                raise ValueError(
                    f"joint '{joint.get('name')}' has the {end} '{link}', but there is no such "
                    f"link: correct it, or {INCLUDED}"
                )
            if end == "child" and link is not None:
                movers[link].append(str(joint.get("name")))
    roots = [str(link) for link in links if link not in movers]
    if len(roots) > 1:
        raise ValueError(
            f"no joint moves or fixes the links {', '.join(map(repr, sorted(roots)))}: a URDF has "
            "one such root; fix the others to it, with a joint of type fixed"
        )
    for link, names in movers.items():
        if len(names) > 1:
            raise ValueError(
                f"the joints {' and '.join(repr(one) for one in names)} move one link, '{link}': "
                "kinematic loops are not supported; leave one of the joints out"
            )


def fix_root(root: ET.Element) -> None:
    """Fix the links of a URDF to its root link that joints of type floating leave free there."""
    moved = {str(one.get("link")) for one in root.iterfind("joint/child")}
    for joint in root.iterfind("joint[@type='floating']"):
        parent = joint.find("parent")
        if parent is not None and parent.get("link") not in moved:
            joint.set("type", "fixed")


def add_limits(root: ET.Element) -> Iterator[str]:
    """Set limits that urdfdom asks for, or that are negative, to 0, which states none; say so."""
    kinds = ("revolute", "prismatic")
    bare = [
        one for one in root.iter("joint") if one.get("type") in kinds and one.find("limit") is None
    ]
    for joint in bare:
        ET.SubElement(joint, "limit")
    for limit in root.iterfind("joint/limit"):
        limit.attrib.update({"effort": "0", "velocity": "0"} | limit.attrib)
    if bare:
        yield f"without limits of the joints {_names(bare)}: they have no <limit>"
    for key in ("effort", "velocity"):
        negative = []
        for joint in root.iter("joint"):
            for limit in joint.findall("limit"):
                if limit.get(key, "").strip().startswith("-"):
                    limit.set(key, "0")
                    negative.append(joint)
        if negative:
            yield f"without the negative {key} limits of the joints {_names(negative)}"


def _names(joints: Iterable[ET.Element]) -> str:
    return ", ".join(f"'{one.get('name')}'" for one in joints)


def mimics_of(root: ET.Element) -> Iterator[Mimic]:
    """Yield the rules of a URDF, but those of fixed joints."""
    for joint in root.iter("joint"):
        rule = joint.find("mimic")
        if rule is None or joint.get("type") == "fixed":
            continue
        name, of = joint.get("name", ""), rule.get("joint", "")
        try:
            ratio, offset = (
                number_of(rule.get(key) or usual)
                for key, usual in (("multiplier", "1"), ("offset", "0"))
            )
        except ValueError:
            raise ValueError(f"joint '{name}' mimics '{of}' by what is no number") from None
        yield Mimic(name, of, ratio, offset)


DEEPEST = 100
"""Elements of the file one within another; robots need seven."""

MOST_ATTRIBUTES = 200
"""Most attributes of an element: the time to read them grows with their square."""

LONGEST_CHAIN = 1000
"""Links one behind another; the parser overflows the stack of 8 MB at about 3800."""

MOST_LINKS = 5000
"""Links in all: the time to read them grows with their square."""

MOST_MEMORY = 2e9
"""[B] while a pinocchio.Data is made: it has four arrays of one number per three velocities.

Python copies it once.
"""


@dataclass(frozen=True)
class Description:
    """A robot's file, read: `root` is a URDF, or an MJCF with what it includes."""

    file: Path
    folders: Folders
    root: ET.Element
    mimics: tuple[Mimic, ...] = ()
    loops: tuple[str, ...] = ()
    """What closes kinematic loops or couples joints otherwise than by mimicking: not modeled."""
    notes: tuple[str, ...] = ()
    """What else the file states that is not modeled, one sentence each."""
    start: Mapping[str, Array] = field(default_factory=dict)
    """Positions (nq of the joint) in which MJCF draws the joints that are not at zero there."""
    mjcf: MjcfRobot | None = None
    """What MuJoCo makes of an MJCF."""

    def q0(self, model: pin.Model) -> Array:
        """Return the configuration (nq,) that the file draws, of the model of `build_model`."""
        q = np.array(pin.neutral(model))
        for name, values in self.start.items():
            at = model.joints[model.getJointId(name)].idx_q
            q[at : at + len(values)] = values
        return q

    @property
    def is_mjcf(self) -> bool:
        """Whether it is MJCF."""
        return self.mjcf is not None


def check_memory(nv: int) -> None:
    """Raise ValueError if a pinocchio.Data of `nv` velocities would need too much memory."""
    memory = 8 * 8.0 * nv**3
    if memory > MOST_MEMORY:
        raise ValueError(
            f"its {nv} degrees of freedom need {memory * 1e-9:.3g} GB of memory, more than "
            f"{MOST_MEMORY * 1e-9:g} GB; fix some joints, or build the pinocchio.Model yourself"
        )


_PARTS = frozenset(["origin", "mass", "inertia", "sphere", "cylinder", "capsule", "box", "mesh"])
_COUNTS = dict.fromkeys(["xyz", "rpy", "size", "scale"], 3)
_COUNTS |= dict.fromkeys(["value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "radius", "length"], 1)


def parsed(text: bytes) -> ET.Element:
    """Return the root element of XML that `check_size` has passed; ValueError where it has faults.

    The parser knows namespaces, which `check_size` does not look at.
    """
    try:
        root = ET.fromstring(_declared(text))
    except ET.ParseError as error:
        raise ValueError(f"it is not well-formed XML: {error}") from None
    for element in root.iter():  # which urdfdom prints as they are
        plain = {name: visible(value.strip()) for name, value in element.attrib.items()}
        element.attrib.update(plain)
    # urdfdom drops an inertia or a collision one of whose numbers is none to it, and goes on.
    for link in root.iter("link"):
        for part in (*link.findall("inertial/*"), *link.findall("collision//*")):
            for name in _COUNTS.keys() & part.attrib.keys() if part.tag in _PARTS else ():
                where = f"the {part.tag} of link '{link.get('name')}': {name}"
                part.set(name, _numbers(part.attrib[name], _COUNTS[name], where))
    return root


def _numbers(text: str, count: int, where: str) -> str:
    """Return `count` finite numbers as Python writes them; `where` begins the error of others."""
    try:
        numbers = [number_of(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        must = f"must be {counted(count, 'finite number')}"
        raise ValueError(f"{where} '{text}' {must}")
    return " ".join(map(repr, numbers))


def _declared(text: bytes) -> bytes:
    """Return XML whose root declares every prefix of a name: other readers ignore them."""
    used = set(re.findall(rb"<([A-Za-z_][\w.-]*):\w", text))
    used |= set(re.findall(rb"\s([A-Za-z_][\w.-]*):[\w.-]+\s*=", text))
    unknown = used - set(re.findall(rb"\sxmlns:([\w.-]+)\s*=", text)) - {b"xml", b"xmlns"}
    if not unknown:
        return text
    named = b"".join(b' xmlns:%b="urn:%b"' % (one, one) for one in sorted(unknown))
    return re.sub(rb"<(?:robot|mujoco)\b", lambda found: found[0] + named, text, count=1)


def check_poses(root: ET.Element, model: pin.Model) -> None:
    """Raise ValueError for what pinocchio would leave out of the poses of an SRDF.

    Values are written anew, as its reader takes less for a number than Python.
    """
    for pose in root.findall("group_state"):
        for one in pose.findall("joint"):
            name, value = one.get("name", ""), one.get("value", "")
            where = f"pose '{pose.get('name')}', joint '{name}'"
            world = name == model.names[0]  # pinocchio's reader crashes at it
            if model.existJointName(name) and not world:
                joint = model.joints[model.getJointId(name)]
                count = 1 if joint.nv == 1 else joint.nq  # of a continuous joint its angle
            elif model.existFrame(name, pin.FrameType.FIXED_JOINT) and not world:
                continue
            else:
                raise ValueError(
                    f"{where}: the robot has no such joint; correct the name or leave it out"
                )
            one.set("value", _numbers(value, count, f"{where}: value"))


def check_size(text: bytes) -> str:
    """Return the name of the root element of a file; ValueError for XML that no robot needs.

    Nothing is kept but the names of links.
    """
    if not text.strip():
        raise ValueError("it is empty")
    parser = expat.ParserCreate()
    opened: list[str] = []
    root: list[str] = []
    joints: list[dict[str, str]] = []
    links = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal links
        opened.append(tag)
        if len(opened) == 1:
            root.append(tag)
        if len(opened) > DEEPEST:
            raise ValueError(f"its elements are nested more than {DEEPEST} deep")
        if len(attributes) > MOST_ATTRIBUTES:
            raise ValueError(f"its element '{tag}' has more than {MOST_ATTRIBUTES} attributes")
        links += opened[1:] == ["link"] or tag == "body"
        if opened[1:] == ["joint"]:
            joints.append({})
        elif opened[1:-1] == ["joint"] and "link" in attributes:
            joints[-1][tag] = attributes["link"]

    def entity(name: str, *_: object) -> None:
        raise ValueError(f"it declares an entity, '{name}'; write what it stands for instead")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: opened.pop()
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(text, True)
    except (expat.ExpatError, LookupError) as error:  # LookupError: an unknown encoding
        raise ValueError(f"it is not well-formed XML: {error}") from None
    if links > MOST_LINKS:
        raise ValueError(f"it has {links} links; at most {MOST_LINKS} can be read")
    children = defaultdict(list)
    for joint in joints:
        children[joint.get("parent")].append(joint.get("child"))
    layer = list(children.keys() - {joint.get("child") for joint in joints})
    length = 0
    while layer:
        length += 1
        # Taken out: a loop, which no URDF may have, must not go on for ever.
        layer = [child for link in layer for child in children.pop(link, ())]
    if length > LONGEST_CHAIN:
        raise ValueError(
            f"it has a chain of {length} links; at most {LONGEST_CHAIN} one behind another can be "
            "read"
        )
    return root[0]
