"""Parts of robots for new scenarios, as text of a URDF."""

from tests import urdf
from tests.urdf import inertial, shape


def link(name: str, size: str = "", at: str = "0 0 0", *parts: str, mass: float = 1.0) -> str:
    """A link with a box, if it has a size."""
    box = [shape("collision", f'<box size="{size}"/>', at)] if size else []
    return urdf.link(name, inertial(mass, 0.01), *box, *parts)


def limb(name, parent, at, *body, kind="revolute", axis="0 1 0", limits=(-1, 1), more="") -> str:
    """A link, as `link` makes it of `body`, on a joint of its parent that is called NAME_j."""
    joint = urdf.joint(f"{name}_j", kind, parent, name, more, at=at, axis=axis)
    low, high = limits
    return link(name, *body) + joint.replace('"-1" upper="1"', f'"{low}" upper="{high}"')


def ball(radius: str, at: str = "0 0 0") -> str:
    return shape("collision", f'<sphere radius="{radius}"/>', at)
