"""MJCF files are read as MuJoCo reads them: its own numbers of the models in tests/data/mjcf."""

import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.dynamics.scene.mimic import mimics
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import RobotWarning
from sphshell_pin.robots.mjcf_compile import silent
from tests.tables import cases_of
from tests.texts import text_of

mujoco = pytest.importorskip("mujoco")

FOLDER = Path(__file__).parents[1] / "data" / "mjcf"
MODELS = sorted(path.name for path in FOLDER.glob("*.xml"))
FREE, BALL = 0, 1


@cache
def of_mujoco(name):
    """Return MuJoCo's model, its data in some state, and the mass matrix there."""
    with silent(mujoco):
        model = mujoco.MjModel.from_xml_path(str(FOLDER / name))
    data, mass, rng = mujoco.MjData(model), np.zeros((model.nv, model.nv)), np.random.default_rng(7)
    data.qpos[:] = model.qpos0 + 0.3 * rng.normal(size=model.nq)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = rng.normal(size=model.nv)
    model.opt.gravity[:] = 0, 0, -9.81
    model.body_gravcomp[:] = 0
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    return model, data, mass


def load(name, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return robots.load_file(FOLDER / name, **options)


def state(model, theirs, data):
    """Return q, v of the model, and the matrix from its velocities to those of MuJoCo."""
    qpos, q, v, to_mujoco = data.qpos, *map(np.zeros, (model.nq, model.nv)), np.eye(model.nv)
    assert theirs.njnt == model.njoints - 1
    for joint, kind in zip(list(model.joints)[1:], theirs.jnt_type, strict=True):
        at, av = joint.idx_q, joint.idx_v
        if kind == FREE:
            q[at : at + 7] = [*qpos[at : at + 3], *qpos[at + 4 : at + 7], qpos[at + 3]]
            turn = pin.Quaternion(q[at + 3 : at + 7]).toRotationMatrix()
            to_mujoco[av : av + 3, av : av + 3] = turn  # linear velocity in the world's axes
        elif kind == BALL:
            q[at : at + 4] = [*qpos[at + 1 : at + 4], qpos[at]]
        else:
            q[at] = qpos[at]
    v[:] = np.linalg.solve(to_mujoco, data.qvel)
    return q, v, to_mujoco


@pytest.mark.parametrize("name", MODELS)
def test_mass_and_forces_are_those_of_mujoco(name):
    (theirs, told, their_mass), model = of_mujoco(name), load(name).model
    q, v, to_mujoco = state(model, theirs, told)
    mass = mass_matrix(model, q)
    expected = to_mujoco.T @ their_mass @ to_mujoco
    assert np.allclose(mass, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    # Of a free joint, MuJoCo's acceleration is that of the linear velocity in the world's axes.
    turning = np.zeros(model.nv)
    for joint, kind in zip(list(model.joints)[1:], theirs.jnt_type, strict=True):
        if kind == FREE:
            at = joint.idx_v
            turning[at : at + 3] = -np.cross(v[at + 3 : at + 6], v[at : at + 3])
    forces = pin.rnea(model, model.createData(), q, v, turning) - model.armature * turning
    expected = to_mujoco.T @ told.qfrc_bias
    assert np.allclose(forces, expected, rtol=0, atol=1e-12 * max(np.abs(expected).max(), 1.0))


@pytest.mark.parametrize("name", MODELS)
def test_spheres_and_sites_are_where_mujoco_has_them(name):
    (theirs, told, _), robot = of_mujoco(name), load(name)
    model, data = robot.model, robot.model.createData()
    q, _, _ = state(model, theirs, told)
    pin.framesForwardKinematics(model, data, q)
    found = {}
    for one in robot.collision_model.geometryObjects:
        if type(one.geometry).__name__ == "Sphere":
            center = data.oMi[one.parentJoint].act(one.placement.translation)
            found[one.name] = [*center, one.geometry.radius]
    for g in np.flatnonzero(theirs.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE):
        if sphere := theirs.geom(g).name:
            expected = [*told.geom_xpos[g], theirs.geom_size[g][0]]
            assert np.allclose(found[sphere], expected, rtol=0, atol=1e-14)
    for s in range(theirs.nsite):
        here = data.oMf[model.getFrameId(theirs.site(s).name)].translation
        assert np.allclose(here, told.site_xpos[s], rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", MODELS)
def test_joints_have_the_names_and_numbers_of_the_file(name):
    (theirs, _, _), model = of_mujoco(name), load(name).model
    for j in range(theirs.njnt):
        joint, first = model.joints[j + 1], theirs.jnt_dofadr[j]
        at, av = joint.idx_q, slice(joint.idx_v, joint.idx_v + joint.nv)
        assert not theirs.joint(j).name or model.names[j + 1] == theirs.joint(j).name
        assert np.all(model.damping[av] == np.ravel(theirs.dof_damping[first])[0])
        assert np.all(model.upperDryFrictionLimit[av] == theirs.dof_frictionloss[first])
        assert np.all(model.lowerDryFrictionLimit[av] == -theirs.dof_frictionloss[first])
        assert np.all(model.armature[av] == theirs.dof_armature[first])
        if joint.nq == 1:
            limits = [model.lowerPositionLimit[at], model.upperPositionLimit[at]]
            wanted = theirs.jnt_range[j] if theirs.jnt_limited[j] else [-np.inf, np.inf]
            np.testing.assert_allclose(limits, wanted, rtol=0, atol=1e-15)


def test_equalities_of_joints_are_mimic_joints():
    """tip_joint, the first in the tree, is the coordinate: half of follow = 0.1 + 1.2 drive."""
    model = load("chained_fingers.xml", mimic=True).model
    assert (model.nq, model.nv) == (2, 2)
    ratios = {name: (rule.ratio, rule.offset) for name, rule in mimics(model).items()}
    assert ratios == {
        "follow": pytest.approx((2.0, 0.0)),
        "drive": pytest.approx((2 / 1.2, -0.1 / 1.2)),
    }
    # The stops are those of the joint that drives the others.
    at = model.joints[model.getJointId("tip_joint")].idx_q
    limits = model.lowerPositionLimit[at], model.upperPositionLimit[at]
    assert np.allclose(limits, 0.5 * (0.1 + 1.2 * np.deg2rad([-10, 80])), rtol=1e-12)


def test_equalities_hold_between_distances_from_the_reference(tmp_path):
    """j1 - 0.2 = 0.1 + 0.5 (j2 - 0.3), of which j1 is the coordinate."""
    joints = ARM.replace('"j1"', '"j1" ref="0.2"').replace('"j2"', '"j2" ref="0.3"')
    equality = '<joint joint1="j1" joint2="j2" polycoef="0.1 0.5"/>'
    path = written(tmp_path, joints, '<compiler angle="radian"/>', equality)
    (rule,) = mimics(robots.load_file(path, mimic=True).model).values()
    assert (rule.ratio, rule.offset) == pytest.approx((2.0, -2.0 * (0.2 + 0.1 - 0.5 * 0.3)))


def test_keys_are_poses_and_without_one_it_starts_as_drawn():
    stand = [0, 0, 0.3, 0, 0, 0, 1, 0.5, -1, 0.5, -1, -0.5, 0, -1]
    assert np.allclose(load("quadruped.xml", pose="stand").q0, stand)
    assert np.allclose(load("reference.xml", pose="home").q0, [0.5, 0.6])
    assert np.allclose(load("reference.xml").q0, [0.2, np.pi / 6])
    turn = pin.exp3(np.pi / 6 * np.array([1, 2, 0]) / np.sqrt(5))
    drawn = pin.SE3ToXYZQUAT(pin.SE3(turn, np.array([0, 0, 0.5])))
    assert np.allclose(load("free.xml").q0, [*drawn, 0.0])


def test_what_is_not_modeled_is_said():
    with pytest.warns(RobotWarning) as caught:
        robots.load_file(FOLDER / "springs.xml")
    said = " ".join(str(one.message) for one in caught)
    for words in (
        "(stiffness, springdamper) are not modeled: 'sprung'",
        "ranges of ball joints are not modeled: 'cone'",
        "gravcomp too: 'b'",
        "tendons are not modeled: 'cord'",
        "add them as shells: 'floor'",
    ):
        assert words in said


INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def written(tmp_path, inside, head="", equality=""):
    path = tmp_path / "r.xml"
    end = f"<equality>{equality}</equality>" if equality else ""
    path.write_text(f"<mujoco>{head}<worldbody>{inside}</worldbody>{end}</mujoco>")
    return path


LINK = '<joint name="{0}"/><geom size="0.1"/>'
ARM = (
    f'<body name="a">{LINK.format("j1")}<body name="b">{LINK.format("j2")}</body></body>'
    f'<body name="c">{LINK.format("j3")}</body>'
)


COUPLED = cases_of("wrong_robots")["coupled"]


@pytest.mark.parametrize("equality", COUPLED)
def test_what_is_no_mimic_joint_is_refused_or_warned_of(tmp_path, equality):
    words, path = COUPLED[equality], written(tmp_path, ARM, equality=equality)
    with pytest.raises(robots.RobotError, match=rf"not supported: .*{words}.*mimic = false"):
        robots.load_file(path, mimic=True)
    with pytest.warns(RobotWarning, match=rf"move freely that the file couples: .*{words}"):
        assert robots.load_file(path).model.nv == 3


@pytest.mark.parametrize(("inside", "head", "words"), cases_of("wrong_robots")["mjcf"])
def test_what_cannot_be_read_is_said_in_a_sentence(tmp_path, monkeypatch, inside, head, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(robots.RobotError, match=rf"not an MJCF that can be read: .*{words}"):
        robots.load_file(written(tmp_path, inside.replace("ARM", ARM), head))
    assert {one.name for one in tmp_path.iterdir()} == {"r.xml"}  # no log of MuJoCo's


@pytest.mark.parametrize(
    ("part", "count", "words"),
    [
        ("<include file='{0}.xml'/><include file='{0}.xml'/>", 22, "more than 1000 files or 64 MB"),
        ("<include file='{0}.xml'/>", 101, "nested more than 100 deep"),
        ("<body>" * 30 + "<include file='{0}.xml'/>" + "</body>" * 30, 5, "more than 100 deep"),
        ("<include file='{0}.xml'/>" * 6 + "<body/>", 4, "has 259 links; at most 50"),
    ],
)
def test_files_included_count_in_total(tmp_path, monkeypatch, part, count, words):
    monkeypatch.setattr("sphshell_pin.robots.mjcf_compile.MOST_LINKS", 50)
    for k in range(count):
        text = part.format(k + 1) if k + 1 < count else "<body/>"
        (tmp_path / f"{k}.xml").write_text(f"<mujocoinclude>{text}</mujocoinclude>")
    path = written(tmp_path, "<include file='0.xml'/>")
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(path)


LIMB = """<mujoco><compiler angle="radian"/><worldbody>
<body name="base" pos="0 0 0.5">{free}<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
  <body name="link" pos="0.1 0 0"><joint name="turn" axis="0 1 0"/>
  <inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></body></worldbody>
<keyframe><key name="home" qpos="{place} 0.3"/></keyframe></mujoco>"""


def test_joints_without_names_get_names_of_their_own(tmp_path):
    """Also those in frames, which are of the body, and beside names that the file states."""
    inside = (
        '<body name="a"><joint axis="1 0 0"/><frame pos="0 0 1"><joint axis="0 1 0"/></frame>'
        '<geom size="1"/><body><joint name="a_joint1"/><geom size="1"/></body></body>'
    )
    names = list(robots.load_file(written(tmp_path, inside)).model.names)
    assert names[1:] == ["a_joint", "a_joint2", "a_joint1"]


def test_a_base_is_freed_and_fixed(tmp_path):
    """As in a file that states it so; keys keep the joints' own numbers."""
    free, fixed = tmp_path / "free.xml", tmp_path / "fixed.xml"
    free.write_text(LIMB.format(free="<freejoint/>", place="0 0 0.5 1 0 0 0"))
    fixed.write_text(LIMB.format(free="", place=""))
    for floats, as_stated, other in ((True, free, fixed), (False, fixed, free)):
        told = robots.load_file(as_stated, pose="home")
        for file in (as_stated, other):
            made = robots.load_file(file, free_flyer=floats, pose="home")
            assert made.model.nv == told.model.nv == (7 if floats else 1)
            np.testing.assert_allclose(made.q0, told.q0)
            places = (one.model.jointPlacements[-1].homogeneous for one in (made, told))
            np.testing.assert_allclose(*places)
    turned = LIMB.format(free="", place="").replace('"0 0 0.5"', '"0 0 0.5" euler="0 1.5 0"')
    framed = turned.replace("<body", '<frame euler="0.5 0 0"><body', 1)
    free.write_text(framed.replace("</worldbody>", "</frame></worldbody>"))
    drawn, home = (robots.load_file(free, free_flyer=True, pose=one).q0 for one in (None, "home"))
    np.testing.assert_allclose(home[:7], drawn[:7])
    with pytest.raises(robots.RobotError, match="has a joint already: it cannot float"):
        robots.load_file(FOLDER / "hinge.xml", free_flyer=True)
    other = '<worldbody><body name="other"><joint name="b"/><geom size="1"/></body>'
    beside = LIMB.format(free="<freejoint/>", place="0.2 0 0 0.5 1 0 0 0")
    free.write_text(beside.replace("<worldbody>", other))
    np.testing.assert_allclose(robots.load_file(free, free_flyer=False, pose="home").q0, [0.2, 0.3])


def test_an_open_mesh_weighs_as_its_hull_and_nothing_where_nothing_moves(tmp_path):
    """An open box: its hull is the whole one. The world's part needs no mass at all."""
    import trimesh

    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.update_faces(np.arange(12) > 1)
    box.export(tmp_path / "open.stl")
    head = '<asset><mesh name="open" file="open.stl"/></asset>'
    geom, joint = '<geom type="mesh" mesh="open"/>', '<joint name="turn" axis="0 1 0"/>'
    text = f'<body name="base">{geom}<body name="link">{joint}{{}}</body></body>'
    path = written(tmp_path, text.format(INERTIAL), head)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert robots.load_file(path).model.inertias[1].mass == 1.0
    path = written(tmp_path, text.format(geom), head)
    with pytest.warns(RobotWarning, match="not closed are those of their convex hulls: 'open'"):
        model = robots.load_file(path).model
    assert model.inertias[1].mass == pytest.approx(1000 * 0.1 * 0.2 * 0.3)


def test_meshes_of_mjcf(tmp_path):
    robot = load("meshes.xml")
    kinds = [type(one.geometry).__name__ for one in robot.collision_model.geometryObjects]
    assert kinds.count("Sphere") == 1
    assert len(kinds) == 4
    text = (FOLDER / "meshes.xml").read_text()
    text = text.replace('<geom type="mesh" mesh="w', f'{INERTIAL}<geom type="mesh" mesh="w')
    text = text.replace('meshdir="assets"', f'meshdir="{FOLDER / "assets"}"')
    path = tmp_path / "r.xml"
    (tmp_path / "broken.stl").write_text("solid")
    for name in ("nix.stl", "broken.stl"):
        path.write_text(text.replace('file="wedge.stl"', f'file="{tmp_path / name}"'))
        said = rf"meshes, which are missing or broken: .*{name}; what lacks .*meshdir="
        with pytest.warns(RobotWarning, match=said):
            robot = robots.load_file(path)
        assert robot.model.nv == 2
        assert 0 < len(robot.collision_model.geometryObjects) < 4


def test_what_only_shows_or_moves_the_robot_is_not_read(tmp_path):
    """Neither are the files that it names: a device would have no end."""
    (tmp_path / "r.xml").write_text(text_of("robots/shown.xml"))
    with pytest.warns(RobotWarning) as caught:
        robot = robots.load_file(tmp_path / "r.xml", pose="home")
    said = " ".join(str(one.message) for one in caught)
    assert "left out: 'hfield'" in said
    assert "nix.stl" in said
    assert robot.q0 == [0.5]
    assert robot.model.inertias[1].mass == 2.0
    assert robot.model.damping == [2.0]
    (ball,) = robot.visual_model.geometryObjects or robot.collision_model.geometryObjects
    np.testing.assert_allclose(ball.meshColor, [0.1, 0.2, 0.3, 1], atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "half"),
    [("sphere", (0.1, 0.1, 0.1)), ("capsule", (0.1, 0.1, 0.3)), ("cylinder", (0.1, 0.1, 0.2))]
    + [(kind, (0.1, 0.2, 0.3)) for kind in ("ellipsoid", "box")],
)
def test_shapes_are_as_large_as_mujoco_says(tmp_path, kind, half):
    """Its sizes are half lengths, of a capsule without its ends."""
    geom = f'<geom type="{kind}" size="0.1 0.2 0.3"/>'
    robot = robots.load_file(written(tmp_path, f'<body><joint name="j"/>{geom}</body>'))
    (one,) = robot.collision_model.geometryObjects
    one.geometry.computeLocalAABB()
    assert one.geometry.aabb_local.max_ == pytest.approx(half, rel=1e-6)
