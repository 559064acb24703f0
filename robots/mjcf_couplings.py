"""Equalities of MJCF: those that are mimic joints, and what the others couple."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.dynamics.scene.mimic import Mimic

JointsOf = Mapping[str, Sequence[str]]


def couplings(
    root: ET.Element,
    start: Mapping[str, NDArray[np.float64]],
    parents: Mapping[str, str],
    joints_of: JointsOf,
) -> tuple[tuple[Mimic, ...], tuple[str, ...]]:
    """Return the equalities that are mimic joints, and a sentence on each of the others.

    start : where the file draws joints; parents : of bodies; joints_of : the joints of each body
    """
    mimics, loops = [], []
    for one in root.iterfind("equality/*"):
        if one.get("active") == "false":
            continue
        label = f"<{one.tag}>" + (f" '{one.get('name')}'" if one.get("name") else "")
        first, second = one.get(f"{one.tag}1"), one.get(f"{one.tag}2")
        if one.tag == "joint" and first is not None:
            terms = np.zeros(5)
            stated = np.array(one.get("polycoef", "0 1 0 0 0").split(), dtype=float)[:5]
            terms[: len(stated)] = stated
            if second is not None and not terms[2:].any():
                # It is of the distances from ref.
                refs = [float(start.get(one, np.zeros(1))[0]) for one in (first, second)]
                offset = float(terms[0] + refs[0] - terms[1] * refs[1])
                mimics.append(Mimic(first, second, float(terms[1]), offset))
            elif second is None:
                loops.append(f"{label} holds joint '{first}' at {terms[0]:g} (lock it instead)")
            else:
                loops.append(f"{label} makes joint '{first}' follow '{second}' by a polynomial")
        elif one.tag in ("connect", "weld"):
            ends = [one.get(f"body{k}") or one.get(f"site{k}") or "world" for k in (1, 2)]
            names = _between(ends, parents, joints_of)
            bodies = " and ".join(f"'{end}'" for end in ends)
            loops.append(
                f"the kinematic loop that {label} closes between {bodies}"
                + (f", of the joints {', '.join(map(repr, names))}" if names else "")
            )
        else:
            loops.append(f"{label} of <equality>")
    return tuple(mimics), tuple(loops)


def _between(bodies: Sequence[str], parents: Mapping[str, str], joints_of: JointsOf) -> list[str]:
    """Return the joints on the way from one body to another; none where one is unknown."""
    ways = []
    for body in bodies:
        way = [body]
        while way[-1] in parents:
            way.append(parents[way[-1]])
        ways.append(way)
    apart = set(ways[0]) ^ set(ways[1])
    order = [*ways[0][::-1], *ways[1][::-1]]
    return [name for body in order if body in apart for name in joints_of.get(body, [])]
