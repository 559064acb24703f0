"""The robot in the picture: its geometry where there is one, else a skeleton of its joints."""

from __future__ import annotations

import contextlib
import io
from typing import TYPE_CHECKING

import coal
import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame, frame_on_joint
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view import nodes
from sphshell_pin.view.frames import PALE_AXIS_COLORS, draw_axes
from sphshell_pin.view.meshes import lit_facets

if TYPE_CHECKING:
    from meshcat import Visualizer

LINK_COLOR = 0x8B95A1
JOINT_COLOR = 0x4A5560


def check_geometry_model(model: pin.Model, geometry_model: pin.GeometryModel) -> None:
    """Raise InvalidParameter unless `geometry_model` hangs on the joints of `model`.

    A geometry model made for the full robot does not fit a model with locked joints.
    """
    for geometry in geometry_model.geometryObjects:
        joint, frame = geometry.parentJoint, geometry.parentFrame
        fits = joint < model.njoints and (
            frame >= model.nframes or model.frames[frame].parentJoint == joint
        )
        if not fits:
            raise InvalidParameter(
                "visual_model",
                geometry.name,
                "must hang on a joint of scene.model: where joints are locked, reduce the geometry "
                "model too with pinocchio.buildReducedModel",
            )


def has_links(model: pin.Model) -> bool:
    """Whether the skeleton of `model` has rods between joints: it is more than bodies that fly."""
    return bool(_linked(model))


def _linked(model: pin.Model) -> list[int]:
    """Return the joints to which a rod leads: those that let no body fly free of the world."""
    joints = range(1, model.njoints)
    return [joint for joint in joints if model.parents[joint] or model.joints[joint].nv == 1]


class GeometryRobot:
    """The geometry objects of a visual or collision model, drawn by Pinocchio's own loader."""

    def __init__(
        self, visualizer: Visualizer, model: pin.Model, geometry_model: pin.GeometryModel
    ) -> None:
        with interrupts_delayed():
            from pinocchio.visualize import MeshcatVisualizer

        check_geometry_model(model, geometry_model)

        class Viewer(MeshcatVisualizer):  # type: ignore[misc]
            def loadMeshFromFile(self, body: pin.GeometryObject) -> object:  # noqa: N802
                loaded = super().loadMeshFromFile(body)
                if getattr(loaded, "mesh_format", "") == "stl":
                    packed = loaded.contents
                    loaded.contents = type(packed)(packed.type, lit_facets(packed.data))
                return loaded

        viewer = Viewer(model, pin.GeometryModel(), geometry_model)
        viewer.initViewer(viewer=visualizer, open=False)
        with contextlib.redirect_stdout(io.StringIO()):
            viewer.loadViewerModel("robot")
        self._model = model
        self._geometry = geometry_model
        self._placed = geometry_model.createData()
        self._parts: list[tuple[nodes.Move, pin.SE3, Array]] = []
        self._paths: list[str] = []
        for index, body in enumerate(geometry_model.geometryObjects):
            node = visualizer[viewer.getViewerNodeName(body, pin.GeometryType.VISUAL)]
            # A reference: it follows the update of all placements.
            self._parts.append((nodes.mover(node), self._placed.oMg[index], _in_body(body)))
            self._paths.append(node.path)

    def held(self) -> list[tuple[str, str | None]]:
        """Return the paths of the nodes, each with a frame of its body, None if it cannot move."""
        return [
            (path, frame_of_body(self._model, body.parentJoint, body.parentFrame))
            for path, body in zip(self._paths, self._geometry.geometryObjects, strict=True)
        ]

    def update(self, data: pin.Data) -> None:
        """Place all geometry where forward kinematics left the joints in `data`."""
        pin.updateGeometryPlacements(self._model, data, self._geometry, self._placed)
        for move, where, in_body in self._parts:
            move(where.homogeneous @ in_body)


def frame_of_body(model: pin.Model, joint: int, number: int | None = None) -> str | None:
    """Return a frame on `joint`, that with the `number` if it fits; None if it cannot move."""
    if joint == 0:
        return None
    if number is not None and number < model.nframes:
        frame = model.frames[number]
        if frame.parentJoint == joint and find_frame(model, frame.name) == number:
            return str(frame.name)
    return frame_on_joint(model, joint)


def _in_body(body: pin.GeometryObject) -> Array:
    """Return the matrix (4, 4) from what the loader draws to the geometry object's own frame."""
    matrix = np.diag([*body.meshScale, 1.0])
    if isinstance(body.geometry, coal.Plane | coal.Halfspace):
        # The loader leaves a plane at the origin.
        matrix[:3, 3] = body.geometry.d * body.geometry.n
    return matrix


class SkeletonRobot:
    """A rod from each joint to its children, and the axes of each joint's frame.

    A joint that lets a body fly free of the world gets no rod to the world's origin. `tips`
    (joint, offset (3,) [m]) are places worth a rod of their own: the spheres. Joints in `drawn`
    have something to see already, and massless ones nothing to show: they get no axes.
    """

    def __init__(
        self,
        visualizer: Visualizer,
        model: pin.Model,
        size: float,
        tips: list[tuple[int, Array]],
        drawn: set[int],
    ) -> None:
        self._model = model
        self._held: list[tuple[str, int]] = []
        self._width = 0.012 * size
        self._links: list[tuple[nodes.Move, int, int, Array]] = []
        self._axes: list[nodes.OnJoint] = []
        root = visualizer["robot"]
        ends = [
            (model.parents[joint], joint, np.zeros(3), model.names[joint])
            for joint in _linked(model)
        ]
        ends += [(joint, joint, at, f"tip_{k}") for k, (joint, at) in enumerate(tips) if joint]
        for start, end, offset, name in ends:
            node = root["links"][nodes.node_name(name)]
            nodes.set_object(node, nodes.rod(1.0, 1.0), nodes.material("MeshPhong", LINK_COLOR))
            self._links.append((nodes.mover(node), start, end, offset))
            self._held.append((node.path, start))
        for joint in range(1, model.njoints):
            if joint in drawn or model.inertias[joint].mass == 0.0:
                continue
            node = root["joints"][nodes.node_name(model.names[joint])]
            nodes.set_object(
                node["ball"],
                nodes.sphere(1.6 * self._width, 20),
                nodes.material("MeshPhong", JOINT_COLOR),
            )
            looks = [nodes.material("MeshBasic", color) for color in PALE_AXIS_COLORS]
            draw_axes(node, self._width, 5.0 * self._width, looks)
            self._axes.append(nodes.OnJoint(node, joint))
            self._held.append((node.path, joint))

    def held(self) -> list[tuple[str, str | None]]:
        """Return the paths of the nodes, each with a frame of its body, None if it cannot move."""
        return [(path, frame_of_body(self._model, joint)) for path, joint in self._held]

    def update(self, data: pin.Data) -> None:
        """Place rods and axes where forward kinematics left the joints in `data`."""
        for move, start, end, offset in self._links:
            first = data.oMi[start].translation
            step = data.oMi[end].act(offset) - first
            short = np.linalg.norm(step) < self._width
            move(nodes.hidden_at(first) if short else nodes.rod_along(first, step, self._width))
        for one in self._axes:
            one.update(data)
