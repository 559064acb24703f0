"""Which frame carries the sphere of a new scenario: tools before jaws; fingers without spheres."""

import itertools
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.scenario.drafting.fingertips import (
    every_finger,
    find_tips,
    only_turns,
    other_ends,
)
from sphshell_pin.scenario.drafting.limb_ends import LinkGeometry, Tip, gripper_joints
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.pose_search import PressSearch
from sphshell_pin.scenario.drafting.searching import CannotReach
from sphshell_pin.scenario.drafting.trial import Fault
from tests import urdf
from tests.scenario.limbs import ball, limb, link
from tests.texts import DATA
from tests.urdf import shape


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., LoadedRobot]:
    """Load the robot of these links and joints; the file stays."""

    def load_parts(parts: str, **options: bool) -> LoadedRobot:
        return robots.load_file(urdf.write(tmp_path / "robot.urdf", parts), **options)

    return load_parts


def tips_of(robot: LoadedRobot, radius: float | None = None) -> list[Tip]:
    return find_tips(robot, shipped=None, frame=None, radius=radius)


def arm(*, jaws: str | None, tool: str | None, mimic: str = "") -> str:
    """Return an arm of two joints, with a gripper of a kind of joint and a fixed frame."""
    out = link("base") + limb("upper", "base", "0 0 .1", ".02 .02 .3", "0 0 .15")
    out += limb("wrist", "upper", "0 0 .3", ".06 .06 .1")
    if jaws is not None:
        body = ".01 .01 .06", "0 0 .03"
        out += limb("left", "wrist", "0 .02 .05", *body, kind=jaws)
        out += limb("right", "wrist", "0 -.02 .05", *body, kind=jaws, more=mimic)
    return out + (limb(tool, "wrist", "0 0 .1", kind="fixed") if tool is not None else "")


def front(robot: LoadedRobot, tip: Tip) -> float:
    """Return where a tip's sphere begins, from the wrist on [m]."""
    frame = robot.model.frames[robot.model.getFrameId(tip.frame)].placement
    return float(frame.act(tip.offset)[2] - tip.radius)


@pytest.mark.parametrize("tool", ["tool0", "my_tcp", "ee_link", "grasp_frame", "flange"])
@pytest.mark.parametrize(
    ("jaws", "mimic"),
    [
        ("prismatic", ""),
        ("prismatic", '<mimic joint="left_j"/>'),
        ("revolute", '<mimic joint="left_j" multiplier="-1"/>'),
    ],
)
def test_the_tool_frame_comes_before_the_jaws(load, tool, jaws, mimic):
    robot = load(arm(jaws=jaws, tool=tool, mimic=mimic), mimic=True)
    (tip,) = tips_of(robot)
    assert tip.frame == tool
    assert gripper_joints(robot.model) == {3, 4}
    assert front(robot, tip) > 0.11 - 1e-6  # where the jaws end


def test_the_ball_is_before_jaws_that_the_shape_of_the_hand_encloses(load) -> None:
    robot = load(arm(jaws="prismatic", tool="tcp").replace(".06 .06 .1", ".1 .1 .3"))
    (tip,) = tips_of(robot)
    assert front(robot, tip) > 0.15 - 1e-6


def carrier(robot: LoadedRobot, tip: Tip) -> str:
    """Return the name of the joint that moves a tip."""
    model = robot.model
    return str(model.names[model.frames[model.getFrameId(tip.frame)].parentJoint])


def test_without_a_tool_frame_the_wrist_carries_it(load) -> None:
    robot = load(arm(jaws="prismatic", tool=None))
    (tip,) = tips_of(robot)
    assert carrier(robot, tip) == "wrist_j"


def test_what_spins_beside_sliding_jaws_is_held_with_them(load) -> None:
    body = ".01 .01 .01"
    spin = limb("spin", "wrist", "0 0 .02", body, kind="continuous", axis="0 0 1")
    assert gripper_joints(load(arm(jaws="prismatic", tool="ee") + spin).model) == {3, 4, 5}


def test_every_finger_gets_a_ball_at_the_end_of_its_mesh(load) -> None:
    robot = load(arm(jaws="revolute", tool=None))
    tips = every_finger(robot)
    assert sorted(tip.frame for tip in tips) == ["left_j", "right_j"]
    for tip in tips:
        ends = LinkGeometry(robot, tip.frame).corners
        assert tip.offset[2] + tip.radius > ends[:, 2].max() - 1e-9
        assert np.hypot(*tip.offset[:2]) < 0.01


def body(*arms: str) -> str:
    """Return a robot on casters with spheres: a lift, a head of two joints, and arms of four."""
    out = link("base", ".5 .4 .2", "0 0 .2")
    out += limb("torso", "base", "0 0 .5", ".2 .2 .4", kind="prismatic", axis="0 0 1")
    for name, at in (("left_caster", "0 .2 .05"), ("right_caster", "0 -.2 .05")):
        out += limb(name, "base", at, "", "", ball(".05"), kind="continuous")
    for name, count, at in (("head", 2, "0 0 .3"), *((one, 4, "0 .3 .3") for one in arms)):
        for k in range(count):
            parent, place = (f"{name}_{k - 1}", "0 0 .25") if k else ("torso", at)
            out += limb(f"{name}_{k}", parent, place, ".05 .05 .2", "0 0 .1")
    return out + limb("camera_tip", "head_1", "0 0 .1", kind="fixed")


@pytest.mark.parametrize("arms", [("one",), ("left", "right"), ("gripper", "effector")])
def test_the_tip_of_a_robot_with_a_head_is_on_an_arm(load, arms: tuple[str, ...]) -> None:
    robot = load(body(*arms))
    (tip,) = tips_of(robot)
    assert carrier(robot, tip) in {f"{arm}_3_j" for arm in arms}
    assert tip.offset[2] > 0.2  # on the end of its link, not at its joint


@pytest.mark.parametrize("feet", [0, 4])
def test_a_drone_touches_with_its_body_or_its_feet(load, feet: int) -> None:
    spheres = [ball(".01", f"{x} {y} -.05") for x, y in itertools.product((0.1, -0.1), repeat=2)]
    out = link("frame", ".2 .2 .05", "0 0 0", *spheres[:feet])
    out += "".join(limb(name, "frame", ".1 .1 0", kind="fixed") for name in ("left", "right"))
    robot = load(out, free_flyer=True)
    tips = tips_of(robot)
    assert len(tips) == (feet or 1)
    assert {carrier(robot, one) for one in tips} == {robot.model.names[1]}


def test_where_one_limb_does_not_come_to_the_part_another_does(draft, tmp_path, monkeypatch):
    """As the thumb of a hand, in whose way its palm may be."""
    file = urdf.write(tmp_path / "body.urdf", body("left", "right"))
    model, tried = robots.load_file(file).model, list[str]()
    (tip,) = tips_of(robots.load_file(file))

    find = PressSearch.find

    def search(one):
        tried.append(frame := one.tips[0].frame)
        if len(tried) == 1:
            said = "link 'x' would be in the part; take another --place"
            raise CannotReach(said, frame, other_ends(model, frame))
        return find(one)

    monkeypatch.setattr(PressSearch, "find", search)
    made = draft(file, "box")
    assert tried[0] == tip.frame != tried[1] == other_ends(model, tip.frame)[0]
    assert made.why[0] == f"frame '{tried[1]}', as with '{tried[0]}' link 'x' would be in the part"
    tried.clear()
    with pytest.raises(CannotReach, match="--place"):
        draft(file, "box", frame=tip.frame)
    urdf.write(file, arm(jaws=None, tool="tcp"))
    assert other_ends(robots.load_file(file).model, "tcp") == []


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_robot_on_fewer_than_three_feet_will_fall_over(tmp_path: Path, count: int) -> None:
    out = link("body", ".2 .2 .1")
    for k, angle in enumerate(2 * np.pi * np.arange(count) / count):
        at = f"{0.2 * np.cos(angle):.6f} {0.2 * np.sin(angle):.6f} 0"
        out += limb(f"foot{k}", "body", at, ".02 .02 .3", "0 0 -.15")
    file = urdf.write(tmp_path / "walker.urdf", out)
    made = new_scenario(file, base="floating", out=tmp_path / "new.toml")
    assert any("it will fall over" in one for one in made.why) == (count < 3)


def test_a_ball_of_free_size_fits_the_part_and_stays_on_its_link(load) -> None:
    robot = load(arm(jaws=None, tool=None))
    (tip,) = tips_of(robot)
    small = tip.at_most(0.2 * tip.radius)
    assert small.radius == 0.2 * tip.radius
    carrying = LinkGeometry(robot, tip.frame)
    for one in (tip, small):
        assert carrying.depth(one.offset) == pytest.approx(-one.radius)
    assert tip.at_most(2 * tip.radius) is tip
    (asked,) = tips_of(robot, radius=0.05)
    assert asked.at_most(0.01) is asked


def test_a_box_of_size_0_marks_a_place_and_is_no_geometry(load) -> None:
    text = arm(jaws=None, tool="tool0")
    (tip,) = tips_of(load(text.replace(link("tool0"), link("tool0", size="0 0 0"))))
    assert tip.frame == "tool0"
    assert tip.radius > 0


def test_of_several_named_tips_the_one_that_stands_free_is_taken(load) -> None:
    out = link("palm", ".1 .1 .02")
    for name, y in (("first", "0"), ("middle", ".02"), ("thumb", ".09"), ("ring", "-.02")):
        for k, parent in enumerate(("palm", f"{name}_0")):
            out += limb(f"{name}_{k}", parent, f"0 {y} .04", axis="1 0 0")
        out += limb(f"{name}_tip", f"{name}_1", "0 0 .03", kind="fixed")
    (tip,) = tips_of(load(out))
    assert tip.frame == "thumb_tip"


def test_an_end_that_is_a_corner_gets_a_ball(load) -> None:
    box = shape("collision", '<box size=".02 .02 .02"/>', "0 0 .2")
    tilted = box.replace("<origin", '<origin rpy="0.7854 0.6155 0"')
    (tip,) = tips_of(load(link("base", ".1 .1 .1") + limb("arm", "base", "0 0 .1", "", "", tilted)))
    assert 0.001 < tip.radius < 0.02


def test_wheels_beside_an_arm_are_no_tip(load) -> None:
    out = link("base", ".3 .3 .1")
    for k, parent in enumerate(("base", "caster0", "caster1")):
        parts = [ball(".03")] if k == 2 else []
        out += limb(f"caster{k}", parent, ".1 0 -.1", "", "", *parts, kind="continuous")
    for k, parent in enumerate(("base", "arm0", "arm1")):
        out += limb(f"arm{k}", parent, "0 0 .1", ".02 .02 .1", "0 0 .05")
    (tip,) = tips_of(load(out))
    assert tip.frame.startswith("arm2")


def test_the_ball_of_a_mechanism_in_a_plane_is_in_that_plane(load) -> None:
    """Also where its last link lies around its hinge."""
    parts = link("base") + limb("cart", "base", "0 0 1", kind="prismatic", axis="1 0 0")
    parts += limb("body", "cart", "0 0 0", ".2 .1 .2")
    parts += limb("foot", "body", "0 0 -.2", ".3 .1 .06")
    (tip,) = tips_of(load(parts))
    assert tip.offset == pytest.approx([0.0, 0.0, tip.offset[2]], abs=2e-3)
    assert tip.offset[2] < -0.03


def test_a_body_of_an_mjcf_is_no_tool_frame_where_its_joint_is_elsewhere() -> None:
    (tip,) = tips_of(robots.load_file(DATA / "robots" / "leg.xml"))
    assert tip.offset[2] > 0.1


def test_a_humanoid_without_feet_stands_on_its_ankles(load) -> None:
    out = link("pelvis", ".2 .3 .2")
    for side, y in (("left", ".1"), ("right", "-.1")):
        for name, parent in (("thigh", "pelvis"), ("ankle", f"{side}_thigh"), ("hand", "pelvis")):
            out += limb(f"{side}_{name}", parent, f"0 {y} -.3", ".05 .05 .3", "0 0 -.2")
    tips = tips_of(load(out, free_flyer=True))
    assert {tip.frame for tip in tips} == {"left_ankle", "right_ankle"}


def test_a_robot_without_names_stands_on_its_lowest_ends(load) -> None:
    parts = link("body", ".2 .2 .1") + limb("mast", "body", "0 0 .05", ".02 .02 .3", "0 0 .15")
    for k, (x, y) in enumerate(itertools.product((0.2, -0.2), (0.2, -0.2))):
        parts += limb(f"limb{k}", "body", f"{x} {y} 0", ".02 .02 .3", "0 0 -.15")
    tips = tips_of(load(parts, free_flyer=True))
    assert [tip.frame for tip in tips] == [f"limb{k}" for k in range(4)]


@pytest.mark.parametrize(
    ("mass", "axis", "floats"), [(50, "0 1 0", True), (5, "0 1 0", False), (50, "0 1 0.1", True)]
)
def test_a_heavy_body_with_one_caster_floats(load, mass, axis, floats) -> None:
    parts = link("body", ".4 .4 .1", mass=mass)
    parts += limb("fork", "body", "0 0 -.1", kind="continuous", axis="0 0 1")
    parts += limb("wheel", "fork", "0 0 0", ".1 .02 .1", kind="continuous", axis=axis)
    assert only_turns(load(parts).model) == floats


def test_a_sensor_on_a_joint_without_range_keeps_no_drone_from_floating(load) -> None:
    parts = link("body", ".4 .4 .1", mass=50) + limb("imu", "body", "0 0 1", limits=(0, 0))
    for name, x in (("front", 0.2), ("back", -0.2)):
        parts += limb(name, "body", f"{x} 0 0", kind="continuous", axis="0 0 1")
    assert only_turns(load(parts).model)


def test_of_several_ends_without_names_the_freest_is_taken(load) -> None:
    """The jaws of a gripper that moves by itself, and no more."""
    parts = link("hand", ".1 .1 .05")
    for side, y in (("left", ".03"), ("right", "-.03"), ("middle", "0")):
        parts += limb(side, "hand", f"0 {y} .03", ".01 .01 .1", "0 0 .05", kind="prismatic")
    (tip,) = tips_of(load(parts))
    assert tip.frame == "left"
    assert "the freest of 3 ends" in tip.source


def test_of_the_spheres_of_a_finger_the_outermost_is_its_tip(load) -> None:
    spheres = [ball(".01", f"0 0 {z}") for z in (0.02, 0.09, 0.05)]
    (tip,) = tips_of(load(link("palm") + limb("finger", "palm", "0 0 1", "", "", *spheres)))
    assert tip.offset[2] == pytest.approx(0.09)


@pytest.mark.parametrize("even", [True, False])
def test_where_only_edges_were_touched_the_links_were_in_the_way(load, even: bool) -> None:
    """Elsewhere the force fails for another reason, which another limb would have, too."""
    robot = load(body("left", "right"))
    (tip,) = tips_of(robot)
    search = SimpleNamespace(
        asked=SimpleNamespace(place=None),
        bench=SimpleNamespace(postures=1, blocked=Counter(link=1), out_of_limb=lambda: tip),
        model=robot.model,
        tip=tip,
        faults=[Fault("force", "the force of 5 N is not held")],
        even=even,
        failed=lambda: "no draft works",
    )
    error = PressSearch.refusal(search)
    assert isinstance(error, CannotReach) != even
    assert "no draft works; take a smaller --radius" in str(error)
