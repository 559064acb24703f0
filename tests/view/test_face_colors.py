"""Shells colored by the kind of the face that their elements lie on."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.view.recording import render_recording
from sphshell_pin.view.surface import FACE_COLORS, hex_colors

from .test_distance import Sheet, scene_of


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_each_kind_has_its_color(method):
    shell = sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3), segments=36)
    sheet = Sheet(scene_of(shell, method=method))
    sheet.display.show("faces", True)
    ((points, colors),) = sheet.drawn("faces")
    flat = np.isclose(np.abs(points[:, 2]), 0.15)
    kinds = dict(zip(FACE_COLORS, hex_colors(tuple(FACE_COLORS.values())), strict=True))
    is_plane = np.isclose(colors, kinds["plane"], atol=1e-6).all(axis=1)
    is_cylinder = np.isclose(colors, kinds["cylinder"], atol=1e-6).all(axis=1)
    assert (is_plane ^ is_cylinder).all()
    assert flat[is_plane].all()
    assert np.allclose(np.linalg.norm(points[is_cylinder, :2], axis=1), 0.1, rtol=5e-3)
    assert is_cylinder.any()
    assert is_plane.any()


def test_a_recording_names_the_kinds():
    scene = scene_of(sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3)))
    integrator = sp.SemiImplicitEuler(1e-3)
    result = sp.Simulation(scene, integrator).run(np.array([0.0, 0.0, 0.3]), np.zeros(3), 0.01)
    page = render_recording(result, scene, color="faces")
    assert "on no face recognized" in page
    assert FACE_COLORS["torus"] in page
    assert "on no face recognized" not in render_recording(result, scene)
