"""A target on a path: limits of its motion, curves through points, and arms that follow exactly."""

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sphshell_pin as sp
from sphshell_pin.dynamics.control.target_path import Curve, Timing, path_fields
from sphshell_pin.errors import InvalidParameter
from tests import meshes, models

POINTS = np.array([[0.3, 0.0, 0.3], [0.3, 0.06, 0.33], [0.28, 0.1, 0.3], [0.3, 0.12, 0.26]])
numbers = st.floats(0.01, 10.0)


def straight(length: float) -> Curve:
    points = np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]])
    return Curve.through(points, None, spline=False)


@settings(max_examples=60, deadline=None)
@given(numbers, numbers, st.none() | numbers, st.none() | numbers)
def test_limits_hold_and_the_end_is_reached_at_rest(length, speed, acceleration, jerk) -> None:
    timing = Timing.along(straight(length), 0.7, speed, acceleration, jerk)
    assert timing.places[-1] == pytest.approx(length, rel=1e-12)
    assert (timing.at(np.array([0.0, 0.7])) == 0.0).all()
    span = np.diff(timing.times)
    assert (span > 0).all()
    v, a, j = timing.speeds[:-1], timing.accelerations[:-1], timing.jerks[:-1]
    after = v + span * (a + span * j / 2)
    assert max(v.max(), after.max()) <= speed * (1 + 1e-9)
    # Each phase begins where the one before ends: the place always, the speed with a limit of the
    # acceleration or jerk, the acceleration with one of the jerk.
    place = timing.places[:-1] + span * (v + span * (a / 2 + span * j / 6))
    np.testing.assert_allclose(place, timing.places[1:], rtol=1e-9, atol=1e-9 * length)
    if acceleration is not None or jerk is not None:
        np.testing.assert_allclose(after, [*v[1:], 0.0], atol=1e-8 * speed)
        assert v[0] == 0.0
    if acceleration is not None:
        assert np.abs([a, a + j * span]).max() <= acceleration * (1 + 1e-9)
    if jerk is not None:
        assert np.abs(j).max() <= jerk
        np.testing.assert_allclose((a + j * span)[:-1], a[1:], atol=1e-8 * np.abs(a + 1e-30).max())


def test_times_of_textbook() -> None:
    """Length over speed, plus a ramp: v / a, and with a limit of the jerk a / j more."""
    for limits, more in (((None, None), 0.0), ((2.0, None), 0.25), ((2.0, 8.0), 0.25 + 0.25)):
        timing = Timing.along(straight(3.0), 0.0, 0.5, *limits)
        assert timing.times[-1] == pytest.approx(6.0 + more, rel=1e-12)
    # Too short for the speed: two ramps of sqrt(length / a).
    assert Timing.along(straight(0.02), 0.0, 0.5, 2.0, None).times[-1] == pytest.approx(0.2)
    # Too short for the acceleration: four jerks of cbrt(length / (2 j)).
    short = Timing.along(straight(2e-3), 0.0, 0.5, 2.0, 1.0)
    assert short.times[-1] == pytest.approx(0.4)


def test_straight_pieces_stop_at_corners_and_a_spline_does_not() -> None:
    for spline in (False, True):
        curve = Curve.through(POINTS, None, spline=spline)
        timing = Timing.along(curve, 0.0, 0.05, 0.5, 5.0)
        passed = np.linalg.norm(POINTS[1:-1, None] - curve.points, axis=2).argmin(axis=1)
        assert curve.points[passed] == pytest.approx(POINTS[1:-1], abs=1e-12)
        near = timing.reaching(curve.along[passed])[:, None] + [-1e-6, 1e-6]
        speeds = np.diff(timing.at(near.ravel()).reshape(-1, 2))[:, 0] / 2e-6
        assert (speeds > 0.04).all() if spline else (speeds < 1e-4).all()
        assert len(curve.corners) == (2 if spline else len(POINTS))


def test_a_spline_that_turns_back_stops_there() -> None:
    """And it is as quick as straight pieces are; with the same limits."""
    there_and_back = np.array([[0.0, 0.0, 0.0], [0.04, 0.04, 0.0], [0.0, 0.0, 0.0]])
    chords, curve = (Curve.through(there_and_back, None, spline=one) for one in (False, True))
    ends = [Timing.along(one, 0.0, 0.036, 0.14, 0.58).times[-1] for one in (chords, curve)]
    assert ends[1] == pytest.approx(ends[0], rel=1e-6)
    assert curve.corners == pytest.approx(chords.corners, rel=1e-6)
    kinks = path_fields(curve, Timing.along(curve, 0.0, 0.036, 0.14, 0.58))["kinks"]
    assert set(ends[1:]) <= set(np.asarray(kinks))
    # Without limits the velocity jumps at the corner: a kink, for integrators with error control.
    jumps = Timing.along(curve, 0.0, 0.036, None, None)
    assert jumps.reaching(curve.corners)[1] == pytest.approx(curve.corners[1] / 0.036)


def test_a_spline_over_an_edge_of_a_box_slows_down_there_alone() -> None:
    shell = sp.Shell(*meshes.cube(0.2))
    path = [[0.05, 0.0, 0.1], [0.1, 0.0, 0.08], [0.1, 0.0, -0.05]]
    curve = Curve.through(np.array(path), shell, spline=True)
    assert len(curve.corners) > 2
    timing = Timing.along(curve, 0.0, 0.05, 0.1, None)
    assert timing.times[-1] < 4 * curve.length / 0.05


def test_points_beside_the_surface_may_share_their_nearest_one() -> None:
    shell = sp.Shell([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0]], elements=[[0, 1, 2]])
    path = [[0.0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0]]
    curve = Curve.through(np.array(path), shell, spline=True)
    assert np.isfinite(curve.tangents).all()
    assert np.isfinite(curve.points).all()
    inside = shell.closest_points(curve.points)
    assert inside.distances == pytest.approx(0.0, abs=1e-12)
    assert 0.5 < curve.length < 0.8


@pytest.mark.parametrize("acceleration", [1e3, 1e15, 1e300])
@pytest.mark.parametrize("jerk", [None, 1e40])
@pytest.mark.parametrize("begin", [0.0, 0.5])
def test_a_limit_that_is_never_felt_leaves_the_speed(begin, acceleration, jerk) -> None:
    timing = Timing.along(straight(0.1), begin, 0.05, acceleration, jerk)
    places = timing.at(begin + np.array([0.0, 0.5, 1.0, 1.5, 2.0]))
    assert places == pytest.approx([0.0, 0.025, 0.05, 0.075, 0.1], abs=1e-4)
    assert timing.times[-1] == pytest.approx(begin + 2.0, abs=1e-3)


def test_paths_that_cannot_be_followed_are_refused() -> None:
    shell = models.plate()
    far = np.array([[0.0, 0, 0], [1e200, 0, 0]])
    with pytest.raises(InvalidParameter, match="is too long to compute with"):
        Curve.through(far, None, spline=False)
    with pytest.raises(InvalidParameter, match="over 2000 times as long as"):
        Curve.through(np.array([[0.0, 0, 0], [1e8, 0, 0]]), shell, spline=False)


def arc(radius: float, count: int) -> np.ndarray:
    """Points (count, 3) of three quarters of a circle."""
    angles = np.linspace(0, 1.5 * np.pi, count)
    return radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)


def warnings_of(**more) -> str:
    scene = sp.Scene(models.arm())
    frame = scene.model.frames[scene.model.nframes - 1].name
    controller = sp.CartesianImpedance(frame, stiffness=50.0, damping=5.0, **more)
    return " ".join(controller._setup_warnings(scene, models.ARM_Q))


def test_a_path_through_a_body_and_a_tight_bend_are_said() -> None:
    box = sp.Shell(*meshes.cube(0.2), name="box")
    through = [[0.1, 0.03, 0.0], [-0.1, 0.03, 0.0]]
    said = warnings_of(path=through, shell=box)
    assert "path jumps by" in said
    assert "is on another side" in said
    assert warnings_of(path=[[0.1, 0.03, 0.0], [0.1, -0.03, 0.02]], shell=box, spline=True) == ""
    ring = arc(0.002, 60)
    said = warnings_of(path=ring, spline=True, speed=0.5, acceleration=0.5)
    assert "bends so much that its target goes at 0.0" in said
    assert warnings_of(path=ring, spline=True, speed=0.5) == ""


def test_a_spline_through_a_circle_is_one() -> None:
    curve = Curve.through(arc(0.2, 40), None, spline=True)
    inner = np.linspace(0.1, 0.9, 50) * curve.length
    assert np.linalg.norm(curve.at(inner), axis=1) == pytest.approx(0.2, abs=1e-5)
    assert curve.length == pytest.approx(0.3 * np.pi, rel=1e-4)
    # The centripetal acceleration is v^2 / r; where the natural spline ends it bends more.
    timing = Timing.along(curve, 0.0, 10.0, 0.5, None)
    assert 0.85 * np.sqrt(0.5 * 0.2) < timing.speeds.max() < np.sqrt(0.5 * 0.2)


def test_a_curve_on_a_shell_stays_on_it() -> None:
    shell = sp.Shell(*meshes.icosphere(3, 0.4))
    ends = np.array([[0.4, 0.0, 0.0], [0.3, 0.2, 0.2], [0.0, 0.4, 0.0], [-0.2, 0.3, 0.1]])
    curve = Curve.through(ends, shell, spline=True)
    assert np.abs(shell.closest_points(curve.points).distances).max() < 1e-12
    toward = curve.points / np.linalg.norm(curve.points, axis=1)[:, None]
    assert np.einsum("ij,ij->i", curve.normals, toward).min() > 0.999
    assert np.einsum("ij,ij->i", curve.normals, curve.tangents) == pytest.approx(0.0, abs=0.02)


def follow(scene: sp.Scene, frame: str, q, v, **more):
    """Return the rows' times and the frame's places in the world."""
    controller = sp.CartesianImpedance(
        frame, stiffness=50.0, damping=5.0, speed=0.2, spline=True, decoupled=True, **more
    )
    rows = sp.Simulation(scene, sp.Adaptive(1e-9)).run(q, v, 1.5, controller, record_dt=0.01)
    places = np.array([models.pose_of(scene.model, one, frame).translation for one in rows.q])
    curve, timing = controller._motion()
    return rows, places, curve.at(timing.at(rows.t))


@pytest.mark.parametrize("rotational", [0.0, 3.0])
def test_a_decoupled_arm_follows_exactly(rotational: float) -> None:
    """From rest on the path, in spite of weak springs, posture and joint damping."""
    # A hold of the orientation takes three joints more.
    if rotational:
        model = pin.buildSampleModelManipulator()
        q = np.array([0.3, 0.8, -0.9, 0.6, 0.4, 0.2])
    else:
        model, q = models.arm(), models.ARM_Q
    scene, frame = sp.Scene(model), model.frames[model.nframes - 1].name
    start = models.pose_of(model, q, frame).translation
    way = start + 0.5 * (POINTS - POINTS[0])
    more = {"path": way, "acceleration": 0.5, "jerk": 5.0, "lead_in": 0.1}
    more |= {"rotational_stiffness": rotational, "rotational_damping": 0.1 * rotational}
    more |= {"posture_stiffness": 0.3, "joint_damping": 0.1}
    rows, places, targets = follow(scene, frame, q, None, **more)
    assert np.linalg.norm(places[-1] - places[0]) > 0.05
    # The targets are chords of the knots.
    np.testing.assert_allclose(places, targets, atol=2e-6)
    coupled = sp.CartesianImpedance(frame, way, 50.0, 5.0, speed=0.2, spline=True)
    far = sp.Simulation(scene, sp.Adaptive(1e-9)).run(q, None, 1.5, coupled, record_dt=0.01)
    assert np.abs(far.q - rows.q).max() > 1e-3


def test_a_path_on_a_turning_carrier_is_followed_exactly() -> None:
    """Coriolis and centrifugal parts of the target's acceleration: a disc that turns freely."""
    model = models.empty(0.0)
    inertia = pin.Inertia(0.7, np.zeros(3), np.diag([0.01, 0.01, 0.02]))
    models.add_body(model, "disc", pin.JointModelRZ(), inertia=inertia)
    models.add_body(model, "tip", pin.JointModelTranslation(), inertia=inertia)
    shell = models.plate()
    rate, begin = 2.0, np.array([0.1, 0.05, 0.0])
    path = [begin, [0.15, 0.1, 0.0], [0.05, 0.15, 0.0]]
    q = np.concatenate([[0.0], begin])
    v = np.concatenate([[rate], np.cross([0.0, 0.0, rate], begin)])
    more = {"path": path, "shell": shell, "shell_frame": "disc", "joints": ["tip_joint"]}
    more |= {"acceleration": 0.5, "jerk": 5.0}
    rows, places, targets = follow(sp.Scene(model), "tip", q, v, **more)
    assert rows.q[-1, 0] == pytest.approx(1.5 * rate)
    turns = (pin.utils.rotate("z", angle) for angle in rows.q[:, 0])
    turned = [turn @ one for turn, one in zip(turns, targets, strict=True)]
    np.testing.assert_allclose(places, turned, atol=2e-6)


def test_the_push_turns_with_the_normal_along_a_piece() -> None:
    """Over a corner of a ball, from one axis to the other: as much along one as along the other."""
    model, shell = models.empty(0.0), sp.Shell.from_geometry(coal.Sphere(0.4))
    models.add_body(model, "tip", pin.JointModelTranslation())
    path = [[0.4, 0.0, 0.0], [0.0, 0.4, 0.0]]
    more = {"normal_force": 2.0, "shell": shell, "shell_frame": "universe", "speed": 1.0}
    push = sp.CartesianImpedance("tip", path, 0.0, 0.0, **more)
    q, quarter = np.array([0.5, 0.0, 0.0]), 0.2 * np.pi
    end = sp.Simulation(sp.Scene(model), sp.Adaptive(1e-9)).run(q, None, quarter, push).v[-1]
    # The integral of 2 N times the normal, of a body of 1 kg.
    np.testing.assert_allclose(end, [-0.8, -0.8, 0.0], rtol=1e-3, atol=1e-9)


def test_a_path_of_one_point_and_of_one_twice() -> None:
    for spline in (False, True):
        curve = Curve.through(POINTS[:1], None, spline=spline)
        timing = Timing.along(curve, 0.3, 0.1, 1.0, None)
        assert (len(timing.times), curve.length) == (1, 0.0)
    twice = Curve.through(POINTS[[0, 0, 1, 1]], None, spline=True)
    assert twice.length == pytest.approx(np.linalg.norm(POINTS[1] - POINTS[0]))
