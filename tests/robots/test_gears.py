"""The gears' meshes and the scenario's own routine describe the same teeth."""

from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import robots, scenarios
from tests.models import pose_of
from tests.programs import module_of

gear_mesh = module_of(Path(__file__).parents[2] / "docs" / "site" / "gear_mesh.py")


@pytest.fixture(scope="module")
def gears():
    return module_of(Path(scenarios.__file__).parent / "gear_contact.py")


def poses(model, angle_1, angle_2):
    q = np.array([np.cos(angle_1), np.sin(angle_1), np.cos(angle_2), np.sin(angle_2)])
    return pose_of(model, q, "gear_2"), pose_of(model, q, "gear_1")


def test_shipped_meshes_are_the_drawn_ones():
    folder = Path(robots.__file__).parent / "meshes"
    for teeth in (20, 40):
        count = np.frombuffer((folder / f"gear_{teeth}.stl").read_bytes()[80:84], "<u4")[0]
        assert count == len(gear_mesh.gear_triangles(teeth))


def test_points_lie_on_the_flanks(gears):
    """Pressed together by little, the points lie on both outlines."""
    model = robots.load("gear_pair").model
    touched = 0
    for angle in np.linspace(0, 0.5, 23):
        for side in (1, -1):
            turn_2 = -angle / 2 + side * (gears.BACKLASH / 2 + gears.RELIEF) / gears.BASE_2
            pose_2, pose_1 = poses(model, angle, turn_2)
            points, _, depths = gears.find(pose_2, pose_1)
            assert len(depths) >= 1
            assert (depths > 0).all()
            for pose, teeth, turn in ((pose_1, 20, 0), (pose_2, 40, np.pi / 40)):
                outline = gear_mesh.gear_outline(teeth, points=400)
                cs, sn = np.cos(turn), np.sin(turn)
                outline = outline @ np.array([[cs, sn], [-sn, cs]])
                for point in points:
                    distance = np.linalg.norm(outline - pose.actInv(point)[:2], axis=1).min()
                    # The relief's slope moves a point along its flank, a tip's by 0.36 mm at most.
                    assert distance < 4e-4
                    touched += 1
    assert touched > 100


def test_the_lever_is_the_slope_of_the_depth(gears):
    """What the contact does to each shaft is the derivative of the depth: no energy is made."""
    model = robots.load("gear_pair").model
    h = 1e-7
    for angle in np.linspace(0, 0.6, 37):
        turn_2 = -angle / 2 + 1.3e-4 / gears.BASE_2
        pose_2, pose_1 = poses(model, angle, turn_2)
        points, normals, depths = gears.find(pose_2, pose_1)
        plus = gears.find(*poses(model, angle + h, turn_2))[2]
        minus = gears.find(*poses(model, angle - h, turn_2))[2]
        plus_2 = gears.find(*poses(model, angle, turn_2 + h))[2]
        if not len(plus) == len(minus) == len(plus_2) == len(depths):
            continue
        lever_1 = np.cross(points - pose_1.translation, normals)[:, 2]
        lever_2 = np.cross(points - pose_2.translation, normals)[:, 2]
        np.testing.assert_allclose((plus - minus) / (2 * h), lever_1, atol=1e-6)
        np.testing.assert_allclose((plus_2 - depths) / h, -lever_2, atol=1e-6)
