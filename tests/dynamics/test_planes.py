"""A shell on a plane in scenes: derivatives, energy, rows, events, and a foundation's volume."""

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.optimize import brentq, curve_fit

import sphshell_pin as sp
from sphshell_pin import testing
from tests.contact.test_planes import egg, pose, rotations, scene_of, support
from tests.dynamics.test_derivatives import assert_derivatives, assert_rows
from tests.meshes import cube, grid_plate, icosphere
from tests.models import add_body, empty, pose_of, run

EGG = np.array([0.03, 0.02, 0.025])
INERTIA = pin.Inertia(0.5, np.array([0.002, -0.001, -0.003]), np.diag([1.5e-4, 2e-4, 1.8e-4]))


def over_plane(shell: sp.Shell, law, friction=None, *, ground: bool = True) -> sp.Scene:
    """A body over a plane of the world, or of a body that moves as well."""
    model, frame = empty(), "universe" if ground else "table"
    if not ground:
        add_body(model, frame, pin.JointModelFreeFlyer())
    add_body(model, "body", pin.JointModelFreeFlyer(), inertia=INERTIA)
    scene = sp.Scene(model)
    plane = sp.Plane(frame, (0.0, 0.0, 0.01), (0.1, -0.05, 1.0))
    scene.add_contact(plane, shell, "body", None, law, friction)
    return scene


def egg_over(law, friction=None, *, ground: bool = True) -> sp.Scene:
    return over_plane(egg(10, EGG), law, friction, ground=ground)


def reach_of(shell: sp.Shell):
    """How far a shell that is turned goes down from its origin, by its vertices."""
    return lambda turned: -(shell.vertices @ turned.T)[:, 2].min()


def touching(scene: sp.Scene, depth: float = 2e-4, seed: int = 0, turned=None, reach=None):
    """A state of `over_plane` with the body `depth` deep, `turned` from the plane or anyhow.

    `reach(turned)` is how far down it goes from its origin; an egg's unless given.
    """
    rng = np.random.default_rng(seed)
    q = pin.neutral(scene.model)
    plane = scene.pairs[0].side_i.plane.placement
    if scene.model.nq > 7:
        q = pin.integrate(scene.model, q, 0.3 * rng.normal(size=scene.model.nv))
        plane = pose_of(scene.model, q, "table") * plane
    turn = rotations(1, seed)[0] if turned is None else plane.rotation @ turned
    down = (reach or (lambda turned: support(EGG, turned)))(plane.rotation.T @ turn)
    q[-7:-4] = plane.act(np.array([0.01, 0.02, down - depth]))
    q[-4:] = pin.Quaternion(turn).coeffs()
    return q, rng.normal(size=scene.model.nv) * 0.3


POINT = sp.ImpactLaw(2e7, 1.5, 20.0, 1e-4)
FRICTIONS = [None, sp.CoulombFriction(0.3, 0.2, 0.05, 0.5), sp.BristleFriction(0.4, 0.3, 2e4, 5.0)]


def test_a_constraint_is_between_the_plane_and_the_part() -> None:
    scene = egg_over(POINT)
    q, _ = touching(scene)
    (made,), contacts = scene.constraints(q).models, scene.contacts(q)
    ends = {made.joint1_id: made.joint1_placement, made.joint2_id: made.joint2_placement}
    np.testing.assert_allclose(ends[0].translation, contacts.point_world[0], atol=1e-12)
    in_plane = scene.pairs[0].side_i.plane.placement.actInv
    deepest = np.append(in_plane(contacts.point_world[0])[:2], -contacts.depth[0])
    on_body = pin.XYZQUATToSE3(q).act(ends[1].translation)
    np.testing.assert_allclose(in_plane(on_body), deepest, atol=1e-12)


def test_rolling_loses_no_energy() -> None:
    """Free of friction and damping."""
    scene = egg_over(sp.ImpactLaw(2e7, 1.5, 0.0, 1e-4))
    q, v = touching(scene, 1e-4)
    result = sp.Simulation(scene, sp.Adaptive(rtol=1e-9, atol=1e-12)).run(q, v, 0.05)
    kept = result.energy.kinetic + result.energy.potential + result.energy.elastic
    assert np.ptp(kept) < 3e-6 * np.ptp(result.energy.kinetic)


def test_a_sensor_and_rows_show_the_force_on_the_body_of_the_plane() -> None:
    scene = egg_over(POINT, FRICTIONS[1], ground=False)
    q, v = touching(scene)
    rows = scene.contacts(q, v)
    place = pose_of(scene.model, q, "table")
    on_table = place.act(scene.external_forces(q, v)[1]).linear
    assert rows.force_world[0] == pytest.approx(on_table, rel=1e-12)


def test_an_egg_falls_and_is_an_event_of_touch() -> None:
    scene = egg_over(POINT, FRICTIONS[2])
    q, v = touching(scene, -0.01)
    result = sp.Simulation(scene, sp.Adaptive(rtol=1e-8)).run(q, 0 * v, 0.1)
    first = next(event for event in result.events if event.kind == "touch")
    plane = scene.pairs[0].side_i.plane.placement
    fall = 0.01 / plane.rotation[2, 2]
    assert first.t == pytest.approx(np.sqrt(2 * fall / 9.81), rel=1e-5)


def test_explanation_of_a_plane() -> None:
    """The gap of the vertices, and the mass with which the egg resists along the normal."""
    scene = egg_over(POINT)
    q, v = touching(scene, -0.01)
    figures = scene.explain(q, v).pairs[0]
    assert "plane on frame 'universe' against shell 'shell' on frame 'body'" in figures.modelled
    assert figures.gap == pytest.approx(0.01, abs=2e-4)
    assert 0 < figures.effective_mass < INERTIA.mass


KAPPA = 2e8  # [Pa/m]
LAW = sp.FoundationLaw(2e5, 1e-3, 3.0)
ELASTIC = sp.FoundationLaw(2e5, 1e-3)


def box(sides=(0.06, 0.05, 0.04)) -> sp.Shell:
    vertices, elements = cube(1.0, quads=True)
    return sp.Shell(vertices * sides, elements)


def clipped(vertices: np.ndarray, edges: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume and centroid of a convex body's part below z = 0, as a hull of its own."""
    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    over = a[:, 2] * b[:, 2] < 0
    t = (a[over, 2] / (a[over, 2] - b[over, 2]))[:, None]
    points = np.vstack([vertices[vertices[:, 2] <= 0], a[over] + t * (b[over] - a[over])])
    part = trimesh.convex.convex_hull(points)
    return part.volume, part.center_mass


def edges_of(shell: sp.Shell) -> np.ndarray:
    return np.vstack([shell.triangles[:, [i, (i + 1) % 3]] for i in range(3)])


@pytest.mark.parametrize("name", ["box", "polyhedron"])
def test_the_force_is_that_of_the_volume_below_at_its_centroid(name: str) -> None:
    shell = box() if name == "box" else sp.Shell(*icosphere(1, 0.05), crease_angle=0.0)
    scene = scene_of(shell, ELASTIC)
    rng = np.random.default_rng(2)
    for rotation in rotations(30):
        lowest = (shell.vertices @ rotation.T)[:, 2].min()
        q = pose(rotation, -lowest * rng.uniform(0.2, 0.99))
        volume, centroid = clipped(shell.vertices @ rotation.T + q[:3], edges_of(shell))
        found = scene.contacts(q)
        assert found.normal_force == pytest.approx([KAPPA * volume], rel=1e-9)
        expected = [*centroid[:2], 0.0]
        assert found.point_world[0] == pytest.approx(expected, abs=1e-9)
        assert found.depth == pytest.approx([-(lowest + q[2])], rel=1e-9)
        wrench = scene.external_forces(q, np.zeros(6))[1].vector
        push = np.array([0, 0, KAPPA * volume])
        torque = np.cross(np.array(expected) - q[:3], push)
        assert wrench[:3] == pytest.approx(rotation.T @ push, rel=1e-9)
        assert wrench[3:] == pytest.approx(rotation.T @ torque, abs=1e-9 * push[2])


def test_the_cap_of_an_ellipsoid() -> None:
    """pi a b c t^2 (1 - t / 3), t the depth over the support; off as its curved elements are."""
    t, errors = 0.02, []
    cap = KAPPA * np.pi * np.prod(EGG) * t**2 * (1 - t / 3)
    for cells in (8, 16):
        scene = scene_of(egg(cells, EGG), ELASTIC)
        poses = [pose(turn, support(EGG, turn) * (1 - t)) for turn in rotations(10, 1)]
        errors.append(max(abs(scene.contacts(q).normal_force[0] / cap - 1) for q in poses))
    assert errors[1] < min(1e-3, 0.12 * errors[0])


def test_a_sheet_bears_by_its_area() -> None:
    """Level: kappa depth area, at its middle; and a plate whose border is below has a potential."""
    shell = sp.Shell(*grid_plate(3, 3, 0.1))
    scene = scene_of(shell, ELASTIC)
    middle = shell.vertices.mean(axis=0)
    q = pose(np.eye(3), -1e-4 - middle[2])
    found = scene.contacts(q)
    assert found.normal_force == pytest.approx([KAPPA * 1e-4 * 0.01])
    assert found.point_world[0] == pytest.approx([*(q[:2] + middle[:2]), 0.0])


SHELLS = {
    "box": box,
    "egg": lambda: egg(10, EGG),
    "sheet": lambda: sp.Shell(*grid_plate(2, 2, 0.05)),
}


@pytest.mark.parametrize("ground", [True, False])
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize(
    ("name", "law"),
    [("egg", sp.ImpactLaw(2e7, 1.5, 20.0, 1e-3)), *((name, LAW) for name in SHELLS)],
)
def test_derivatives_are_those_of_finite_differences(name, law, friction, ground: bool) -> None:
    shell = SHELLS[name]()
    scene = over_plane(shell, law, friction, ground=ground)
    q, v = touching(scene, 8e-4, 5, pin.exp3(np.array([0.02, 0.03, 0.4])), reach_of(shell))
    assert_derivatives(scene, q, v)
    assert_rows(scene, q, v)
    if not ground:
        testing.assert_wrenches_cancel(scene, q, v)


SPUN = (0.1, 0, -0.2, 1.0, 2.0, 5.0)


def fallen(make, inertia, law, friction, integrator, *, v=SPUN, turn=(0.5, 0.3), **more):
    """Run of a body that begins 5 mm above the plane, turned."""
    shell, rotation = make(), pin.rpy.rpyToMatrix(*turn, 0.2)
    height = 0.005 - (shell.vertices @ rotation[2]).min()
    q = np.r_[0, 0, height, pin.Quaternion(rotation).coeffs()]
    scene = scene_of(shell, law, friction, inertia=inertia)
    return run(scene, integrator, q, np.array(v, float), **more)


BOX = pin.Inertia.FromBox(0.2, 0.06, 0.05, 0.04)


def test_a_block_that_spins_on_its_face_is_slowed_by_the_moment_of_all_its_points() -> None:
    """The mean distance from the middle of an even pressure, times mu N; a bristle's within 1 %."""
    mu, sides = 0.3, np.array([0.06, 0.05])
    x = [side * (np.arange(400) / 400 - 0.49875) for side in sides]
    lever = np.hypot(*np.meshgrid(*x)).mean()
    expected = mu * 9.81 * lever / (sides @ sides / 12)
    coulomb = sp.CoulombFriction(mu, mu, 1e-3, 1e-2)
    for friction in (coulomb, sp.BristleFriction(mu, mu, 1e5, 140.0)):
        scene = scene_of(box(), sp.FoundationLaw(1e6, 1e-3), friction, inertia=BOX)
        depth = 0.2 * 9.81 / (1e9 * np.prod(sides))
        q = np.array([0, 0, 0.02 - depth, 0, 0, 0, 1.0])
        result = sp.Simulation(scene, sp.Implicit(1e-6, 1e-9)).run(q, [0, 0, 0, 0, 0, 20.0], 0.3)
        slowed = (result.t > 0.01) & (result.t < 0.1)
        found = -np.polyfit(result.t[slowed], result.v[slowed, 5], 1)[0]
        assert found == pytest.approx(expected, rel=0.01)
        assert np.abs(result.v[-1]).max() < 1e-6


def test_a_cylinder_that_rolls_is_slowed_by_the_dissipation() -> None:
    """The layer's gap rate is w x: its moment b w N mean(x^2), where the pressure's is a^2 / 5."""
    radius, length, mass, b = 0.02, 0.06, 0.2, 100.0
    shell = sp.Shell.from_geometry(coal.Cylinder(radius, length), segments=48)
    law, inertia = sp.FoundationLaw(1e6, 1e-3, b), pin.Inertia.FromCylinder(mass, radius, length)
    scene = scene_of(shell, law, sp.BristleFriction(0.5, 0.5, 1e5, 30.0), inertia=inertia)
    # N = kappa length 4/3 a depth, a^2 = 2 radius depth.
    depth = (mass * 9.81 / (1e9 * length * 4 / 3 * np.sqrt(2 * radius))) ** (2 / 3)
    turn = pin.utils.rotate("x", np.pi / 2)
    q = np.r_[0, 0, radius - depth, pin.Quaternion(turn).coeffs()]
    v = np.r_[turn.T @ [2.0 * radius, 0, 0], turn.T @ [0, 2.0, 0]]
    result = sp.Simulation(scene, sp.Implicit(1e-6, 1e-9)).run(q, v, 0.5)
    late = result.t > 0.1
    rate = -np.polyfit(result.t[late], np.log(np.abs(result.v[late, 5])), 1)[0]
    expected = b * 9.81 * (2 * radius * depth / 5) / (1.5 * radius**2)
    assert rate == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("power", "exponent"), [(-2.0, 1 / 3), (-0.5, 2 / 3), (0.6, 5 / 2)])
def test_a_disc_spins_down_with_the_published_exponents(power: float, exponent: float) -> None:
    """The tilt of Euler's disk is a (1 - t / end)^exponent: its energy is 3/2 m g radius tilt.

    A loss as tilt^-2, of the air below it: Moffatt, Nature 404 (2000) 833; as its speed of rolling,
    tilt^-1/2: Easwar, Rouyer and Menon, Phys. Rev. E 66 (2002) 045102. It acts as a moment against
    the rotation; what is measured is that the contact adds no loss of its own. Last that of the law
    alone, b N mean(gap rate^2): the disc is depth / tilt wide and sqrt(depth / tilt) long where it
    touches, so that the volume gives tilt^(3/5).
    """
    own = power > 0
    radius, thickness, mass, tilt, end = 0.04, 0.001, 0.2, 0.1, 0.6
    shell = sp.Shell.from_geometry(coal.Cylinder(radius, thickness), segments=48)
    inertia = pin.Inertia.FromCylinder(mass, radius, thickness)
    friction = sp.CoulombFriction(0.02, 0.02, 0.01, 0.1)
    law = sp.FoundationLaw(1e7, 1e-3, 10.0) if own else sp.FoundationLaw(1e8, 1e-3)
    scene = scene_of(shell, law, friction, inertia=inertia)
    turn = pin.Quaternion(pin.utils.rotate("y", tilt)).coeffs()
    touch = radius * np.sin(tilt) + thickness / 2 * np.cos(tilt)

    def lift(z: float) -> float:
        return scene.contacts(np.r_[0, 0, z, turn]).normal_force.sum() - mass * 9.81

    q = np.r_[0, 0, brentq(lift, 0.9 * touch, touch - 1e-7), turn]
    spin = np.sqrt(4 * 9.81 * np.sin(tilt) / radius)  # about the diameter through the contact
    loss = exponent * 1.5 * mass * 9.81 * radius * tilt / end  # [W], at first

    def tilt_of(q: np.ndarray) -> float:
        return float(np.linalg.norm(pin.Quaternion(q[3:7]).matrix()[2, :2]))

    def moment(_t, q, v, _contacts) -> np.ndarray:
        return np.r_[0, 0, 0, -loss * (tilt_of(q) / tilt) ** power * v[3:] / (v[3:] @ v[3:])]

    duration, more = end * (1 - 0.35 ** (1 / exponent)), {"controller": moment, "control_dt": 5e-4}
    if own:
        duration, more = 1.1, {}
    result = run(scene, sp.Adaptive(1e-5, 1e-8), q, [0, 0, 0, -spin, 0, 0], duration, **more)
    tilts = [tilt_of(one) for one in result.q]

    def expected(t, a, b, c):
        return a * np.maximum(1 - t / b, 1e-9) ** c

    guess = tilt, 2.0 if own else end, exponent
    fitted = curve_fit(expected, result.t, tilts, guess)[0]
    assert fitted[2] == pytest.approx(exponent, rel=0.05 if own else 0.03)
    assert own or fitted[1] == pytest.approx(end, rel=0.02)
