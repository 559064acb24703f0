"""The arm of the press with its fixed links merged: what the engines without Pinocchio load."""

import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from benchmarks.peers.press import FRAME, PressScene
from benchmarks.peers.shapes import Surface

AXES = {"JointModelRX": "1 0 0", "JointModelRY": "0 1 0", "JointModelRZ": "0 0 1"}


def text(*numbers: ArrayLike) -> str:
    """Return numbers with all their digits, as an attribute."""
    return " ".join(repr(float(x)) for one in numbers for x in np.ravel(one))


def merged_urdf(scene: PressScene, scale: float = 1.0, sphere: bool = True) -> str:
    """Return a URDF of one link per moving joint, every length times `scale`.

    Link and joint `i` are those of Pinocchio's model, in its order; the fingertip is a collision
    sphere on the last link, unless `sphere` is False; inertias grow with scale^2, masses stay.
    Joints have no limits, which some engines would check in every step.
    """
    model = pin.buildModelFromXML(scene.urdf)
    tip = model.frames[model.getFrameId(FRAME)]
    nothing = " ".join(f'{name}="0"' for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    parts = [
        f'<link name="link0"><inertial><mass value="0"/><inertia {nothing}/></inertial></link>'
    ]
    for i in range(1, model.njoints):
        inertia, placement = model.inertias[i], model.jointPlacements[i]
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = scale**2 * np.asarray(inertia.inertia)
        parts.append(
            f'<link name="link{i}"><inertial><origin xyz="{text(scale * inertia.lever)}"/>'
            f'<mass value="{text(inertia.mass)}"/><inertia ixx="{text(xx)}" '
            f'ixy="{text(xy)}" ixz="{text(xz)}" iyy="{text(yy)}" '
            f'iyz="{text(yz)}" izz="{text(zz)}"/></inertial>'
        )
        if sphere and i == tip.parentJoint:
            parts.append(
                f'<collision><origin xyz="{text(scale * tip.placement.translation)}"/>'
                f'<geometry><sphere radius="{text(scale * scene.radius)}"/></geometry>'
                "</collision>"
            )
        turn = pin.rpy.matrixToRpy(placement.rotation)
        parts.append(
            f'</link><joint name="joint{i}" type="continuous">'
            f'<parent link="link{model.parents[i]}"/><child link="link{i}"/>'
            f'<origin xyz="{text(scale * placement.translation)}" rpy="{text(turn)}"/>'
            f'<axis xyz="{AXES[model.joints[i].shortname()]}"/></joint>'
        )
    return f'<robot name="arm">{"".join(parts)}</robot>'


def obj_text(vertices: np.ndarray, triangles: np.ndarray) -> str:
    """Return a mesh as the text of an OBJ file: vertices (n, 3), triangles (m, 3)."""
    points = "v %.17g %.17g %.17g\n" * len(vertices) % tuple(vertices.ravel().tolist())
    return points + "f %d %d %d\n" * len(triangles) % tuple((triangles + 1).ravel().tolist())


class MeshFiles:
    """Surfaces as OBJ files in a temporary `folder`, each written once."""

    def __init__(self) -> None:
        self._held = tempfile.TemporaryDirectory()
        self.folder = Path(self._held.name)
        self._known: dict[Surface, str] = {}

    def of(self, surface: Surface) -> str:
        """Return the path of the file of a surface."""
        if surface not in self._known:
            path = self.folder / f"{len(self._known)}.obj"
            path.write_text(obj_text(surface.vertices, surface.triangles))
            self._known[surface] = str(path)
        return self._known[surface]
