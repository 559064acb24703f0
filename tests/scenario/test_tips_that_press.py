"""How tips of new scenarios press and fall: along what joints move, softly, free of the part."""

from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.scenario.drafting.searching import CannotReach, NewScenario
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.scenario.running.run import simulate
from tests import urdf
from tests.scenario.limbs import HINGE, ball, joint, link
from tests.urdf import inertial, shape


@pytest.mark.parametrize("tilts", [False, True])
def test_what_carries_rotors_alone_falls_on_its_body(draft, tmp_path: Path, tilts: bool) -> None:
    """The turn of a rotor moves no sphere across a part; its body does not stand on one either."""
    out = link("body", ".2 .2 .05").replace('mass value="1"', 'mass value="9"')
    for x, name in ((0.2, "front"), (-0.2, "back")):
        at, holder = f"{x} 0 .05", "body"
        if tilts:
            turning = f"{name}_arm"
            out += link(turning) + joint(f"{name}_t", holder, turning, "continuous", at, "1 0 0")
            at, holder = "0 0 .05", turning
        out += link(name, ".1 .02 .01")
        out += joint(f"{name}_j", holder, name, "continuous", at, "0 0 1")
    file = urdf.write(tmp_path / "drone.urdf", out)
    made = draft(file, "box")
    assert "the base is floating, by the robot's shape: or --base" in made.why
    assert made.built.scene.model.nv == 6  # rotors are locked
    (pair,) = made.built.scene.pairs
    assert pair.spheres[0].in_joint.translation[2] < -0.025  # below its body


def test_a_finger_of_one_joint_presses_along_its_motion(draft, tmp_path: Path) -> None:
    """Pressed along another direction it jams: friction bears part of the force."""
    out = link("palm", ".05 .1 .05") + link("finger", "", "", ball(".01", "0 0 .1"))
    out += joint("bend", "palm", "finger", "revolute", "0 0 .1", ".4 .9 .2")
    file = urdf.write(tmp_path / "hand.urdf", out)
    made = draft(file, "box")
    (pair,), (shell,), q = made.built.scene.pairs, made.built.shells.values(), made.built.q0
    place = pair.shells[0].placement
    reach = Reach(made.built.scene.model, "finger", [0.0, 0.0, 0.1])
    motion = reach.jacobian(q)[:3, 0]
    center = place.actInv(reach.center(q))
    normal = place.rotation @ shell.closest_points(center[None]).normals[0]
    assert abs(motion @ normal) > 0.999 * np.linalg.norm(motion)


@pytest.mark.parametrize("hard", ["rubber", "steel"])
def test_a_heavy_body_that_gets_a_ball_comes_down_softly(draft, tmp_path: Path, hard: str) -> None:
    """From as high as its weight presses the ball in: 4 weights by the energy of Hertz's law."""
    box = shape("collision", '<box size=".3 .2 .1"/>')
    file = urdf.write(tmp_path / "robot.urdf", urdf.link("body", inertial(60, 1), box))
    built = draft(file, "plane", material=hard).built
    result, _ = simulate(built)
    (pair,) = result.stats.pairs.values()
    assert 60 * 9.81 < pair.peak_force < 4 * 60 * 9.81


def test_a_body_comes_down_on_a_ball_below_its_wheels(draft, tmp_path: Path) -> None:
    parts = link("body", ".3 .2 .05").replace('mass value="1"', 'mass value="9"')
    for x, name in ((0.1, "front"), (-0.1, "back")):
        parts += link(name, ".2 .02 .2")
        parts += joint(f"{name}_j", "body", name, "continuous", f"{x} 0 -.05", "0 1 0")
    made = draft(urdf.write(tmp_path / "cart.urdf", parts), "plane")
    (pair,) = made.built.scene.pairs
    sphere = pair.spheres[0]
    assert sphere.in_joint.translation[2] - sphere.sphere.radius < -0.15


def test_a_disc_touches_with_its_rim_and_turns(draft) -> None:
    made = draft("gear_pair")
    (contact,) = made.built.scenario.contact
    assert np.hypot(*contact.sphere.offset[:2]) > 0.05
    assert settled(made) == pytest.approx(1.0, abs=0.05)


def test_a_wheel_beside_its_leg_presses_where_the_leg_points(draft, tmp_path: Path) -> None:
    """The leg moves in a plane; its wheel's ball is beside that, on the axle."""
    parts = link("base") + link("thigh", ".02 .02 .2", "0 0 -.1")
    parts += link("shank", ".02 .02 .2", "0 0 -.1") + link(
        "wheel", "", "0 0 0", ball(".05", "0 .04 0")
    )
    parts += joint("hip", "base", "thigh", *HINGE)
    parts += joint("knee", "thigh", "shank", "revolute", "0 0 -.2", "0 1 0")
    parts += joint("axle", "shank", "wheel", "continuous", "0 0 -.2", "0 1 0")
    made = draft(urdf.write(tmp_path / "leg.urdf", parts), "plane")
    assert settled(made) == pytest.approx(1.0, abs=0.05)


def test_a_leg_that_starts_at_a_limit_of_its_knee_bends_it(draft, tmp_path: Path) -> None:
    parts = link("base") + link("thigh", ".04 .04 .2", "0 0 -.1") + link("shank", "", "0 0 0")
    parts += link("foot", "", "0 0 0", ball(".02")) + joint("hip", "base", "thigh", *HINGE)
    knee = joint("knee", "thigh", "shank", "revolute", "0 0 -.2", "0 1 0")
    parts += knee.replace('lower="-1" upper="1"', 'lower="0.5" upper="2.5"')
    parts += joint("ankle", "shank", "foot", "fixed", "0 0 -.2", "0 1 0")
    made = draft(urdf.write(tmp_path / "leg.urdf", parts), "plane")
    _, knee = made.built.q0
    assert 0.6 < knee < 2.4


def leg(lower: float, upper: float) -> str:
    """A leg that turns about z and swings down at its knee, within limits; a ball at its end."""
    parts = (
        link("body", ".1 .1 .1") + link("hip") + link("shank", "", "0 0 0", ball(".08", ".5 0 0"))
    )
    knee = joint("knee", "hip", "shank", "revolute", "0.2 0 0", "0 1 0")
    limits = f'lower="{lower}" upper="{upper}"'
    parts += knee.replace('lower="-1" upper="1"', limits)
    return parts + joint("turn", "body", "hip", "revolute", "0 0 0", "0 0 1")


def settled(made: NewScenario) -> float:
    """Return the normal force at the end, as a part of the one asked for."""
    result, _ = simulate(made.built)
    log = result.contacts
    last = log.normal_force[log.row == len(result.t) - 1]
    return float(last.sum() / made.built.scenario.controller.normal_force)


def test_a_tip_that_moves_aside_as_it_presses_presses_as_asked(draft, tmp_path: Path) -> None:
    """Steeply down, the knee moves the foot aside more than down: its spring pulls it back."""
    made = draft(urdf.write(tmp_path / "leg.urdf", leg(0.52, 1.22)), "plane", place="below")
    assert settled(made) == pytest.approx(1.0, abs=0.03)


def test_a_tip_on_the_axis_of_its_last_joint_presses_along_its_line(draft, tmp_path: Path) -> None:
    parts = link("palm", ".05 .1 .05") + link("finger") + link("tip", "", "0 0 0", ball(".01"))
    parts += joint("bend", "palm", "finger", "revolute", "0 0 .1", ".4 .9 .2")
    parts += joint("turn", "finger", "tip", "revolute", "0 0 .1", "1 0 0")
    made = draft(urdf.write(tmp_path / "hand.urdf", parts), "box")
    assert settled(made) == pytest.approx(1.0, abs=0.05)


def test_a_joint_is_not_pressed_into_its_stop(draft, tmp_path: Path) -> None:
    parts = link("base", ".05 .05 .05") + link("arm", "", "0 0 0", ball(".02", ".3 0 0"))
    hinge = joint("hinge", "base", "arm", "revolute", "0 0 .3", "0 1 0")
    parts += hinge.replace('lower="-1" upper="1"', 'lower="0" upper="0.8"')
    made = draft(urdf.write(tmp_path / "arm.urdf", parts), "plane", place="above")
    assert settled(made) == pytest.approx(1.0, abs=0.02)


def test_a_joint_that_moves_nothing_is_held(draft, tmp_path: Path) -> None:
    parts = (
        link("base") + link("arm", ".02 .02 .3", "0 0 .15") + link("fore", ".02 .02 .3", "0 0 .15")
    )
    parts += urdf.link("flange") + urdf.link("tool0")
    parts += joint("a", "base", "arm", *HINGE) + joint(
        "b", "arm", "fore", "revolute", "0 0 .3", "0 1 0"
    )
    parts += joint("c", "fore", "flange", "revolute", "0 0 .3", "0 0 1")
    parts += joint("d", "flange", "tool0", "fixed", "0 0 .02", "0 0 1")
    made = draft(urdf.write(tmp_path / "arm.urdf", parts), "plane")
    assert made.built.scenario.robot[0].lock == ["c"]
    assert "held, as nothing that they move has a mass: joints 'c'" in made.why


def test_a_heavy_slide_presses_with_a_soft_tip(draft, tmp_path: Path) -> None:
    box = shape("collision", '<box size=".2 .2 .1"/>', "0 0 -.05")
    parts = urdf.link("rail") + urdf.link("carriage", inertial(150, 1), box)
    slide = joint("lift", "rail", "carriage", "prismatic", "0 0 .8", "0 0 1")
    file = urdf.write(tmp_path / "slide.urdf", parts + slide.replace('"50"', '"5000"'))
    made = draft(file, "plane", material="silicone", radius=0.01)
    assert settled(made) == pytest.approx(1.0, abs=0.03)


def test_couplings_that_no_model_has_leave_their_joints_free(draft, tmp_path: Path) -> None:
    file = tmp_path / "jaws.xml"
    file.write_text(
        """<mujoco><worldbody><body name="arm"><joint name="a" axis="0 1 0"/>
        <geom type="capsule" size=".02" fromto="0 0 0 0 0 .3"/>
        <body name="hand" pos="0 0 .3"><joint name="b" axis="0 1 0"/>
        <geom type="capsule" size=".02" fromto="0 0 0 0 0 .3"/></body></body></worldbody>
        <tendon><fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed>
        </tendon>
        <equality><tendon tendon1="t"/></equality></mujoco>"""
    )
    made = draft(file, "plane")
    assert made.why[0].startswith("joints that are coupled move freely (--no-mimic)")
    assert not made.built.scenario.robot[0].mimic


def test_a_ball_between_walls_is_carried_out_of_them(draft, tmp_path: Path) -> None:
    """The ball is 100 mm deep between plates, on a joint that moves it by 20 mm."""
    plates = [
        shape("collision", '<box size=".12 .01 .2"/>', at) for at in ("0 .06 .1", "0 -.06 .1")
    ]
    out = link("base") + link("upper", ".02 .02 .3", "0 0 .15") + link("cup", "", "", *plates)
    out += joint("a", "base", "upper", "revolute", "0 0 .4", "0 1 0")
    out += joint("b", "upper", "cup", "revolute", "0 0 .3", "0 1 0")
    out += link("tip", "", "", ball(".01"))
    slide = joint("c", "cup", "tip", "prismatic", "0 0 .1", "0 0 1")
    out += slide.replace('"-1"', '"-.02"').replace('"1"', '".02"')
    file = urdf.write(tmp_path / "cup.urdf", out)
    made = draft(file)
    assert "of its collision geometry, on a stub of 76 mm: else links would be" in made.why[0]
    (contact,) = made.built.scenario.contact
    assert np.linalg.norm(contact.sphere.offset) == pytest.approx(0.076, abs=1e-5)
    result, _ = simulate(made.built)
    force = made.built.scenario.controller.normal_force
    log = result.contacts
    assert log.normal_force[log.t > log.t.max() - 0.2].mean() == pytest.approx(force, rel=0.05)
    with pytest.raises(CannotReach, match="'cup' would be in the part"):
        draft(file, frame="tip", radius=0.01)


def test_what_stands_beside_a_free_body_is_not_carried_by_it(draft, tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    geom = '<geom type="capsule" size=".02" fromto="0 0 0 0 0 .3"/>'
    file.write_text(
        '<mujoco><worldbody><body name="object" pos="1 0 0"><freejoint/><geom size=".05"/></body>'
        f'<body name="upper"><joint name="a" axis="0 1 0"/>{geom}<body name="lower" pos="0 0 .3">'
        f'<joint name="b" axis="0 1 0"/>{geom}</body></body></worldbody></mujoco>'
    )
    made = draft(file, "plane")
    assert made.built.scenario.robot[0].base == "fixed"
    assert settled(made) == pytest.approx(1.0, abs=0.05)
