"""The first picture of a new scenario, and what a user may ask of it: the place and the path."""

from pathlib import Path

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.touch_points import sides
from sphshell_pin.scenario.running.run import simulate
from tests.models import jacobian_of
from tests.scenario.files import center_of

GANTRY = Path(__file__).parents[1] / "data" / "robots" / "gantry.urdf.xacro"


def placed(built):
    """Return the vertices of the surface in the world, and its placement."""
    (side,) = (pair.side_j for pair in built.scene.pairs)
    return side.shell.transformed(side.placement).vertices, side.placement


def way(built):
    return np.array(built.scenario.controller.path)


def test_a_part_lies_before_a_bent_arm_as_on_a_table(arm, plate, draft, tmp_path):
    """The arm stands straight up at zero: by default it does what `--place below` does."""
    made = draft(arm, plate, radius=0.01)
    below = new_scenario(arm, plate, radius=0.01, place="below", out=tmp_path / "b.toml")
    assert made.text.replace("a.toml", "b.toml") == below.text
    corners, placement = placed(made.built)
    assert corners[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(placement.rotation, np.eye(3), atol=1e-9)
    (contact,) = made.built.scene.explain(made.built.q0).pairs
    assert contact.gap > 0
    # All six directions of the tip are free, and no joint is at a limit.
    q = made.built.q0
    values = np.linalg.svd(jacobian_of(made.built.scene.model, q, "link_5"), compute_uv=False)
    assert values[-1] > 0.02 * values[0]
    assert np.abs(q).max() < 2.75
    assert np.linalg.norm(way(made.built)[-1] - way(made.built)[0]) > 0.05


def dome(tmp_path, *, up):
    """Write an open hemisphere of radius 0.1 m, its rim at z = 0; return the file."""
    ball = sp.Shell.from_geometry(coal.Sphere(0.1))
    kept = ball.triangles[(ball.vertices[ball.triangles][:, :, 2] > -1e-9).all(axis=1)]
    vertices = ball.vertices * [1.0, 1.0 if up else -1.0, 1.0 if up else -1.0]
    path = tmp_path / "dome.shl"
    sp.Shell(vertices, kept).to_file(path)
    return path


@pytest.mark.parametrize("up", [True, False])
def test_an_open_scan_is_touched_from_outside(up, arm, draft, tmp_path):
    file = dome(tmp_path, up=up)
    np.testing.assert_array_equal(sides(sp.Shell.from_file(file))[0], [0, 0, 1 if up else -1])
    built = draft(arm, file, radius=0.01).built
    assert np.linalg.norm(center_of(built, built.q0)) > 0.1
    # It lies on its rim.
    assert placed(built)[0][:, 2].min() == pytest.approx(0.0, abs=1e-5)


def test_a_gantry_slides(plate, draft):
    """Nothing can turn its tip, so that it needs no joints against rolling."""
    made = draft(GANTRY, plate, frame="probe", radius=0.01)
    control = made.built.scenario.controller
    assert len(control.path) > 2
    assert control.rotational_stiffness == 0.0
    result, _ = simulate(made.built)
    moved = np.linalg.norm(result.q[-1][:2] - result.q[0][:2])
    first, *_, last = way(made.built)
    assert moved == pytest.approx(np.linalg.norm(last - first), rel=0.05)


def test_a_point_of_the_part_is_touched(arm, plate, draft, tmp_path):
    at = (0.05, -0.06, 0.04)
    for text in (at, "0.05, -0.06, 0.04"):
        built = draft(arm, plate, radius=0.01, at=text).built
        np.testing.assert_allclose(way(built)[0], at, atol=1e-5)
    # A side is turned up, as the tip presses down.
    built = new_scenario(arm, plate, radius=0.01, at=(0.15, 0, 0.02), out=tmp_path / "b.toml").built
    np.testing.assert_allclose(placed(built)[1].rotation @ [1, 0, 0], [0, 0, 1], atol=1e-9)


def test_a_face_is_touched_by_its_kind_and_size(arm, draft, tmp_path):
    """A cylinder of 40 mm on its end: its mantle, or the larger of its planes."""
    sp.Shell.from_geometry(coal.Cylinder(0.04, 0.1)).to_file(tmp_path / "rod.shl")
    for text in ("cylinder", "cylinder 40 mm", "cylinders of radius 40 mm"):
        built = draft(arm, tmp_path / "rod.shl", radius=0.01, at=text).built
        assert np.linalg.norm(way(built)[0][:2]) == pytest.approx(0.04, rel=2e-3)
    built = draft(arm, tmp_path / "rod.shl", radius=0.01, at="plane").built
    assert abs(way(built)[0][2]) == pytest.approx(0.05, abs=1e-6)
    with pytest.raises(SphshellError, match=r"has no face 'cylinder 30 mm'; .*radius 40 mm"):
        draft(arm, tmp_path / "rod.shl", radius=0.01, at="cylinder 30 mm")
    with pytest.raises(SphshellError, match=r"no face 'lid': give x,y,z"):
        draft(arm, tmp_path / "rod.shl", radius=0.01, at="lid")


def length_of(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def test_the_path_has_the_shape_and_length_asked_for(arm, plate, draft):
    line = way(draft(arm, plate, radius=0.01, path="line", length=0.08).built)
    assert length_of(line) == pytest.approx(0.08, abs=0.005)
    circle = way(draft(arm, plate, radius=0.01, path="circle", length=0.1).built)
    np.testing.assert_allclose(circle[0], circle[-1], atol=1e-5)
    away = np.linalg.norm(circle[:-1] - circle[:-1].mean(axis=0), axis=1)
    np.testing.assert_allclose(away, 0.1 / (2 * np.pi), rtol=1e-2)
    made = draft(arm, plate, radius=0.01, path="raster", length=0.12)
    raster = way(made.built)
    assert len(raster) == 10
    assert length_of(raster) == pytest.approx(0.12, rel=1e-3)
    assert not made.built.scenario.controller.spline
    np.testing.assert_allclose(raster[:, 2], 0.04, atol=1e-6)


def test_the_points_of_a_path_are_taken_over(arm, plate, draft):
    points = [[-0.02, 0, 0.04], [0.03, 0.0, 0.04], [0.03, 0.03, 0.04]]
    text = "; ".join(",".join(map(str, one)) for one in points)
    for path in (points, text):
        built = draft(arm, plate, radius=0.01, path=path).built
        np.testing.assert_allclose(way(built), points, atol=1e-5)
    result, _ = simulate(built)
    center = center_of(built, result.q[-1])
    np.testing.assert_allclose(center[:2], points[-1][:2], atol=0.003)
