"""What a run leaves behind as tables: the columns of its rows, contacts, events and energy."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import column
from sphshell_pin.dynamics.result.result_parts import PairSeries, patch_columns
from sphshell_pin.dynamics.scene.joint_components import joint_slides

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene

Columns = dict[str, ArrayLike]

# Joints with several coordinates: the units of q and of v.
_SEVERAL = {
    "JointModelFreeFlyer": (["m"] * 3 + ["1"] * 4, ["m/s"] * 3 + ["rad/s"] * 3),
    "JointModelPlanar": (["m", "m", "1", "1"], ["m/s", "m/s", "rad/s"]),
    "JointModelTranslation": (["m"] * 3, ["m/s"] * 3),
    "JointModelSpherical": (["1"] * 4, ["rad/s"] * 3),
    "JointModelSphericalZYX": (["rad"] * 3, ["rad/s"] * 3),
    "JointModelUniversal": (["rad"] * 2, ["rad/s"] * 2),
}


def coordinates(model: pin.Model) -> tuple[list[str], list[str]]:
    """Return the names of the columns of q (nq) and of v (nv), with their units.

    They are q.JOINT and v.JOINT, and of a joint with several numbers q.JOINT.0, q.JOINT.1, ...; a
    joint that turns without end has its cosine and sine in q.
    """
    in_q, in_v = [""] * model.nq, [""] * model.nv
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        kind = joint.shortname()
        if kind == "JointModelMimic":  # its coordinate is that of another joint
            continue
        if joint.nv == 1:
            slides = joint_slides(joint)
            of_q = ["1", "1"] if joint.nq == 2 else ["m" if slides else "rad"]
            of_v = ["m/s" if slides else "rad/s"]
        else:
            of_q, of_v = _SEVERAL.get(kind, ([""] * joint.nq, [""] * joint.nv))
        for names, units, letter, first in (
            (in_q, of_q, "q", joint.idx_q),
            (in_v, of_v, "v", joint.idx_v),
        ):
            for k, unit in enumerate(units):
                part = f"{letter}.{name}" if len(units) == 1 else f"{letter}.{name}.{k}"
                names[first + k] = column(part, unit)
    return in_q, in_v


def state_titles(result: Result, scene: Scene | None) -> tuple[list[str], list[str]]:
    """Return the `coordinates` of `scene`; without one q.0, q.1, ... and v.0, v.1, ..."""
    if scene is not None:
        return coordinates(scene.model)
    in_q, in_v = result.q.shape[1], result.v.shape[1]
    return [f"q.{k}" for k in range(in_q)], [f"v.{k}" for k in range(in_v)]


def row_columns(result: Result, scene: Scene | None) -> dict[str, Array]:
    """Return the rows as columns; see `Result.row_columns`."""
    in_q, in_v = state_titles(result, scene)
    columns = {column("t", "s"): result.t}
    columns |= dict(zip(in_q, result.q.T, strict=True))
    columns |= dict(zip(in_v, result.v.T, strict=True))
    for index in range(len(result.pairs)):
        pair = PairSeries.of(result, index)
        name = f"pairs.{pair.name}"
        columns[column(f"{name}.normal_force", "N")] = pair.normal
        columns[column(f"{name}.friction_force", "N")] = pair.friction
        for axis, values in zip("xyz", pair.force_world.T, strict=True):
            columns[column(f"{name}.force_{axis}", "N")] = values
        columns[column(f"{name}.depth", "m")] = pair.depth
    return columns


def contact_columns(result: Result) -> Columns:
    """Return the contact log as columns; see `Result.contact_columns`."""
    log = result.contacts
    columns: Columns = {column("t", "s"): log.t, "pair": [result.pairs[i] for i in log.pair]}
    columns |= _vector("point", "m", log.point_world) | _vector("normal", "1", log.normal_world)
    columns |= {column("depth", "m"): log.depth, column("normal_force", "N"): log.normal_force}
    columns |= _vector("friction_force", "N", log.friction_force_world)
    columns |= _vector("slip_velocity", "m/s", log.slip_velocity_world)
    columns |= {"element": log.element, "feature": log.feature, "number": log.contact_id}
    return columns | ({} if result.patch_rows is None else patch_columns(result.patch_rows))


def event_columns(result: Result) -> Columns:
    """Return the events as columns; see `Result.event_columns`."""
    return {
        column("t", "s"): np.array([event.t for event in result.events]),
        "pair": [event.pair for event in result.events],
        "kind": [event.kind for event in result.events],
    }


def energy_columns(result: Result) -> dict[str, Array]:
    """Return the energy audit as columns; see `Result.energy_columns`."""
    energy = result.energy
    columns = {column("t", "s"): result.t}
    columns |= {column(f.name, "J"): getattr(energy, f.name) for f in fields(energy)}
    return columns | {column("residual", "J"): energy.residual}


def _vector(name: str, unit: str, values: Array) -> Columns:
    return {column(f"{name}_{axis}", unit): values[:, k] for k, axis in enumerate("xyz")}
