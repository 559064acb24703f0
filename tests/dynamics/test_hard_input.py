"""What is easy to get wrong: crowded contacts, callbacks that throw, odd models, times, numbers."""

import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.errors import Interrupted, InvalidParameter, ResultError, UnitWarning
from sphshell_pin.study.fit import Experiment
from sphshell_pin.study.fit.data import read_experiment
from tests import meshes, models
from tests.models import LAW, arm, ball, free_q, on_plate

TIP = sp.Sphere(0.1, "ball")


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

    scene, law = sp.Scene(ball(radius=0.1)), sp.ImpactLaw(1e4, 1.5)
    scene.add_contact(TIP, sp.Shell(*meshes.grid_plate()), law=law, name="plate")
    scene.add_contact_source(find, "ball", "universe", law, name="mine")
    q = models.free_q([0, 0, 0.099])
    with pytest.raises(Interrupted) as caught:
        sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(q, None, 1.0)
    result = caught.value.result
    assert 0 < len(result.contacts) == len(result.contacts.row) == len(result.contacts.t)
    assert result.contacts.row.max() < len(result.t)
    assert len(sp.Result.load(result.save(tmp_path / "part.npz")).t) == len(result.t)


def test_a_joint_that_moves_no_mass_is_named() -> None:
    model = ball()
    model.inertias[1] = pin.Inertia.Zero()
    scene = sp.Scene(model)
    with pytest.raises(InvalidParameter, match=r"'ball_joint'.*moves no mass"):
        sp.Simulation(scene).run(pin.neutral(scene.model), None, 0.01)
    with pytest.raises(InvalidParameter, match="moves no mass"):
        scene.explain()


def test_rows_farther_apart_than_the_run_is_long() -> None:
    scene = sp.Scene(ball())
    rows = sp.Simulation(scene).run(scene.neutral, None, 0.01, record_dt=1e9)
    assert rows.t.tolist() == [0.0, 0.01]


def explained(sphere: sp.Sphere, shell: sp.Shell, model=None, **more) -> list[str]:
    """The warnings of the explanation of a contact."""
    scene = sp.Scene(model or ball(radius=0.1))
    scene.add_contact(sphere, shell, law=models.LAW, **more)
    return scene.explain().warnings


def warned(words: str, *given, **more) -> bool:
    return any(words in one for one in explained(*given, **more))


def test_one_sided_open_shells_and_millimeters_taken_for_meters_are_warned_of() -> None:
    vertices, elements = meshes.grid_plate()
    plate = sp.Shell(vertices, elements)
    assert warned("one-sided", TIP, sp.Shell(vertices, elements, side="outside"))
    with pytest.warns(UnitWarning, match="radius = 10 .* is more than the robot's reach"):
        assert warned("is it in mm?", sp.Sphere(10, "ball"), plate, models.arm())
    with pytest.warns(UnitWarning, match="'plate'.*unit='mm'"):
        assert warned("unit='mm'", TIP, sp.Shell(1000 * vertices, elements, name="plate"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        explained(TIP, plate)


@pytest.mark.parametrize(
    ("friction", "warns"),
    [
        (sp.CoulombFriction(0.8, 0.68), True),
        (sp.CoulombFriction(0.8, 0.68, 0.005, 0.05), False),
        (sp.BristleFriction(0.8, 0.68, 1e4, 10.0), False),
    ],
)
def test_friction_that_creeps_visibly_is_warned_of(friction: sp.Friction, warns: bool) -> None:
    given = sp.Sphere(0.01, "ball"), sp.Shell(*meshes.grid_plate())
    assert warned("creeps at 0.035 m/s", *given, friction=friction) == warns
    creep = friction.creep_speed
    assert creep == 0.0 or friction.coefficient(creep) == pytest.approx(0.4, rel=1e-12)


def _set(name: str, value: object):
    return lambda model: setattr(model, name, value)


def _mass(value: float):
    return lambda model: setattr(model.inertias[1], "mass", value)


HERE, NOWHERE = pin.SE3.Identity(), pin.SE3(np.full((3, 3), np.nan), np.zeros(3))
DEADLY = {
    "parent": lambda model: model.parents.__setitem__(1, 7),
    "mass nan": _mass(np.nan),
    "placement nan": lambda model: model.jointPlacements.__setitem__(1, NOWHERE),
}
CHANGES = DEADLY | {
    "joint": lambda model: model.addJoint(1, pin.JointModelRX(), HERE, "new"),
    "no gravity": lambda model: setattr(model.gravity, "linear", np.zeros(3)),
    "mass": _mass(2.0),
    "frame": lambda model: model.addFrame(pin.Frame("new", 1, HERE, pin.FrameType.OP_FRAME)),
}
DEADLY["negative mass"] = _mass(-1.0)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("compiled", [False, True])
def test_a_changed_model_is_noticed(change: str, compiled: bool) -> None:
    scene = on_plate(ball(), LAW)
    simulation = sp.Simulation(scene)
    if compiled:
        scene.contacts(Q)
    varied = scene.with_pairs(scene.pairs)
    CHANGES[change](scene.model)
    for use in (
        lambda: scene.model,
        lambda: scene.external_forces(Q),
        lambda: scene.contacts(np.r_[Q, 0.3]),
        lambda: scene.contact_derivatives(Q),
        lambda: scene.explain(Q),
        lambda: simulation.run(Q, None, 0.01),
        lambda: simulation.rollout([Q] * 2, None, 0.01),
        lambda: varied.contacts(Q),
    ):
        with pytest.raises(InvalidParameter, match=r"scene\.model was changed"):
            use()


def test_an_untouched_model_is_one_object_and_equal_to_the_given_one() -> None:
    model = arm()
    scene = sp.Scene(model)
    assert scene.model is scene.model
    assert scene.model is not model
    assert scene.model == model
    CHANGES["joint"](model)
    assert len(scene.external_forces(pin.neutral(scene.model))) == scene.model.njoints


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        *((damage, "joint") for damage in DEADLY.values()),
        (lambda model: model.joints[1].setIndexes(1, 40, 40), "indices of joint"),
        (lambda model: model.nqs.__setitem__(1, 3), "indices of joint"),
        (lambda model: model.idx_vs.__setitem__(1, 40), "lists of indices"),
        (lambda model: model.subtrees[1].append(40), "supports or subtrees"),
        (lambda model: model.supports[1].append(40), "supports or subtrees"),
        (_set("armature", np.zeros(1)), "armature has 1 numbers, nv is 6"),
        (_set("lowerPositionLimit", np.zeros(1)), "lowerPositionLimit has 1 numbers, nq is 7"),
    ],
)
def test_a_model_that_pinocchio_would_not_survive_makes_no_scene(damage, said: str) -> None:
    model = ball()
    damage(model)
    with pytest.raises(InvalidParameter, match=said):
        sp.Scene(model)


Q = free_q([0.0, 0.0, 0.049])


def test_laws_at_the_end_of_the_numbers_run_and_are_explained() -> None:
    scene = on_plate(ball(), sp.HuntCrossleyLaw(1e308, 1e20))
    assert "1 contact pair" in str(scene.explain(Q))
    assert len(sp.Simulation(scene).run(Q, None, 0.001).t)


def test_arguments_of_files_and_pictures_are_named(tmp_path) -> None:
    result = sp.Simulation(on_plate(ball(), LAW)).run(Q, None, 0.001)
    path = tmp_path / "run.mcap"
    with pytest.raises(InvalidParameter, match=r"kind = .* must be a name"):
        result.plot(np.array(["a", "b"]))
    pytest.importorskip("mcap")
    with pytest.raises(InvalidParameter, match="scene = 'wrong' must be a Scene"):
        result.to_mcap(path, scene="wrong")
    with pytest.raises(ResultError, match="are not all from 1970 to 2038"):
        replace(result, t=np.full_like(result.t, -1e308)).to_mcap(path)


def read(force, **more):
    """Return the data of a force at two times; `more` columns by name."""
    data = {"t [s]": [0.0, 1.0], "f [N]": force} | more
    return read_experiment(Experiment(data), 1, {"f": "N"}, 1.0)


def test_data_that_cannot_be_computed_with_are_named() -> None:
    with pytest.raises(errors.DataError, match=r"row 1: 1e\+308 in column 'f \[N\]' is too large"):
        read([1.0, 1e308])
    with pytest.raises(errors.DataError, match=r"'f.sigma' must be positive .*too small to comp"):
        read([1.0, 2.0], **{"f.sigma [N]": [1e-320] * 2})
    assert read(np.ma.masked_greater([1.0, 2.0], 1.5))[0].measured.tolist() == [1.0]
