"""Shells coloured by kinds of faces."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.display import Display
from sphshell_pin.view.recording import render_recording
from sphshell_pin.view.surface import FACE_COLORS, hex_colors
from tests import models
from tests.view.drawn import Film, attribute


def scene_of(shell, method="smooth"):
    return models.on_shell(models.block(), shell, models.linear_law(1e6), method=method)


class Sheet(Film):
    """A display, and what was drawn in it."""

    def __init__(self, scene):
        super().__init__()
        self.display = Display(scene, visualizer=self.canvas)

    def shown(self):
        """Which way to color the shell is seen."""
        return [path.rpartition("/")[2] for path, on in self.visible.items() if on]


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_each_kind_has_its_color(method):
    shell = sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3), segments=36)
    sheet = Sheet(scene_of(shell, method=method))
    assert sheet.shown() == []
    sheet.display.show("faces", True)
    assert sheet.shown() == ["faces"]
    (drawn,) = (drawn for path, drawn in sheet.objects.items() if path.endswith("/faces"))
    points, colors = attribute(drawn), attribute(drawn, "color")
    flat = np.isclose(np.abs(points[:, 2]), 0.15)
    kinds = dict(zip(FACE_COLORS, hex_colors(tuple(FACE_COLORS.values())), strict=True))
    is_plane = np.isclose(colors, kinds["plane"], atol=1e-6).all(axis=1)
    is_cylinder = np.isclose(colors, kinds["cylinder"], atol=1e-6).all(axis=1)
    assert (is_plane ^ is_cylinder).all()
    assert flat[is_plane].all()
    assert np.allclose(np.linalg.norm(points[is_cylinder, :2], axis=1), 0.1, rtol=5e-3)
    assert is_cylinder.any()
    assert is_plane.any()
    sheet.display.show("faces", False)
    assert sheet.shown() == ["surface"]


def test_a_recording_states_the_kinds():
    shell = sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3))
    scene = scene_of(shell)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run([0.0, 0.0, 0.3], duration=0.01)
    for color in ("surface", "faces"):
        page = render_recording(result, scene, color=color)
        assert ("on no face recognized" in page) == (color == "faces")
    assert FACE_COLORS["torus"] in page
    with pytest.raises(InvalidParameter, match="surface, faces"):
        render_recording(result, scene, color="depth")
