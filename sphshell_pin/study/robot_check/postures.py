"""Legal random postures, and joints that no forward dynamics can move."""

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.dynamics.scene.models import mass_matrix, reduced_model
from sphshell_pin.testing.forces import joint_names

# Below this, of mass matrices with a unit diagonal, rounding decides the accelerations.
_SINGULAR = 1e-9


def random_posture(model: pin.Model, rng: np.random.Generator) -> Array:
    """Return a random configuration (nq,) within the joints' limits.

    Where a joint has none (or more than a turn) it lies within half a turn [rad] or half a meter of
    its neutral place; free bodies are turned anyhow within half a meter of the origin.
    """
    move = np.zeros(model.nv)
    limited: list[tuple[int, float]] = []
    for joint in list(model.joints)[1:]:
        span = slice(joint.idx_v, joint.idx_v + joint.nv)
        if joint.nq == joint.nv:
            for k in range(joint.nq):
                low, high = (
                    float(limit[joint.idx_q + k])
                    for limit in (model.lowerPositionLimit, model.upperPositionLimit)
                )
                widest = 0.5 if joint_slides(joint) else np.pi
                low, high = max(low, -widest), min(high, widest)
                # Limits that leave nothing within the widest range, or none at all, are as given.
                value = rng.uniform(low, high) if low < high else 0.5 * (low + high)
                limited.append((joint.idx_q + k, value))
        elif joint.shortname() == "JointModelPlanar":
            move[span] = (*rng.uniform(-0.5, 0.5, 2), rng.uniform(-np.pi, np.pi))
        elif joint.shortname() == "JointModelFreeFlyer":
            move[span] = (*rng.uniform(-0.5, 0.5, 3), *_turn(rng))
        else:
            move[span] = rng.uniform(-np.pi, np.pi, joint.nv) if joint.nv != 3 else _turn(rng)
    q = np.array(pin.integrate(model, pin.neutral(model), move))
    for k, value in limited:
        q[k] = value
    return q


def massless_joints(model: pin.Model, postures: list[Array]) -> list[str]:
    """Return the joints to hold so that forward dynamics has an answer at one of `postures`.

    First those that move no mass or inertia at all; then, as long as it is needed, the last one on
    its limb that the bodies behind it cannot slow down.
    """
    names = joint_names(model)
    least = np.max([np.diag(mass_matrix(model, q)) for q in postures], axis=0)
    light = least <= 1e-14 * least.max(initial=0.0)
    held = list(dict.fromkeys(name for name, bare in zip(names, light, strict=True) if bare))
    while len(held) < model.njoints - 1:
        rest = reduced_model(model, tuple(held), postures[0]) if held else model
        keep = [k for k, name in enumerate(names) if name not in held]
        space = [_pivots(rest, _kept(model, rest, q)) for q in postures]
        shares = np.max(space, axis=0)
        weak = np.flatnonzero(~(shares > _SINGULAR))
        if not len(weak):
            break
        held.append(names[keep[int(weak[-1])]])
    return held


def regularity(model: pin.Model, q: Array) -> float:
    """Return how far the mass matrix at q (nq,) is from singular: 0 if it is, 1 if diagonal."""
    pivots = _pivots(model, q)
    return float(pivots.min(initial=1.0)) if np.isfinite(pivots).all() else 0.0


def _pivots(model: pin.Model, q: Array) -> Array:
    """Return by what ABA divides (nv,): the inertia at each joint, other joints free to yield.

    Relative to that with the other joints held.
    """
    mass = mass_matrix(model, q)
    held = np.diag(mass).copy()
    # M = U D U^T, from the last velocity on; Pinocchio's own has no mimic joints.
    with np.errstate(divide="ignore", invalid="ignore"):
        for k in range(model.nv - 1, 0, -1):
            mass[:k, :k] -= np.outer(mass[:k, k], mass[:k, k]) / mass[k, k]
        return np.asarray(np.diag(mass) / held)


def _kept(model: pin.Model, rest: pin.Model, q: Array) -> Array:
    """Return of q (nq,) of `model` what the joints of its part `rest` have."""
    parts = [
        q[joint.idx_q : joint.idx_q + joint.nq]
        for joint in (model.joints[model.getJointId(name)] for name in list(rest.names)[1:])
    ]
    return np.concatenate([np.zeros(0), *parts])


def _turn(rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    return np.asarray(axis / np.linalg.norm(axis) * rng.uniform(0.0, np.pi))
