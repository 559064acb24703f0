"""Surfaces as they are drawn: by kinds of faces, with outlines, and tubes."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.view.display import Display
from sphshell_pin.view.recording import render_recording
from sphshell_pin.view.surface import FACE_COLORS, SurfaceMesh, hex_colors, outlined_edges, tube
from tests import meshes, models
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
    scene = scene_of(sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3)))
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run([0.0, 0.0, 0.3], duration=0.01)
    for faces in (False, True):
        page = render_recording(result, scene, faces=faces)
        assert ("on no face recognized" in page) == faces
    assert FACE_COLORS["torus"] in page


def test_patches_share_no_vertices_and_keep_their_shape():
    cube = sp.Shell(*meshes.cube(quads=True))
    assert len(outlined_edges(cube)) == 12  # no diagonals, which the file does not have
    mesh = SurfaceMesh.of(cube)
    assert len(mesh.vertices) == 24
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], cube.vertices[cube.triangles])


def test_a_fine_shell_is_outlined_by_its_sharp_edges_only(monkeypatch):
    rod = sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3), segments=12)
    assert len(outlined_edges(rod)) > 24
    monkeypatch.setattr("sphshell_pin.view.surface.MOST_OUTLINED_EDGES", 24)
    assert len(outlined_edges(rod)) == 24  # of both rims


def test_a_tube_keeps_its_radius_round_a_helix():
    angle = np.linspace(0.0, 12.0, 400)
    helix = np.column_stack((np.cos(angle), np.sin(angle), 0.1 * angle))
    vertices, triangles = tube(helix, 0.01)
    radii = np.linalg.norm(vertices.reshape(len(helix), -1, 3) - helix[:, None], axis=2)
    np.testing.assert_allclose(radii, 0.01, rtol=1e-9, atol=0)
    # Every inner edge of the mantle belongs to two triangles: no holes.
    edges = np.sort(np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    assert np.count_nonzero(counts == 1) == 2 * 6
    assert counts.max() == 2
