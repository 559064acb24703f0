"""What is wrong with the contacts of spheres."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array

MM = 1e-3

FAULTS = {
    "lost": "no contact where the sphere touches",
    "missing": "a minimum of the distance has no contact",
    "shallow": "the deepest contact is too shallow",
    "deep": "the deepest contact is too deep",
    "phantom": "a contact is at no minimum of the distance",
    "double": "the weights add up to more than the components of the surface inside the sphere",
    "force": "one minimum, on a plane, and another force",
}


@dataclass
class Verdict:
    """Spheres that were asked, and the rows of those with faults.

    Attributes
    ----------
    centers, radii : (n, 3) and (n,) [m]; joints : what meets there, one a sphere
    faults : rows by the name of the fault; details : of rows
    """

    part: str
    centers: Array
    radii: Array
    joints: list[str]
    faults: dict[str, list[int]] = field(default_factory=lambda: {name: [] for name in FAULTS})
    details: dict[int, str] = field(default_factory=dict)

    def add(self, fault: str, row: int, detail: str) -> None:
        self.faults[fault].append(row)
        self.details[row] = detail

    def found(self) -> dict[str, list[str]]:
        """Faults, with a description of each sphere."""
        found = self.faults.items()
        return {name: [self.describe(row) for row in rows] for name, rows in found if rows}

    def describe(self, row: int) -> str:
        where = f"center {self.centers[row].tolist()}, radius {float(self.radii[row])}"
        return f"{self.joints[row]}: {where}: {self.details[row]}"


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
