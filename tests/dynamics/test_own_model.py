"""A scene is compiled with its model: a changed one is noticed, whatever was changed."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter
from tests.models import LAW, arm, ball, free_q, on_plate

Q = free_q([0.0, 0.0, 0.049])


def _set(name: str, value: object):
    return lambda model: setattr(model, name, value)


def _mass(value: float):
    return lambda model: setattr(model.inertias[1], "mass", value)


HERE, NOWHERE = pin.SE3.Identity(), pin.SE3(np.full((3, 3), np.nan), np.zeros(3))
DEADLY = {
    "parent": lambda model: model.parents.__setitem__(1, 7),
    "mass nan": _mass(np.nan),
    "placement nan": lambda model: model.jointPlacements.__setitem__(1, NOWHERE),
}
CHANGES = DEADLY | {
    "joint": lambda model: model.addJoint(1, pin.JointModelRX(), HERE, "new"),
    "no gravity": lambda model: setattr(model.gravity, "linear", np.zeros(3)),
    "mass": _mass(2.0),
    "frame": lambda model: model.addFrame(pin.Frame("new", 1, HERE, pin.FrameType.OP_FRAME)),
}
DEADLY["negative mass"] = _mass(-1.0)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("compiled", [False, True])
def test_a_changed_model_is_noticed(change: str, compiled: bool) -> None:
    scene = on_plate(ball(), LAW)
    simulation = sp.Simulation(scene)
    if compiled:
        scene.contacts(Q)
    varied = scene.with_pairs(scene.pairs)
    CHANGES[change](scene.model)
    for use in (
        lambda: scene.model,
        lambda: scene.external_forces(Q),
        lambda: scene.contacts(np.r_[Q, 0.3]),
        lambda: scene.contact_derivatives(Q),
        lambda: scene.explain(Q),
        lambda: simulation.run(Q, None, 0.01),
        lambda: simulation.rollout([Q] * 2, None, 0.01),
        lambda: varied.contacts(Q),
    ):
        with pytest.raises(InvalidParameter, match=r"scene\.model was changed"):
            use()


def test_an_untouched_model_is_one_object_and_equal_to_the_given_one() -> None:
    model = arm()
    scene = sp.Scene(model)
    assert scene.model is scene.model
    assert scene.model is not model
    assert scene.model == model
    CHANGES["joint"](model)
    assert len(scene.external_forces(pin.neutral(scene.model))) == scene.model.njoints


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        *((damage, "joint") for damage in DEADLY.values()),
        (lambda model: model.joints[1].setIndexes(1, 40, 40), "indices of joint"),
        (lambda model: model.joints[1].setIndexes(9, 0, 0), "indices of joint"),
        (lambda model: model.joints[1].setIndexes(1, -1, 0), "indices of joint"),
        (lambda model: model.nqs.__setitem__(1, 3), "indices of joint"),
        (lambda model: model.idx_vs.__setitem__(1, 40), "lists of indices"),
        (lambda model: model.subtrees[1].append(40), "supports or subtrees"),
        (lambda model: model.supports[1].append(40), "supports or subtrees"),
        (_set("armature", np.zeros(1)), "armature has 1 numbers, nv is 6"),
        (_set("lowerPositionLimit", np.zeros(1)), "lowerPositionLimit has 1 numbers, nq is 7"),
    ],
)
def test_a_model_that_pinocchio_would_not_survive_makes_no_scene(damage, said: str) -> None:
    model = ball()
    damage(model)
    with pytest.raises(InvalidParameter, match=said):
        sp.Scene(model)
