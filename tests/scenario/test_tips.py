"""Which frame carries the sphere of a new scenario: tools before jaws; fingers without spheres."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.scenario.drafting.fingertips import every_finger, find_tips, other_ends
from sphshell_pin.scenario.drafting.limb_ends import LinkGeometry, gripper_joints
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.pose_search import PressSearch
from sphshell_pin.scenario.drafting.searching import CannotReach
from sphshell_pin.scenario.format.reach import Reach


def link(name: str, size: str = "", at: str = "0 0 0") -> str:
    shape = f'<origin xyz="{at}"/><geometry><box size="{size}"/></geometry>'
    return (
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" '
        f'ixy="0" ixz="0" iyz="0"/></inertial>{f"<collision>{shape}</collision>" if size else ""}'
        "</link>"
    )


def joint(name: str, parent: str, child: str, kind: str, at: str, axis: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="{axis}"/>'
        f'<limit lower="-1" upper="1" effort="50" velocity="2"/>{more}</joint>'
    )


def arm(*, jaws: str | None, tool: str | None, mimic: str = "") -> str:
    """Return an arm of two joints, with a gripper of a kind of joint and a fixed frame."""
    out = link("base") + link("upper", ".02 .02 .3", "0 0 .15") + link("wrist", ".06 .06 .1")
    out += joint("a", "base", "upper", "revolute", "0 0 .1", "0 1 0")
    out += joint("b", "upper", "wrist", "revolute", "0 0 .3", "0 1 0")
    if jaws is not None:
        for side, y in (("left", ".02"), ("right", "-.02")):
            rule = mimic if side == "right" else ""
            out += link(side, ".01 .01 .06", "0 0 .03")
            out += joint(f"{side}_jaw", "wrist", side, jaws, f"0 {y} .05", "0 1 0", rule)
    if tool is not None:
        out += link(tool) + joint("mount", "wrist", tool, "fixed", "0 0 .1", "0 0 1")
    return f'<robot name="arm">{out}</robot>'


@pytest.mark.parametrize("tool", ["tool0", "my_tcp", "ee_link", "grasp_frame", "flange"])
@pytest.mark.parametrize(
    ("jaws", "mimic"),
    [
        ("prismatic", ""),
        ("prismatic", '<mimic joint="left_jaw"/>'),
        ("revolute", '<mimic joint="left_jaw" multiplier="-1"/>'),
    ],
)
def test_the_tool_frame_comes_before_the_jaws(tmp_path, tool, jaws, mimic):
    file = tmp_path / "arm.urdf"
    file.write_text(arm(jaws=jaws, tool=tool, mimic=mimic))
    robot = robots.load_file(file, mimic=True)
    (tip,) = find_tips(robot, shipped=None, frame=None, radius=None)
    assert tip.frame == tool
    assert gripper_joints(robot.model) == {3, 4}
    # In front of the jaws, which end 11 cm from the wrist.
    frame = robot.model.frames[robot.model.getFrameId(tool)].placement
    assert frame.act(tip.offset)[2] - tip.radius > 0.11 - 1e-6


def test_without_a_tool_frame_the_wrist_carries_it(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(jaws="prismatic", tool=None))
    robot = robots.load_file(file)
    (tip,) = find_tips(robot, shipped=None, frame=None, radius=None)
    model = robot.model
    assert model.names[model.frames[model.getFrameId(tip.frame)].parentJoint] == "b"


def test_what_spins_beside_sliding_jaws_is_held_with_them(tmp_path: Path) -> None:
    file, spin = tmp_path / "arm.urdf", link("spin", ".01 .01 .01")
    spin += joint("spin_joint", "wrist", "spin", "continuous", "0 0 .02", "0 0 1")
    file.write_text(arm(jaws="prismatic", tool="ee").replace("</robot>", f"{spin}</robot>"))
    assert gripper_joints(robots.load_file(file).model) == {3, 4, 5}


def test_every_finger_gets_a_ball_at_the_end_of_its_mesh(tmp_path: Path) -> None:
    file = tmp_path / "hand.urdf"
    file.write_text(arm(jaws="revolute", tool=None))
    robot = robots.load_file(file)
    tips = every_finger(robot)
    assert sorted(tip.frame for tip in tips) == ["left_jaw", "right_jaw"]
    for tip in tips:
        ends = LinkGeometry(robot, tip.frame).corners
        assert tip.offset[2] + tip.radius > ends[:, 2].max() - 1e-9
        assert np.hypot(*tip.offset[:2]) < 0.01


def body(*arms: str) -> str:
    """Return a robot on casters with spheres: a lift, a head of two joints, and arms of four."""
    shape = '<collision><geometry><sphere radius=".05"/></geometry></collision></link>'
    out = link("base", ".5 .4 .2", "0 0 .2") + link("torso", ".2 .2 .4")
    out += joint("lift", "base", "torso", "prismatic", "0 0 .5", "0 0 1")
    for name, at in (("left_caster", "0 .2 .05"), ("right_caster", "0 -.2 .05")):
        out += link(name).replace("</link>", shape)
        out += joint(f"{name}_roll", "base", name, "continuous", at, "0 1 0")
    for limb, count, at in (("head", 2, "0 0 .3"), *((one, 4, "0 .3 .3") for one in arms)):
        for k in range(count):
            out += link(f"{limb}_{k}", ".05 .05 .2", "0 0 .1")
            parent, place = (f"{limb}_{k - 1}", "0 0 .25") if k else ("torso", at)
            out += joint(f"{limb}_{k}_j", parent, f"{limb}_{k}", "revolute", place, "0 1 0")
    out += link("camera_tip") + joint("mount", "head_1", "camera_tip", "fixed", "0 0 .1", "0 0 1")
    return f'<robot name="body">{out}</robot>'


@pytest.mark.parametrize("arms", [("one",), ("left", "right"), ("gripper", "effector")])
def test_the_tip_of_a_robot_with_a_head_is_on_an_arm(tmp_path: Path, arms: tuple[str, ...]) -> None:
    file = tmp_path / "body.urdf"
    file.write_text(body(*arms))
    robot = robots.load_file(file)
    (tip,) = find_tips(robot, shipped=None, frame=None, radius=None)
    model = robot.model
    carried = model.names[model.frames[model.getFrameId(tip.frame)].parentJoint]
    assert carried in {f"{arm}_3_j" for arm in arms}
    # On the end of its link, not at its joint.
    assert tip.offset[2] > 0.2


@pytest.mark.parametrize("feet", [0, 4])
def test_a_drone_touches_with_its_body_or_its_feet(tmp_path: Path, feet: int) -> None:
    shape = '<geometry><sphere radius=".01"/></geometry>'
    spheres = [
        f'<collision><origin xyz="{x} {y} -.05"/>{shape}</collision>'
        for x, y in itertools.product((0.1, -0.1), repeat=2)
    ]
    out = link("frame", ".2 .2 .05").replace("</link>", "".join(spheres[:feet]) + "</link>")
    for name in ("left", "right"):
        out += link(name) + joint(f"{name}_j", "frame", name, "fixed", ".1 .1 0", "0 0 1")
    file = tmp_path / "drone.urdf"
    file.write_text(f'<robot name="drone">{out}</robot>')
    robot = robots.load_file(file, free_flyer=True)
    tips = find_tips(robot, shipped=None, frame=None, radius=None)
    assert len(tips) == (feet or 1)
    carriers = [robot.model.frames[robot.model.getFrameId(one.frame)] for one in tips]
    assert {int(one.parentJoint) for one in carriers} == {1}


def test_where_one_limb_does_not_come_to_the_part_another_does(tmp_path: Path, monkeypatch) -> None:
    """As the thumb of a hand, in whose way its palm may be."""
    file = tmp_path / "body.urdf"
    file.write_text(body("left", "right"))
    model, tried = robots.load_file(file).model, list[str]()
    (tip,) = find_tips(robots.load_file(file), shipped=None, frame=None, radius=None)

    find = PressSearch.find

    def search(one):
        tried.append(frame := one.tips[0].frame)
        if len(tried) == 1:
            said = "link 'x' would be in the part; take another --place"
            raise CannotReach(said, frame, other_ends(model, frame))
        return find(one)

    monkeypatch.setattr(PressSearch, "find", search)
    made = new_scenario(file, "box", out=tmp_path / "new.toml")
    assert tried[0] == tip.frame != tried[1] == other_ends(model, tip.frame)[0]
    assert made.why[0] == f"frame '{tried[1]}', as with '{tried[0]}' link 'x' would be in the part"
    tried.clear()
    with pytest.raises(CannotReach, match="--place"):
        new_scenario(file, "box", frame=tip.frame, out=tmp_path / "new.toml", force=True)
    file.write_text(arm(jaws=None, tool="tcp"))
    assert other_ends(robots.load_file(file).model, "tcp") == []


def test_a_humanoid_without_feet_stands_on_its_ankles(tmp_path: Path) -> None:
    file, out = tmp_path / "humanoid.urdf", link("pelvis", ".2 .3 .2")
    for side, y in (("left", ".1"), ("right", "-.1")):
        for name, parent in (("thigh", "pelvis"), ("ankle", f"{side}_thigh"), ("hand", "pelvis")):
            out += link(f"{side}_{name}", ".05 .05 .3", "0 0 -.2")
            at = f"0 {y} -.3"
            out += joint(f"{side}_{name}_j", parent, f"{side}_{name}", "revolute", at, "0 1 0")
    file.write_text(f'<robot name="humanoid">{out}</robot>')
    robot = robots.load_file(file, free_flyer=True)
    tips = find_tips(robot, shipped=None, frame=None, radius=None)
    assert {tip.frame for tip in tips} == {"left_ankle", "right_ankle"}


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_robot_on_fewer_than_three_feet_will_fall_over(tmp_path: Path, count: int) -> None:
    file, out = tmp_path / "walker.urdf", link("body", ".2 .2 .1")
    for k, angle in enumerate(2 * np.pi * np.arange(count) / count):
        at = f"{0.2 * np.cos(angle):.6f} {0.2 * np.sin(angle):.6f} 0"
        out += link(f"foot{k}", ".02 .02 .3", "0 0 -.15")
        out += joint(f"hip{k}", "body", f"foot{k}", "revolute", at, "0 1 0")
    file.write_text(f'<robot name="walker">{out}</robot>')
    made = new_scenario(file, base="floating", out=tmp_path / "new.toml")
    assert any("it will fall over" in one for one in made.why) == (count < 3)


@pytest.mark.parametrize("tilts", [False, True])
def test_what_carries_rotors_alone_falls_on_its_body(tmp_path: Path, tilts: bool) -> None:
    """The turn of a rotor moves no sphere across a part; its body does not stand on one either."""
    out = link("body", ".2 .2 .05").replace('mass value="1"', 'mass value="9"')
    for x, name in ((0.2, "front"), (-0.2, "back")):
        at, carrier = f"{x} 0 .05", "body"
        if tilts:
            out += link(f"{name}_arm") + joint(
                f"{name}_t", carrier, f"{name}_arm", "continuous", at, "1 0 0"
            )
            at, carrier = "0 0 .05", f"{name}_arm"
        out += link(name, ".1 .02 .01") + joint(
            f"{name}_j", carrier, name, "continuous", at, "0 0 1"
        )
    file = tmp_path / "drone.urdf"
    file.write_text(f'<robot name="drone">{out}</robot>')
    made = new_scenario(file, "box", out=tmp_path / "new.toml")
    assert "the base is floating, by the robot's shape: or --base" in made.why
    assert made.built.scene.model.nv == 6  # rotors are locked
    (pair,) = made.built.scene.pairs
    assert pair.spheres[0].in_joint.translation[2] < -0.025  # below its body


def test_a_finger_of_one_joint_presses_along_its_motion(tmp_path: Path) -> None:
    """Pressed along another direction it jams: friction bears part of the force."""
    shape = '<geometry><sphere radius=".01"/></geometry>'
    ball = f'<collision><origin xyz="0 0 .1"/>{shape}</collision></link>'
    out = link("palm", ".05 .1 .05") + link("finger").replace("</link>", ball)
    out += joint("bend", "palm", "finger", "revolute", "0 0 .1", ".4 .9 .2")
    file = tmp_path / "hand.urdf"
    file.write_text(f'<robot name="hand">{out}</robot>')
    made = new_scenario(file, "box", out=tmp_path / "new.toml")
    (pair,), (shell,), q = made.built.scene.pairs, made.built.shells.values(), made.built.q0
    place = pair.shells[0].placement
    reach = Reach(made.built.scene.model, "finger", [0.0, 0.0, 0.1])
    motion = reach.jacobian(q)[:3, 0]
    center = place.actInv(reach.center(q))
    normal = place.rotation @ shell.closest_points(center[None]).normals[0]
    assert abs(motion @ normal) > 0.999 * np.linalg.norm(motion)


def test_a_ball_of_free_size_fits_the_part_and_stays_on_its_link(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(jaws=None, tool=None))
    robot = robots.load_file(file)
    (tip,) = find_tips(robot, shipped=None, frame=None, radius=None)
    small = tip.at_most(0.2 * tip.radius)
    assert small.radius == 0.2 * tip.radius
    carrier = LinkGeometry(robot, tip.frame)
    for one in (tip, small):
        assert carrier.depth(one.offset) == pytest.approx(-one.radius)
    assert tip.at_most(2 * tip.radius) is tip
    (asked,) = find_tips(robot, shipped=None, frame=None, radius=0.05)
    assert asked.at_most(0.01) is asked


def test_a_box_of_size_0_marks_a_place_and_is_no_geometry(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    text = arm(jaws=None, tool="tool0")
    file.write_text(text.replace(link("tool0"), link("tool0", size="0 0 0")))
    (tip,) = find_tips(robots.load_file(file), shipped=None, frame=None, radius=None)
    assert tip.frame == "tool0"
    assert tip.radius > 0


def test_of_several_named_tips_the_one_that_stands_free_is_taken(tmp_path: Path) -> None:
    out = link("palm", ".1 .1 .02")
    for name, y in (("first", "0"), ("middle", ".02"), ("thumb", ".09"), ("ring", "-.02")):
        for k, parent in enumerate(("palm", f"{name}_0")):
            out += link(f"{name}_{k}")
            out += joint(f"{name}_{k}_j", parent, f"{name}_{k}", "revolute", f"0 {y} .04", "1 0 0")
        out += link(f"{name}_tip")
        out += joint(f"{name}_end", f"{name}_1", f"{name}_tip", "fixed", "0 0 .03", "0 0 1")
    file = tmp_path / "hand.urdf"
    file.write_text(f'<robot name="hand">{out}</robot>')
    (tip,) = find_tips(robots.load_file(file), shipped=None, frame=None, radius=None)
    assert tip.frame == "thumb_tip"
