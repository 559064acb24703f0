"""Arguments of Scene.add_contact and add_contacts: spheres or a plane, and what they touch."""

import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TypedDict

import numpy as np
import pinocchio as pin

from sphshell_pin.base.checks import check_name, check_placement, check_type
from sphshell_pin.contact import FoundationLaw, Plane, Sphere
from sphshell_pin.dynamics.scene.models import unit_warning
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.sources import Find
from sphshell_pin.errors import InvalidParameter, SetupWarning, UnitWarning
from sphshell_pin.shell import Shell


class Parts(TypedDict, total=False):
    """Fields of a ContactPair in which kinds of pairs differ."""

    placement: pin.SE3
    method: str
    sphere: Sphere
    shell: Shell
    find: Find
    other_sphere: Sphere
    group: str
    plane: Plane


def parts_of(
    sphere: Sphere | Plane,
    shell: Shell | Sphere,
    frame: str,
    placement: pin.SE3 | None,
    method: str | None,
) -> tuple[str, Parts]:
    """Check the arguments of Scene.add_contact; return frame_j and the fields of the pair."""
    if isinstance(sphere, Plane):
        check_type("shell", shell, Shell, "must be a Shell beside a Plane (of a ball: a sphere)")
    else:
        check_type("sphere", sphere, Sphere, "must be a Sphere(radius, frame) or a Plane(frame)")
    if isinstance(shell, Sphere):
        assert isinstance(sphere, Sphere)  # a plane has been refused
        why = "must not be given where shell is a Sphere"
        if frame != "universe":
            raise InvalidParameter("frame", frame, f"{why}: that names its own frame")
        if placement is not None:
            raise InvalidParameter("placement", placement, f"{why}: that has its own offset")
        if method is not None:
            raise InvalidParameter("method", method, f"{why}: their contact has a closed form")
        return shell.frame, {
            "placement": pin.SE3.Identity(),
            "sphere": sphere,
            "other_sphere": shell,
        }
    check_type("shell", shell, Shell, "must be a Shell (of a file: Shell.from_file) or a Sphere")
    method = "smooth" if method is None else method
    placement = check_placement("placement", placement)
    parts: Parts = {"placement": placement, "method": method, "shell": shell}
    if isinstance(sphere, Plane):
        return frame, {**parts, "plane": sphere}
    return frame, {**parts, "sphere": sphere}


def default_group(shell: Shell | Sphere) -> str:
    """Return what the contacts of several spheres with `shell` are called."""
    return shell.frame if isinstance(shell, Sphere) else shell.name


def named(spheres: Iterable[Sphere], name: str) -> Iterator[tuple[Sphere, str]]:
    """Yield each of `spheres`, which are one at least, with the name of its pair."""
    check_name("name", name)
    wanted = "must be spheres, one at least: Sphere(radius, frame)"
    if isinstance(spheres, Sphere) or not isinstance(spheres, Iterable):
        raise InvalidParameter("spheres", spheres, wanted)
    every = list(spheres)
    for k, one in enumerate(every):
        check_type(f"spheres[{k}]", one, Sphere, "must be a Sphere(radius, frame)")
    if not every:
        raise InvalidParameter("spheres", every, wanted)
    counts = Counter(one.frame for one in every)
    seen: Counter[str] = Counter()
    for one in every:
        called = f"{name}/{one.frame}"
        yield one, called if counts[one.frame] == 1 else f"{called}-{seen[one.frame]}"
        seen[one.frame] += 1


def corner_warning(pair: ContactPair) -> str | None:
    """Say so where a flat face may lie on a plane, with a law that acts at its lowest corner."""
    shell = pair.shell
    if pair.plane is None or shell is None or isinstance(pair.law, FoundationLaw):
        return None
    corners, normals = shell.vertices[shell.triangles], shell.triangle_normals
    patch = shell.element_patch[shell.triangle_element]
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    first = np.unique(patch, return_index=True)[1]
    along = np.einsum("ij,ij->i", normals, normals[first][patch])
    total = np.bincount(patch, area)
    flat = np.bincount(patch, area * along) > (1 - 1e-9) * total
    for k in first[flat & (total > 1e-3 * shell.size**2)]:
        if ((shell.vertices - corners[k, 0]) @ normals[k]).max() < 1e-6 * shell.size:
            return (
                f"contact '{pair.name}': shell '{shell.name}' has a flat face, which with "
                f"{type(pair.law).__name__} stands on one corner at a time and rattles: take a "
                "FoundationLaw, for which the face is one contact"
            )
    return None


def seam_warning(pair: ContactPair, other: ContactPair) -> str | None:
    """Say so where a sphere touches two shells that go on smoothly into each other."""
    a, b = pair.shell, other.shell
    if a is None or b is None or a.is_closed or b.is_closed or pair.sphere != other.sphere:
        return None
    if pair.joint_j != other.joint_j or isinstance(pair.law, FoundationLaw):
        return None
    # Places of border vertices, on a grid, and the normal of a triangle there.
    borders = []
    for one, shell in ((pair, a), (other, b)):
        pose = one.placement_j
        normals = np.zeros_like(shell.vertices)
        normals[shell.triangles] = shell.triangle_normals[:, None]
        on = np.unique(shell.edge_vertices[shell.edge_class == 2])
        places = (shell.vertices[on] @ pose.rotation.T + pose.translation) / (1e-6 * a.size)
        borders.append(
            dict(zip(map(tuple, np.rint(places)), normals[on] @ pose.rotation.T, strict=True))
        )
    shared = borders[0].keys() & borders[1].keys()
    smooth = [k for k in shared if abs(borders[0][k] @ borders[1][k]) > np.cos(a.crease_angle)]
    if len(smooth) < 2:
        return None
    return (
        f"contacts '{pair.name}' and '{other.name}': shells '{a.name}' and '{b.name}' go on into "
        "each other, and push twice at their seam: make them one shell"
    )


def warn_of_size(model: pin.Model, pair: ContactPair) -> None:
    """Warn of a suspiciously large sphere or shell, and of faces that stand on corners."""
    corners = corner_warning(pair)
    if corners:
        warnings.warn(corners, SetupWarning, stacklevel=3)
    if pair.sphere is None or pair.shell is None:
        return
    suspicion = unit_warning(model, pair.sphere.radius, pair.shell.size)
    if suspicion:
        warnings.warn(
            f"contact '{pair.name}', shell '{pair.shell.name}': {suspicion}",
            UnitWarning,
            stacklevel=3,
        )
