"""What the panel of a recording knows of its run: curves, cameras, and where the contact is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.view.camera import ASPECT, FIELD_OF_VIEW, View
from sphshell_pin.view.curves import run_curves
from sphshell_pin.view.meshes import pack_numbers
from sphshell_pin.view.nodes import Json

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.view.contact_path import ContactRows

CLOSE = 8.0  # radii of the sphere around it that a close-up shows, at least


def run_panel(
    result: Result,
    scene: Scene,
    contacts: ContactRows,
    count: int,
    frames: Array,
    views: Mapping[str, View],
) -> Json:
    """Return the page's command "panel" for the first `count` rows of `result`.

    `frames` (f, nq) are the configurations of the page's frames, `views` its cameras.
    """
    return {
        "type": "panel",
        "path": "",
        "aspect": ASPECT,
        "views": {
            name: {"eye": one.eye.tolist(), "target": one.target.tolist()}
            for name, one in views.items()
        },
        "focus": _focus(scene, contacts, frames),
        "curves": [one.packed() for one in run_curves(result, count)],
    }


def _focus(scene: Scene, contacts: ContactRows, frames: Array) -> Json | None:
    """Describe the way of the tip: `points` (f, 3) [m], and the `distance` [m] of a close-up.

    It is the mean of the centers of the spheres, each weighted by what its pair pressed in total,
    so that it does not jump where one contact ends and another begins. None without spheres.
    """
    pressed = np.zeros(len(scene.pairs))
    np.add.at(pressed, contacts.pair, np.maximum(contacts.normal_force, 0.0))
    if not pressed.any():
        pressed = np.ones(len(scene.pairs))
    parts = [
        (one, weight / len(pair.spheres))
        for pair, weight in zip(scene.pairs, pressed, strict=True)
        for one in pair.spheres
        if weight > 0.0
    ]
    if not parts:
        return None
    shares = np.array([weight for _, weight in parts])
    shares /= shares.sum()
    model, data = scene.model, scene.model.createData()
    points, spread = np.empty((len(frames), 3)), 0.0
    for frame, q in enumerate(frames):
        pin.forwardKinematics(model, data, q)
        centers = np.array([data.oMi[one.joint].act(one.in_joint.translation) for one, _ in parts])
        points[frame] = shares @ centers
        if contacts.row.size:
            # The root of the mean square: a sphere that hardly pressed does not count.
            squares = np.sum((centers - points[frame]) ** 2, axis=1)
            spread = max(spread, float(np.sqrt(shares @ squares)))
    radius = float(shares @ np.array([one.radius for one, _ in parts]))
    half = 1.5 * spread + CLOSE * radius
    return {
        "points": pack_numbers(points.reshape(-1), exact=False),
        "distance": float(half / np.tan(np.deg2rad(0.5 * FIELD_OF_VIEW))),
    }
