"""`HertzLaw` where a flat goes on smoothly into a fillet: the energy does not jump."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.testing import assert_derivatives
from tests import meshes
from tests.contact.test_hertz_law import MODULUS
from tests.models import block, on_shell
from tests.oracle.hertz import hertz_contact

RADIUS, BEND, HALF, DEPTH = 0.01, 0.015, 0.02, 4e-5
LAW = sp.HertzLaw(1e7, 0.3)
LENGTH = np.sqrt(RADIUS * DEPTH)  # of contact


def halfpipe(**more) -> sp.Shell:
    """A flat floor between two quarter cylinders that are tangent to it."""
    angle = np.linspace(0, np.pi / 2, 25)
    right = np.stack([HALF + BEND * np.sin(angle), BEND - BEND * np.cos(angle)], -1)
    profile = np.concatenate([right[::-1] * [-1, 1], right])
    rails = [np.insert(profile, 1, y, axis=1) for y in (-0.03, 0.03)]
    return sp.Shell(*meshes.ribbon(rails), **more)


def scene(law=LAW, shell=None, gravity=0.0) -> sp.Scene:
    model = block(gravity, 0.05, RADIUS)
    return on_shell(model, shell or halfpipe(), law, radius=RADIUS, name="c")


def center(beyond: float) -> np.ndarray:
    """Where the ball is DEPTH deep, its closest point so far beyond the joint."""
    if beyond <= 0:
        return np.array([HALF + beyond, 0.002, RADIUS - DEPTH])
    angle, reach = beyond / BEND, BEND - RADIUS + DEPTH
    return np.array([HALF + reach * np.sin(angle), 0.002, BEND - reach * np.cos(angle)])


def force(one: sp.Scene, at: np.ndarray) -> np.ndarray:
    return one.external_forces(at, np.zeros(3))[1].linear


def test_away_from_the_joint_each_face_has_its_own_curvature() -> None:
    one = scene()
    for beyond, curvature in ((-1.001, 0.0), (1.001, -1 / BEND)):
        expected, *_ = hertz_contact(0.5 / RADIUS, 0.5 * (1 / RADIUS + curvature), MODULUS, DEPTH)
        found = np.linalg.norm(force(one, center(beyond * LENGTH)))
        assert np.isclose(found, expected, rtol=1e-5)


def test_the_force_is_continuous_and_small_beside_the_normal() -> None:
    one = scene()
    places = np.linspace(-1.2, 1.2, 401) * LENGTH
    forces = np.array([force(one, center(x)) for x in places])
    size = np.linalg.norm(forces, axis=1)
    per_micrometer = np.abs(np.diff(forces, axis=0)).max() / (places[1] - places[0]) * 1e-6
    assert per_micrometer < 0.01 * size.max()
    # The share of the other face goes from 1/2 to 0 as smoothly as it can.
    assert per_micrometer * 1e6 * LENGTH < 0.35 * size.max()
    assert np.all(np.diff(size) > -1e-9 * size.max())
    # On the flat nothing but the law pushes aside, by at most the root of depth over radius.
    flat = places < 0
    assert np.abs(forces[flat, 0]).max() < 0.3 * np.sqrt(DEPTH / RADIUS) * size.max()
    across = force(one, center(1e-9)) - force(one, center(-1e-9))
    assert np.abs(across).max() < 1e-6 * size.max()


def button(sides: int = 32, across: int = 16) -> sp.Shell:
    """A disc that goes on into a round rim; the middle of one side of their joint is along x."""
    angle = np.linspace(0, np.pi / 2, across + 1)
    turns = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    rim = np.stack([HALF + BEND * np.sin(angle), BEND * np.cos(angle) - BEND], axis=1)
    vertices, elements = meshes.revolved([(0.0, 0.0), *rim], turns)
    slope = np.append(0.0, np.repeat(angle, sides))
    out = np.append([0.0], np.tile(turns, across + 1))
    normals = [np.sin(slope) * np.cos(out), np.sin(slope) * np.sin(out), np.cos(slope)]
    return sp.Shell(vertices, elements[:, ::-1], normals=np.transpose(normals))


def test_the_force_is_continuous_beside_a_joint_that_bulges_beyond_its_chords() -> None:
    one, places = scene(shell=button()), np.linspace(-1.2, 1.2, 401) * LENGTH
    reach = BEND + RADIUS - DEPTH
    flat, bent = np.minimum(places, 0.0), np.maximum(places, 0.0) / BEND
    across, height = HALF + flat + reach * np.sin(bent), reach * np.cos(bent) - BEND
    centers = np.stack([across, 0 * across, height], axis=1)
    forces = np.array([force(one, at) for at in centers])
    size = np.linalg.norm(forces, axis=1)
    assert np.abs(np.diff(forces, axis=0)).max() < 3e-3 * size.max()
    assert size[-1] < 0.9 * size[0]  # the rim is softer than the disc


@pytest.mark.parametrize("beyond", [-0.9, -0.4, -0.1, 0.1, 0.4, 0.9])
def test_derivatives_are_those_of_differences(beyond: float) -> None:
    one, at = scene(), center(beyond * LENGTH)
    assert_derivatives(one, at, np.zeros(3), tolerance=1e-5)
    (by_q,) = one.contact_force_derivatives(at, np.zeros(3)).by_q
    assert np.abs(by_q - by_q.T).max() < 1e-5 * np.abs(by_q).max()  # the force is a gradient


@pytest.mark.parametrize("faces", [True, False])
def test_a_ball_that_slides_over_joints_keeps_its_energy(faces: bool) -> None:
    law = sp.HertzLaw(1e6, 0.4)
    depth = law.on_plane(RADIUS).depth_at(0.05 * 9.81)
    residuals = []
    for one in (law, law.on_plane(RADIUS)):
        several = scene(one, halfpipe(faces=faces), 9.81)
        start = np.array([0.0, 0.002, RADIUS - depth])
        simulation = sp.Simulation(several, sp.Adaptive(1e-8, 1e-11))
        run = simulation.run(start, np.array([0.25, 0.0, 0.0]), 1.0)
        residuals.append(np.abs(run.energy.residual).max() / run.energy.kinetic[0])
    assert residuals[0] < 5 * residuals[1] + 1e-6
