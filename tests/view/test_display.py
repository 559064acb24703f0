import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import ImpactLaw, Plane, Scene, Sphere
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view import Display
from sphshell_pin.view.camera import choose_view
from tests.view import stand_ins
from tests.view.drawn import Film
from tests.view.stand_ins import ball_configuration, ball_model, ball_scene, contact_log, plate


def of_arm(model):
    """The scene of an arm beside a plate."""
    pair = stand_ins.contact_pair(model, "effector_body", 0.05, plate())
    return stand_ins.a_scene(model, pair)


def filmed(scene, q, contacts=None, **options):
    """Transforms by path after one update, and the paths of what was drawn."""
    film = Film()
    Display(scene, visualizer=film.canvas, **options).update(q, contacts)
    return film.matrices, list(film.objects)


def test_shells_and_spheres_move_with_their_bodies():
    placement = pin.SE3(pin.utils.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.4, 0.0, 0.1]))
    scene = ball_scene(plate(name="disc"), "table", placement)
    where, _ = filmed(scene, ball_configuration([1.0, 2.0, 3.0], 0.7))
    expected = pin.SE3(pin.utils.rotate("z", 0.7), np.zeros(3)) * scene.pairs[0].shells[0].placement
    np.testing.assert_allclose(where["shells/0_disc"], expected.homogeneous, atol=1e-12)
    np.testing.assert_allclose(where["spheres/0_tip"][:3, 3], [1.0, 2.0, 3.0])
    with pytest.raises(InvalidParameter, match=r"\(8,\)"):
        filmed(scene, np.zeros(3))


def test_both_of_two_spheres_are_drawn():
    scene = Scene(ball_model())
    ends = Sphere(0.05, "ball"), Sphere(0.02, "table", (0.3, 0.0, 0.1))
    scene.add_contact(*ends, law=ImpactLaw(1e4), name="tip")
    where, drawn = filmed(scene, ball_configuration([1.0, 2.0, 3.0], 0.7))
    np.testing.assert_allclose(where["spheres/0_tip"][:3, 3], [1.0, 2.0, 3.0])
    turned = pin.utils.rotate("z", 0.7) @ [0.3, 0.0, 0.1]
    np.testing.assert_allclose(where["spheres/1_tip"][:3, 3], turned, atol=1e-12)
    assert not any(path.startswith("shells/") for path in drawn)


def test_a_shell_shared_by_many_spheres_is_drawn_once():
    _, drawn = filmed(ball_scene(names=["p0", "p1", "p2", "p3"]), ball_configuration())
    assert sum(path.endswith("/surface") for path in drawn) == 1
    balls = [path for path in drawn if path.startswith("spheres/") and path.endswith("/ball")]
    assert balls == ["spheres/0_p0/ball"]


def test_a_pair_without_sphere_or_shell_shows_its_contacts():
    scene = Scene(ball_model())
    scene.add_contact_source(lambda *_: ([], [], []), "ball", "table", ImpactLaw(1e5), name="gears")
    contacts = contact_log([{"point_world": [0.1, 0.2, 0.3], "normal_force": 7.0}])
    where, _ = filmed(scene, ball_configuration(), contacts)
    np.testing.assert_allclose(where["contacts/point_0"][:3, 3], [0.1, 0.2, 0.3])


def test_names_with_slashes_stay_one_node():
    scene = ball_scene(plate(name="/parts//blade"), names=["a/b"])
    where, _ = filmed(scene, ball_configuration())
    assert "shells/0__parts__blade" in where
    assert "spheres/0_a_b" in where


def test_a_model_without_geometry_gets_a_skeleton():
    model = pin.buildSampleModelManipulator()
    q = pin.neutral(model)
    where, _ = filmed(of_arm(model), q)
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    elbow, rod = model.getJointId("elbow_joint"), where["robot/links/elbow_joint"]
    for joint, end in ((elbow, 0.5), (model.parents[elbow], -0.5)):
        place = data.oMi[joint].translation
        np.testing.assert_allclose((rod @ [0, end, 0, 1])[:3], place, atol=1e-12)
    for matrix in where.values():
        assert np.linalg.norm(matrix[:3, :3], axis=0).min() > 0.0


def test_given_geometry_is_drawn_where_pinocchio_puts_it():
    model = pin.buildSampleModelManipulator()
    geometry = pin.buildSampleGeometryModelManipulator(model)
    geometry.geometryObjects[1].meshScale = np.array([1.0, 2.0, 3.0])
    q = pin.integrate(model, pin.neutral(model), np.linspace(0.1, 0.6, model.nv))
    where, _ = filmed(of_arm(model), q, visual_model=geometry)
    data, placed = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, placed, q)
    for index, body in enumerate(geometry.geometryObjects):
        expected = placed.oMg[index].homogeneous @ np.diag([*body.meshScale, 1.0])
        np.testing.assert_allclose(where[f"robot/visuals/{body.name}"], expected, atol=1e-12)


def test_geometry_of_another_model_is_refused():
    full = pin.buildSampleModelManipulator()
    geometry = pin.buildSampleGeometryModelManipulator(full)
    reduced = pin.buildReducedModel(full, [2], pin.neutral(full))
    with pytest.raises(InvalidParameter, match="buildReducedModel"):
        filmed(of_arm(reduced), pin.neutral(reduced), visual_model=geometry)
    # A joint that is there, and a frame of another one.
    geometry.geometryObjects[-1].parentFrame = 1
    with pytest.raises(InvalidParameter, match="must hang on a joint"):
        filmed(of_arm(full), pin.neutral(full), visual_model=geometry)


def test_a_plane_is_drawn_where_its_shell_is_and_the_eye_above_it():
    scene = Scene(ball_model())
    tilted = Plane("table", (0.0, 0.0, -0.5), (1.0, 0.0, 1.0))
    scene.add_contact(tilted, plate(), frame="ball", law=ImpactLaw(1e4), name="on")
    q = ball_configuration([30.0, 2.0, 3.0], 0.7)
    where, drawn = filmed(scene, q)
    square = where["planes/0_on"]
    up = pin.utils.rotate("z", 0.7) @ [np.sqrt(0.5), 0.0, np.sqrt(0.5)]
    np.testing.assert_allclose(square[:3, 2], up, atol=1e-12)
    assert abs((square[:3, 3] - [0.0, 0.0, -0.5]) @ up) < 1e-12  # on the plane
    # Below the shell, to a cell.
    away = square[:3, 3] - [30.0, 2.0, 3.0]
    low, high = scene.pairs[0].shells[0].shell.box
    assert np.linalg.norm(away - (away @ up) * up) < np.linalg.norm(high - low)
    assert sum(path.endswith("/square") for path in drawn) == 1
    # Normals of contacts lead into the plane.
    view = choose_view(scene, q[None, :], np.array([[30.0, 2.0, 3.0]]), -up[None, :])
    assert (view.eye - view.target) @ up > 0
