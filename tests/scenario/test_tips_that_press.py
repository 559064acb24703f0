"""How tips of new scenarios press and fall: along what joints move, softly, free of the part."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.placing import Place
from sphshell_pin.scenario.drafting.poses import Limb, Stance
from sphshell_pin.scenario.drafting.searching import CannotReach, NewScenario
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.scenario.running.run import simulate
from tests import models, urdf
from tests.scenario.limbs import ball, limb, link
from tests.texts import DATA
from tests.urdf import shape


@pytest.fixture
def draft_of(draft, tmp_path: Path):
    """Draft a scenario of the robot of these links and joints."""

    def made(parts: str, *arguments: object, **options: object) -> NewScenario:
        return draft(urdf.write(tmp_path / "robot.urdf", parts), *arguments, **options)

    return made


def settled(made: NewScenario) -> float:
    """Return the normal force at the end, as a part of the one asked for."""
    result, _ = simulate(made.built)
    log = result.contacts
    last = log.normal_force[log.row == len(result.t) - 1]
    return float(last.sum() / made.built.scenario.controller.normal_force)


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_a_path_ends_before_a_joint_has_to_turn_fast_whatever_the_size(size: float) -> None:
    """To a place beside the axis of an arm's first joint, which turns the faster the nearer."""
    model = models.arm()
    model.upperPositionLimit[:] = 3.0
    model.lowerPositionLimit[:] = -3.0
    for joint in range(1, 4):
        placement = model.jointPlacements[joint]
        placement.translation = size * placement.translation
    tip = Tip("ball", 0.01 * size, np.array([0.0, 0.0, 0.0]), "")
    model.frames[model.getFrameId("ball")].placement.translation *= size
    stance = Stance(Limb(model, tip), np.array([0.0, 1.2, 1.0]), np.array([0.0, 0.0, -1.0]))
    beside = np.array([0.0, 0.02 * size, stance.center[2]])
    way = stance.center + np.linspace(0.0, 1.0, 41)[:, None] * (beside - stance.center)
    assert stance.follows(way, lambda _: True) == (37, "its joints do not reach farther there")


@pytest.mark.parametrize(
    ("turn", "raised", "told"),
    [
        (0.0, 0.0, "upright, as in its file, on the floor of the robot's base"),
        (np.pi / 2, 5e-5, "with its +x side towards the tip, on the floor of the robot's base"),
        (0.0, 0.02, "upright, as in its file, 20 mm above the floor of the robot's base: there"),
        (0.0, -0.02, "upright, as in its file, 20 mm below the floor of the robot's base: there"),
    ],
)
def test_how_a_part_stands_is_told(turn: float, raised: float, told: str) -> None:
    placement = pin.SE3(pin.utils.rotate("y", turn), np.zeros(3))
    # What does not tell is left out.
    place = Place(None, None, placement, True, raised, np.array([1.0, 0.0, 0.0]))  # type: ignore
    assert place.told.startswith(f"the surface stands {told}")


@pytest.mark.parametrize("tilts", [False, True])
def test_what_carries_rotors_alone_falls_on_its_body(draft_of, tilts: bool) -> None:
    """The turn of a rotor moves no sphere across a part; its body does not stand on one either."""
    out = link("body", ".2 .2 .05", mass=9)
    for at, name in ((".2 0 .05", "front"), ("-.2 0 .05", "back")):
        holder = "body"
        if tilts:
            out += limb(f"{name}_arm", holder, at, kind="continuous", axis="1 0 0")
            at, holder = "0 0 .05", f"{name}_arm"  # noqa: PLW2901
        out += limb(name, holder, at, ".1 .02 .01", kind="continuous", axis="0 0 1")
    made = draft_of(out, "box")
    assert "the base is floating, by the robot's shape: or --base" in made.why
    assert made.built.scene.model.nv == 6  # rotors are locked
    (pair,) = made.built.scene.pairs
    assert pair.spheres[0].in_joint.translation[2] < -0.025  # below its body


def test_a_finger_of_one_joint_presses_along_its_motion(draft_of) -> None:
    """Pressed along another direction it jams: friction bears part of the force."""
    out = link("palm", ".05 .1 .05")
    out += limb("finger", "palm", "0 0 .1", "", "", ball(".01", "0 0 .1"), axis=".4 .9 .2")
    made = draft_of(out, "box")
    (pair,), (shell,), q = made.built.scene.pairs, made.built.shells.values(), made.built.q0
    place = pair.shells[0].placement
    reach = Reach(made.built.scene.model, "finger", [0.0, 0.0, 0.1])
    motion = reach.jacobian(q)[:3, 0]
    center = place.actInv(reach.center(q))
    normal = place.rotation @ shell.closest_points(center[None]).normals[0]
    assert abs(motion @ normal) > 0.999 * np.linalg.norm(motion)


@pytest.mark.parametrize("hard", ["rubber", "steel"])
def test_a_heavy_body_that_gets_a_ball_comes_down_softly(draft_of, hard: str) -> None:
    """From as high as its weight presses the ball in: 4 weights by the energy of Hertz's law."""
    result, _ = simulate(draft_of(link("body", ".3 .2 .1", mass=60), "plane", material=hard).built)
    (pair,) = result.stats.pairs.values()
    assert 60 * 9.81 < pair.peak_force < 4 * 60 * 9.81


def test_a_body_comes_down_on_a_ball_below_its_wheels(draft_of) -> None:
    parts = link("body", ".3 .2 .05", mass=9)
    for at, name in ((".1 0 -.05", "front"), ("-.1 0 -.05", "back")):
        parts += limb(name, "body", at, ".2 .02 .2", kind="continuous")
    (pair,) = draft_of(parts, "plane").built.scene.pairs
    sphere = pair.spheres[0]
    assert sphere.in_joint.translation[2] - sphere.sphere.radius < -0.15


def test_a_disc_touches_with_its_rim_and_turns(draft) -> None:
    made = draft("gear_pair")
    (contact,) = made.built.scenario.contact
    assert np.hypot(*contact.sphere.offset[:2]) > 0.05
    assert settled(made) == pytest.approx(1.0, abs=0.05)


THIN = ".02 .02 .2", "0 0 -.1"
LEG = link("base") + limb("thigh", "base", "0 0 1", *THIN)
LEG += limb("shank", "thigh", "0 0 -.2", *THIN)
TURNING = link("palm", ".05 .1 .05") + limb("finger", "palm", "0 0 .1", axis=".4 .9 .2")
STEEP = link("body", ".1 .1 .1") + limb("hip", "body", "0 0 0", axis="0 0 1")
STEEP += limb("foot", "hip", ".2 0 0", "", "", ball(".08", ".5 0 0"), limits=(0.52, 1.22))
STOPPED = limb("arm", "base", "0 0 .3", "", "", ball(".02", ".3 0 0"), limits=(0, 0.8))
SLIDE = link("carriage", ".2 .2 .1", "0 0 -.05", mass=150)
LIFT = urdf.joint("lift", "prismatic", "rail", "carriage", at="0 0 .8", axis="0 0 1")
PRESSING = {
    # The leg moves in a plane; its wheel's ball is beside that, on the axle.
    "a wheel beside its leg": (
        LEG + limb("wheel", "shank", "0 0 -.2", "", "", ball(".05", "0 .04 0"), kind="continuous"),
        {},
        0.05,
    ),
    # Steeply down, the knee moves the foot aside more than down: its spring pulls it back.
    "a tip that moves aside as it presses": (STEEP, {"place": "below"}, 0.03),
    "a tip on the axis of its last joint": (
        TURNING + limb("tip", "finger", "0 0 .1", "", "", ball(".01"), axis="1 0 0"),
        {"surface": "box"},
        0.05,
    ),
    "a joint that is not pressed into its stop": (
        link("base", ".05 .05 .05") + STOPPED,
        {"place": "above"},
        0.02,
    ),
    "a heavy slide with a soft tip": (
        urdf.link("rail") + SLIDE + LIFT.replace('"50"', '"5000"'),
        {"material": "silicone", "radius": 0.01},
        0.03,
    ),
}


@pytest.mark.parametrize("what", PRESSING)
def test_a_tip_presses_as_asked(draft_of, what: str) -> None:
    parts, options, tolerance = PRESSING[what]
    made = draft_of(parts, **{"surface": "plane", **options})
    assert settled(made) == pytest.approx(1.0, abs=tolerance)


def test_a_leg_that_starts_at_a_limit_of_its_knee_bends_it(draft_of) -> None:
    thick = ".04 .04 .2", "0 0 -.1"
    parts = link("base") + limb("thigh", "base", "0 0 1", *thick)
    parts += limb("shank", "thigh", "0 0 -.2", limits=(0.5, 2.5))
    parts += limb("foot", "shank", "0 0 -.2", "", "", ball(".02"), kind="fixed")
    _, knee = draft_of(parts, "plane").built.q0
    assert 0.6 < knee < 2.4


def test_a_joint_that_moves_nothing_is_held(draft_of) -> None:
    body = ".02 .02 .3", "0 0 .15"
    parts = link("base") + limb("arm", "base", "0 0 1", *body)
    parts += limb("fore", "arm", "0 0 .3", *body)
    parts += urdf.link("flange") + urdf.link("tool0")
    parts += urdf.joint("c", "revolute", "fore", "flange", at="0 0 .3", axis="0 0 1")
    parts += urdf.joint("d", "fixed", "flange", "tool0", at="0 0 .02")
    made = draft_of(parts, "plane")
    assert made.built.scenario.robot[0].lock == ["c"]
    assert "held, as nothing that they move has a mass: joints 'c'" in made.why


def test_couplings_that_no_model_has_leave_their_joints_free(draft) -> None:
    made = draft(DATA / "robots" / "jaws.xml", "plane")
    assert made.why[0].startswith("joints that are coupled move freely (--no-mimic)")
    assert not made.built.scenario.robot[0].mimic


def test_a_ball_between_walls_is_carried_out_of_them(draft, draft_of, tmp_path: Path) -> None:
    """The ball is 100 mm deep between plates, on a joint that moves it by 20 mm."""
    wall = '<box size=".12 .01 .2"/>'
    plates = [shape("collision", wall, f"0 {y} .1") for y in (0.06, -0.06)]
    out = link("base") + limb("upper", "base", "0 0 .4", ".02 .02 .3", "0 0 .15")
    out += limb("cup", "upper", "0 0 .3", "", "", *plates)
    on_rail = {"kind": "prismatic", "axis": "0 0 1", "limits": (-0.02, 0.02)}
    out += limb("tip", "cup", "0 0 .1", "", "", ball(".01"), **on_rail)
    made = draft_of(out)
    assert "of its collision geometry, on a stub of 76 mm: else links would be" in made.why[0]
    (contact,) = made.built.scenario.contact
    assert np.linalg.norm(contact.sphere.offset) == pytest.approx(0.076, abs=1e-5)
    assert settled(made) == pytest.approx(1.0, abs=0.05)
    with pytest.raises(CannotReach, match="'cup' would be in the part"):
        draft(tmp_path / "robot.urdf", frame="tip", radius=0.01)


def test_what_stands_beside_a_free_body_is_not_carried_by_it(draft) -> None:
    made = draft(DATA / "robots" / "arm_beside_object.xml", "plane")
    assert made.built.scenario.robot[0].base == "fixed"
    assert settled(made) == pytest.approx(1.0, abs=0.05)
