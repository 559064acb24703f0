"""Friction that sticks: against closed forms, conserved quantities, and other meshes."""

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests import meshes, models
from tests.dynamics.scenes import free_ball
from tests.models import run

R = 0.05
G = 9.81
K = 1e5  # stiffness of the normal law, and of bristles [N/m]
DEPTH = G / K  # of 1 kg at rest
every = models.every_integrator(1e-4, 1e-7, 1e-6)


def block(friction: sp.BristleFriction) -> sp.Scene:
    """1 kg that slides without turning."""
    law = models.linear_law(K, 300.0)
    return models.on_shell(models.block(), models.square(4.0), law, friction)


def pushed(force):
    """Push along x with `force`(t) [N]."""
    return lambda t, q, v, contacts: np.array([force(t), 0.0, 0.0])


REST = [0.0, 0.0, R - DEPTH]


@every
@pytest.mark.parametrize("damping", [0.0, 2.0, 300.0])
def test_below_the_limit_nothing_creeps(integrator, damping: float) -> None:
    """A third of mu N, at once: x = X (1 - exp(-c t / 2m) cos(w t + ...)), X = F / k, for ever."""
    more = {"controller": pushed(lambda t: 0.2 * G), "record_dt": 5e-3}
    scene = block(sp.BristleFriction(0.6, 0.6, K, damping))
    x = run(scene, integrator, REST, None, 0.6, **more).q[:, 0]
    expected = 0.2 * G / K
    assert x.max() < 2.02 * expected
    assert x.min() > -0.02 * expected
    if damping == 300.0:
        assert x[60:] == pytest.approx(expected, rel=1e-5)


def test_break_away_and_stribeck() -> None:
    """It holds up to mu_static N, and slides with mu(s) N."""
    rate = 4.0
    more = {"controller": pushed(lambda t: rate * G * t), "record_dt": 2e-4}
    scene = block(sp.BristleFriction(0.5, 0.3, K, 300.0, v_stribeck=0.05))
    rows = run(scene, sp.Adaptive(1e-7), REST, None, 0.2, **more)
    log = rows.contacts
    force = np.linalg.norm(log.friction_force_world, axis=1) / log.normal_force
    slip = np.linalg.norm(log.slip_velocity_world, axis=1)
    assert force.max() == pytest.approx(0.5, rel=2e-3)
    assert log.t[np.argmax(force)] == pytest.approx(0.5 / rate, rel=0.02)
    assert rows.q[log.t < 0.12, 0].max() < 1.02 * 0.5 * G / K
    sliding = slip > 0.01
    assert sliding.sum() > 50
    mu = 0.3 + 0.2 * np.exp(-((slip[sliding] / 0.05) ** 2))
    assert force[sliding] == pytest.approx(mu, rel=1e-6)
    assert force[-1] == pytest.approx(0.3, rel=1e-5)


@pytest.mark.parametrize("speed", [0.1, 2.0])
def test_a_bristle_that_slides_stores_what_it_holds(speed: float) -> None:
    """(mu N)^2 / 2k beside the normal law's (m g)^2 / 2K, however fast it slides."""
    scene = block(sp.BristleFriction(0.3, 0.3, K, 2.0))
    rows = run(scene, sp.Adaptive(1e-9), REST, [speed, 0, 0], 0.02, record_dt=1e-3)
    stored = rows.energy.elastic - 0.5 * G**2 / K
    assert rows.v[-1, 0] > 0.3 * speed
    assert stored[5:] == pytest.approx(0.5 * (0.3 * G) ** 2 / K, rel=1e-6)


def test_force_and_moment_share_the_limit() -> None:
    """Both act against w = v + rho spin n, with mu N together: while sliding they keep its way."""
    depth, model = 1e-3, models.empty(0.0)
    place, light = pin.SE3(np.eye(3), np.array([0, 0, R - depth])), pin.Inertia.FromSphere(1e-9, R)
    carrier = models.add_body(model, "carrier", pin.JointModelPX(), placement=place, inertia=light)
    ball = pin.Inertia.FromSphere(1.0, R)
    models.add_body(model, "ball", pin.JointModelRZ(), carrier, inertia=ball)
    friction = sp.BristleFriction(0.4, 0.4, 1e6, 0.0, torsional=True)
    scene = models.on_shell(model, models.square(4.0), models.linear_law(1e4), friction)
    rows = run(scene, sp.Adaptive(1e-9), [0.0, 0.0], [0.5, 30.0], 0.02, record_dt=1e-4)
    force = np.diff(rows.v[:, 0]) / np.diff(rows.t)
    moment = np.diff(rows.v[:, 1]) / np.diff(rows.t) * ball.inertia[2, 2]
    limit, lever, late = 0.4 * 1e4 * depth, 3 * np.pi / 16 * np.sqrt(R * depth), slice(20, 100)
    whole = (force / limit) ** 2 + (moment / (limit * lever)) ** 2
    assert whole[late] == pytest.approx(1.0, rel=2e-3)
    v = 0.5 * (rows.v[1:] + rows.v[:-1])
    assert (moment / force)[late] == pytest.approx((lever**2 * v[:, 1] / v[:, 0])[late], rel=1e-2)


SPRING, DRAWN, STATIC, DYNAMIC = 1e3, 0.01, 0.6, 0.4


def period() -> float:
    """With mu_static until it slips and mu_dynamic while it does, it sticks again at rest."""
    stretch, frequency = (STATIC - DYNAMIC) * G / SPRING, np.sqrt(SPRING)
    slip = 2 / frequency * (np.pi - np.arctan(stretch * frequency / DRAWN))
    return 2 * stretch / DRAWN + slip


@pytest.mark.study
@pytest.mark.parametrize(
    ("v_stribeck", "percent"), [(1e-4, -0.13), (1e-3, 2.7), (3e-3, 5.2), (1e-2, 9.5)]
)
def test_the_period_of_stick_slip(v_stribeck: float, percent: float) -> None:
    """Drawn at a constant speed, by a spring."""
    scene = block(sp.BristleFriction(STATIC, DYNAMIC, 1e6, 100.0, v_stribeck))
    more = {"controller": lambda t, q, *_: np.array([SPRING * (DRAWN * t - q[0]), 0.0, 0.0])}
    more |= {"control_dt": 2e-4, "record_dt": 1e-4}
    rows = run(scene, sp.Adaptive(1e-7, 1e-10), REST, None, 3.0, **more)
    fast = rows.v[:, 0] > 2 * DRAWN
    begins = rows.t[np.flatnonzero(fast[1:] & ~fast[:-1])]
    found = 100 * (np.diff(begins)[1:].mean() / period() - 1)
    assert np.isclose(found, percent, atol=0.15)


@pytest.mark.parametrize(("way", "kept"), [(0.9, 1.0), (1.1, 0.0)])
def test_a_contact_goes_on_within_its_disc_and_else_begins_anew(way: float, kept: float) -> None:
    """In a tight bore it moves 25 times as far as the center, `way` times sqrt(r^2 - (r-d)^2)."""
    bore, depth, dt, along = 0.052, 1e-4, 1e-4, 0.2
    angle = way * np.sqrt(R**2 - (R - depth) ** 2) / bore
    wall = sp.Shell.from_geometry(coal.Cylinder(bore, 0.4), segments=96, side="inside")
    law, friction = models.linear_law(K), sp.BristleFriction(9.0, 9.0, K, 0.0)
    scene = models.on_shell(models.block(0.0), wall, law, friction)
    # The center goes round the axis by the angle in one step.
    off = bore - R + depth
    round_axis = 2 * off * np.sin(angle / 2) / dt
    v = [-round_axis * np.sin(angle / 2), round_axis * np.cos(angle / 2), along]
    made = run(scene, sp.SemiImplicitEuler(dt), [off, 0.0, 0.0], v, dt, record_dt=dt)
    assert len(made.contacts) == 2
    assert made.contacts.friction_force_world[1, 2] == pytest.approx(
        -kept * K * along * dt, rel=0.01
    )


def test_where_a_minimum_and_a_saddle_end_their_stretch_goes_on() -> None:
    """A ball that spins in a trough of less radius: three places of touch become one."""
    radius, height = 0.9, 0.93
    vertices, quads = meshes.grid_plate(24, 60, 1.0, quads=True)
    x = vertices[:, 0] - vertices[:, 0].mean()
    vertices[:, 0], vertices[:, 2] = x, x**2 / (2 * radius)
    vertices[:, 1] -= vertices[:, 1].mean()
    normals = np.stack([-x / radius, 0 * x, 1 + 0 * x], axis=1)
    trough = sp.Shell(vertices, quads, normals=normals, crease_angle=3.0)
    friction = sp.BristleFriction(5.0, 5.0, 1e4, 0.0)
    scene = free_ball(trough, models.linear_law(1e5), friction, gravity=0.0, mass=1e4)
    v = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.5])
    made = run(scene, sp.RungeKutta4(1e-4), models.free_q([0, 0, height]), v, 0.12, record_dt=1e-3)
    log = made.contacts
    counts = np.bincount(np.searchsorted(made.t, log.t))
    assert (counts[0], counts[-1]) == (3, 1)
    force = np.zeros(len(made.t))
    np.add.at(force, np.searchsorted(made.t, log.t), log.friction_force_world[:, 1])
    # The slope after it, where the one that is left is far from the axis of the spin.
    assert np.abs(np.diff(force)).max() == pytest.approx(force[-2] - force[-1], rel=0.1)
