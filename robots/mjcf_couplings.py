"""Equalities of MJCF: those that are mimic joints, and what the others couple."""

from collections.abc import Sequence
from typing import Any

from sphshell_pin.dynamics.scene.mimic import Mimic

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
