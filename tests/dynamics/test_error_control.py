"""Error-controlled runs: rows, held torques, kinks, and what the arguments may be."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests import models
from tests.models import run
from tests.programs import python

R = 0.05
ROOT = Path(__file__).parents[2]
CONTROLLED = [sp.Adaptive(1e-7), sp.Implicit(1e-6)]
every = models.every_integrator(1e-4, 1e-7, 1e-6)
both = pytest.mark.parametrize("integrator", CONTROLLED, ids=["Adaptive", "Implicit"])
BRISTLE = sp.BristleFriction(0.4, 0.3, 1e4, 20.0)


def bouncing() -> sp.Scene:
    return models.on_plate(models.ball(), models.linear_law(4000.0, 20.0), BRISTLE)


START = models.free_q([0.1, -0.05, R + 0.01]), np.array([1.0, 0.3, -0.2, 10.0, -20.0, 5.0])


@both
@pytest.mark.parametrize("record_dt", [1e-2, 1 / 300, 7e-4])
def test_rows_stand_at_exact_multiples(integrator, record_dt: float) -> None:
    t = run(bouncing(), integrator, *START, 0.2, record_dt=record_dt).t
    assert np.array_equal(t[:-1], np.arange(len(t) - 1) * record_dt)
    assert t[-1] == 0.2
    # One row in every interval, and no second one a round-off before the end.
    assert 1e-9 < t[-1] - t[-2] <= record_dt * (1 + 1e-12)


@both
def test_no_row_stands_a_round_off_before_the_end(integrator) -> None:
    # 2 / 30 in doubles lies below 0.0666666667, and 1e-3 k below some of its decimals.
    duration = np.nextafter(3 * 0.02, 1.0)
    t = run(sp.Scene(models.slider()), integrator, np.zeros(1), None, duration, record_dt=0.02).t
    assert len(t) == 4


@every
def test_recording_does_not_change_the_motion(integrator) -> None:
    whole = run(bouncing(), integrator, *START, 0.4)
    assert len(whole.events) > 2
    for record_dt in (1e-4, 3e-3, 5.0):
        rows = run(bouncing(), integrator, *START, 0.4, record_dt=record_dt)
        assert np.array_equal(rows.q[-1], whole.q[-1])
        assert np.array_equal(rows.v[-1], whole.v[-1])
        assert rows.events == whole.events
        for name in ("damping_loss", "friction_loss", "control_work"):
            assert getattr(rows.energy, name)[-1] == getattr(whole.energy, name)[-1]
        assert rows.stats.steps == whole.stats.steps


@both
def test_dense_rows_lie_on_the_motion(integrator) -> None:
    """Against a much finer run; the dense output is of order 4, or of 3 with Rodas."""
    rows = run(bouncing(), integrator, *START, 0.15, record_dt=1e-3)
    fine = run(bouncing(), sp.Adaptive(1e-11), *START, 0.15, record_dt=1e-3)
    assert np.array_equal(rows.t, fine.t)
    assert np.abs(rows.q - fine.q).max() < 2e-5
    assert np.abs(rows.v - fine.v).max() < 2e-3
    assert np.linalg.norm(rows.q[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-12)


@every
@pytest.mark.parametrize("t0", [0.0, 0.1, 3.7, 1e3])
def test_held_torques(integrator, t0: float) -> None:
    """Called once a period, held in between: the speed is the sum of what was given."""
    calls = []

    def controller(t, q, v, contacts):
        calls.append((t, float(v[0])))
        return np.array([float(len(calls))])

    scene = sp.Scene(models.slider(gravity=0.0, mass=2.0))
    rows = run(scene, integrator, [0.0], None, 0.1, controller=controller, control_dt=7e-3, t0=t0)
    periods = np.arange(15)
    assert [t for t, _ in calls] == pytest.approx(t0 + 7e-3 * periods, abs=1e-12)
    speeds = 7e-3 * np.cumsum(periods) / 2.0
    assert [v for _, v in calls] == pytest.approx(speeds, abs=1e-10)
    assert rows.v[-1, 0] == pytest.approx(speeds[-1] + (0.1 - 14 * 7e-3) * 15 / 2.0, abs=1e-10)


FAR = """
import sys
sys.path.insert(0, {root!r})
import numpy as np
import sphshell_pin as sp
from tests import models
way = np.array([[0.3, 0.0, 0.3], [0.3, 0.05, 0.3], [0.3, 0.05, 0.35]])
for integrator in (sp.Adaptive(), sp.Implicit()):
    calls = []
    def hold(t, q, v, contacts):
        calls.append(t)
        return np.zeros(1)
    sp.Simulation(sp.Scene(models.slider()), integrator).run([0.0], None, 0.02, hold, 1e-3, t0=1e6)
    assert len(calls) == 20, len(calls)
    print("held", flush=True)
    impedance = sp.CartesianImpedance("ball", way, 100.0, 10.0, speed=0.5, lead_in=0.42)
    sp.Simulation(sp.Scene(models.arm()), integrator).run(
        models.ARM_Q, None, 0.6, impedance, t0=0.09)
    print("kink", flush=True)
"""


def test_round_off_of_time_does_not_hang_the_run() -> None:
    """0.09 + (0.42 - 0.09) < 0.42, and 1e6 + k 1e-3 is off by more than 1e-9 of the period."""
    said = python(FAR.format(root=str(ROOT)))
    assert said.stdout.split() == ["held", "kink"] * 2, said.stderr


@both
def test_path_kinks(integrator) -> None:
    """A path's corners are met by a step: the same motion as with a tolerance far finer."""
    way = np.array([[0.3, 0.0, 0.3], [0.3, 0.05, 0.3], [0.3, 0.05, 0.35]])
    impedance = sp.CartesianImpedance("ball", way, 100.0, 10.0, speed=0.5, lead_in=0.1)
    scene = sp.Scene(models.arm())
    rows = run(scene, integrator, models.ARM_Q, None, 0.5, controller=impedance)
    fine = run(scene, sp.Adaptive(1e-11), models.ARM_Q, None, 0.5, controller=impedance)
    assert rows.q[-1] == pytest.approx(fine.q[-1], abs=2e-6)
    for kink in (0.1, 0.2, 0.3):
        assert np.abs(rows.t - kink).min() < 1e-15
    assert rows.stats.steps < 4000


@both
def test_a_callable_is_asked_at_stages(integrator) -> None:
    """A spring of one's own, at every stage: cos(w t) to the tolerance."""
    scene = sp.Scene(models.slider(gravity=0.0, mass=2.0))
    rows = run(scene, integrator, [0.1], None, 1.0, controller=lambda t, q, v, c: -50.0 * q)
    assert rows.q[-1, 0] == pytest.approx(0.1 * np.cos(5.0), abs=1e-5)
    # Five radians of a cosine: a method of order 4 takes a hundred steps or two.
    assert rows.stats.steps < 1000


@pytest.mark.parametrize("turn", [(0, 0, 0), (0, 0, 1.0), (0.5, 0, 0), (0, 1.5, 0.3)])
def test_bristles_of_a_source_hold_whatever_its_frames(turn) -> None:
    """The same plane on a frame turned any way: F / k stretches the bristle, and it sticks."""
    model = models.block()
    base = pin.SE3(pin.utils.rpyToMatrix(*turn), np.zeros(3))
    model.addFrame(pin.Frame("base", 0, 0, base, pin.FrameType.OP_FRAME))
    model.gravity.linear = np.array([2.0, 1.0, -9.81])
    scene = sp.Scene(model)

    def find(pose_i, pose_j):
        x, y, z = pose_i.translation
        return [[x, y, 0.0]], [[0.0, 0.0, 1.0]], [R - z]

    law, friction = models.linear_law(1e5, 300.0), sp.BristleFriction(0.6, 0.6, 1e5, 300.0)
    scene.add_contact_source(find, "ball", "base", law, friction, name="plane")
    rows = run(scene, sp.Implicit(1e-6), [0.0, 0.0, R - 9.81e-5], None, 0.2)
    assert rows.q[-1, :2] == pytest.approx([2e-5, 1e-5], rel=1e-3)


def zoo() -> sp.Scene:
    """Free flyer on a chain of a planar, a spherical and a composite joint; the tip touches."""
    model, parent = models.empty(), 0
    lump = pin.Inertia(1.0, np.array([0.02, 0.01, 0.03]), np.diag([0.02, 0.03, 0.04]))
    out = pin.SE3(np.eye(3), np.array([0.05, 0.02, 0.1]))
    mixed = pin.JointModelComposite(pin.JointModelRX())
    mixed.addJoint(pin.JointModelRUBY(), pin.SE3(np.eye(3), np.array([0.0, 0.03, 0.0])))
    kinds = pin.JointModelFreeFlyer(), pin.JointModelPlanar(), pin.JointModelSpherical(), mixed
    for name, joint in zip(("a", "b", "c", "ball"), kinds, strict=True):
        parent = models.add_body(model, name, joint, parent, placement=out, inertia=lump)
    return models.on_shell(model, models.square(20), models.linear_law(1e4, 20.0), BRISTLE)


def test_all_kinds_of_joints_agree() -> None:
    scene, rng = zoo(), np.random.default_rng(3)
    q = pin.integrate(scene.model, pin.neutral(scene.model), rng.uniform(-0.4, 0.4, scene.model.nv))
    q[2] += R - 2e-3 - models.pose_of(scene.model, q, "ball").translation[2]
    v = rng.uniform(-2.0, 2.0, scene.model.nv)
    explicit = run(scene, sp.Adaptive(1e-11), q, v, 0.1)
    implicit = run(scene, sp.Implicit(1e-9), q, v, 0.1)
    assert len(explicit.contacts.depth) > 10
    apart = pin.difference(scene.model, explicit.q[-1], implicit.q[-1])
    assert np.abs(apart).max() < 1e-7
    assert np.abs(explicit.energy.residual).max() < 1e-7 * explicit.energy.exchanged


@both
def test_a_start_in_touch_and_at_rest(integrator) -> None:
    q = models.free_q([0.0, 0.0, R - 9.81 / 4000.0])
    rows = run(bouncing(), integrator, q, None, 2.0)
    assert [(e.t, e.kind) for e in rows.events] == [(0.0, "touch")]
    assert rows.q[-1] == pytest.approx(q, abs=1e-9)
    assert rows.stats.steps < 3000
