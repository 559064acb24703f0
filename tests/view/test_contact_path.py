import numpy as np
import pinocchio as pin

from sphshell_pin.view.contact_path import contact_paths, spaced
from tests.view import stand_ins


def test_on_a_turning_shell_the_path_is_in_the_shells_frame():
    model = stand_ins.ball_model()
    placement = pin.SE3(pin.utils.rpyToMatrix(0.3, -0.2, 0.5), np.array([0.1, 0.2, -0.3]))
    pair = stand_ins.contact_pair(model, "ball", 0.05, stand_ins.plate(), "table", placement)
    angles = np.linspace(0.0, 5.0, 30)
    on_shell = np.column_stack((0.002 * np.arange(30), np.zeros(30), np.zeros(30)))
    rows = []
    for row, angle in enumerate(angles):
        turned = pin.SE3(pin.utils.rotate("z", angle), np.zeros(3)) * placement
        point, normal = turned.act(on_shell[row]), turned.rotation[:, 2]
        rows.append({"row": row, "point_world": point, "normal_world": normal})
    q = [stand_ins.ball_configuration(np.zeros(3), angle) for angle in angles]
    (path,) = contact_paths(stand_ins.a_result(angles, q, rows), stand_ins.a_scene(model, pair))
    np.testing.assert_allclose(path.points, on_shell, atol=1e-14)
    np.testing.assert_allclose(path.normals, np.tile([0, 0, 1.0], (30, 1)), atol=1e-14)
    assert path.on_shell
    assert len(path.runs) == 1


def test_a_run_ends_where_the_contact_is_lost_or_jumps():
    model = stand_ins.ball_model()
    scene = stand_ins.a_scene(model, stand_ins.contact_pair(model, "ball", 0.05, stand_ins.plate()))
    places = {0: 0.0, 1: 0.001, 4: 0.002, 5: 0.003, 6: 0.4, 7: 0.401}
    rows = [{"row": row, "point_world": [x, 0, 0]} for row, x in places.items()]
    q = np.tile(stand_ins.ball_configuration(np.zeros(3)), (8, 1))
    (path,) = contact_paths(stand_ins.a_result(np.arange(8), q, rows), scene)
    assert [run.tolist() for run in path.runs] == [[0, 1], [2, 3], [4, 5]]


def test_of_several_contacts_the_hardest_marks_the_path():
    rows = [{"row": 0, "point_world": [x, 0, 0], "normal_force": x} for x in (1.0, 3.0, 2.0)]
    (path,) = contact_paths(stand_ins.a_result([0.0], np.zeros((1, 8)), rows), None)
    np.testing.assert_array_equal(path.points, [[3.0, 0, 0]])
    assert not path.on_shell


def test_spacing_keeps_the_ends_and_drops_the_crowd():
    points = np.column_stack((np.linspace(0, 1, 10_001), np.zeros((10_001, 2))))
    kept = spaced(points, 0.1)
    assert (kept[0], kept[-1]) == (0, 10_000)
    assert len(kept) <= 12
