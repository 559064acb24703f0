"""The scenes' truths, against equations of motion integrated here and against plain geometry."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.peers import scenes
from benchmarks.peers.engine import Trajectory
from sphshell_pin.study.report import swing

UP = np.array([0.0, 0.0, 1.0])


def integrate(rate, state, duration, rows):
    """Return t and the states (rows + 1, n)."""
    t = np.linspace(0, duration, rows + 1)
    found = solve_ivp(
        lambda _, y: rate(y), (0, duration), state, "DOP853", t, rtol=1e-12, atol=1e-14
    )
    return t, found.y.T


def trajectory(t, position, velocity, **more):
    zero = np.zeros_like(position)
    return Trajectory(t, position, velocity, zero, 1.0, float(t[-1]), len(t) - 1, **more)


def rolling(scene, depth, normal):
    """Return the acceleration and spin rate of a ball that rolls on the lever a = r - depth.

    Newton's and Euler's laws with the constraint that the point of contact moves with the surface:
    solved for the force at every state as a linear system.
    """
    m, inertia, lever = scene.mass, scene.inertia, scene.radius - depth

    def table(x):
        return scene.table_speed * np.cross(UP, x)

    def rate(y):
        x, v, w = y[:3], y[3:6], y[6:9]
        n, small = normal(x), 1e-6
        ahead, behind = x + small * v, x - small * v
        n_rate = (normal(ahead) - normal(behind)) / (2 * small)
        u_rate = (table(ahead) - table(behind)) / (2 * small)
        r, r_rate = -lever * n, -lever * n_rate
        # d/dt (v + w x r - u) = 0 along the two tangents; n . v = 0 stays so.
        t1 = np.cross(n, [0.3, 0.5, 0.8])
        t1 /= np.linalg.norm(t1)
        t2 = np.cross(n, t1)

        def motion(force):
            return scene.gravity + force / m, np.cross(r, force) / inertia

        def residual(force):
            acceleration, spin_rate = motion(force)
            slip = acceleration + np.cross(spin_rate, r) + np.cross(w, r_rate) - u_rate
            return np.array([t1 @ slip, t2 @ slip, n @ acceleration + n_rate @ v])

        base = residual(np.zeros(3))
        matrix = np.column_stack([residual(e) - base for e in np.eye(3)])
        acceleration, spin_rate = motion(np.linalg.solve(matrix, -base))
        return np.concatenate([v, acceleration, spin_rate])

    return rate


@pytest.mark.parametrize(
    ("name", "rows", "bounds"),
    [
        ("cylinder", 600, {"rate": 1e-6, "path": 1e-6}),
        ("turntable", 250, {"rate": 1e-8, "closure": 1e-7}),
        ("slope", 100, {"acceleration": 1e-10}),
    ],
)
def test_a_scene_is_what_the_equations_of_rolling_give(name, rows, bounds):
    scene = scenes.SCENES[name]()
    depth, normal = scene.mass * -scene.gravity[2] / scene.stiffness, lambda x: UP
    if name == "cylinder":
        depth, normal = scene.depth, lambda x: -x * [1, 1, 0] / np.linalg.norm(x[:2])
    start = np.concatenate([scene.position, scene.velocity, scene.angular_velocity])
    t, found = integrate(rolling(scene, depth, normal), start, scene.duration, rows)
    errors = scene.errors(trajectory(t, found[:, :3], found[:, 3:6]))
    assert errors.keys() == bounds.keys()
    assert all(errors[key] < bound for key, bound in bounds.items())


def test_a_body_that_creeps_on_the_slope_is_judged_so():
    ball, locked = scenes.slope().variants()
    assert (ball.rolls, locked.rolls) == (True, False)
    t = np.linspace(0, locked.duration, 101)
    crept = np.array(locked.position) + np.outer(t, [2e-3, 0, 0])
    creep = locked.errors(trajectory(t, crept, np.zeros_like(crept)))["creep [m/s]"]
    assert creep == pytest.approx(2e-3)
    assert ball.b(0.0) == pytest.approx(0.4)  # of a hard ball, but for the sink into the spring


def test_a_swing_with_a_wrong_period_or_energy_is_judged_so():
    scene = scenes.bowl(0.3).variants()[3]
    pull = scene.stiffness / scene.mass

    def rate(y):
        reach = np.linalg.norm(y[:3])
        back = pull * max(0.0, reach - swing.ARM) / reach
        return np.concatenate([y[3:], -back * y[:3] + scene.gravity])

    start = np.concatenate([scene.position, np.zeros(3)])
    t, rows = integrate(rate, start, scene.duration, 4000)
    right = scene.errors(trajectory(t, rows[:, :3], rows[:, 3:]))
    assert right["period"] < 1e-7
    assert right["energy"] < 1e-7
    slow = scene.errors(trajectory(1.001 * t, rows[:, :3], rows[:, 3:] / 1.001))
    assert slow["period"] == pytest.approx(1e-3, rel=1e-3)
    lower = rows[:, :3] - np.outer(t / t[-1], [0, 0, 0.01 * swing.ENERGY / scene.weight])
    lost = scene.errors(trajectory(t, lower, rows[:, 3:]))["energy"]
    assert 0.005 < lost < 0.011


def test_at_rest_the_plate_and_the_groove_are_right():
    still = np.zeros((50, 3))
    t = np.linspace(0, 0.3, 50)
    plate = scenes.plate()
    place = np.tile([0.0, 0.0, plate.radius - plate.weight / plate.stiffness], (50, 1))
    weight = np.tile([0.0, 0.0, plate.weight], (50, 1))
    errors = plate.errors(trajectory(t, place, still, force=weight))
    assert max(errors.values()) < 1e-12
    groove = scenes.groove()
    # m g = 2 N cos 45 deg: two walls at right angles.
    load = groove.weight / math.sqrt(2)
    height = (groove.radius - load / groove.stiffness) * math.sqrt(2)
    place = np.tile([0.0, 0.0, height], (50, 1))
    pushes = load * math.sqrt(0.5) * np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
    errors = groove.errors(trajectory(t, place, still, contact_forces=pushes))
    assert max(errors.values()) < 1e-12


@pytest.mark.parametrize("name", [name for name in scenes.SCENES if name != "press"])
def test_the_surface_is_one_thing_in_all_its_forms(name):
    surface = scenes.SCENES[name]().surface
    a, b, c = surface.vertices[surface.triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    assert length.min() > 0.02 * np.median(length)
    normal /= length[:, None]
    if surface.normals is not None:
        corners = surface.normals[surface.triangles]
        assert np.einsum("ij,ikj->ik", normal, corners).min() > 0.98
    if surface.height is not None and "bowl" not in name:
        x, y, z = surface.vertices.T
        assert np.abs(surface.height(x, y) - z).max() < 1e-12
    if surface.boxes:
        distance = np.full(len(surface.vertices), np.inf)
        for box in surface.boxes:
            local = np.abs((surface.vertices - box.center) @ box.rotation) - box.half
            outside = np.linalg.norm(np.maximum(local, 0), axis=1)
            distance = np.minimum(distance, outside + np.maximum(-local.max(axis=1), 0))
        # On the surface of a box, up to the sagitta of the cylinder's facets.
        assert distance.max() < 1e-4
