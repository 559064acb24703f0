"""Two files of one part: faces that differ are found, by how much, and misplaced parts."""

import json
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import Shell
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.study.against import Against, compare_shells
from tests.command import call, refused, succeed

# An L without any symmetry, extruded [m].
OUTLINE = np.array([[0, 0], [0.09, 0], [0.09, 0.02], [0.03, 0.02], [0.03, 0.05], [0, 0.05]])
HEIGHT = 0.035


def bracket(bulge: float = 0.0, unit: str = "m", sides: slice = slice(None)) -> Shell:
    """The L; the middle of its lower side is off by `bulge`; `sides` of it alone."""
    n = len(OUTLINE)
    lids = [np.c_[OUTLINE, np.full(n, z)] for z in (0.0, HEIGHT)]
    middle = np.array([[0.045, -bulge, HEIGHT / 2]])
    walls = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    low = walls[0]
    fan = [[low[k], low[(k + 1) % 4], 2 * n] for k in range(4)]
    elements = [*fan, *walls[1:], list(range(n))[::-1], list(range(n, 2 * n))]
    return Shell(np.concatenate([*lids, middle]), elements[sides], name="bracket")


def off(found: Against) -> list[tuple[int, str, float]]:
    return [(face.of, face.kind, face.worst) for face in found.off]


def test_a_part_is_the_same_as_itself_whatever_its_elements() -> None:
    one = bracket()
    found = compare_shells(one, Shell(one.vertices, one.triangles))
    assert found.same
    assert len(found.faces) == 16
    assert all(face.places > 10 for face in found.faces)
    assert max(abs(face.worst) for face in found.faces) < 1e-9
    assert "the same within 0.01 of the force" in found.verdict()


@pytest.mark.parametrize("bulge", [2e-5, -2e-5, 1e-3, -1e-3])
def test_a_bulging_plane_is_found_by_its_height(bulge: float) -> None:
    found = compare_shells(bracket(), bracket(bulge))
    assert not found.same
    plane = next(face for face in found.faces if face.of == 0 and face.off(0.01))
    assert plane.kind == "plane"
    assert np.sign(plane.worst) == np.sign(bulge)
    assert 0.5 * abs(bulge) < abs(plane.worst) <= 1.001 * abs(bulge)
    assert plane.at[1] == pytest.approx(0.0, abs=1e-6)
    assert plane.area == pytest.approx(0.09 * HEIGHT)
    # Its force is (1 + bulge / depth)^1.5; beyond the depth the contact is lost or comes early.
    if abs(bulge) < found.depth:
        expected = (1.0 + plane.worst / found.depth) ** 1.5
        assert any(value == pytest.approx(expected, rel=1e-3) for value in plane.force)
        assert (plane.lost, plane.extra) == (0, 0)
    else:
        assert (plane.lost > 0, plane.extra > 0) == (bulge < 0, bulge > 0)
    # No other plane of the first is off.
    assert [face.area for face in found.off if face.of == 0] == [plane.area]


def test_missing_faces_are_lost_contacts() -> None:
    found = compare_shells(bracket(), bracket(sides=slice(0, -1)))
    (lid,) = [face for face in found.off if face.of == 0]
    assert lid.lost > 0.9 * lid.places
    assert lid.at[2] == pytest.approx(HEIGHT)
    assert f"{lid.lost} contacts lost" in found.verdict()
    back = compare_shells(bracket(sides=slice(0, -1)), bracket())
    (lid,) = [face for face in back.off if face.of == 1]
    assert lid.lost > 0.9 * lid.places
    assert lid.force[0] == 0.0


@pytest.mark.parametrize(
    ("place", "scale", "says"),
    [((0.0, 0.0, 0.0), 25.4, "25.4 times as large"), ((0.001, 0.0, 0.02), 1.0, "(0.001, 0, 0.02)")],
)
def test_a_part_in_another_place_or_unit_is_told_so(place, scale, says):
    first = bracket()
    found = compare_shells(first, first.transformed(pin.SE3(np.eye(3), np.array(place)), scale))
    assert not found.same
    assert found.faces == ()
    assert says in found.verdict()


def test_the_command_prints_the_faces_and_ends_with_1(tmp_path: Any) -> None:
    one, two = tmp_path / "one.obj", tmp_path / "two.stl"
    bracket().to_file(one, "mm")
    bracket(1e-3).to_file(two, "m")
    out, drawn = tmp_path / "figures.json", tmp_path / "map.png"
    units = ("--unit", "mm", "--against-unit", "m")
    options = ("--json", out, "--radius", "2mm", "--map", drawn)
    told = call("check", one, *units, "--against", two, *options)
    assert told.exit_code == 1, told.output
    assert "A one.obj, B two.stl; spheres of radius 0.002 m" in " ".join(told.output.split())
    assert "plane" in told.output
    figures = json.loads(out.read_text())
    assert figures["files"] == [str(one), str(two)]
    assert (figures["same"], figures["radius"]) == (False, 0.002)
    assert drawn.read_bytes().startswith(b"\x89PNG")
    assert 5e-4 < abs(figures["faces"][0]["worst"]) <= 1.001e-3
    succeed("check", one, *units[:2], "--against", one, "--against-unit", "mm")
    assert "--against-unit" in refused("check", one, *units[:2], "--against", two)


def test_numbers_out_of_range_are_refused() -> None:
    with pytest.raises(InvalidParameter, match="radius"):
        compare_shells(bracket(), bracket(), radius=-1.0)
