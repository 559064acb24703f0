"""Contact points of one's own: a Python callable per pair feeds the same forces into a scene."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import RungeKutta4, Scene, SemiImplicitEuler, Simulation
from sphshell_pin.errors import SphshellError
from tests.models import FRICTION, LAW, add_body, ball, empty, free_q, linear_law, on_plate, pose_of

RADIUS = 0.05


def plate_points(pose_i: pin.SE3, pose_j: pin.SE3):
    """What a ball of RADIUS in frame i touches of the plane z = 0 of frame j."""
    up = pose_j.rotation[:, 2]
    height = float(up @ (pose_i.translation - pose_j.translation))
    if height >= RADIUS:
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    return (pose_i.translation - height * up)[None], up[None], np.array([RADIUS - height])


def by_source(find=plate_points, friction=FRICTION) -> Scene:
    scene = Scene(ball())
    scene.add_contact_source(find, "ball", "universe", LAW, friction, name="mine")
    return scene


START = free_q([0.1, -0.05, RADIUS + 0.01]), np.array([1.0, 0.3, -0.2, 10.0, -20.0, 5.0])


@pytest.mark.parametrize("friction", [None, FRICTION])
@pytest.mark.parametrize("integrator", [SemiImplicitEuler, RungeKutta4])
def test_a_source_that_mimics_the_plate_gives_the_same_run(integrator, friction) -> None:
    """Ball that bounces and skids: rounding apart, shell and source tell the same story."""
    scenes = on_plate(ball(), LAW, friction), by_source(friction=friction)
    a, b = (Simulation(s, integrator(dt=2e-4)).run(*START, 0.3) for s in scenes)
    assert np.array_equal(a.t, b.t)
    assert b.q == pytest.approx(a.q, abs=1e-10)
    assert b.v == pytest.approx(a.v, abs=1e-9)
    assert len(a.contacts.depth) == len(b.contacts.depth) > 0
    assert b.contacts.normal_force == pytest.approx(a.contacts.normal_force, abs=1e-6)
    assert [e.kind for e in a.events] == [e.kind for e in b.events]
    assert list(b.pairs) == ["mine"]


def test_source_between_two_moving_bodies() -> None:
    """Equal and opposite, at one point, with the poses of the frames it was given."""
    model = empty(gravity=0.0)
    for name in ("one", "two"):
        add_body(model, name, pin.JointModelFreeFlyer(), frame=pin.SE3.Random())
    q = pin.integrate(model, pin.neutral(model), np.random.default_rng(0).normal(size=12))
    point, normal, seen = np.array([0.3, 0.2, 0.1]), np.array([0.0, 0.6, 0.8]), []

    def find(*poses: pin.SE3):
        seen.append([pin.SE3(pose) for pose in poses])
        return [point, -point], [normal, normal], [0.01, 0.02]

    scene = Scene(model)
    scene.add_contact_source(find, "one", "two", linear_law(1000.0), None, name="gears")
    fext = scene.external_forces(q, np.random.default_rng(1).normal(size=12))
    wrenches = []
    for k, name in enumerate(("one", "two")):
        assert seen[0][k].isApprox(pose_of(model, q, name), 1e-12)
        wrenches.append(pose_of(model, q, f"{name}_joint").act(fext[k + 1]).vector)
    torque = np.cross(point, 10.0 * normal) + np.cross(-point, 20.0 * normal)
    assert wrenches[0] == pytest.approx(np.concatenate([30.0 * normal, torque]), abs=1e-11)
    assert wrenches[1] == pytest.approx(-wrenches[0], abs=1e-12)
    contacts = scene.contacts(q)
    assert contacts.point_world == pytest.approx(np.stack([point, -point]), abs=1e-14)
    assert contacts.normal_force == pytest.approx([10.0, 20.0])


def test_an_error_in_the_callable_comes_through() -> None:
    """The run stops and the user's own exception arrives, not a crash."""

    def broken(pose_i, pose_j):
        raise RuntimeError("teeth fell out")

    scene = by_source(broken)
    with pytest.raises(RuntimeError, match="teeth fell out") as caught:
        scene.external_forces(*START)
    (note,) = caught.value.__notes__
    assert "raised by contact source 'mine' with its frames at [0.1, -0.05, 0.06] m" in note
    assert "(test_contact_sources.py:broken, line " in note
    with pytest.raises(RuntimeError, match="teeth fell out"):
        Simulation(scene, SemiImplicitEuler(dt=1e-3)).run(*START, 0.01)


UP = np.array([[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    "answer",
    [
        (np.zeros((1, 2)), np.zeros((1, 3)), np.zeros(1)),
        (np.zeros((2, 3)), np.tile(UP, (2, 1)), np.zeros(1)),
        (np.full((1, 3), np.nan), UP, np.array([0.01])),
        None,
        (np.zeros((1, 3)),),
        (np.zeros(6), np.tile(UP, (2, 1)), np.zeros(2)),
        (np.zeros((2, 3)), np.tile(UP[0], 2), np.zeros(2)),
        (np.zeros((2, 3)), np.tile(UP, (2, 1)), np.zeros((1, 2))),
        (np.zeros((1, 3), complex), UP, np.zeros(1)),
    ],
)
def test_a_wrong_answer_is_named(answer) -> None:
    with pytest.raises(SphshellError, match="mine"):
        by_source(lambda pose_i, pose_j: answer).external_forces(*START)
