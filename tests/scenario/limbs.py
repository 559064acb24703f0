"""Parts of robots for new scenarios, as text of a URDF."""

from tests import urdf
from tests.urdf import inertial, shape

HINGE = "revolute", "0 0 1", "0 1 0"


def link(name: str, size: str = "", at: str = "0 0 0", *parts: str) -> str:
    """A link of 1 kg, with a box if it has a size."""
    box = [shape("collision", f'<box size="{size}"/>', at)] if size else []
    return urdf.link(name, inertial(1, 0.01), *box, *parts)


def joint(name: str, parent: str, child: str, kind: str, at: str, axis: str, *more: str) -> str:
    return urdf.joint(name, kind, parent, child, *more, at=at, axis=axis)


def ball(radius: str, at: str = "0 0 0") -> str:
    return shape("collision", f'<sphere radius="{radius}"/>', at)
