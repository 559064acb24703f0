"""Texts of small robots, for URDF files that tests write."""

from pathlib import Path


def inertial(
    mass: float = 1.0,
    moment: float | tuple[float, float, float] = 1.0,
    at: tuple[float, float, float] = (0, 0, 0),
) -> str:
    """Mass, the moments of inertia about its center of mass, and where that is."""
    x, y, z = moment if isinstance(moment, tuple) else (moment,) * 3
    origin = f'<origin xyz="{at[0]:g} {at[1]:g} {at[2]:g}"/>' if any(at) else ""
    return (
        f'<inertial>{origin}<mass value="{mass:g}"/><inertia ixx="{x:g}" iyy="{y:g}" '
        f'izz="{z:g}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def shape(kind: str, geometry: str, at: str = "0 0 0") -> str:
    """Return a `collision` or `visual` element."""
    return f'<{kind}><origin xyz="{at}"/><geometry>{geometry}</geometry></{kind}>'


def mesh(uri: object) -> str:
    return f'<mesh filename="{uri}"/>'


def link(name: str, *parts: str) -> str:
    return f'<link name="{name}">{"".join(parts)}</link>'


def joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    *more: str,
    at: str = "0 0 0",
    axis: str = "0 1 0",
    rpy: str = "0 0 0",
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="-1" upper="1" effort="50" velocity="2"/>{"".join(more)}</joint>'
    )


def robot(*parts: str) -> str:
    return f'<robot name="robot">{"".join(parts)}</robot>'


def write(path: Path, *parts: str) -> Path:
    """Write the file of a robot of these parts; return its path."""
    path.write_text(robot(*parts), encoding="utf-8")
    return path


def xacro(file: Path, *parts: str) -> Path:
    """Write the xacro file of a robot "arm" of these parts; return its path."""
    head = '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro">'
    file.write_text(f"{head}{''.join(parts)}</robot>", encoding="utf-8")
    return file
