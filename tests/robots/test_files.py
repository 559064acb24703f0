"""Robots' files: package paths, poses, mimic joints, and what is refused."""

import re
import shutil
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.dynamics.scene.mimic import mimics
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import NameNotFound, RobotWarning
from tests import urdf
from tests.tables import cases_of

FOLDER = Path(__file__).parents[1] / "data" / "xacro"
INERTIAL = urdf.inertial()
WRONG = cases_of("wrong_robots")


def arm(tmp_path, *, collision="", visual="", name="arm.urdf"):
    """Return the file of a pendulum with meshes."""
    kinds = {"collision": collision, "visual": visual}
    parts = [urdf.shape(kind, urdf.mesh(uri)) for kind, uri in kinds.items() if uri]
    file = tmp_path / name
    file.parent.mkdir(parents=True, exist_ok=True)
    links = urdf.link("a"), urdf.link("b", INERTIAL, *parts)
    return urdf.write(file, *links, urdf.joint("j", "continuous", "a", "b"))


def package(folder, *, manifest=True):
    """Make the package arm_meshes with a mesh in `folder`."""
    (folder / "meshes").mkdir(parents=True)
    shutil.copy(FOLDER / "finger_description/meshes/cube.stl", folder / "meshes")
    if manifest:
        (folder / "package.xml").write_text("<package><name>arm_meshes</name></package>")


URI = "package://arm_meshes/meshes/cube.stl"


@pytest.mark.parametrize(
    ("place", "manifest", "variable", "folder"),
    [
        ("packages/arm_meshes", False, None, "{}/packages"),
        ("packages/renamed", True, None, "{}/packages/renamed"),
        ("ros/src/stack/arm_meshes", True, "ROS_PACKAGE_PATH", "{}/ros/src"),
        ("ros/arm_meshes", False, "ROS_PACKAGE_PATH", "nothing:{}/ros"),
        ("ament/share/arm_meshes", False, "AMENT_PREFIX_PATH", "{}/ament"),
        ("robot", False, None, ""),  # which the file is in
    ],
)
def test_packages_are_found(tmp_path, monkeypatch, place, manifest, variable, folder):
    package(tmp_path / place, manifest=manifest)
    uri = URI.replace("arm_meshes", "robot") if place == "robot" else URI
    file = arm(tmp_path, collision=uri, visual=uri, name="robot/urdf/arm.urdf")
    given = [folder.format(tmp_path)] if folder else []
    if variable:
        with pytest.warns(RobotWarning, match="--package-dir"):
            robots.load_file(file)
        monkeypatch.setenv(variable, *given)
        given = []
    robot = robots.load_file(file, given)
    assert robot.collision_model.ngeoms == 1
    (drawn,) = robot.visual_model.geometryObjects
    assert drawn.meshPath == str(tmp_path / place / "meshes/cube.stl")


def test_other_names_of_meshes(tmp_path):
    package(tmp_path / "arm_meshes")
    mesh = tmp_path / "arm_meshes/meshes/cube.stl"
    windows = r"package://arm_meshes\meshes\cube.stl"
    for uri in (str(mesh), f"file://{mesh}", "arm_meshes/meshes/cube.stl", windows):
        assert robots.load_file(arm(tmp_path, collision=uri)).collision_model.ngeoms == 1


def test_a_mesh_that_is_missing_warns_once_and_goes_on(tmp_path):
    """Motion needs none, nor one that is broken."""
    file = arm(tmp_path, visual=URI)
    part = urdf.shape("visual", urdf.mesh(URI))
    file.write_text(file.read_text().replace(part, part + part.replace("cube", "ball") + part))
    with pytest.warns(RobotWarning, match=r"cube\.stl, .*ball\.stl; searched in") as caught:
        assert robots.load_file(file).visual_model.ngeoms == 0
    assert len(caught) == 1
    file = arm(tmp_path, collision=URI)
    with pytest.warns(RobotWarning, match=r"cube\.stl; what lacks its .* touches nothing"):
        assert robots.load_file(file).model.nv == 1
    package(tmp_path / "arm_meshes")
    (tmp_path / "arm_meshes/meshes/cube.stl").write_text("no mesh")
    with pytest.warns(RobotWarning, match=r"broken: .*cube\.stl; what lacks its .* touches no"):
        assert robots.load_file(file).collision_model.ngeoms == 0


def test_limits_that_are_not_stated_are_none(tmp_path):
    file = arm(tmp_path)
    text = file.read_text().replace("continuous", "revolute")
    file.write_text(re.sub(r"<limit[^>]*/>", '<limit lower="-1" upper="2"/>', text))
    assert robots.load_file(file).model.upperPositionLimit == 2
    file.write_text(re.sub(r"<limit[^>]*/>", "", text))
    with pytest.warns(RobotWarning, match="they have no <limit>"):
        assert not JointComponents.from_model(robots.load_file(file).model).limits


@pytest.mark.parametrize(("name", "words"), WRONG["formats"])
def test_other_formats_name_the_next_step(tmp_path, name, words):
    path = tmp_path / name
    path.write_text("<model/>")
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(path)


NO_LINK_B = (
    '<link name="a"/><joint name="j" type="fixed"><parent link="b"/><child link="a"/></joint>'
)


@pytest.mark.parametrize("text", [urdf.robot(), urdf.robot(NO_LINK_B), "<mujocoinclude/>"])
def test_part_of_a_robot_asks_for_the_file_that_includes_it(tmp_path, text):
    path = tmp_path / "part.urdf"
    path.write_text(text)
    with pytest.raises(robots.RobotError, match=r"name (that|the file of the robot)"):
        robots.load_file(path)


def test_a_massless_root_cannot_float(tmp_path):
    with pytest.raises(robots.RobotError, match=r"root link 'a' is to float but has no mass") as e:
        robots.load_file(arm(tmp_path), free_flyer=True)
    assert "without --free-flyer" in str(e.value)
    # What is fixed to it counts: usual in ROS.
    file = arm(tmp_path)
    file.write_text(file.read_text().replace("continuous", "fixed"))
    assert robots.load_file(file, free_flyer=True).model.nv == 6


def test_a_kinematic_loop_names_its_joints(tmp_path):
    file = arm(tmp_path)
    again = urdf.link("c", INERTIAL) + urdf.joint("k", "continuous", "a", "c")
    again += urdf.joint("l", "continuous", "c", "b")
    file.write_text(file.read_text().replace("</robot>", f"{again}</robot>"))
    with pytest.raises(robots.RobotError, match=r"joints 'j' and 'l' move one link, 'b'.*loops"):
        robots.load_file(file)


def test_poses_of_an_srdf():
    file, srdf = FOLDER / "hand.urdf.xacro", FOLDER / "hand.srdf"
    robot = robots.load_file(file, srdf=srdf, pose="closed", mimic=True)
    at = [robot.model.joints[robot.model.getJointId(n)].idx_q for n in ("f1_base", "f2_base")]
    assert robot.q0[at].tolist() == [0.8, 0.9]
    with pytest.raises(NameNotFound, match=r"no pose 'open'; .*has: closed"):
        robots.load_file(file, srdf=srdf, pose="open")
    with pytest.raises(robots.RobotError, match=r"nix\.srdf: no such"):
        robots.load_file(file, srdf=FOLDER / "nix.srdf")


@pytest.mark.parametrize(("joint", "words"), WRONG["poses"])
def test_poses_that_would_be_left_out_are_named(tmp_path, joint, words):
    srdf = tmp_path / "p.srdf"
    srdf.write_text(f"<robot name='h'><group_state name='p'><joint {joint}/></group_state></robot>")
    with pytest.raises(robots.RobotError, match=rf"p\.srdf: .*pose 'p', joint.*{words}"):
        robots.load_file(FOLDER / "hand.urdf.xacro", srdf=srdf)


def check_reduced(whole: pin.Model, model: pin.Model) -> None:
    """Assert that the mimic model's mass matrix and forces are G^T M G and G^T tau."""
    rng, rules = np.random.default_rng(0), mimics(model)
    assert list(model.names) == list(whole.names)
    assert [one.name for one in model.frames] == [one.name for one in whole.frames]
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
    g, q_whole = np.zeros((whole.nv, model.nv)), np.zeros(whole.nq)
    for name, old, new in [*zip(whole.names, whole.joints, model.joints, strict=True)][1:]:
        rule = rules.get(name)
        of = model.joints[model.getJointId(rule.of)] if rule else new
        ratio, offset = (rule.ratio, rule.offset) if rule else (1.0, 0.0)
        g[old.idx_v : old.idx_v + old.nv, of.idx_v : of.idx_v + of.nv] = ratio * np.eye(old.nv)
        values = q[of.idx_q : of.idx_q + of.nq]
        q_whole[old.idx_q : old.idx_q + old.nq] = ratio * values + offset if rule else values
    v, a = rng.normal(size=(2, model.nv))
    full, data = whole.createData(), model.createData()
    expected, found = g.T @ mass_matrix(whole, q_whole) @ g, np.triu(pin.crba(model, data, q))
    found += np.triu(found, 1).T
    assert np.allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    expected = g.T @ pin.rnea(whole, full, q_whole, g @ v, g @ a)
    found = pin.rnea(model, data, q, v, a)
    assert np.allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    # What the joints dissipate: damping v^2, and dry friction |v|.
    assert np.allclose(model.damping * v @ v, whole.damping * (g @ v) @ (g @ v))
    dry = whole.upperDryFrictionLimit @ abs(g @ v)
    assert np.allclose(model.upperDryFrictionLimit @ abs(v), dry)


@pytest.mark.parametrize(
    "name",
    [*(f"xacro/{one}.urdf.xacro" for one in ("one_finger", "hand", "gripper"))]
    + [f"mjcf/{one}.xml" for one in ("gripper", "hand", "chained_fingers")],
)
def test_mimic_joints_of_files_are_exact(name):
    whole, robot = (robots.load_file(FOLDER.parent / name, mimic=one) for one in (False, True))
    assert robot.model.nv < whole.model.nv
    check_reduced(whole.model, robot.model)
    # A geometry keeps its joint and frame.
    assert all(robot.model.existFrame(tip.frame) for tip in robots.end_spheres(robot))


def test_numbers_that_urdfdom_would_drop_with_their_part_are_refused(tmp_path):
    """An inertia or a collision goes with one of its numbers, in silence."""
    shapes = ("<sphere radius='1'/>", "<box size='1 1 1'/>", "<cylinder radius='1' length='1'/>")
    head, end = "<collision><origin xyz='1 0 0' rpy='1 0 0'/><geometry>", "</geometry></collision>"
    places = "".join(f"{head}{shape}{end}" for shape in shapes)
    inertial = INERTIAL.replace("<inertial>", '<inertial><origin xyz="0 0 1" rpy="0 0 1"/>')
    file = arm(tmp_path)
    whole = re.sub("<limit[^>]*>", "", file.read_text()).replace(INERTIAL, inertial + places)
    file.write_text(whole)
    robot = robots.load_file(file)
    assert robot.collision_model.ngeoms == 3
    assert robot.model.inertias[1].mass == 1
    starts = [found.end() for found in re.finditer("[a-z]=['\"](?=1)", whole)]
    assert len(starts) == 14
    for at in starts:
        for number in ("1_0", "nan", "1e400", "-inf", "0x10", "\u0661", "", "1 1 1 1"):
            file.write_text(whole[:at] + number + whole[at + 1 :], encoding="utf-8")
            with pytest.raises(robots.RobotError, match=r"must be [13] finite number"):
                robots.load_file(file)
    named = f"""<robot name="x"><link name="${{prefix}}link">{inertial}</link></robot>"""
    file.write_text(named.replace('value="1"', 'value="nan"', 1))
    with pytest.raises(robots.RobotError, match=r"link '\$\{prefix\}link': value 'nan' must be 1"):
        robots.load_file(file)


@pytest.mark.parametrize(("mimic", "words"), WRONG["mimics"])
def test_wrong_mimic_joints_are_named(tmp_path, mimic, words):
    file = arm(tmp_path)
    file.write_text(file.read_text().replace("</joint>", f"<mimic {mimic}/></joint>"))
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(file, mimic=True)


def test_a_floating_joint_of_a_urdf_is_fixed_where_the_base_is_to_be(tmp_path):
    file = arm(tmp_path)
    free = '<joint name="f" type="floating"><parent link="world"/><child link="a"/></joint>'
    file.write_text(file.read_text().replace("</robot>", f'<link name="world"/>{free}</robot>'))
    assert robots.load_file(file).model.nv == 7
    assert robots.load_file(file, free_flyer=False).model.nv == 1
