"""FoundationLaw in scenes: wrenches, friction by points, energy, derivatives, files."""

from functools import partial

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter
from tests import meshes, models
from tests.contact.smooth.test_sweeps_edges import edged
from tests.dynamics import scenes
from tests.dynamics.scenes import assert_rate_jacobian
from tests.dynamics.test_derivatives import assert_derivatives
from tests.models import ball, free_q, on_plate

KAPPA = 2e4  # modulus / thickness [Pa/m]
LAW = sp.FoundationLaw(1e4, 0.5)
DAMPED = sp.FoundationLaw(1e4, 0.5, dissipation=0.2)
COULOMB = sp.CoulombFriction(0.3, 0.1, 0.1, 1.0)
BRISTLE = sp.BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05)
free_ball = partial(scenes.free_ball, gravity=0.0, mass=10.0)


def test_plane_law() -> None:
    """What the depth alone says: on a plane."""
    law = sp.FoundationLaw(1e6, 5e-3).on_plane(0.01)
    assert law.normal_force(1e-3) == pytest.approx(2e8 * np.pi * 1e-6 * (0.01 - 1e-3 / 3))
    stored = np.trapezoid([law.normal_force(d) for d in np.linspace(0, 1e-3, 2001)], dx=5e-7)
    assert law.energy(1e-3) == pytest.approx(stored, rel=1e-6)
    assert law.depth_at(law.normal_force(7e-4)) == pytest.approx(7e-4)
    with pytest.raises(InvalidParameter, match="on_plane"):
        LAW.normal_force(1e-3)
    damped = DAMPED.on_plane(1.0)
    assert damped.normal_force(0.1, -0.5) == pytest.approx(1.1 * damped.normal_force(0.1))


def test_pressure_adds_up_to_the_contact() -> None:
    shell = edged("cube")
    center = np.array([2.3, 2.2, 2.6])
    points, forces, pressures, areas = sp.foundation_pressure(shell, center, 1.0, LAW)
    on_ball = free_ball(shell, LAW).external_forces(free_q(center))[1]
    assert np.abs(forces.sum(axis=0) - on_ball.linear).max() <= 1e-12 * np.abs(forces).sum()
    assert np.linalg.norm(on_ball.angular) <= 1e-12 * np.linalg.norm(on_ball.linear)
    assert points.shape == forces.shape
    assert pressures.shape == areas.shape == (len(points),)
    with pytest.raises(InvalidParameter, match="FoundationLaw"):
        sp.foundation_pressure(shell, center, 1.0, sp.ImpactLaw(1e4))  # type: ignore[arg-type]


@pytest.mark.parametrize("spin", [0.05, 0.5, 5.0])
def test_spinning_ball_feels_a_moment(spin: float) -> None:
    """Friction of every point by its own speed: the integral over the disc of overlap."""
    depth = 0.1
    scene = free_ball(sp.Shell(*meshes.grid_plate(5, 5, size=4.0)), LAW, COULOMB)
    force = scene.external_forces(free_q([0.1, 0.2, 1 - depth]), np.array([0, 0, 0, 0, 0, spin]))[1]
    nodes, weights = np.polynomial.legendre.leggauss(400)
    rim = np.sqrt(2 * depth - depth**2)
    r, w = rim * (1 + nodes) / 2, weights * rim / 2
    rho = np.hypot(r, 1 - depth)
    pressed = KAPPA * (1 - rho**2) / (2 * rho) * 2 * np.pi * r
    moment = w @ (pressed * r * [COULOMB.coefficient(spin * s) for s in r])
    assert force.angular == pytest.approx([0, 0, -moment], rel=3e-3, abs=1e-2 * moment)
    assert np.linalg.norm(force.linear[:2]) <= 2e-3 * COULOMB.mu_static * force.linear[2]


def test_local_dissipation() -> None:
    """A ball that comes down without turning: p (1 - b gap_rate) everywhere; no pull."""
    scene = free_ball(sp.Shell(*meshes.grid_plate(3, 3, size=4.0)), DAMPED)
    q, still = free_q([0.1, 0.2, 0.9]), np.zeros(6)
    elastic = scene.external_forces(q, still)[1].linear[2]
    for speed, share in ((-0.5, 1.1), (0.5, 0.9), (20.0, 0.0)):
        pressed = scene.external_forces(q, np.array([0, 0, speed, 0, 0, 0]))[1].linear[2]
        assert pressed == pytest.approx(share * elastic, abs=1e-9 * elastic)


@pytest.mark.parametrize(("law", "stretch"), [(LAW, 1e-3), (DAMPED, 1e-3), (DAMPED, 1.0)])
def test_bristle_holds_at_the_center_of_pressure(law, stretch: float) -> None:
    """Its rates and derivatives, but for the small turn of the center of pressure; it slides."""
    scene = free_ball(sp.Shell(*meshes.grid_plate(3, 3, size=4.0)), law, BRISTLE)
    q, v = free_q([0.1, 0.2, 0.9]), np.array([0.02, 0.01, -0.1, 0.01, 0.02, 0.1])
    z = np.zeros(scene._binding.bristle_size)
    z[:3] = np.array([1.0, -2.0, 0.0]) * stretch
    assert_rate_jacobian(scene, q, v, z)


def drop(scene, q, v, duration):
    return sp.Simulation(scene, sp.Adaptive(1e-9, 1e-11)).run(q, v, duration)


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_energy_over_a_crease(method: str) -> None:
    """Sliding over the edge of a block, and over the border of a sheet."""
    for shell in (edged("cube"), edged("sheet")):
        height = 2.0 if shell.side == "outside" else 0.0
        scene = free_ball(shell, LAW, gravity=9.81, method=method)
        q = free_q([1.2, 0.3, height + 0.95])
        result = drop(scene, q, np.array([1.5, 0.1, 0, 0, 0, 0]), 0.8)
        assert result.q[-1, 0] > 2.2
        assert np.abs(result.energy.residual).max() <= 1e-6 * np.ptp(result.energy.kinetic)


def test_energy_with_friction() -> None:
    """What damping and friction take is what is missing."""
    scene = free_ball(edged("cube"), DAMPED, COULOMB, gravity=9.81)
    result = drop(scene, free_q([1.5, 0.3, 3.1]), np.array([1.0, 0.1, 0, 0, 1.0, 3.0]), 0.8)
    energy = result.energy
    assert energy.friction_loss[-1] > 0.01 * np.ptp(energy.kinetic)
    assert np.abs(energy.residual).max() <= 1e-6 * np.ptp(energy.kinetic)


@models.every_integrator(1e-4, 1e-6, 1e-6)
@pytest.mark.parametrize("friction", [COULOMB, BRISTLE], ids=["coulomb", "bristle"])
def test_every_integrator_comes_to_rest(integrator, friction) -> None:
    """At the depth where the foundation carries the weight."""
    law = sp.FoundationLaw(1e4, 0.5, dissipation=3.0)
    scene = free_ball(sp.Shell(*meshes.grid_plate(3, 3, size=4.0)), law, friction, gravity=9.81)
    result = models.run(scene, integrator, free_q([0.1, 0.2, 0.97]), None, 0.7, record_dt=0.01)
    depth = law.on_plane(1.0).depth_at(98.1)
    assert 1 - result.q[-1, 2] == pytest.approx(depth, rel=2e-2)
    assert np.abs(result.energy.residual).max() <= 1e-2 * np.ptp(result.energy.kinetic) + 1e-4


@pytest.mark.filterwarnings("ignore::sphshell_pin.errors.WeakLawWarning")
@pytest.mark.parametrize(("speed", "depth", "duration"), [(2.0, 0.1, 1.0), (60.0, 1.0, 0.1)])
def test_two_spheres(speed: float, depth: float, duration: float) -> None:
    """The faster one goes in by more than its radius: its center is within the other, too."""
    scene = sp.Scene(ball(0.0, 10.0, 1.0))
    other = sp.Sphere(2.0, "universe")
    scene.add_contact(sp.Sphere(1.0, "ball"), other, law=LAW, name="ball")
    q, v = free_q([0.0, 1.7, 2.35]), np.array([0.3, 0.1, -0.2, 0.4, 0.3, 2.0])
    assert_derivatives(scene, q, v)
    start = np.array([0, 0, -speed, 0, 0, 0])
    result = drop(scene, free_q([0.2, 0.1, 3.2]), start, duration)
    assert result.stats.pairs["ball"].max_depth > depth
    assert np.abs(result.energy.residual).max() <= 1e-6 * np.ptp(result.energy.kinetic)


def test_a_foundation_that_cannot_carry_its_load_says_so() -> None:
    scene = on_plate(ball(mass=1000.0), sp.FoundationLaw(1e4, 5e-3))
    with pytest.warns(sp.errors.WeakLawWarning, match="cannot stop the sphere"):
        sp.Simulation(scene).run(free_q([0, 0, 0.06]), np.zeros(6), 0.01)


@pytest.mark.parametrize("depth", [5e-6, 2e-4])
def test_derivatives_by_the_radius_hold_beside_a_border(depth: float) -> None:
    """Where the depth is small beside the radius, by which the steps of differences are."""
    plate = sp.Shell([[-0.02, -1, 0], [0.02, -1, 0], [0.02, 1, 0], [-0.02, 1, 0]], [[0, 1, 2, 3]])
    law = sp.FoundationLaw(1e6, 2e-3, dissipation=0.3)
    scene = models.on_shell(models.block(0.0, 0.05, 0.01), plate, law, radius=0.01)
    center = np.array([0.021, 0.0, np.sqrt((0.01 - depth) ** 2 - 1e-6)])
    assert_derivatives(scene, center, np.full(3, -0.05), 1e-5)
