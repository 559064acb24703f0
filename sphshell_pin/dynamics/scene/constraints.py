"""Contacts as constraints of Pinocchio's own solvers."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts
from sphshell_pin.dynamics.scene.sides import PlaneSide


@dataclass(frozen=True, repr=False)
class ContactConstraints(Summarized):
    """The k contacts of a scene for Pinocchio's solvers of constraints.

    `models` are k pinocchio.PointContactConstraintModel: joint 1 carries the shell, joint 2 the
    sphere, at the closest points of both, with z along the normal and the pair's coefficient of
    static friction (0 without friction). `depth` (k,) [m] is how far they overlap, `compliance`
    (k,) [m/N] the inverse slope of the pair's law at that depth, `pair` (k,) the scene's pair.

    Solvers of impulses (pinocchio.ADMMConstraintSolver, PGSConstraintSolver) take a compliance in
    1/kg, that is `compliance` / dt^2, and the overlap as a velocity, `depth` / dt.
    """

    models: list[pin.PointContactConstraintModel]
    depth: Array
    compliance: Array
    pair: Ints

    def _facts(self) -> list[Fact]:
        return [Fact("contacts", len(self.models))]


def constraints_of(
    model: pin.Model, pairs: tuple[ContactPair, ...], q: Array, contacts: SceneContacts
) -> ContactConstraints:
    """Return the constraints of `contacts`, which are those of `pairs` at q (nq,)."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    models, compliance = [], []
    columns = contacts.pair, contacts.point_world, contacts.normal_world, contacts.depth
    for k, point, normal, depth in zip(*columns, strict=True):
        pair = pairs[k]
        # The point is on the shell, or on the plane, which has the part of the sphere.
        on_shell = pin.SE3(_frame(normal), point)
        on_sphere = pin.SE3(on_shell.rotation, point - depth * normal)
        if isinstance(pair.side_i, PlaneSide):
            on_shell, on_sphere = pin.SE3(on_shell.rotation, point + depth * normal), on_shell
        ends = (pair.joint_j, on_shell), (pair.joint_i, on_sphere)
        placed = [one for joint, at in ends for one in (joint, data.oMi[joint].actInv(at))]
        made = pin.PointContactConstraintModel(model, *placed)
        made.setFriction(pair.friction.largest_coefficient if pair.friction else 0.0)
        models.append(made)
        stiffness = pair.plane_law.normal_stiffness(float(depth))
        compliance.append(1.0 / stiffness if stiffness > 0.0 else np.inf)
    return ContactConstraints(models, contacts.depth, np.array(compliance), contacts.pair)


def _frame(normal: Array) -> Array:
    """Return a rotation (3, 3) whose z is `normal`."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(normal, x), normal))
