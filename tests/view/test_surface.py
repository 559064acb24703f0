import coal
import numpy as np

import sphshell_pin as sp
from sphshell_pin.view.surface import SurfaceMesh, outlined_edges, tube
from tests import meshes


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
    rings = vertices.reshape(len(helix), -1, 3)
    radii = np.linalg.norm(rings - helix[:, None], axis=2)
    np.testing.assert_allclose(radii, 0.01, rtol=1e-9, atol=0)
    # Every inner edge of the mantle belongs to two triangles: no holes.
    edges = np.sort(np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    assert np.count_nonzero(counts == 1) == 2 * 6
    assert counts.max() == 2
