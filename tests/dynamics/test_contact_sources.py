"""Contact points of one's own: a Python callable per pair feeds the same forces into a scene."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import CoulombFriction, RungeKutta4, Scene, SemiImplicitEuler, Simulation
from sphshell_pin.dynamics.scene.sides import SourceSide, SphereSide
from sphshell_pin.errors import SphshellError
from tests.models import add_body, ball, empty, free_q, linear_law, on_plate

RADIUS = 0.05
LAW = linear_law(4000.0, 20.0)
FRICTION = CoulombFriction(0.3, 0.1, 0.1, 1.0)


def plate_points(pose_i: pin.SE3, pose_j: pin.SE3):
    """What a ball of RADIUS in frame i touches of the plane z = 0 of frame j."""
    up = pose_j.rotation[:, 2]
    height = float(up @ (pose_i.translation - pose_j.translation))
    if height >= RADIUS:
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    return (pose_i.translation - height * up)[None], up[None], np.array([RADIUS - height])


def by_source(model: pin.Model, find=plate_points, friction=FRICTION) -> Scene:
    scene = Scene(model)
    scene.add_contact_source(find, "ball", "universe", LAW, friction, name="mine")
    return scene


START = free_q([0.1, -0.05, RADIUS + 0.01]), np.array([1.0, 0.3, -0.2, 10.0, -20.0, 5.0])


@pytest.mark.parametrize("friction", [None, FRICTION])
@pytest.mark.parametrize("integrator", [SemiImplicitEuler, RungeKutta4])
def test_a_source_that_mimics_the_plate_gives_the_same_run(integrator, friction) -> None:
    """Ball that bounces and skids: rounding apart, shell and source tell the same story."""
    scenes = on_plate(ball(), LAW, friction), by_source(ball(), friction=friction)
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
    frames = [pin.SE3.Random() for _ in range(2)]
    for name, frame in zip(("one", "two"), frames, strict=True):
        add_body(model, name, pin.JointModelFreeFlyer(), frame=frame)
    q = pin.integrate(model, pin.neutral(model), np.random.default_rng(0).normal(size=12))
    v = np.random.default_rng(1).normal(size=12)
    point, normal = np.array([0.3, 0.2, 0.1]), np.array([0.0, 0.6, 0.8])
    seen = []

    def find(pose_i: pin.SE3, pose_j: pin.SE3):
        seen.append((pin.SE3(pose_i), pin.SE3(pose_j)))
        return np.stack([point, -point]), np.stack([normal, normal]), np.array([0.01, 0.02])

    scene = Scene(model)
    scene.add_contact_source(find, "one", "two", linear_law(1000.0), None, name="gears")
    fext = scene.external_forces(q, v)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    for pose, name in zip(seen[0], ("one", "two"), strict=True):
        assert pose.isApprox(data.oMf[model.getFrameId(name)], 1e-12)
    world = [data.oMi[k].act(fext[k]).vector for k in (1, 2)]
    torque = np.cross(point, 10.0 * normal) + np.cross(-point, 20.0 * normal)
    assert world[0] == pytest.approx(np.concatenate([30.0 * normal, torque]), abs=1e-11)
    assert world[1] == pytest.approx(-world[0], abs=1e-12)
    contacts = scene.contacts(q, v)
    assert contacts.point_world == pytest.approx(np.stack([point, -point]), abs=1e-14)
    assert contacts.normal_force == pytest.approx([10.0, 20.0])


def test_source_beside_a_shell() -> None:
    """Both kinds of pairs in one scene: forces add."""
    q, v = free_q([0.0, 0.0, RADIUS - 0.002]), np.array([0.5, 0.0, -0.1, 0.0, 5.0, 0.0])
    shell, source = on_plate(ball(), LAW, FRICTION), by_source(ball())
    both = on_plate(ball(), LAW, FRICTION)
    both.add_contact_source(plate_points, "ball", "universe", LAW, FRICTION, name="mine")
    one, two, sum_ = (s.external_forces(q, v)[1].vector for s in (shell, source, both))
    assert one == pytest.approx(two, abs=1e-10)
    assert sum_ == pytest.approx(one + two, abs=1e-10)
    assert [type(p.side_i) for p in both.pairs] == [SphereSide, SourceSide]


def test_an_error_in_the_callable_comes_through() -> None:
    """The run stops and the user's own exception arrives, not a crash."""

    def broken(pose_i, pose_j):
        raise RuntimeError("teeth fell out")

    scene = by_source(ball(), broken)
    with pytest.raises(RuntimeError, match="teeth fell out") as caught:
        scene.external_forces(*START)
    (note,) = caught.value.__notes__
    assert "raised by contact source 'mine' with its frames at [0.1, -0.05, 0.06] m" in note
    assert "(test_contact_sources.py:broken, line " in note
    with pytest.raises(RuntimeError, match="teeth fell out"):
        Simulation(scene, SemiImplicitEuler(dt=1e-3)).run(*START, 0.01)


@pytest.mark.parametrize(
    "answer",
    [
        (np.zeros((1, 2)), np.zeros((1, 3)), np.zeros(1)),
        (np.zeros((2, 3)), np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros(1)),
        (np.full((1, 3), np.nan), np.array([[0.0, 0.0, 1.0]]), np.array([0.01])),
        None,
        (np.zeros((1, 3)),),
        (np.zeros(6), np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros(2)),
        (np.zeros((2, 3)), np.tile([0.0, 0.0, 1.0], 2), np.zeros(2)),
        (np.zeros((2, 3)), np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros((1, 2))),
        (np.zeros((1, 3), complex), np.array([[0.0, 0.0, 1.0]]), np.zeros(1)),
    ],
)
def test_a_wrong_answer_is_named(answer) -> None:
    scene = by_source(ball(), lambda pose_i, pose_j: answer)
    with pytest.raises(SphshellError, match="mine"):
        scene.external_forces(*START)
