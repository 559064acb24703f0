"""Which frame carries the sphere of a new scenario: tools before jaws; fingers without spheres."""

from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.scenario.drafting.fingertips import every_finger, find_tips
from sphshell_pin.scenario.drafting.limb_ends import LinkGeometry, gripper_joints


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


def test_two_free_fingers_are_no_gripper(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(jaws="revolute", tool=None))
    assert gripper_joints(robots.load_file(file).model) == set()


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
