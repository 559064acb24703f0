"""Shells, spheres and planes as a Display draws them: each once, hanging on a joint."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.view import nodes, surface
from sphshell_pin.view.nodes import sphere

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.pairs import ContactPair
    from sphshell_pin.dynamics.scene.sides import ShellSide, SphereSide

SPHERE_COLOR = 0x2F6FDE
PLANE_COLOR = 0x7A8794
_CELLS = 12  # of the square that stands for a plane, along a side


def drawn_key(side: ShellSide) -> Hashable:
    """Return a key: shells with equal keys share a picture."""
    return side.key, side.is_smooth


def sphere_key(sphere: SphereSide) -> Hashable:
    """Return a key: spheres with equal keys share a picture."""
    return sphere.joint, sphere.in_joint.homogeneous.tobytes(), sphere.radius


def plane_key(pair: ContactPair) -> Hashable:
    """Return a key: pairs with equal keys share the picture of their plane."""
    return pair.joint_i, pair.placement_i.homogeneous.tobytes()


class DrawnShell(nodes.OnJoint):
    """The shell of `side`, drawn below `visualizer`; `index` numbers the shells of the scene."""

    def __init__(self, visualizer: Visualizer, side: ShellSide, index: int) -> None:
        shell = side.shell
        node = visualizer[f"{index}_{nodes.node_name(shell.name)}"]
        super().__init__(node, side.joint, side.in_joint)
        self.shell = shell
        self._curved = side.is_smooth
        self._index = index
        self._by_face: bool | None = None  # until it is drawn so
        surface.draw_shell(node, shell, index, curved=self._curved)

    def show_curved(self, on: bool) -> None:
        """Draw the curved elements that contact uses, or the flat ones of the file."""
        if self._curved:
            surface.draw_shell(self.node, self.shell, self._index, curved=on)
            nodes.show(self.node["surface"], not self._by_face)

    def show_faces(self, on: bool) -> None:
        """Show the colors of faces, which are drawn when they are first shown, or those of all."""
        if on and self._by_face is None:
            surface.draw_faces(self.node, self.shell, curved=self._curved)
        if on or self._by_face is not None:
            self._by_face = on
            nodes.show(self.node["faces"], on)
            nodes.show(self.node["surface"], not on)


class DrawnSphere(nodes.OnJoint):
    """A sphere of the pair `name`, drawn below `visualizer`; `index` numbers those of the scene."""

    def __init__(self, visualizer: Visualizer, name: str, drawn: SphereSide, index: int) -> None:
        radius, node = drawn.radius, visualizer[f"{index}_{nodes.node_name(name)}"]
        super().__init__(node, drawn.joint, drawn.in_joint)
        nodes.set_object(
            node["ball"],
            sphere(radius, 48),
            # Pulled forward a little: robots draw their own fingertip of the same radius.
            nodes.material(
                "MeshPhong",
                SPHERE_COLOR,
                0.6,
                side=0,
                depthWrite=False,
                shininess=60,
                polygonOffset=True,
                polygonOffsetFactor=-2.0,
                polygonOffsetUnits=-2.0,
            ),
            order=5,
        )
        # A faint disc through whatever hides the sphere: it often sits inside a hand.
        nodes.set_object(
            node["ghost"], sphere(radius, 24), nodes.on_top(SPHERE_COLOR, 0.25), order=4
        )
        # Three great circles, so that one sees a ball spin.
        nodes.set_object(
            node["circles"],
            nodes.line_segments(*surface.great_circles(1.003 * radius)),
            nodes.material("LineBasic", 0x0D2C66, 0.8),
            "LineSegments",
            order=6,
        )


class DrawnPlane:
    """The plane of `pair`: a square of cells of half the shell's size, where the shell is."""

    def __init__(self, visualizer: Visualizer, pair: ContactPair, index: int) -> None:
        low, high = np.asarray(pair.shells[0].shell.box)
        self._cell = 0.5 * float(np.linalg.norm(high - low))
        self._plane = pair.joint_i, pair.placement_i
        self._shell = pair.joint_j, pair.placement_j
        self._center = 0.5 * (low + high)
        self._middle = np.full(3, np.inf)
        node = visualizer[f"{index}_{nodes.node_name(pair.name)}"]
        points, lines = nodes.lattice(np.arange(_CELLS + 1.0) - 0.5 * _CELLS)
        points, last = self._cell * points, len(points) - 1
        corners = np.array([0, _CELLS, last, 0, last, last - _CELLS], np.int32)
        look = nodes.material("MeshBasic", PLANE_COLOR, 0.25, depthWrite=False)
        nodes.set_object(node["square"], nodes.triangle_mesh(points, corners), look, order=1)
        look = nodes.material("LineBasic", PLANE_COLOR, 0.5, depthWrite=False)
        nodes.set_object(
            node["cells"], nodes.line_segments(points, lines), look, "LineSegments", order=2
        )
        self._move = nodes.mover(node)

    def update(self, data: pin.Data) -> None:
        """Place it where forward kinematics left its joint in `data`, a cell on with the shell."""
        plane, shell = (data.oMi[joint] * place for joint, place in (self._plane, self._shell))
        seen = plane.actInv(shell.act(self._center)) * [1.0, 1.0, 0.0]
        if np.abs(seen - self._middle).max() > 0.25 * _CELLS * self._cell:
            self._middle = self._cell * np.round(seen / self._cell)
        self._move((plane * pin.SE3(np.eye(3), self._middle)).homogeneous)
