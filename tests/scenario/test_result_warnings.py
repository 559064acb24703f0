"""Input that is allowed and probably a mistake earns a warning, in all commands that meet it."""

import warnings
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.scene.models import model_reach
from sphshell_pin.errors import InvalidParameter, ScenarioError, SetupWarning
from sphshell_pin.scenario import build, explain_built
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.live.acting import targets_of
from sphshell_pin.scenario.running.run import simulate
from tests.command import call
from tests.models import pose_of
from tests.scenario.files import DROP, write

pytestmark = pytest.mark.usefixtures("no_pictures")

SHORT = {"run.duration": "1e-4"}
OFF = {"controller.path": "[[0, 0, 0], [0.5, 2.0, 0.0]]"}
AWAY = {"shell.box.placement.xyz": "[3.0, 2.0, -3.0]"}


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """A finger that presses on a box; the run is short."""
    path = tmp_path_factory.mktemp("finger") / "a.toml"
    new_scenario("three_link_finger", "box", out=path)
    return path


def told(path, changes):
    built = build(path, {"run.duration": "0.1", **changes})
    return explain_built(built).warnings


def test_a_sound_scenario_earns_none(scenario):
    assert told(scenario, {}) == ()
    built = build(scenario)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = built.simulation.run(built.q0, built.v0, 0.3, built.controller, record_dt=0.01)
    assert built.controller._result_warnings(result) == []


def test_a_path_that_is_off_the_part(scenario):
    (said,) = told(scenario, OFF)
    assert "path[1] is 1.88 m" in said
    assert "'box', which measures" in said
    built = build(scenario, {"run.duration": "0.01", **OFF})
    with pytest.warns(SetupWarning, match=r"path\[1\] is 1.88 m"):
        built.simulation.run(built.q0, None, 0.01, built.controller)


def test_a_path_that_begins_beside_the_tip(scenario):
    """Its spring pulls with the distance times the stiffness, from the first step on."""
    control = build(scenario).scenario.controller
    beside = [control.path[0][0] + 0.03, *control.path[0][1:]]
    (said,) = told(scenario, {"controller.path": str([beside])})
    assert "the controller's path begins 0.03 m from the tip" in said
    assert f"with {0.03 * control.stiffness:.3g} N at once" in said


def test_a_start_beyond_a_limit(scenario):
    model = build(scenario).scene.model
    name, high = model.names[1], model.upperPositionLimit[0]
    beyond = {f"robot.start.{name}": repr(float(high) + 0.25)}
    (said,) = [one for one in told(scenario, beyond) if "limits" in one]
    assert said.startswith(f"joint '{name}' starts at {high + 0.25:.6g}, beyond its limits")
    assert f"to {high:.6g} " in said


def test_a_press_on_nothing_and_a_target_out_of_reach(scenario):
    built = build(scenario, AWAY)
    result, _ = simulate(replace(built, scenario=build(scenario, {**AWAY, **SHORT}).scenario))
    nothing, far = built.controller._result_warnings(result)
    assert nothing.startswith("nothing was touched, though the controller presses with")
    # Across the normal, as the force acts along it.
    (pair,) = built.scene.pairs
    tip = pair.side_j.placement.actInv(pose_of(built.scene.model, built.q0, "tip").translation)
    at = pair.side_j.shell.closest_points(built.scenario.controller.path[:1])
    away, normal = tip - at.points[0], at.normals[0]
    expected = np.linalg.norm(away - normal * (normal @ away))
    assert far.startswith("the controller's target was never in reach: frame 'tip'")
    assert float(far.split("than ")[1].split(" m")[0]) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("share", "lines"), [(0.045, 0), (0.055, 1)])
def test_a_twentieth_of_the_robots_size_from_the_target_is_out_of_reach(share, lines):
    robot = sp.robots.load("three_link_finger")
    robot.model.gravity.setZero()
    beside = pose_of(robot.model, robot.q0, "tip").translation
    beside[0] += share * model_reach(robot.model)
    control = sp.CartesianImpedance("tip", [beside], stiffness=0.0, damping=0.0)
    result = sp.Simulation(sp.Scene(robot.model)).run(robot.q0, None, 1e-3, control)
    assert len(control._result_warnings(result)) == lines


def test_a_robot_whose_joints_are_at_one_place_is_as_large_as_its_links():
    """A cart with a pole: a target of 1e-10 m beside it is not out of its reach."""
    model = pin.Model()
    cart = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "cart")
    pole = model.addJoint(cart, pin.JointModelRY(), pin.SE3.Identity(), "pole")
    above = pin.SE3(np.eye(3), np.array([0.0, 0.3, 0.4]))
    model.appendBodyToJoint(pole, pin.Inertia.FromSphere(1.0, 0.05), above)
    assert model_reach(model) == pytest.approx(0.5)
    sliding, _ = targets_of(sp.JointPD(10.0, 1.0), model, pin.neutral(model))
    assert (sliding.low, sliding.high) == pytest.approx((-0.5, 0.5))


def test_the_commands_say_so(scenario, tmp_path):
    off, away = ([f"--set={k}={one}" for k, one in them.items()] for them in (OFF, AWAY))
    options = ["--no-recording", "--duration=0.01", f"--out={tmp_path}/o"]
    ran = call("run", scenario, *options, *off, *away)
    assert "warning: the controller's path is off the shell" in ran.output
    assert "warning: nothing was touched" in ran.output
    explained = call("explain", scenario, *off)
    assert "Warning: the controller's path is off the shell" in explained.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("t, q", r"'tau\(t, q\)' must take tau\(t, q, v, contacts\)"),
        ("t, q, v, contacts, gain", r"gain\)' must take tau\(t, q, v, contacts\).*'gain'"),
    ],
)
def test_a_callable_of_the_wrong_signature(arguments, said, tmp_path):
    code = f"def tau({arguments}):\n    return 0\n"
    (tmp_path / "own.py").write_text(code, encoding="utf-8")
    text = DROP + '\n[controller]\ntype = "python"\nfunction = "own.py:tau"\n'
    with pytest.raises(ScenarioError, match=said):
        build(write(tmp_path, text))
    names: dict[str, object] = {}
    exec(code, names)
    built = build(write(tmp_path))
    with pytest.raises(InvalidParameter, match=said):
        built.simulation.run(built.q0, None, 0.01, names["tau"])
