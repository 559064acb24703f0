"""Compiled robots: the same motion as Pinocchio's, for all kinds of joints that are compiled."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.compiled import robot as compiled_robot
from sphshell_pin.errors import InvalidParameter, SetupWarning, SphshellError
from tests import meshes
from tests.dynamics.test_mimic import gripper
from tests.models import pose_of

pytest.importorskip("casadi")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SPHSHELL_PIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "robots"


def tree(*joints: pin.JointModel, branches: bool = True) -> pin.Model:
    """A random tree of these joints, with armature and a weight that is not along an axis."""
    random = np.random.default_rng(4)
    pin.seed(4)
    model = pin.Model()
    model.gravity.linear = np.array([0.4, -0.3, -9.7])
    for joint in joints:
        parent = int(random.integers(0, model.njoints)) if branches else model.njoints - 1
        number = model.addJoint(parent, joint, pin.SE3.Random(), f"joint{model.njoints}")
        inertia = pin.Inertia.FromSphere(random.uniform(0.5, 2.0), 0.2)
        model.appendBodyToJoint(number, inertia, pin.SE3.Random())
        model.addBodyFrame(f"body{number}", number, pin.SE3.Identity(), 0)
    model.armature = random.uniform(0.0, 0.2, model.nv)
    return model


PLAIN = ("FreeFlyer", "RX", "RUBZ", "Spherical", "Planar", "Translation", "PZ")


def all_kinds() -> pin.Model:
    axis = np.array([0.36, 0.48, 0.8])
    return tree(
        *(getattr(pin, f"JointModel{kind}")() for kind in PLAIN),
        pin.JointModelHY(0.3),
        pin.JointModelPrismaticUnaligned(axis),
        pin.JointModelRevoluteUnaligned(axis),
        pin.JointModelHelicalUnaligned(axis, -0.2),
        pin.JointModelRevoluteUnboundedUnaligned(),
    )


def arm() -> pin.Model:
    return tree(pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ(), branches=False)


def touching(model: pin.Model, q: Array, compiled: bool) -> sp.Scene:
    """A sphere at the last body, which begins in a plate."""
    scene = sp.Scene(model, compiled=compiled)
    tip, radius = model.frames[model.nframes - 1].name, 0.05
    below = pose_of(model, q, tip).translation - [0.0, 0.0, 0.9 * radius]
    place, plate = pin.SE3(np.eye(3), below), sp.Shell(*meshes.grid_plate(4, 4, 2.0))
    law, friction = sp.HuntCrossleyLaw(1e4, 1.5, 0.1), sp.BristleFriction(0.5, 0.4, 1e3, 1.0, 1e-2)
    scene.add_contact(sp.Sphere(radius, tip), plate, "universe", place, law, friction)
    return scene


@pytest.mark.parametrize("make", [all_kinds, lambda: gripper()[0]], ids=["all kinds", "mimics"])
def test_runs_rollouts_and_accelerations_are_those_of_pinocchio(make) -> None:
    """Loading has compared them to 1e-12 at states with and without forces from outside."""
    model = make()
    q = pin.integrate(model, pin.neutral(model), np.full(model.nv, 0.1))
    ours, judge = (touching(model, q, compiled) for compiled in (True, False))
    assert ours.bind_joints() is not None
    assert judge.bind_joints() is None
    v = np.linspace(-0.2, 0.2, model.nv)
    step = sp.SemiImplicitEuler(dt=1e-4)
    one, other = (sp.Simulation(scene, step).run(q, v, 0.02) for scene in (ours, judge))
    assert len(one.contacts) > 0
    scale = np.abs(other.v).max()
    np.testing.assert_allclose(one.q, other.q, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.v, other.v, rtol=0, atol=1e-9 * scale)
    rolled = sp.Simulation(ours, step).rollout(q[None], v[None], duration=0.02)
    np.testing.assert_array_equal(rolled[0].q[-1], one.q[-1])
    # Derivatives stay Pinocchio's, at placements from here.
    found, wanted = (scene.dynamics_derivatives(q, v) for scene in (ours, judge))
    for a, b in ((found.by_q, wanted.by_q), (found.by_v, wanted.by_v)):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9 * np.abs(b).max())


def test_a_robot_is_compiled_once_and_again_when_its_file_is_damaged(cache, monkeypatch):
    compiled = []
    usual = compiled_robot._compile

    def counted(source: str, made: Path) -> None:
        compiled.append(made)
        usual(source, made)

    monkeypatch.setattr(compiled_robot, "_compile", counted)
    model = arm()
    path = compiled_robot.compile_robot(model)
    assert sp.Scene(model, compiled=True).bind_joints() is not None
    assert path.parent == cache
    assert path.stat().st_mode & 0o077 == 0
    assert len(compiled) == 1
    with pytest.raises(RuntimeError, match="of another model"):
        _core.CompiledRobot(str(path), gripper()[0])
    path.write_bytes(b"no program")
    assert sp.Scene(model, compiled=True).bind_joints() is not None
    assert len(compiled) == 2
    # What others could have written is not opened.
    path.chmod(0o666)
    assert compiled_robot.compile_robot(model) == path
    assert len(compiled) == 3
    assert [one.name for one in cache.iterdir()] == [path.name]


def test_a_differing_object_is_not_used() -> None:
    model, heavier = arm(), arm()
    heavier.armature = 1.01 * np.array(model.armature)
    with pytest.raises(ValueError, match=r"differs from Pinocchio by .* of the largest number"):
        _core.CompiledRobot(str(compiled_robot.compile_robot(heavier)), model)


def massless() -> pin.Model:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "free")
    return model


@pytest.mark.parametrize(
    ("make", "cause"),
    [
        (lambda: tree(pin.JointModelSphericalZYX()), "'joint1' is of the kind SphericalZYX"),
        (massless, "moves no mass"),
        (pin.Model, "has 0 joints"),
    ],
)
def test_other_models_stay_with_pinocchio_and_a_sentence(make, cause):
    with pytest.warns(SetupWarning, match=f"Pinocchio's own algorithms.*{cause}"):
        scene = sp.Scene(make(), compiled=True)
    assert scene.bind_joints() is None
    with pytest.raises(InvalidParameter, match=cause):
        compiled_robot.compile_robot(make())


def test_without_a_compiler_or_a_folder_a_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setenv("CC", "/no/such/compiler")
    with pytest.raises(SphshellError, match="no C compiler '/no/such/compiler': install one"):
        compiled_robot.compile_robot(arm())
    monkeypatch.setenv("CC", "false")
    with pytest.raises(SphshellError, match="compiler 'false' failed"):
        compiled_robot.compile_robot(arm())
    monkeypatch.setenv("SPHSHELL_PIN_CACHE", "")
    with pytest.warns(SetupWarning, match="cache folder.*SPHSHELL_PIN_CACHE"):
        sp.Scene(arm(), compiled=True)
