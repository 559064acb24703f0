"""Recorded patches: what they are, where they are asked for, and where not."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import ResultError
from tests import meshes
from tests.oracle.hertz import hertz_contact
from tests.patches.scenes import LAW, RADIUS, plate, pressed, slide, slider


def pressing(shell, law=LAW):
    scene = sp.Scene(slider())
    scene.add_contact(sp.Sphere(RADIUS, "ball"), shell, law=law, name="tip")
    return sp.Simulation(scene)


def test_a_ball_on_a_plane_has_the_patch_of_hertz():
    result = slide()
    patches, log = result.patches, result.contacts
    assert len(patches) == len(log) == 51
    # Johnson 4.2: a^2 = R depth, p0 = 3 N / (2 pi a^2).
    a = np.sqrt(RADIUS * log.depth)
    np.testing.assert_allclose(patches["half_axes"], np.stack([a, a], axis=1), rtol=1e-12)
    peak = 1.5 * log.normal_force / (np.pi * a * a)
    np.testing.assert_allclose(patches["peak_pressure"], peak, rtol=1e-12)
    np.testing.assert_allclose(patches["mean_pressure"] * 1.5, patches["peak_pressure"])
    np.testing.assert_allclose(patches["approach"], log.depth)
    assert np.abs((patches["axis_world"] * log.normal_world).sum(axis=1)).max() < 1e-15
    assert not patches.flags.writeable


def test_other_numbers_are_the_same_without_patches():
    simulation, q0 = pressing(plate()), [0.0, 0.0, RADIUS - pressed(20.0)]
    asked = simulation.run(q0, [0.1, 0, 0], 0.02, record=["patch"])
    not_asked = simulation.run(q0, [0.1, 0, 0], 0.02)
    assert np.array_equal(asked.q, not_asked.q)
    assert np.array_equal(asked.contacts.normal_force, not_asked.contacts.normal_force)
    assert not_asked.patch_rows is None
    with pytest.raises(ResultError, match=r"record=\('patch',\)"):
        not_asked.patches  # noqa: B018


def test_open_runs_and_rollouts_record_them():
    simulation, q0 = pressing(plate()), [0.0, 0.0, RADIUS - pressed()]
    run = OpenRun(simulation, q0, record_dt=1e-3, record=("patch",))
    assert len(run.snapshot().patches) == 1
    assert len(run.advance(0.01).patches) == 11
    assert len(run.advance(0.0).patches) == 0
    rollout = simulation.rollout([q0, q0], duration=0.01, record=("patch",))
    assert len(rollout[1].patches) == len(rollout[1].contacts) == 2


def test_a_contact_of_unknown_geometry_has_no_patch():
    def find(pose_i, pose_j):
        return np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([1e-4])

    scene = sp.Scene(slider())
    scene.add_contact_source(find, "ball", "universe", law=LAW, name="own")
    result = sp.Simulation(scene).run(np.zeros(3), None, 1e-3, record=["patch"])
    assert np.isnan(result.patches["half_axes"]).all()
    assert np.isnan(result.patches["peak_pressure"]).all()


@pytest.mark.parametrize("law", [sp.HertzLaw(1e7, 0.3), LAW], ids=["hertz", "impact"])
def test_a_ball_on_a_cylinder_has_an_elliptical_patch(law):
    radius = 0.03
    flat, elements = meshes.grid_plate(6, 4, quads=True)
    angle, z = 1.8 * flat[:, 0], 0.04 * flat[:, 1]
    across = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    shell = sp.Shell(radius * across + np.outer(z, [0, 0, 1]), elements, normals=across)
    away = np.array([np.cos(0.2), np.sin(0.2), 0.0])
    q0 = (radius + RADIUS - 2e-4) * away + np.array([0.0, 0.0, 3e-3])
    result = pressing(shell, law).run(q0, duration=1e-5, record=("patch",))
    patch, log = result.patches[0], result.contacts
    _, a, b, _ = hertz_contact(0.5 / RADIUS, 0.5 / RADIUS + 0.5 / radius, 1.0, patch["approach"])
    # HertzLaw corrects what the elements leave of the cylinder.
    assert patch["approach"] == pytest.approx(2e-4, rel=1e-3 if law is not LAW else 2e-2)
    np.testing.assert_allclose(patch["half_axes"], [a, b], rtol=2e-3)
    assert abs(patch["axis_world"][2]) == pytest.approx(1.0, abs=1e-6)
    peak = 1.5 * log.normal_force[0] / (np.pi * patch["half_axes"].prod())
    assert patch["peak_pressure"] == pytest.approx(peak, rel=1e-12)
