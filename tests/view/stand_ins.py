"""Scenes and results made by hand: any contact log, no dynamics, known answers."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.dynamics.result.run_stats import RunStats
from sphshell_pin.dynamics.scene.sides import ShellSide, SphereSide
from tests.shell.surfaces import CUBE, CUBE_QUADS

CUBE_VERTICES, CUBE_ELEMENTS = CUBE - 0.5, np.array(CUBE_QUADS)


def quad_shell(vertices, elements, name="shell", patches=None):
    """A shell of quads with every edge sharp; one patch per element unless told otherwise."""
    elements = np.asarray(elements)
    triangles = np.concatenate([elements[:, [0, 1, 2]], elements[:, [0, 2, 3]]])
    element = np.tile(np.arange(len(elements)), 2)
    order = np.argsort(element, kind="stable")
    edges = np.unique(
        np.sort(np.concatenate([elements[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1), axis=0
    )
    patch = np.arange(len(elements)) if patches is None else np.asarray(patches)
    return SimpleNamespace(
        vertices=np.asarray(vertices, dtype=float),
        elements=elements.astype(np.int32),
        is_closed=False,
        triangles=triangles[order].astype(np.int32),
        triangle_element=element[order].astype(np.int32),
        box=np.array([np.min(vertices, axis=0), np.max(vertices, axis=0)]),
        name=name,
        edge_vertices=edges.astype(np.int32),
        edge_class=np.full(len(edges), 1, dtype=np.uint8),
        element_patch=patch.astype(np.int32),
        element_face=None,
        faces=(),
        num_elements=len(elements),
    )


def plate(size=1.0, name="plate"):
    """A square plate at z = 0."""
    corners = 0.5 * size * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    return quad_shell(corners, [[0, 1, 2, 3]], name)


def contact_pair(model, frame, radius, shell, shell_frame="universe", placement=None, name="tip"):
    """One sphere at a frame against one shell; `radius` None is a pair without sphere or shell."""
    sphere_frame = model.frames[model.getFrameId(frame)]
    shell_body = model.frames[model.getFrameId(shell_frame)]
    placement = placement or pin.SE3.Identity()
    joint, center = sphere_frame.parentJoint, sphere_frame.placement
    ends = shell_body.parentJoint, shell_body.placement, shell, placement, "facets"
    return SimpleNamespace(
        spheres=()
        if radius is None
        else (SphereSide(frame, joint, center, sp.Sphere(radius, frame)),),
        shells=() if shell is None else (ShellSide(shell_frame, *ends),),
        side_i=None,
        name=name,
        frame_i=frame,
        placement_i=center,
        placement_j=shell_body.placement * placement,
        joint_i=joint,
        joint_j=shell_body.parentJoint,
    )


def ball_model():
    """A ball that translates and turns freely, frame "ball", beside a turntable, frame "table"."""
    model = pin.Model()
    inertia = pin.Inertia.FromSphere(1.0, 0.05)
    moves = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "ball_moves")
    turns = model.addJoint(moves, pin.JointModelSpherical(), pin.SE3.Identity(), "ball_turns")
    model.appendBodyToJoint(turns, inertia, pin.SE3.Identity())
    table = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "table_turns")
    model.appendBodyToJoint(table, inertia, pin.SE3.Identity())
    for name, joint in (("ball", turns), ("table", table)):
        model.addFrame(pin.Frame(name, joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return model


def ball_configuration(position, angle=0.0):
    """Configuration (8,) of `ball_model`: ball at `position` (3,), table turned by `angle`."""
    return np.concatenate((position, [0.0, 0.0, 0.0, 1.0], [angle]))


def contact_log(rows):
    """A contact log of dictionaries; what they leave out is filled in."""
    defaults = {
        "row": 0,
        "pair": 0,
        "t": 0.0,
        "point_world": np.zeros(3),
        "normal_world": np.array([0.0, 0.0, 1.0]),
        "depth": 1e-4,
        "normal_force": 1.0,
        "friction_force_world": np.zeros(3),
        "slip_velocity_world": np.zeros(3),
        "element": 0,
        "feature": 0,
    }
    filled = [{**defaults, **row} for row in rows]
    columns = {}
    for key, value in defaults.items():
        shape = (0, 3) if np.ndim(value) else (0,)
        columns[key] = (
            np.array([row[key] for row in filled])
            if filled
            else np.zeros(shape, dtype=np.asarray(value).dtype)
        )
    return SimpleNamespace(**columns)


def a_result(t, q, rows=(), pairs=("tip",), **energy):
    """A result at times `t` (n,) and configurations `q` (n, nq) with the contacts `rows`."""
    t = np.asarray(t, dtype=float)
    names = ("kinetic", "potential", "elastic", "damping_loss", "friction_loss", "control_work")
    audit = {name: np.zeros(len(t)) for name in (*names, "residual")}
    return SimpleNamespace(
        t=t,
        q=np.asarray(q, dtype=float),
        pairs=list(pairs),
        contacts=contact_log(rows),
        energy=SimpleNamespace(**{**audit, "exchanged": 1.0, **energy}),
        stats=RunStats(),
        scene=None,
        origin=None,
        patch_rows=None,
        sensors={},
    )


def a_scene(model, *pairs):
    """A scene of these pairs."""
    return SimpleNamespace(model=model, pairs=pairs)


def ball_on_plate(frames=61, dt=0.05):
    """A ball that comes down on a plate, slides over it and leaves; scene and result."""
    model = ball_model()
    scene = a_scene(model, contact_pair(model, "ball", 0.05, plate(), name="ball"))
    t = dt * np.arange(frames)
    configurations, rows = [], []
    for row, share in enumerate(np.linspace(0.0, 1.0, frames)):
        touching = 0.25 <= share <= 0.75
        height = 0.05 if touching else 0.05 + 0.6 * (abs(share - 0.5) - 0.25)
        position = np.array([-0.3 + 0.6 * share, 0.1, height])
        configurations.append(ball_configuration(position))
        if touching:
            rows.append(
                {
                    "row": row,
                    "t": t[row],
                    "point_world": position * [1, 1, 0],
                    "normal_force": 5.0 + np.sin(20.0 * share),
                    "friction_force_world": np.array([-1.5, 0.0, 0.0]),
                }
            )
    return scene, a_result(t, configurations, rows, ("ball",))
