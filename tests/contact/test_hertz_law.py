"""HertzLaw: the stiffness follows from the curvature of a tessellated shell."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from tests import meshes
from tests.models import ball, free_q, on_shell, square
from tests.oracle.hertz import hertz_contact

YOUNG, POISSON = 1e7, 0.3
LAW = sp.HertzLaw(YOUNG, POISSON)
MODULUS = YOUNG / (2 * (1 - POISSON**2))


class Surface:
    """Points over parameters u, v, whose order makes the normal point outward; its tessellation.

    Normals and principal curvatures are those of differences of the points.
    """

    def __init__(self, point, spans, counts, step=1e-5):
        self.point, self.spans, self.step = point, spans, step
        grid = [np.linspace(*span, n + 1) for span, n in zip(spans, counts, strict=True)]
        u, v = (one.ravel() for one in np.meshgrid(*grid, indexing="ij"))
        self.vertices, self.normals = point(u, v), self.normal(u, v)
        self.triangles = meshes.grid_plate(*counts)[1]

    def slopes(self, u, v):
        h = self.step
        along_u = (self.point(u + h, v) - self.point(u - h, v)) / (2 * h)
        return along_u, (self.point(u, v + h) - self.point(u, v - h)) / (2 * h)

    def normal(self, u, v):
        across = np.cross(*self.slopes(u, v))
        return across / np.linalg.norm(across, axis=-1, keepdims=True)

    def curvatures(self, u, v):
        """Principal ones, the smaller first; positive where it bulges."""
        h, along = self.step, np.array(self.slopes(u, v))
        turns = [self.normal(u + h, v) - self.normal(u - h, v)]
        turns.append(self.normal(u, v + h) - self.normal(u, v - h))
        shape = np.linalg.solve(along @ along.T, np.array(turns) @ along.T) / (2 * h)
        return np.sort(np.linalg.eigvals(shape))

    def shell(self, *, exact=True):
        normals = self.normals if exact else None
        return sp.Shell(self.vertices, self.triangles, normals=normals)

    @property
    def longest_side(self):
        corners = self.vertices[self.triangles]
        return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()

    def inside(self, rng, share=0.8):
        return [rng.uniform(*(share * np.subtract(s, np.mean(s)) + np.mean(s))) for s in self.spans]

    def middle(self):
        """A point amid it, and the normal there."""
        u, v = (0.5 * (a + b) for a, b in self.spans)
        return self.point(u, v), self.normal(u, v)


def torus(u, v):
    away = 3.0 + np.cos(v)
    return np.stack([away * np.cos(u), away * np.sin(u), np.sin(v)], -1)


def ellipsoid(*axes):
    return lambda u, v: (
        np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], -1) * axes
    )


def cylinder(sign, counts):
    """Of radius one, from outside or inside."""
    point = lambda u, v: np.stack([np.cos(u), sign * np.sin(u), v], -1)  # noqa: E731
    return Surface(point, ((0, 1.5), (-1.2, 1.2)), counts)


BALL = ((0, 1.6), (-0.7, 0.7))
# Longest sides of 0.3 of the smallest radius of curvature, 1.
SURFACES = {
    "sphere": Surface(ellipsoid(1, 1, 1), BALL, (8, 7)),
    "cylinder": cylinder(1.0, (8, 11)),
    "inside a cylinder": cylinder(-1.0, (8, 11)),
    "saddle of a torus": Surface(torus, ((0, 1.5), (1.8, 4.4)), (15, 14)),
    "ellipsoid": Surface(ellipsoid(1.5, 1.25, 1.25), BALL, (10, 9)),
}


def ball_scene(shell, radius, law, gravity=(0, 0, 0)):
    model = ball(radius=radius)
    model.gravity.linear = np.array(gravity, dtype=float)
    return on_shell(model, shell, law, radius=radius)


def force_on(scene, center):
    return scene.external_forces(free_q(center), np.zeros(6))[1]


@pytest.mark.parametrize(
    ("name", "share", "exact", "inner", "error"),
    [(name, share, True, 0.8, 1e-3) for name in SURFACES for share in (0.3, 0.6)]
    # Without normals the surface is nearly met, away from its border.
    + [(name, 0.5, False, 0.4, 3e-3) for name in ("saddle of a torus", "ellipsoid")],
)
def test_force_of_a_coarse_tessellation_is_that_of_elliptical_hertz(
    name, share, exact, inner, error
) -> None:
    surface = SURFACES[name]
    assert 0.25 < surface.longest_side < 0.345  # diagonals included
    scene, rng = ball_scene(surface.shell(exact=exact), share, LAW), np.random.default_rng(1)
    for _ in range(15):
        u, v = surface.inside(rng, inner)
        x, n = surface.point(u, v), surface.normal(u, v)
        low, high = 0.5 * (1 / share + surface.curvatures(u, v))
        for depth in (0.01 * share, 0.03 * share):
            expected, *_ = hertz_contact(low, high, MODULUS, depth)
            force = force_on(scene, x + (share - depth) * n)
            assert np.isclose(force.linear @ n, expected, rtol=error)
            if exact:
                assert np.linalg.norm(force.linear - force.linear @ n * n) < 2e-3 * expected
            assert np.abs(force.angular).max() < 1e-12 * expected  # through the ball's center


def test_flat_is_the_plane() -> None:
    shell = square()
    for radius, depth in ((0.1, 1e-3), (0.5, 1e-2)):
        force = force_on(ball_scene(shell, radius, LAW), [0.2, 0.1, radius - depth])
        expected = 4 / 3 * MODULUS * np.sqrt(radius) * depth**1.5
        assert np.isclose(force.linear[2], expected, rtol=1e-12)
        assert np.isclose(LAW.on_plane(radius).normal_force(depth), expected, rtol=1e-12)


def test_two_balls_are_hertz_on_both_radii() -> None:
    scene = sp.Scene(ball(joint=pin.JointModelTranslation()))
    scene.add_contact(sp.Sphere(0.1, "ball"), sp.Sphere(0.3, "universe"), law=LAW)
    force = scene.external_forces(np.array([0, 0, 0.399]), np.zeros(3))[1].linear
    expected = sp.ImpactLaw.hertz(0.1, YOUNG, POISSON, YOUNG, POISSON, radius_2=0.3)
    assert np.isclose(force[2], expected.normal_force(1e-3), rtol=1e-12)


@pytest.mark.parametrize("name", ["saddle of a torus", "ellipsoid"])
def test_energy_closes_where_the_curvature_changes_along_the_path(name) -> None:
    surface = SURFACES[name]
    x, n = surface.middle()
    along = np.cross(n, [0.3, 0.2, 1.0])
    scene = ball_scene(surface.shell(), 0.3, LAW, gravity=-50 * n)
    start = free_q(x + 0.297 * n)
    speed = np.array([*(1.5 * along / np.linalg.norm(along)), 0, 0, 0])
    result = sp.Simulation(scene, sp.Adaptive(rtol=1e-10, atol=1e-12)).run(start, speed, 0.1)
    energy = result.energy
    total = energy.kinetic + energy.potential + energy.elastic
    assert len(result.contacts) > 100
    assert np.ptp(total) < 1e-6 * np.ptp(energy.elastic)


@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_restitution_is_that_stated(restitution) -> None:
    surface = SURFACES["ellipsoid"]
    law = sp.HertzLaw(YOUNG, POISSON, restitution=restitution, speed=1.0)
    x, n = surface.middle()
    scene = ball_scene(surface.shell(), 0.3, law)
    result = sp.Simulation(scene).run(free_q(x + 0.3001 * n), [*-n, 0, 0, 0], 0.05)
    assert np.isclose(result.v[-1][:3] @ n, restitution, rtol=2e-3)


def test_a_loss_tangent_is_that_of_a_small_oscillation() -> None:
    # About a depth the loss in a cycle over 2 pi times the energy at its peak.
    tangent, frequency = 0.1, 200.0
    law = sp.HertzLaw(YOUNG, POISSON, loss_tangent=tangent, frequency=frequency, radius=0.01)
    depth, amplitude, omega = 1e-4, 1e-7, 2 * np.pi * frequency
    phase = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    rate = amplitude * omega * np.cos(phase)
    depths = depth + amplitude * np.sin(phase)
    force = [law.normal_force(*one) for one in zip(depths, -rate, strict=True)]
    lost = np.mean(force * rate) * (2 * np.pi / omega)
    stored = 0.5 * law.normal_stiffness(depth) * amplitude**2
    assert np.isclose(lost / (2 * np.pi * stored), tangent, rtol=1e-5)


def test_a_socket_of_nearly_the_ball_s_radius_is_beyond_hertz() -> None:
    surface = SURFACES["inside a cylinder"]
    x, n = surface.middle()
    for radius, kinds in ((0.995, {"beyond_hertz"}), (0.97, set())):
        scene = ball_scene(surface.shell(), radius, sp.HertzLaw(1e9, POISSON))
        start = free_q(x + (radius - 1e-4 * radius) * n)
        result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-5)).run(start, np.zeros(6), 1e-4)
        assert {e.kind for e in result.events} - {"touch", "lift_off", "deep"} == kinds


def test_a_vertex_is_like_what_is_beside_it() -> None:
    # A ball that is large against the shell rests on vertices, where elements bend too little.
    surface = cylinder(1.0, (8, 10))
    scene = ball_scene(surface.shell(), 200.0, LAW)
    u, v = 0.75, 0.0  # of a vertex
    sizes = []
    for away in (0.0, 1e-6):
        x, n = surface.point(u + away, v + away), surface.normal(u + away, v + away)
        sizes.append(np.linalg.norm(force_on(scene, x + (200 - 1e-3) * n).linear))
    assert np.isclose(*sizes, rtol=1e-5)
    expected, *_ = hertz_contact(0.5 / 200, 0.5 * (1 + 1 / 200), MODULUS, 1e-3)
    assert np.isclose(sizes[0], expected, rtol=1e-5)


@pytest.mark.parametrize("share", [0.3, 0.6])
@pytest.mark.parametrize("name", SURFACES)
def test_ellipse_and_pressure_are_recorded(name, share) -> None:
    surface = SURFACES[name]
    scene = ball_scene(surface.shell(), share, LAW)
    u, v = (0.37 * a + 0.63 * b for a, b in surface.spans)
    x, n = surface.point(u, v), surface.normal(u, v)
    depth = 0.02 * share
    low, high = surface.curvatures(u, v)
    _, *expected = hertz_contact(0.5 * (1 / share + low), 0.5 * (1 / share + high), MODULUS, depth)
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(1e-9))
    start = free_q(x + (share - depth) * n)
    patch = simulation.run(start, None, 1e-9, record=("patch",)).patches[0]
    found = [*patch["half_axes"], patch["peak_pressure"]]
    assert np.allclose(found, expected, rtol=2e-3)
    if name not in ("sphere", "ellipsoid"):
        direction = surface.point(u, v + 1e-6) - x  # along the meridian or the axis
        axis = patch["axis_world"] @ direction / np.linalg.norm(direction)
        assert min(abs(abs(axis) - 1), abs(axis)) < 1e-3


def test_a_number_of_the_second_material_that_is_left_out_is_that_of_the_first() -> None:
    for kind, more in ((sp.HertzLaw, ()), (sp.MindlinFriction, (0.5, 0.4))):
        whole = kind(*more, 1e6, 0.48, 5e6, 0.48)
        assert kind(*more, 1e6, 0.48, young_2=5e6)._moduli == whole._moduli
    expected = 1 / ((1 - 0.48**2) / 1e6 + (1 - 0.3**2) / 1e6)
    assert sp.HertzLaw(1e6, 0.48, poisson_2=0.3).modulus == pytest.approx(expected, rel=1e-15)


def test_names_of_materials_stand_for_their_values() -> None:
    steel, rubber = sp.MATERIALS["steel"], sp.MATERIALS["rubber"]
    numbers = (rubber.young, rubber.poisson, steel.young, steel.poisson)
    assert sp.HertzLaw.of("rubber", "steel") == sp.HertzLaw(*numbers, restitution=0.7, speed=1.0)
    damped = sp.HertzLaw.of("rubber", "steel", loss_tangent=0.1, frequency=10.0)
    assert damped == sp.HertzLaw(*numbers, loss_tangent=0.1, frequency=10.0)
    coefficients = (rubber.friction, rubber.friction * rubber.slip)
    assert sp.CoulombFriction.of("rubber", "steel") == sp.CoulombFriction(*coefficients)
    bristle = sp.BristleFriction.of("rubber", "steel", stiffness=1e4)
    assert bristle == sp.BristleFriction(*coefficients, 1e4)
    mindlin = sp.MindlinFriction.of("rubber", "steel")
    assert mindlin == sp.MindlinFriction(*coefficients, *numbers)
