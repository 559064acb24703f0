"""What is wrong with the contacts of spheres."""

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import sphshell_pin as sp

MM = 1e-3


@dataclass
class Verdict:
    """Spheres that were asked, and what is wrong with some.

    Attributes
    ----------
    spheres : how many
    faults : descriptions of spheres by the name of the fault:
        lost, no contact where the sphere touches
        missing, a minimum of the distance has no contact
        shallow, deep, the deepest contact is too shallow, or too deep
        phantom, a contact is at no minimum of the distance
        double, the weights add up to more than the components of the surface inside the sphere
        force, one minimum, on a plane, and another force
    """

    part: str
    spheres: int
    faults: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))


def exact_share(shell: sp.Shell) -> float:
    """The share of the area of a shell's faces on which contacts are exact."""
    p, q, r = shell.vertices[shell.triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    of_element = np.bincount(shell.triangle_element, area, len(shell.elements))
    on_face = [face.elements for face in shell.faces]
    total = of_element[np.concatenate(on_face)].sum() if on_face else 0.0
    return float(of_element[exact_elements(shell)].sum() / total) if total else 1.0


def exact_elements(shell: sp.Shell) -> NDArray[np.bool_]:
    """Whether each element is exact."""
    out = np.zeros(len(shell.elements), bool)
    for face in shell.faces:
        out[face.elements] = True
        out[face.curved] = False
    return out
