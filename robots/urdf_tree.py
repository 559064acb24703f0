"""The links and joints of a URDF, as elements: what readers of it leave unchecked or ask for."""

import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Iterator

from sphshell_pin.base.texts import number_of
from sphshell_pin.dynamics.scene.mimic import Mimic

INCLUDED = "name the file of the robot that includes this one"


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


def add_limits(root: ET.Element) -> Iterator[str]:
    """Give joints an empty <limit>, which states none, where urdfdom asks for one; say of which."""
    kinds = ("revolute", "prismatic")
    bare = [
        one for one in root.iter("joint") if one.get("type") in kinds and one.find("limit") is None
    ]
    for joint in bare:
        ET.SubElement(joint, "limit", effort="0", velocity="0")
    if bare:
        names = ", ".join(f"'{one.get('name')}'" for one in bare)
        yield f"without limits of the joints {names}: they have no <limit>"


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
