"""Error-controlled runs: rows, held torques, kinks; touch, lift-off and what they cost."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests import models
from tests.models import run
from tests.programs import python
from tests.texts import DATA

R = 0.05
CONTROLLED = [sp.Adaptive(1e-7), sp.Implicit(1e-6)]
every = models.every_integrator(1e-4, 1e-7, 1e-6)
both = pytest.mark.parametrize("integrator", CONTROLLED, ids=["Adaptive", "Implicit"])
BRISTLE = sp.BristleFriction(0.4, 0.3, 1e4, 20.0)


def bouncing() -> sp.Scene:
    return models.on_plate(models.ball(), models.linear_law(4000.0, 20.0), BRISTLE)


START = models.free_q([0.1, -0.05, R + 0.01]), np.array([1.0, 0.3, -0.2, 10.0, -20.0, 5.0])


# 2 / 30 in doubles lies below 0.0666666667, and 1e-3 k below some of its decimals.
BEYOND = np.nextafter(3 * 0.02, 1.0)


@both
@pytest.mark.parametrize(
    ("duration", "record_dt"), [(0.2, 1e-2), (0.2, 1 / 300), (0.2, 7e-4), (BEYOND, 0.02)]
)
def test_rows_stand_at_exact_multiples(integrator, duration: float, record_dt: float) -> None:
    t = run(bouncing(), integrator, *START, duration, record_dt=record_dt).t
    assert np.array_equal(t[:-1], np.arange(len(t) - 1) * record_dt)
    assert t[-1] == duration
    # One row in every interval, and no second one a round-off before the end.
    assert 1e-9 < t[-1] - t[-2] <= record_dt * (1 + 1e-12)


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


@both
def test_a_step_cut_short_leaves_the_next_as_long_as_it_was_to_be(integrator) -> None:
    """An arm swings; the periods of a held torque end steps, and each costs no more than one."""
    scene, periods = sp.Scene(models.arm()), 40
    hold = {"controller": lambda *_: np.zeros(3), "control_dt": 2.0 / periods}
    free, held = (run(scene, integrator, models.ARM_Q, None, 2.0, **more) for more in ({}, hold))
    assert held.stats.steps <= free.stats.steps + periods


def test_round_off_of_time_does_not_hang_the_run() -> None:
    """0.09 + (0.42 - 0.09) < 0.42, and 1e6 + k 1e-3 is off by more than 1e-9 of the period."""
    said = python(FAR, cwd=DATA.parents[1])
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


DROP = 0.05
# Evaluations of an accepted step and of one that is tried again.
STEP = {sp.Adaptive: 7, sp.Implicit: 8}
LAWS = {
    "linear": models.linear_law(4000.0),
    "damped": models.linear_law(4000.0, 1.0),
    "hertz": sp.ImpactLaw(1e6, 1.5),
    "hunt-crossley": sp.HuntCrossleyLaw(1e6, 1.5, 0.2),
}
tolerances = pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
either = pytest.mark.parametrize("kind", [sp.Adaptive, sp.Implicit])


def bounce(integrator: sp.Adaptive | sp.Implicit, law: object, **more: object) -> sp.Result:
    """Drop a ball on a plate for two seconds: eight bounces or more."""
    scene = models.on_plate(models.ball(), law)
    q = models.free_q([0.1, -0.05, R + DROP])
    return sp.Simulation(scene, integrator).run(q, None, 2.0, **more)


def touches(result: sp.Result) -> list[float]:
    return [event.t for event in result.events if event.kind == "touch"]


@either
@tolerances
@pytest.mark.parametrize("law", LAWS)
def test_a_bounce_costs_few_evaluations(kind, rtol: float, law: str) -> None:
    """All evaluations but those of accepted steps: tried again for their error, or for events.

    A bounce has two events; with a damped law three, as its clamp is one.
    """
    result = bounce(kind(rtol), LAWS[law])
    count = len(touches(result))
    assert count >= 8
    stats = result.stats
    beyond = stats.evaluations - STEP[kind] * stats.steps
    assert beyond / count <= (60 if law in ("linear", "hertz") else 90)
    # No dynamics in these: contacts alone, on the dense output.
    assert stats.event_queries / count <= 120


@either
@tolerances
def test_touch_times_against_the_closed_form(kind, rtol: float) -> None:
    """A ball on an elastic plate comes back for ever, after equal times."""
    stiffness, gravity = 4000.0, 9.81
    result = bounce(kind(rtol), LAWS["linear"])
    speed, omega = np.sqrt(2 * gravity * DROP), np.sqrt(stiffness)
    # In touch: depth = sag (1 - cos) + speed / omega sin, until it is zero again.
    half = np.pi - np.arctan(speed * omega / gravity)
    period = 2 * half / omega + 2 * speed / gravity
    times = np.array(touches(result))
    assert result.events == tuple(sorted(result.events, key=lambda event: event.t))
    exact = speed / gravity + period * np.arange(len(times))
    assert times[0] == pytest.approx(exact[0], abs=1e-3 * rtol)
    assert times == pytest.approx(exact, abs=20 * rtol)


@either
@pytest.mark.parametrize("law", LAWS)
def test_a_step_ends_at_each_event(kind, law: str) -> None:
    """A contact begins with hardly any depth, and the row before its end has hardly any."""
    result = bounce(kind(1e-6), LAWS[law])
    depth = np.zeros(len(result.t))
    depth[result.contacts.row] = result.contacts.depth
    for event in result.events:
        row = int(np.searchsorted(result.t, event.t))
        assert result.t[row] == event.t
        near = row if event.kind == "touch" else row - 1
        assert 0 <= depth[row] < 1e-10 if near == row else depth[row] == 0


def test_the_first_of_several_events_ends_the_step() -> None:
    """Two spheres of one body over a plate touch one after the other."""
    scene = sp.Scene(models.slider())
    for name, place in (("low", (0.2, 0.0, 0.0)), ("high", (0.0, 0.0, 3e-6))):
        sphere = sp.Sphere(R, "ball", place)
        scene.add_contact(sphere, models.plate(), law=LAWS["linear"], name=name)
    result = sp.Simulation(scene, sp.Adaptive(1e-5)).run([R + DROP], None, 0.15)
    first = [(event.pair, event.t) for event in result.events if event.kind == "touch"][:2]
    assert [pair for pair, _ in first] == ["low", "high"]
    speed = np.sqrt(2 * 9.81 * DROP)
    assert first[1][1] - first[0][1] == pytest.approx(3e-6 / speed, rel=1e-3)


def thrown(integrator: object, law: object, duration: float, **more: object) -> sp.Result:
    """Throw a ball of 1 kg at a plate with 0.6 m/s, without gravity."""
    scene = models.on_plate(models.ball(gravity=0.0), law)
    q = models.free_q([0.0, 0.0, R + 1e-3])
    velocity = [0.0, 0.0, -0.6, 0.0, 0.0, 0.0]
    return sp.Simulation(scene, integrator).run(q, velocity, duration, **more)


@either
@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6])
def test_peaks_lie_between_steps(kind, rtol: float) -> None:
    """All energy is in the spring: m v^2 / 2 = k depth^2.5 / 2.5."""
    figures = thrown(kind(rtol), LAWS["hertz"], 0.02).stats.pairs["ball-plate"]
    depth = (2.5 * 0.6**2 / (2 * 1e6)) ** 0.4
    assert figures.max_depth == pytest.approx(depth, rel=10 * rtol)
    assert figures.peak_force == pytest.approx(1e6 * depth**1.5, rel=10 * rtol)
    # Half of the contact time, 2.9432 depth / v (Johnson, Contact Mechanics, 11.4).
    turn = 1e-3 / 0.6 + 0.5 * 2.9432 * depth / 0.6
    assert figures.max_depth_time == pytest.approx(turn, rel=max(10 * rtol, 1e-3))


@either
def test_the_peak_of_a_damped_force_comes_before_that_of_the_depth(kind) -> None:
    law = sp.HuntCrossleyLaw(1e6, 1.5, dissipation=2.0)
    fine = thrown(kind(1e-10), law, 0.02).stats.pairs["ball-plate"]
    assert fine.peak_force_time < fine.max_depth_time - 1e-4
    coarse = thrown(kind(1e-4), law, 0.02).stats.pairs["ball-plate"]
    assert coarse.peak_force == pytest.approx(fine.peak_force, rel=1e-3)
    assert coarse.max_depth == pytest.approx(fine.max_depth, rel=1e-3)
    assert coarse.peak_force_time == pytest.approx(fine.peak_force_time, rel=1e-2)


def test_the_peak_of_a_stop_lies_between_steps() -> None:
    """A mass on a joint runs into the end of its range: F = v sqrt(k m)."""
    stop = {"ball_joint": sp.JointLimits(-0.01, 0.01, sp.ImpactLaw(1e4, 1.0))}
    scene = sp.Scene(models.slider(gravity=0.0), joints=sp.JointComponents(limits=stop))
    result = sp.Simulation(scene, sp.Adaptive(1e-4)).run([0.0], [-0.6], 0.06)
    figures = result.stats.joints["ball_joint"]
    assert figures.peak_stop_force == pytest.approx(0.6 * np.sqrt(1e4), rel=1e-3)
    assert figures.max_stop_depth == pytest.approx(0.6 / np.sqrt(1e4), rel=1e-3)


def test_fixed_steps_take_peaks_at_their_ends() -> None:
    result = thrown(sp.RungeKutta4(1e-4), LAWS["hertz"], 0.02)
    figures = result.stats.pairs["ball-plate"]
    assert figures.peak_force == result.contacts.normal_force.max()
    assert figures.peak_force_time in result.t
