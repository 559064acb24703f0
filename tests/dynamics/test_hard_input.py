"""Runs that are easy to get wrong: crowded contacts, callbacks that throw, odd models and times."""

import warnings

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import Interrupted, InvalidParameter, UnitWarning
from tests import meshes, models

TIP = sp.Sphere(0.1, "tip")


def ball_model(inertia=None) -> pin.Model:
    model = models.empty()
    inertia = inertia or pin.Inertia.FromSphere(1.0, 0.1)
    models.add_body(model, "tip", pin.JointModelFreeFlyer(), inertia=inertia)
    return model


def test_a_ball_that_fills_a_faceted_socket_touches_every_facet() -> None:
    vertices, elements = meshes.icosphere(5)
    shell = sp.Shell(vertices, elements)
    inner = shell.contacts(np.zeros(3), 1.01, method="facets")
    assert len(inner) == len(elements)
    assert len(np.unique(inner.element)) == len(elements)


@pytest.mark.parametrize("spin", [1.0, 100.0])
def test_a_free_planar_body_keeps_its_momentum(spin: float) -> None:
    model = models.ball(gravity=0.0, joint=pin.JointModelPlanar())
    start, v = [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, spin]
    result = models.run(sp.Scene(model), sp.SemiImplicitEuler(1e-3), start, v, 1.0)
    assert np.linalg.norm(result.v[-1, :2]) == pytest.approx(1.0, abs=1e-12)
    assert result.q[-1, :2] == pytest.approx([1.0, 0.0], abs=1e-12)


def test_an_interrupted_source_leaves_a_consistent_record(tmp_path) -> None:
    """The pair before it has been evaluated when the source throws; its contacts have no row."""
    calls = iter(range(40))

    def find(pose_i: pin.SE3, pose_j: pin.SE3):
        if next(calls, None) is None:
            raise KeyboardInterrupt
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)

    scene, law = sp.Scene(ball_model()), sp.ImpactLaw(1e4, 1.5)
    scene.add_contact(TIP, sp.Shell(*meshes.grid_plate()), law=law, name="plate")
    scene.add_contact_source(find, "tip", "universe", law, name="mine")
    q = models.free_q([0, 0, 0.099])
    with pytest.raises(Interrupted) as caught:
        sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(q, None, 1.0)
    result = caught.value.result
    assert 0 < len(result.contacts) == len(result.contacts.row) == len(result.contacts.t)
    assert result.contacts.row.max() < len(result.t)
    assert len(sp.Result.load(result.save(tmp_path / "part.npz")).t) == len(result.t)


def test_a_joint_that_moves_no_mass_is_named() -> None:
    scene = sp.Scene(ball_model(inertia=pin.Inertia.Zero()))
    with pytest.raises(InvalidParameter, match=r"'tip_joint'.*moves no mass"):
        sp.Simulation(scene).run(pin.neutral(scene.model), None, 0.01)
    with pytest.raises(InvalidParameter, match="moves no mass"):
        scene.explain()


def test_times_that_cannot_be_counted_are_refused() -> None:
    scene = sp.Scene(ball_model())
    q = pin.neutral(scene.model)
    with pytest.raises(InvalidParameter, match="t0"):
        sp.Simulation(scene).run(q, None, 0.01, t0=1e13)
    rows = sp.Simulation(scene).run(q, None, 0.01, record_dt=1e9)
    assert rows.t.tolist() == [0.0, 0.01]


def test_normals_of_needles_do_not_depend_on_the_first_corner() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.3, 0.2], [0.5, 0.15 + 1e-7, 0.1]])
    turn = pin.exp3(np.array([0.3, -0.8, 0.5]))
    corners = corners @ turn.T
    first, last = corners[2] - corners[0], corners[1] - corners[2]
    exact = np.cross(first, last)
    exact /= np.linalg.norm(exact)
    for k in range(3):
        shell = sp.Shell(corners, [[k, (k + 1) % 3, (k + 2) % 3]])
        normal = shell._binding.triangle_normals[0]
        assert abs(normal @ exact) == pytest.approx(1.0, abs=1e-15)
        assert np.linalg.norm(normal - np.sign(normal @ exact) * exact) < 1e-8


def explained(sphere: sp.Sphere, shell: sp.Shell, model=None, **more) -> list[str]:
    """The warnings of the explanation of a contact."""
    scene = sp.Scene(model or ball_model())
    scene.add_contact(sphere, shell, law=models.LAW, **more)
    return scene.explain().warnings


def warned(words: str, *given, **more) -> bool:
    return any(words in one for one in explained(*given, **more))


def test_one_sided_open_shells_are_warned_of() -> None:
    assert warned("one-sided", TIP, sp.Shell(*meshes.grid_plate(), side="outside"))


def test_a_radius_in_millimeters_is_suspected() -> None:
    plate = sp.Shell(*meshes.grid_plate(), name="plate")
    with pytest.warns(UnitWarning, match="radius = 10 .* is more than the robot's reach"):
        assert warned("is it in mm?", sp.Sphere(10, "ball"), plate, models.arm())


def test_millimeters_taken_for_meters_are_suspected() -> None:
    vertices, elements = meshes.grid_plate()
    with pytest.warns(UnitWarning, match="'plate'.*unit='mm'"):
        assert warned("unit='mm'", TIP, sp.Shell(1000 * vertices, elements, name="plate"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        explained(TIP, sp.Shell(vertices, elements))


@pytest.mark.parametrize(
    ("friction", "warns"),
    [
        (sp.CoulombFriction(0.8, 0.68), True),
        (sp.CoulombFriction(0.8, 0.68, 0.005, 0.05), False),
        (sp.BristleFriction(0.8, 0.68, 1e4, 10.0), False),
    ],
)
def test_friction_that_creeps_visibly_is_warned_of(friction: sp.Friction, warns: bool) -> None:
    given = sp.Sphere(0.01, "tip"), sp.Shell(*meshes.grid_plate())
    assert warned("creeps at 0.035 m/s", *given, friction=friction) == warns
    creep = friction.creep_speed
    assert creep == 0.0 or friction.coefficient(creep) == pytest.approx(0.4, rel=1e-12)
