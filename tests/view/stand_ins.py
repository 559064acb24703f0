"""Scenes and results made by hand: any contact log, no dynamics, known answers."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.dynamics.result.result_parts import ContactLog
from sphshell_pin.dynamics.result.run_stats import RunStats
from tests import meshes, models


def plate(size=1.0, name="plate"):
    """A square plate at z = 0."""
    return sp.Shell(*meshes.grid_plate(size=size, quads=True), name=name)


def contact_pair(
    model, frame, radius, shell, shell_frame="universe", placement=None, name="tip", friction=None
):
    """One sphere at a frame against one shell."""
    ends = sp.Sphere(radius, frame), shell, shell_frame, placement
    more = {"law": sp.ImpactLaw(1e4), "friction": friction, "method": "facets", "name": name}
    return sp.Scene(model).add_contact(*ends, **more)


def ball_model():
    """A ball that translates and turns freely, frame "ball", beside a turntable, frame "table"."""
    model = models.ball()
    models.add_body(model, "table", pin.JointModelRZ())
    return model


def ball_configuration(position=(0.0, 0.0, 0.0), angle=0.0):
    """Configuration (8,) of `ball_model`: ball at `position` (3,), table turned by `angle`."""
    return np.concatenate((position, [0.0, 0.0, 0.0, 1.0], [angle]))


def contact_log(rows):
    """A contact log of dictionaries; what they leave out is filled in."""
    zero, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
    defaults = dict.fromkeys(("row", "pair", "element", "feature", "contact_id"), 0)
    defaults |= {"t": 0.0, "point_world": zero, "normal_world": up, "depth": 1e-4}
    defaults |= {"normal_force": 1.0, "friction_force_world": zero, "slip_velocity_world": zero}
    # One row more gives every column its shape and kind.
    filled = [{**defaults, **row} for row in (*rows, {})]
    return ContactLog(**{key: np.array([row[key] for row in filled])[:-1] for key in defaults})


def a_result(t, q, rows=(), pairs=("tip",), **energy):
    """A result at times `t` (n,) and configurations `q` (n, nq) with the contacts `rows`."""
    t = np.asarray(t, dtype=float)
    names = ("kinetic", "potential", "elastic", "damping_loss", "friction_loss", "control_work")
    audit = {name: np.zeros(len(t)) for name in (*names, "residual")} | {"exchanged": 1.0}
    made = {"t": t, "q": np.asarray(q, dtype=float), "pairs": list(pairs), "stats": RunStats()}
    made |= {"contacts": contact_log(rows), "energy": SimpleNamespace(**audit | energy)}
    return SimpleNamespace(**made, scene=None, origin=None, patch_rows=None, sensors={})


def a_scene(model, *pairs):
    """A scene of these pairs."""
    return SimpleNamespace(model=model, pairs=pairs)


def ball_scene(shell=None, *more, names=("tip",)):
    """The ball of `ball_model` and a shell, a plate by default, in as many pairs as names."""
    model, shell = ball_model(), shell or plate()
    pairs = (contact_pair(model, "ball", 0.05, shell, *more, name=name) for name in names)
    return a_scene(model, *pairs)


def ball_on_plate(frames=61, dt=0.05):
    """A ball that comes down on a plate, slides over it and leaves; scene and result."""
    t = dt * np.arange(frames)
    configurations, rows = [], []
    for row, share in enumerate(np.linspace(0.0, 1.0, frames)):
        x, height = -0.3 + 0.6 * share, 0.05 + 0.6 * max(abs(share - 0.5) - 0.25, 0.0)
        configurations.append(ball_configuration([x, 0.1, height]))
        if 0.25 <= share <= 0.75:
            force = {"normal_force": 5.0 + np.sin(20.0 * share), "point_world": [x, 0.1, 0.0]}
            rows.append({"row": row, "t": t[row], "friction_force_world": [-1.5, 0, 0], **force})
    return ball_scene(names=["ball"]), a_result(t, configurations, rows, ("ball",))
