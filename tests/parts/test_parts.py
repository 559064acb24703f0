"""The study of mesh files measures what it says: its solids, its touches, its files."""

import numpy as np
import pytest

from tests.parts.cad_mesh import joined, meshed_faces
from tests.parts.files import KINDS_OF_FILE
from tests.parts.judge import Part, forces_on_planes, loaded, random_part
from tests.parts.occ import area_and_volume
from tests.parts.solids import FAMILIES, family_of, random_solid

EXPORTED = tuple(kind for kind in KINDS_OF_FILE if kind != "decimated")


@pytest.fixture(scope="module")
def part() -> Part:
    """A box with thin walls, rounded."""
    return random_part(tuple(FAMILIES).index("thin_box"))


def test_every_family_makes_a_closed_mesh_of_its_volume() -> None:
    for number, family in enumerate(FAMILIES):
        assert family_of(number) == family
        solid = random_solid(number)
        size = joined(meshed_faces(solid, 1.0, 0.5)).size
        mesh = joined(meshed_faces(solid, 1e-3 * size, 0.3))
        _, volume = area_and_volume(solid)
        corners = mesh.vertices[mesh.triangles]
        inside = np.linalg.det(corners).sum() / 6
        assert inside == pytest.approx(volume, rel=0.05), family


def test_flat_elements_are_exact_on_planes(part: Part) -> None:
    shell, _, _ = loaded(part, "exact normals")
    forces = forces_on_planes(shell, part.touches, "facets")
    assert len(forces) > 10
    np.testing.assert_allclose(forces, 1.0, rtol=0.01)


@pytest.mark.parametrize("kind", EXPORTED)
def test_a_file_has_the_triangles_of_the_mesh(part: Part, kind: str) -> None:
    shell, rows, seconds = loaded(part, kind)
    assert seconds > 0.0
    assert shell.is_closed
    source = rows[shell.source_element[shell.triangle_element]]
    middle = 1e3 * shell.vertices[shell.triangles].mean(axis=1)
    there = part.mesh.vertices[part.mesh.triangles[source]].mean(axis=1)
    assert np.abs(middle - there).max() < 1e-4 * part.mesh.size


def test_rounded_planes_are_found_whole() -> None:
    """Six digits are 0.5 micrometers here, a sixth of the depth; the largest triangle's normal is
    off by more, so its plane missed the others, and curved elements pressed 5.4 times as hard."""
    part = random_part(tuple(FAMILIES).index("variable_fillets"), seed=3)
    shell, _, _ = loaded(part, "text STL, 6 digits")
    forces = forces_on_planes(shell, part.touches, "smooth")
    assert len(forces) > 10
    np.testing.assert_allclose(forces, 1.0, atol=0.2)


def test_a_decimated_file_has_fewer_triangles(part: Part) -> None:
    pytest.importorskip("fast_simplification")
    _, rows, _ = loaded(part, "decimated")
    assert 0.25 < len(rows) / len(part.fine.triangles) < 0.8
    assert (rows == -1).all()
