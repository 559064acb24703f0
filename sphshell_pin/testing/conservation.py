"""What a run must keep: momentum of a closed system, and energy; measured with Pinocchio."""

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result, Scene
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.testing.finding import Finding


def momentum(result: Result) -> Finding:
    """Measure how far the momentum of all bodies of a closed system strays from that at the start.

    Closed: no gravity, no controller, and every joint at the root a free-flyer. The error is the
    largest change, over the recorded rows, of the linear momentum relative to the impulse of the
    contacts, and of the angular momentum about their middle relative to that impulse at the
    farthest body.

    Raises InvalidParameter if the system is not closed, or the run touched nothing: the measure
    would say nothing.
    """
    scene = scene_of(result)
    _check_closed(scene, result)
    model, data = scene.model, scene.model.createData()
    impulse = sum(one.impulse for one in result.stats.pairs.values())
    if not len(result.contacts) or impulse <= 0.0:
        raise InvalidParameter("result", "a run", "must have contacts: nothing touched in it")
    middle = result.contacts.point_world.mean(axis=0)
    rows = []
    for q, v in zip(result.q, result.v, strict=True):
        about_mass = pin.computeCentroidalMomentum(model, data, q, v)
        linear, lever = np.array(about_mass.linear), data.com[0] - middle
        rows.append(np.append(linear, about_mass.angular + np.cross(lever, linear)))
    bodies = [data.oMi[joint].translation for joint in range(1, model.njoints)]
    reach = float(np.linalg.norm(np.array(bodies) - middle, axis=1).max())
    change = np.array(rows) - rows[0]
    shares = np.linalg.norm(change.reshape(-1, 2, 3), axis=2) / (impulse * np.array([1.0, reach]))
    k = int(np.argmax(shares.max(axis=1)))
    where = (
        f"at t = {result.t[k]:.6g} s the linear momentum is off by "
        f"{np.linalg.norm(change[k, :3]):.3g} N s and the angular by "
        f"{np.linalg.norm(change[k, 3:]):.3g} N m s; the contacts' impulse is {impulse:.6g} N s"
    )
    return Finding(float(shares[k].max()), where)


def energy(result: Result) -> Finding:
    """Measure energy that appeared from nowhere, relative to the energy that changed form.

    Kinetic and potential energy are computed anew, by Pinocchio; what contacts store and lose and
    the controller's work are those of `result.energy`. The error is the largest over the recorded
    rows.
    """
    scene = scene_of(result)
    audit = result.energy
    lost = audit.elastic, audit.damping_loss, audit.friction_loss, -audit.control_work
    return _residual(result, np.array([*_energies(scene, result), *lost]))


def elastic_energy(result: Result) -> Finding:
    """Measure energy that appeared from nowhere in a run without any loss.

    The contacts store law.energy(depth) at the depths that were recorded; kinetic and
    potential energy are Pinocchio's. Nothing of `result.energy` is used.

    Raises InvalidParameter if a contact has damping or friction, or if there was a controller.
    """
    scene = scene_of(result)
    stored = np.zeros(len(result.t))
    for k, pair in enumerate(scene.pairs):
        law = pair.law
        if law.has_damping or pair.friction is not None or result.energy.control_work.any():
            raise InvalidParameter(
                "result", pair.name, "must be a contact without damping, friction and controller"
            )
        log = result.contacts.of_pair(k)
        each = np.array([law.energy(depth) for depth in log.depth])
        np.add.at(stored, log.row, np.where(log.normal_force < 0.0, -each, each))
    return _residual(result, np.array([*_energies(scene, result), stored]))


def _energies(scene: Scene, result: Result) -> tuple[Array, Array]:
    model, data = scene.model, scene.model.createData()
    rows = list(zip(result.q, result.v, strict=True))
    kinetic = [kinetic_energy(model, q, v) for q, v in rows]
    potential = [_potential_energy(model, data, q) for q, _ in rows]
    return np.array(kinetic), np.array(potential)


def kinetic_energy(model: pin.Model, q: Array, v: Array) -> float:
    """Return the kinetic energy [J].

    Pinocchio's function refuses mimic joints, and leaves out the armature of joints about a skew
    axis.
    """
    return 0.5 * float(v @ mass_matrix(model, q) @ v)


def _potential_energy(model: pin.Model, data: pin.Data, q: Array) -> float:
    if not len(model.mimicking_joints):
        return float(pin.computePotentialEnergy(model, data, q))
    center = np.array(pin.centerOfMass(model, data, q))
    return -float(data.mass[0] * (model.gravity.linear @ center))


def _residual(result: Result, parts: Array) -> Finding:
    """Compare the sum of the rows of `parts` (k, n) [J] with that at the start."""
    total = parts.sum(axis=0)
    exchanged = 0.5 * float(np.abs(np.diff(parts, axis=1)).sum())
    off = np.abs(total - total[0])
    k = int(np.argmax(off))
    where = (
        f"at t = {result.t[k]:.6g} s, {total[k] - total[0]:.3g} J too much; "
        f"{exchanged:.6g} J changed form in the run"
    )
    return Finding(float(off[k]) / exchanged if exchanged > 0.0 else float(off[k]), where)


def scene_of(result: object) -> Scene:
    """Return the scene of a run; InvalidParameter for a result that was loaded."""
    if not isinstance(result, Result):
        raise InvalidParameter("result", type(result).__name__, "must be a sphshell_pin.Result")
    if result.scene is None:
        raise InvalidParameter(
            "result", "a loaded result", "must know its scene: take what Simulation.run returned"
        )
    return result.scene


def _check_closed(scene: Scene, result: Result) -> None:
    model = scene.model
    if np.abs(model.gravity.vector).max() > 0.0:
        raise InvalidParameter("scene.model.gravity", model.gravity.linear.tolist(), "must be zero")
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0 and model.joints[joint].shortname() != "JointModelFreeFlyer":
            raise InvalidParameter(
                "scene.model", model.names[joint], "must be a free-flyer: the world holds it"
            )
    for pair in scene.pairs:
        if 0 in (pair.joint_i, pair.joint_j):
            raise InvalidParameter("scene", pair.name, "must not touch the universe")
    if result.energy.control_work.any():
        raise InvalidParameter("result", "a run with a controller", "must have none")
