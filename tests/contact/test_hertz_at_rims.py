"""`HertzLaw` with the surface's curvature: rims, borders, corners and the smallest depths."""

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.testing import assert_derivatives
from tests.models import block, on_shell

RADIUS = 6e-3
LAW = sp.HertzLaw(2e7, 0.4)


def without_faces(geometry) -> sp.Shell:
    solid = sp.Shell.from_geometry(geometry)
    return sp.Shell(solid.vertices, solid.elements, faces=False)


def open_bowl() -> sp.Shell:
    """Half an ellipsoid: its border is a curve."""
    solid = sp.Shell.from_geometry(coal.Ellipsoid(0.03, 0.03, 0.05), segments=32)
    corners = solid.vertices[solid.triangles]
    return sp.Shell(solid.vertices, solid.triangles[corners[:, :, 2].max(axis=1) < 1e-9])


SHELLS = {
    "cylinder": lambda: sp.Shell.from_geometry(coal.Cylinder(0.03, 0.1)),
    "cone": lambda: sp.Shell.from_geometry(coal.Cone(0.03, 0.1)),
    "cylinder of a mesh": lambda: without_faces(coal.Cylinder(0.03, 0.1)),
    "ellipsoid": lambda: without_faces(coal.Ellipsoid(0.03, 0.02, 0.05)),
    "bowl": open_bowl,
}


def scene(shell: sp.Shell, mass: float = 0.02) -> sp.Scene:
    return on_shell(block(0.0, mass, RADIUS), shell, LAW, radius=RADIUS)


def starts(shell: sp.Shell, rng: np.random.Generator, lean: float):
    """A place on an element, a side or a corner, and a direction away from it."""
    triangle = rng.integers(len(shell.triangles))
    weights = rng.dirichlet([1.0, 1.0, 1.0])
    kind = rng.random()
    if kind < 0.3:
        weights = np.eye(3)[rng.integers(3)]
    elif kind < 0.7:
        weights[rng.integers(3)] = 0.0
    place = weights @ shell.vertices[shell.triangles[triangle]] / weights.sum()
    away = shell.triangle_normals[triangle] + lean * rng.normal(size=3)
    return place, away / np.linalg.norm(away)


@pytest.mark.parametrize("name", SHELLS)
def test_forces_and_derivatives_are_numbers(name):
    """At depths from 1e-17 to 0.03 of the radius, the normal in any direction."""
    shell, rng = SHELLS[name](), np.random.default_rng(1)
    several, compared = scene(shell), 0
    for i in range(400):
        place, away = starts(shell, rng, 0.9)
        near = place + RADIUS * away
        foot = shell.closest_points([near]).points[0]
        from_foot = near - foot
        if np.linalg.norm(from_foot) < 1e-9:
            continue
        depth = RADIUS * 10 ** rng.uniform(-17.0, -1.5)
        center = foot + (RADIUS - depth) * from_foot / np.linalg.norm(from_foot)
        force = several.external_forces(center, np.zeros(3))[1].linear
        assert np.isfinite(force).all()
        pressed = several.contacts(center).normal_force
        # What the surface rises beyond its elements comes on with the depth: at first twice.
        assert np.linalg.norm(force) <= 2.1 * pressed.sum() + 1e-12
        if i % 4 == 0:
            assert np.isfinite(several.dynamics_derivatives(center, np.zeros(3)).by_q).all()
            compared += 1
    assert compared > 60


@pytest.mark.parametrize("name", SHELLS)
def test_elastic_bounces_at_rims_keep_the_energy(name):
    shell, rng = SHELLS[name](), np.random.default_rng(3)
    several, bounces = scene(shell), 0
    for _ in range(40):
        place, away = starts(shell, rng, 0.6)
        center = place + 1.3 * RADIUS * away
        if shell.closest_points([center]).distances[0] < 1.02 * RADIUS:
            continue
        solver = sp.Adaptive(rtol=1e-8, atol=1e-10)
        done = sp.Simulation(several, solver).run(center, -0.5 * away, 0.02)
        bounces += len(done.contacts.depth) > 0
        assert abs(done.energy.residual[-1]) < 1e-5 * 0.5 * 0.02 * 0.25
    assert bounces > 15


def test_the_force_is_continuous_where_a_border_is_met_edge_on():
    shell = open_bowl()
    several = scene(shell)
    top = np.array([0.03, 0.0, 0.0])
    # Around the border's tangent, from inside the bowl to outside: edge-on is in the middle.
    forces = []
    for angle in np.pi / 2 + np.linspace(-1e-3, 1e-3, 41):
        around = np.array([-np.cos(angle), 0.0, np.sin(angle)])
        center = top + (RADIUS - 2e-5) * around
        forces.append(several.external_forces(center, np.zeros(3))[1].linear)
    forces = np.array(forces)
    size = np.linalg.norm(forces, axis=1)
    assert size.min() > 0.0
    assert np.abs(np.diff(forces, axis=0)).max() < 1e-3 * size.max()


@pytest.mark.parametrize("off", [0.0, 1e-6, 1e-4, 3e-4, 6e-4])
def test_derivatives_hold_at_the_tip_of_a_cone(off):
    """On the tip, and at this distance from its axis on the side, normal to it."""
    half_angle, several = np.arctan(0.3), scene(SHELLS["cone"]())
    slope = np.array([np.cos(half_angle), 0.0, np.sin(half_angle)])
    tip = np.array([0.0, 0.0, 0.05])
    around = np.linspace(0.3, 6.0, 5)
    for lean in (0.0, 0.5, 0.99) if off == 0.0 else (1.0,):
        for angle in around:
            turn = pin.utils.rotate("z", angle)
            normal = lean * slope + (1 - lean) * np.array([0.0, 0.0, 1.0])
            normal = turn @ normal / np.linalg.norm(normal)
            place = tip + turn @ np.array([off, 0.0, -off / 0.3])
            center = place + (RADIUS - 1e-4) * normal
            assert len(several.contacts(center).depth) == 1
            assert_derivatives(several, center, np.zeros(3), tolerance=1e-5)


def test_the_energy_does_not_jump_from_the_side_of_a_cone_to_its_tip():
    half_angle, several = np.arctan(0.3), scene(SHELLS["cone"]())
    simulation = sp.Simulation(several, sp.SemiImplicitEuler(1e-12))
    tip, slope = np.array([0, 0, 0.05]), np.array([np.cos(half_angle), 0, np.sin(half_angle)])
    energies, forces = [], []
    for off in np.linspace(-1e-6, 1e-6, 9):
        # Along the side through the cone's plane, and on round the tip.
        center = tip + (RADIUS - 1e-4) * slope + off * np.array([slope[2], 0, -slope[0]])
        energies.append(simulation.run(center, np.zeros(3), 1e-12).energy.elastic[0])
        forces.append(several.external_forces(center, np.zeros(3))[1].linear)
    assert np.ptp(energies) < 3e-3 * max(energies)
    assert np.abs(np.diff(forces, axis=0)).max() < 3e-3 * np.abs(forces).max()
