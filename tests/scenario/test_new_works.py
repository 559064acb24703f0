"""A new scenario works: it touches, holds its force, and keeps links off the part."""

import re
from dataclasses import replace
from types import SimpleNamespace

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.contact.materials import find_material
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.fingertips import find_tips
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.paths import Way
from sphshell_pin.scenario.drafting.plan import Materials, Press
from sphshell_pin.scenario.drafting.pose_search import repaired
from sphshell_pin.scenario.drafting.trial import Fault, _force_fault, _path_fault
from sphshell_pin.scenario.running.run import simulate
from tests import models, urdf
from tests.scenario.files import center_of, run_well
from tests.texts import DATA

PROBE, BIPED = (DATA / "robots" / name for name in ("arm_with_probe.urdf", "biped.xml"))
BLADE = next(iter(shipped_scenarios().values())).parent / "surfaces" / "bladex_upper.stl"
FINGER = (robots.URDF_FOLDER / "three_link_finger.urdf").read_text()
PLACES = ("below", "above", "+x", "-x", "+y", "-y")


def held(built, result):
    """Return the mean normal force [N] from the end of the lead-in on."""
    log = result.contacts
    force = np.bincount(log.row, log.normal_force, len(result.t))
    return float(force[result.t > built.scenario.controller.lead_in].mean())


@pytest.mark.parametrize("place", PLACES)
def test_a_sphere_away_from_its_frame_presses_and_follows_its_path(place, draft):
    """The tip's sphere is 80 mm before its frame."""
    made = draft(PROBE, BLADE, unit="mm", place=place)
    built = build(made.path)
    result = run_well(built)
    control = built.scenario.controller
    assert held(built, result) == pytest.approx(control.normal_force, rel=0.05)
    (pair,) = built.scene.pairs
    assert pair.side_i.sphere.frame == "link_5"
    for offset in (control.offset, pair.side_i.sphere.offset):
        np.testing.assert_allclose(offset, [0, 0, 0.08])
    # The sphere's center ends over the path's last point.
    away = center_of(built, result.q[-1]) - control.path[-1]
    normal = pair.side_j.shell.closest_points([control.path[-1]]).normals[0]
    assert abs(away @ normal) == pytest.approx(pair.side_i.sphere.radius, rel=0.03)
    assert np.linalg.norm(away - normal * (away @ normal)) < 0.25 * pair.side_i.sphere.radius


def test_a_limb_comes_into_a_bowl_from_above(draft):
    made = draft(PROBE, "bowl")
    assert any("through the upper half of the bowl" in one for one in made.why)
    result = run_well(made.built)
    control = made.built.scenario.controller
    assert held(made.built, result) == pytest.approx(control.normal_force, rel=0.05)


def test_a_hard_tip_settles(draft):
    made = draft(PROBE, "plane", material="steel")
    result, _ = simulate(made.built)
    (figures,) = result.stats.pairs.values()
    force = made.built.scenario.controller.normal_force
    assert figures.touches <= 5
    assert figures.peak_force < 6 * force
    assert held(made.built, result) == pytest.approx(force, rel=0.05)
    assert result.events[-1].t < made.built.scenario.controller.lead_in


@pytest.mark.parametrize(
    ("surface", "side"),
    [("plane", "both"), ("box", "outside"), ("bowl", "inside"), ("sphere", "outside")],
)
def test_a_closed_body_has_one_side(surface, side, draft):
    built = draft("ball", surface).built
    assert built.shells[surface].side == side
    (pair,) = built.scene.explain(built.q0, built.v0).pairs
    assert 0 < pair.gap < 0.03


def test_a_robot_on_four_legs_stands(draft):
    """Its joints give way by what they were drafted for, 0.05 rad, and it sinks by little."""
    built = draft("solo12", "plane").built
    result = run_well(built)
    assert np.abs(result.q[-1, 7:] - built.q0[7:]).max() < 0.05
    assert abs(result.q[-1, 2] - built.q0[2]) < 0.01


def test_what_cannot_stand_on_a_part_is_held_and_touches_it_with_one_foot(draft):
    with pytest.raises(SphshellError, match=r"LEG' is in the part .* hold it with --base fixed"):
        draft("solo12", BLADE, unit="mm", base="floating")
    made = draft("solo12", BLADE, unit="mm")
    assert "cannot stand on the surface: link 'FL_LOWER_LEG' is in the part" in made.why[0]
    built = build(made.path)
    # Three joints of the leg are left, of which none is the base.
    assert built.scene.model.nv == built.scene.model.njoints - 1 == 3
    result = run_well(built)
    assert held(built, result) == pytest.approx(built.scenario.controller.normal_force, rel=0.05)


def test_a_biped_whose_foot_is_beside_the_part_is_held(tmp_path):
    block = tmp_path / "block.stl"
    trimesh.creation.box((0.1, 0.1, 0.02)).export(block)
    made = new_scenario(BIPED, block, unit="m", out=tmp_path / "a.toml")
    assert "comes down beside the surface" in made.why[0]
    assert build(made.path).scene.model.nv <= 4


BALL = '<sphere radius="0.06"/>'


@pytest.mark.parametrize(
    ("kind", "geometry"),
    [("visual", BALL), ("collision", BALL), ("visual", '<box size="0.2 0.2 0.2"/>')],
)
@pytest.mark.parametrize("floats", [False, True])
def test_an_end_larger_than_the_part_gets_a_smaller_ball(kind, geometry, floats, tmp_path):
    """Round ones too, and that of a body that falls."""
    link = urdf.link("b", urdf.inertial(), urdf.shape(kind, geometry))
    slide = urdf.link("a") + urdf.joint("j", "prismatic", "a", "b", axis="0 0 1")
    robot = urdf.write(tmp_path / "robot.urdf", link, "" if floats else slide)
    block = tmp_path / "block.stl"
    trimesh.creation.box((0.02, 0.02, 0.02)).export(block)
    made = new_scenario(robot, block, unit="m", out=tmp_path / "a.toml")
    assert made.built.scenario.contact[0].sphere.radius <= (0.02 if floats else 0.005)


def test_a_body_without_joints_is_not_advised_to_be_held(draft, tmp_path):
    """Nothing moves then: the fall that failed is what is told."""
    plate = urdf.shape("collision", '<box size="2 2 0.1"/>')
    file = urdf.write(tmp_path / "body.urdf", urdf.link("b", urdf.inertial(), plate))
    with pytest.raises(SphshellError, match=r"'b' is in the part .* can come down$"):
        draft(file, "bowl", radius=0.05)


def test_efforts_that_do_not_carry_the_robot_are_left_out_and_said_so(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(FINGER.replace('effort="2"', 'effort="1e-3"'))
    made = new_scenario(file, out=tmp_path / "weak.toml")
    assert "effort" not in made.built.scenario.robot[0].joints
    assert any("effort limits" in why and "its own weight" in why for why in made.why)


def test_a_tip_of_two_joints_begins_at_the_gap(tmp_path):
    """They do not move it along the approach alone: the part comes to the tip."""
    file = tmp_path / "arm.urdf"
    file.write_text(re.sub(r'(<joint name="\w+" type=)"revolute"', r'\1"fixed"', FINGER, count=1))
    made = new_scenario(file, out=tmp_path / "two.toml")
    result, _ = simulate(made.built)
    (pair,) = result.stats.pairs.values()
    assert pair.peak_force < 1.5 * made.built.scenario.controller.normal_force


def test_links_in_a_part_are_found():
    """A cube of 0.1 m before, around and beside links of the arm that stands straight up."""
    robot = robots.load_file(PROBE)
    q = pin.neutral(robot.model)
    cube = sp.Shell.from_geometry(coal.Box(0.1, 0.1, 0.1), side="outside")
    tip = Tip("link_5", 0.01, np.array([0, 0, 0.08]), "")
    links = Links(robot.model, robot.collision_model, cube, [tip], [])
    # The cylinder of link_2 goes from z = 0.42 to 0.58 with radius 0.03: the cube begins at 0.05.
    for x, found in ((0.0805, False), (0.0795, True)):
        inside = links.within(q, pin.SE3(np.eye(3), np.array([x, 0, 0.5])))
        assert inside == ("link_2" if found else None)
    # The sphere itself, and what of its own link is near it, may touch; the rest of the link not.
    top = 1.0 + 0.08
    for z, found in ((top + 0.049, False), (top + 0.05 - 0.0201, True)):
        assert (links.within(q, pin.SE3(np.eye(3), np.array([0, 0, z]))) is not None) == found
    # All of link_5 inside a large part touches no surface of it.
    block = sp.Shell.from_geometry(coal.Box(4.0, 4.0, 4.0), side="outside")
    links = Links(robot.model, robot.collision_model, block, [tip], [])
    assert links.within(q, pin.SE3.Identity()) is None
    assert links.within(q, pin.SE3.Identity(), whole=True) is not None


def test_a_part_with_a_hole_is_pressed_beside_it(draft, tmp_path):
    """A washer: its middle is a hole, as large as the sphere."""
    turns = np.linspace(0, 2 * np.pi, 49)[:-1]
    ring = np.array([np.cos(turns), np.sin(turns), 0 * turns]).T
    n = len(turns)
    quads = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    sp.Shell(np.concatenate([0.06 * ring, 0.02 * ring]), quads).to_file(tmp_path / "washer.shl")
    built = draft(PROBE, tmp_path / "washer.shl").built
    result, _ = simulate(built)
    assert held(built, result) == pytest.approx(built.scenario.controller.normal_force, rel=0.05)
    away = np.linalg.norm(np.array(built.scenario.controller.path)[:, :2], axis=1)
    assert away.min() > 0.02
    assert re.search(r'side = "both"', (tmp_path / "a.toml").read_text())


def test_what_the_file_states_of_the_joints_is_modelled(draft, tmp_path):
    """Motors make up for damping and dry friction, so that the tip slides as without them."""
    text = PROBE.read_text(encoding="utf-8")
    built = new_scenario(PROBE, out=tmp_path / "plain.toml").built
    assert built.scenario.robot[0].joints == ["limits", "effort", "speed"]
    assert not built.scenario.controller.friction_compensation
    assert set(built.scene.joints.effort) == set(list(built.scene.model.names)[1:])
    stated = '<dynamics damping="1" friction="0.5"/></joint>'
    (tmp_path / "arm.urdf").write_text(text.replace("</joint>", stated), encoding="utf-8")
    made = draft(tmp_path / "arm.urdf").built
    assert made.scenario.robot[0].joints == ["limits", "damping", "friction", "effort", "speed"]
    assert made.scenario.controller.friction_compensation
    path = made.scenario.controller.path
    assert len(path) == len(built.scenario.controller.path) > 1
    result, _ = simulate(made)
    assert held(made, result) == pytest.approx(made.scenario.controller.normal_force, rel=0.05)
    away = center_of(made, result.q[-1]) - path[-1]
    radius = made.scene.pairs[0].side_i.sphere.radius
    assert np.linalg.norm(away) < 1.1 * radius


def test_a_round_end_is_the_sphere_and_a_flat_one_gets_a_ball():
    """A capsule ends in its own half ball; on a cylinder's end stands a ball, in its middle."""
    robot = robots.load_file(PROBE)
    for shape, radius, above, words in (
        (coal.Capsule(0.02, 0.1), 0.02, 0, "covers the end of link 'link_5'"),
        (coal.Cylinder(0.03, 0.1), None, 1, "a ball on the end of link 'link_5'"),
    ):
        geometry = pin.GeometryModel()
        link = robot.model.getFrameId("link_5")
        frame = robot.model.frames[link]
        at = frame.placement * pin.SE3(np.eye(3), np.array([0, 0, 0.05]))
        geometry.addGeometryObject(pin.GeometryObject("end", frame.parentJoint, link, at, shape))
        ended = replace(robot, collision_model=geometry)
        (tip,) = find_tips(ended, shipped=None, frame=None, radius=None)
        assert radius is None or tip.radius == pytest.approx(radius, rel=0.03)
        assert tip.offset == pytest.approx([0, 0, 0.1 + above * tip.radius], abs=1e-3)
        assert words in tip.source


def test_a_sphere_inside_its_link_is_refused_with_a_command_that_works(draft):
    with pytest.raises(SphshellError, match=r"inside link 'link_5', .* mm deep") as caught:
        draft(PROBE, frame="link_5", offset=[0, 0, 0.05], radius=0.002)
    words = str(caught.value).partition("--frame ")[2].split()
    frame, _, *offset, _, radius = words[:7]
    draft(PROBE, frame=frame, offset=[float(one) for one in offset], radius=float(radius))


def pressing(points, **changes):
    """A tip of radius 0.1 m that is pressed along a path of these points, at 0.3 m/s."""
    masses = {"mass": 1, "slide_mass": 1, "inertia": 0.0, "joint_inertia": np.ones(4)}
    stance = SimpleNamespace(tip=Tip("tip", 0.1, np.zeros(3), ""), joints=4, fastest=1, **masses)
    stance.aside, stance.slide = np.zeros(3), np.eye(3)[0]
    pair = Materials(find_material("rubber"), find_material("steel"))
    place = SimpleNamespace(stance=stance, placement=pin.SE3.Identity())
    return Press(place, Way(np.array(points)), pair, 1.0, 1e-3, **changes)


PATH = [[0.0, 0.0, 0.0], [0.3, 0.1, 0.0]]


@pytest.mark.parametrize(
    ("kind", "before", "path", "repair"),
    [
        ("force", "", PATH, "calmed"),
        ("force", "calmed", PATH, None),
        ("path", "", PATH[:1], None),
        ("path", "", [[0.1 * k, 0.0, 0.0] for k in range(5)], "cut"),
        ("path", "cut", PATH, None),
    ],
)
def test_what_failed_decides_what_is_tried_next(kind, before, path, repair):
    press = pressing(path, repair=before)
    found = repaired(press, Fault(kind, "it fails", press.lead_in + 0.35 / 0.3))
    if repair == "cut":  # four fifths of the 35 cm that the target has come
        assert found.way.length == pytest.approx(0.2)
        assert found.way.why == "it fails"
    if repair == "calmed":
        assert found.damping == pytest.approx(4 * press.damping, rel=0.02)
        assert any(press.posture_stiffness)
        assert not found.posture_stiffness
    assert (None if found is None else found.repair) == repair


@pytest.mark.parametrize("repair", ["", "calmed"])
@pytest.mark.parametrize(("at", "told"), [(0.1, True), (0.8, True), (None, False)])
def test_a_force_may_not_rise_by_half_again_while_the_tip_slides(at, told, repair):
    """Nor at the first touch, but of a draft that was calmed: a hard tip may do no better."""
    press, t = pressing(PATH, repair=repair), np.linspace(0.0, 1.0, 101)
    rises = np.zeros(len(t), bool) if at is None else np.abs(t - at) < 0.015
    log = SimpleNamespace(
        row=np.arange(len(t)),
        normal_force=np.where(rises, 1.6, 1.0),
        normal_world=np.tile([0.0, 0.0, 1.0], (len(t), 1)),
        friction_force_world=np.zeros((len(t), 3)),
    )
    fault = _force_fault(None, SimpleNamespace(control=press), SimpleNamespace(t=t, contacts=log))
    assert (fault is not None) == (told and not (repair and at < press.lead_in))
    assert fault is None or (fault.kind == "force" and fault.t == pytest.approx(at, abs=0.02))


@pytest.mark.parametrize(("aside", "told"), [(0.55, False), (0.66, True)])
def test_a_tip_may_stay_behind_the_end_of_its_path_by_a_part_of_its_radius(aside, told):
    """0.6 radii along the surface, which is where the run ends, not where it begins."""
    radius, place = 0.05, pin.SE3(pin.utils.rotate("x", 0.3), np.array([0.1, 0.2, 0.3]))
    scene = sp.Scene(models.ball(joint=pin.JointModelTranslation()))
    tip = Tip("ball", radius, np.array([0.01, 0.0, 0.02]), "")
    sphere = sp.Sphere(radius, "ball", tip.offset)
    scene.add_contact(sphere, models.plate(), placement=place, law=models.LAW)
    start, end = (place.act(np.add(one, [0, 0, radius])) - tip.offset for one in PATH)
    behind = end - place.rotation @ [aside * radius, 0.0, 0.0]
    plan = SimpleNamespace(control=pressing(PATH), tips=(tip,))
    result = SimpleNamespace(q=np.array([end if told else start, behind]))
    fault = _path_fault(SimpleNamespace(scene=scene), plan, result)
    assert (fault is not None) == told
    assert not told or "33 mm behind the end of its path" in fault.text


def test_a_force_that_comes_late_gets_more_time_once():
    press = pressing(PATH[:1], repair="stays")
    late = Fault("force", "it is low", 0.6 * press.lead_in)
    slower = repaired(press, late)
    assert slower.force_rise == pytest.approx(2 * press.force_rise)
    assert repaired(slower, late) is None
