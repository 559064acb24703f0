"""Robots' files: xacro, package paths, poses, mimic joints, and what is refused."""

import shutil
import sys
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.dynamics.scene.mimic import mimics
from sphshell_pin.errors import MissingExtra, NameNotFound, RobotWarning
from sphshell_pin.robots import xacro_file
from tests.studies import mostly_studies

FOLDER = Path(__file__).parents[1] / "data" / "xacro"
INERTIAL = (
    "<inertial><mass value='1'/>"
    "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
)
MESH = "<geometry><mesh filename='{0}'/></geometry>"


@pytest.mark.parametrize(
    ("name", "nq", "spheres"),
    [
        ("one_finger", 1, 1),
        ("hand", 4, 3),
        ("from_yaml", 3, 0),
        ("gripper", 2, 2),
        ("legged", 6, 2),
    ],
)
def test_xacro_files_are_read(name, nq, spheres):
    robot = robots.load_file(FOLDER / f"{name}.urdf.xacro", mimic=True)
    assert robot.model.name == name
    assert robot.model.nq == nq
    assert len(robots.end_spheres(robot)) == spheres
    assert all(inertia.mass > 0 for inertia in list(robot.model.inertias)[1:])


def test_xacro_has_arguments_and_finds_packages():
    file = FOLDER / "hand.urdf.xacro"
    robot = robots.load_file(file, xacro_args={"fingers": 2, "with_wrist": False})
    assert list(robot.model.names)[1:] == ["f1_base", "f1_end", "f2_base", "f2_end"]
    # The meshes of its visual geometry, by package://.
    assert robot.visual_model.ngeoms == 4
    model = robot.model
    assert np.all(model.damping == 0.02)
    assert np.all(model.upperDryFrictionLimit == 0.01)
    assert np.all(model.upperEffortLimit == 2)
    assert np.all(model.velocityLimit == 3)
    assert np.all(model.lowerPositionLimit == -0.3)
    length, radius = 0.05, 0.01
    mass = 2700 * np.pi * radius**2 * length
    assert model.inertias[1].mass == pytest.approx(mass)


OS = "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == '_wrap_close'][0]"
HOSTILE = {
    "lambda": "${(lambda: " + OS + ".__init__.__globals__['system']('touch FILE'))()}",
    "comprehension": "${[" + OS + ".__init__.__globals__['system']('touch FILE') for i in [1]]}",
    "frame": "${[g.gi_frame.f_back.f_builtins for g in [(1 for i in [1])]]}",
    "underscore": "${len.__self__}",
    "eval": "$(eval eval('_'*2 + 'import' + '_'*2 + '(\"os\").system(\"touch FILE\")'))",
    "open": "$(eval open('FILE', 'w'))",
    "argument": "$(eval (lambda: open('FILE', 'w'))())",
    "walrus": "${[y := 1, y]}",
    "nested": "${" + "-" * 3000 + "(lambda: 1)()}",
    "vars": "${python.vars(python.type)['mro'](int)}",
    "type": "${python.type('a', (), dict())}",
    "class": "${''.__class__}",
    "method": "${[].append}",
    "format": "${f1.format(1)}",
    "format of a key": "${f2.format([1])}",
    "width": "${f3.format(1)}",
    "width of %": "${'%099999999999d' % 1}",
    "attribute of a number": "${(1).real}",
    "attribute of a function": "${len.real}",
    "loader": "$(eval __loader__)",
    "private name of math": "$(eval [v for v in [__spec__]])",
    "bytes": "${b'a'}",
    "f-string": "$(eval f'{1}')",
    "function of functions": "${map(python.vars, [1])}",
}


def xacro(tmp_path, inside):
    """Return the file of a xacro robot."""
    path = tmp_path / "r.xacro"
    path.write_text(f"<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>{inside}</robot>")
    return path


@pytest.mark.parametrize("how", HOSTILE)
def test_xacro_expressions_compute_and_do_nothing_else(how, tmp_path):
    made = tmp_path / "made"
    expression = escape(HOSTILE[how].replace("FILE", str(made)), {"'": "&apos;", '"': "&quot;"})
    links = "<link name='a'/><link name='${p}'/>"
    values = {"p": expression, "f1": "{0.real}", "f2": "{0[0]}", "f3": "{:99999999999}"}
    given = "".join(f"<xacro:property name='{k}' value='{v}'/>" for k, v in values.items())
    path = xacro(tmp_path, given + links)
    # What is in $(eval ...) ends at the first parenthesis, and is no expression then.
    why = (
        "refused in the expression|too deeply|is not defined"
        if "${" in HOSTILE[how]
        else "xacro cannot expand"
    )
    with pytest.raises(robots.RobotError, match=why):
        robots.load_file(path)
    assert not made.exists()


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ("9**9**9", "has more than 1000000 items"),
        ("10**10**10", "has more than 1000000 items"),
        ("1 &lt;&lt; 10**10", "has more than 1000000 items"),
        ("'a'*10**9", "has more than 1000000 items"),
        ("[0]*10**9", "has more than 1000000 items"),
        ("'a'.zfill(10**9)", "has more than 1000000 items"),
        ("python.zip(python.range(10**12))", "has more than 1000000 items"),
        ("[1 for a in range(10**5) for b in range(10**5)]", "take more than 300000 steps"),
        ("[0 for a in range(10**9) if 0]", "take more than 300000 steps"),
        ("python.sum(python.range(10**11))", "takes more than 1 s to expand"),
        ("math.factorial(10**8)", "takes more than 1 s to expand"),
        ("len(list(range(10**9)))", "takes more than 1 GB of memory"),
    ],
)
def test_what_a_xacro_file_takes_is_limited(tmp_path, monkeypatch, expression, words):
    monkeypatch.setattr(xacro_file, "TIME_LIMIT", 1.0)
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(xacro(tmp_path, f'<link name="${{{expression}}}"/>'))


UNCHECKED = """
import os, socket
from sphshell_pin.robots import xacro_child
def attempt(function, *arguments):
    try:
        function(*arguments)
    except Exception as error:
        return type(error).__name__
    return "done"
def unchecked(xacro, substitution_args):
    xacro.safe_eval = lambda text, *_: eval(text, globals())
xacro_child.install = unchecked
serve = xacro_child.serve
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel has no such means")
def test_an_expression_that_escapes_is_in_a_process_that_does_nothing(tmp_path, monkeypatch):
    (tmp_path / "unchecked_xacro.py").write_text(UNCHECKED)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(xacro_file, "CHILD", "unchecked_xacro")
    kept = tmp_path / "kept"
    kept.write_text("precious")
    calls = (
        f"os.unlink, '{kept}'",
        f"os.mkdir, '{tmp_path / 'made'}'",
        f"open, '{kept}', 'w'",
        "socket.socket",
        "os.execv, '/bin/true', ['true']",
        "os.fork",
    )
    links = "".join(f'<link name="a{k}_${{attempt({call})}}"/>' for k, call in enumerate(calls))
    description = robots.read(xacro(tmp_path, links))
    names = [link.get("name") for link in description.root.iter("link")]
    assert names == [f"a{k}_PermissionError" for k in range(len(calls))]
    assert kept.read_text() == "precious"


def test_xacro_expressions_compute(tmp_path):
    names = ["${'a'.upper() + str(max([round(x) for x in (1.2, 3.7)]))}", "$(eval 'b2')"]
    values = {
        "_tmp_ + 1": 4,
        "dict(a=1, **dict(b=2))['b']": 2,
        "', '.join(sorted(['b', 'a'])[::-1])": "b, a",
        "python.isinstance(_tmp_, python.int) and not _tmp_ in [1, 2]": True,
        "[a * b for a, b in python.zip([1, 2], [3, 4]) if a > 1]": [8],
        "f.format(1, name=2)": "1  2.00",
        "'%d %s' % (1, 'a')": "1 a",
        "xacro.tokenize('a, b;c')": ["a", "b", "c"],
        "2**3 // 5 % 2 << 2": 4,
        "list(map(str, python.range(2)))": ["0", "1"],
        "1 if 1 < 2 < 2 else python.sum(x for x in [1, 2])": 3,
        "max(['aa', 'b'], key=len).count('a')": 2,
    }
    start = "<xacro:property name='_tmp_' value='3'/>"
    start += "<xacro:property name='f' value='{} {name:5.2f}'/>"
    texts = "".join(f'<a b="${{{escape(text)}}}"/>' for text in values)
    expanded = robots.read(xacro(tmp_path, start + texts)).root
    assert [one.get("b") for one in expanded.iter("a")] == [*map(str, values.values())]
    links = "".join(f'<link name="{name}"/>' for name in names)
    joint = (
        '<joint name="j" type="revolute"><parent link="A4"/><child link="b2"/>'
        '<limit lower="${-pi/2}" upper="${radians(90) if 1 &lt; 2 else 0}" effort="1" '
        'velocity="1"/></joint>'
    )
    model = robots.load_file(xacro(tmp_path, links + joint)).model
    assert model.existFrame("A4")
    assert model.upperPositionLimit[0] == -model.lowerPositionLimit[0] == pytest.approx(np.pi / 2)


def test_what_xacro_cannot_expand_is_said(tmp_path, monkeypatch):
    for inside, words in (
        ("${nix}", "xacro cannot expand it: .*nix"),
        ('<xacro:include filename="$(find nix)/a.xacro"/>', "no package 'nix' in .*--package-dir"),
        ('<xacro:include filename="b.xacro"/>', r"b\.xacro"),
        ("<link name='a'>", "xacro cannot expand it"),
        ("<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>", "nested too deeply"),
    ):
        with pytest.raises(robots.RobotError, match=words):
            robots.load_file(xacro(tmp_path, inside))
    with pytest.raises(robots.RobotError, match=r"arguments are for files that end in \.xacro"):
        robots.load_file(robots.URDF_FOLDER / "ball.urdf", xacro_args={"a": 1})
    monkeypatch.setitem(__import__("sys").modules, "xacro", None)
    with pytest.raises(MissingExtra, match=r"needs xacro: .*sphshell-pin\[robots\]"):
        robots.load_file(FOLDER / "hand.urdf.xacro")


def arm(tmp_path, *, collision="", visual="", name="arm.urdf"):
    """Return the file of a pendulum with meshes."""
    parts = "".join(
        f"<{kind}>{MESH.format(uri)}</{kind}>"
        for kind, uri in (("collision", collision), ("visual", visual))
        if uri
    )
    file = tmp_path / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(
        f"<robot name='arm'><link name='a'/><link name='b'>{INERTIAL}{parts}</link>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint></robot>"
    )
    return file


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
        ("packages/arm_meshes", False, None, "packages"),
        ("packages/renamed", True, None, "packages/renamed"),
        ("ros/src/stack/arm_meshes", True, "ROS_PACKAGE_PATH", "ros/src"),
        ("ros/arm_meshes", False, "ROS_PACKAGE_PATH", "nothing:{}/ros"),
        ("ament/share/arm_meshes", False, "AMENT_PREFIX_PATH", "ament"),
    ],
)
def test_packages_are_found(tmp_path, monkeypatch, place, manifest, variable, folder):
    package(tmp_path / place, manifest=manifest)
    file = arm(tmp_path, collision=URI, visual=URI, name="robot/arm.urdf")
    given = [tmp_path / folder]
    if variable:
        full = folder.format(tmp_path) if "{}" in folder else str(tmp_path / folder)
        with pytest.raises(robots.RobotError, match="package_dirs"):
            robots.load_file(file)
        monkeypatch.setenv(variable, full)
        given = []
    robot = robots.load_file(file, given)
    assert robot.collision_model.ngeoms == robot.visual_model.ngeoms == 1
    assert robot.visual_model.geometryObjects[0].meshPath == str(
        tmp_path / place / "meshes/cube.stl"
    )


def test_the_package_that_the_file_is_in_is_found(tmp_path):
    package(tmp_path / "arm_meshes", manifest=False)
    file = arm(tmp_path, collision=URI, name="arm_meshes/urdf/arm.urdf")
    assert robots.load_file(file).collision_model.ngeoms == 1


def test_other_names_of_meshes(tmp_path):
    package(tmp_path / "arm_meshes")
    mesh = tmp_path / "arm_meshes/meshes/cube.stl"
    for uri in (str(mesh), f"file://{mesh}", "arm_meshes/meshes/cube.stl"):
        assert robots.load_file(arm(tmp_path, collision=uri)).collision_model.ngeoms == 1


def test_a_visual_mesh_that_is_missing_warns_once_and_goes_on(tmp_path):
    file = arm(tmp_path, visual=URI)
    text = file.read_text()
    part = f"<visual>{MESH.format(URI)}</visual>"
    file.write_text(text.replace(part, part + part.replace("cube", "ball") + part))
    with pytest.warns(RobotWarning, match=r"cube\.stl, .*ball\.stl; searched in") as caught:
        robot = robots.load_file(file)
    assert len(caught) == 1
    assert robot.visual_model.ngeoms == 0
    with pytest.raises(robots.RobotError, match=r"cube\.stl is not there.*--package-dir"):
        robots.load_file(arm(tmp_path, collision=URI))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("r.sdf", "SDF file.*convert it to MJCF"),
        ("r.usda", "export a URDF or MJCF"),
        ("r.dae", "is a mesh, .*URDF or MJCF with a link"),
        ("r.step", "CAD file"),
        ("r.srdf", "give the URDF as the file"),
        ("r.txt", "root element is <model>; robots are read from URDF"),
    ],
)
def test_other_formats_name_the_next_step(tmp_path, name, words):
    path = tmp_path / name
    path.write_text("<model/>")
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(path)


def test_sdf_is_known_by_its_content_too(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text("<sdf version='1.6'><model name='m'/></sdf>")
    with pytest.raises(robots.RobotError, match="has no SDF reader"):
        robots.load_file(path)


def test_a_massless_root_cannot_float(tmp_path):
    with pytest.raises(robots.RobotError, match=r"root link 'a' is to float but has no mass"):
        robots.load_file(arm(tmp_path), free_flyer=True)
    # What is fixed to it counts: usual in ROS.
    text = arm(tmp_path).read_text().replace("continuous", "fixed")
    (tmp_path / "fixed.urdf").write_text(text)
    assert robots.load_file(tmp_path / "fixed.urdf", free_flyer=True).model.nv == 6


def test_a_kinematic_loop_names_its_joints(tmp_path):
    file = arm(tmp_path)
    again = (
        f"<link name='c'>{INERTIAL}</link>"
        "<joint name='k' type='continuous'><parent link='a'/><child link='c'/></joint>"
        "<joint name='l' type='continuous'><parent link='c'/><child link='b'/></joint></robot>"
    )
    file.write_text(file.read_text().replace("</robot>", again))
    with pytest.raises(robots.RobotError, match=r"joints 'j' and 'l' move one link, 'b'.*loops"):
        robots.load_file(file)


def test_poses_of_an_srdf():
    file, srdf = FOLDER / "hand.urdf.xacro", FOLDER / "hand.srdf"
    robot = robots.load_file(file, srdf=srdf, pose="closed", mimic=True)
    at = {n: robot.model.joints[robot.model.getJointId(n)].idx_q for n in robot.model.names}
    assert robot.q0.shape == (robot.model.nq,)
    assert (robot.q0[at["f1_base"]], robot.q0[at["f2_base"]]) == (0.8, 0.9)
    with pytest.raises(NameNotFound, match=r"no pose 'open'; .*has: closed"):
        robots.load_file(file, srdf=srdf, pose="open")
    with pytest.raises(robots.RobotError, match=r"nix\.srdf: no such"):
        robots.load_file(file, srdf=FOLDER / "nix.srdf")


@pytest.mark.parametrize(
    ("joint", "words"),
    [
        ("name='f1_base' value='nan'", "'f1_base': value 'nan' must be 1 finite number"),
        ("name='f1_base' value='1 2 3'", "'f1_base': value '1 2 3' must be 1 finite number"),
        ("name='f1_base' value='wide'", "'f1_base': value 'wide' must be"),
        ("name='f1_base'", "'f1_base': value '' must be"),
        ("value='1'", "'': the robot has no such joint"),
        ("name='f9' value='1'", "'f9': the robot has no such joint"),
        ("name='universe' value='1'", "'universe': the robot has no such joint"),
    ],
)
def test_poses_that_would_be_left_out_are_named(tmp_path, joint, words):
    srdf = tmp_path / "p.srdf"
    srdf.write_text(f"<robot name='h'><group_state name='p'><joint {joint}/></group_state></robot>")
    with pytest.raises(robots.RobotError, match=rf"p\.srdf: .*pose 'p', joint.*{words}"):
        robots.load_file(FOLDER / "hand.urdf.xacro", srdf=srdf)


def test_values_of_poses_are_read_whole(tmp_path):
    srdf = tmp_path / "p.srdf"
    one = "<joint name='f1_base' value='0.1_5'/>"
    srdf.write_text(f"<robot name='h'><group_state name='p'>{one}</group_state></robot>")
    robot = robots.load_file(FOLDER / "hand.urdf.xacro", srdf=srdf, pose="p")
    assert 0.15 in robot.q0


def check_reduced(whole: pin.Model, model: pin.Model) -> None:
    """Assert that the mimic model's mass matrix and forces are G^T M G and G^T tau."""
    rng = np.random.default_rng(0)
    rules = mimics(model)
    assert list(model.names) == list(whole.names)
    assert [one.name for one in model.frames] == [one.name for one in whole.frames]
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
    g, q_whole = np.zeros((whole.nv, model.nv)), np.zeros(whole.nq)
    for name, old, new in zip(whole.names, whole.joints, model.joints, strict=True):
        if name == "universe":
            continue
        rule = rules.get(name)
        of = model.joints[model.getJointId(rule.of)] if rule else new
        ratio, offset = (rule.ratio, rule.offset) if rule else (1.0, 0.0)
        g[old.idx_v : old.idx_v + old.nv, of.idx_v : of.idx_v + of.nv] = ratio * np.eye(old.nv)
        values = q[of.idx_q : of.idx_q + of.nq]
        q_whole[old.idx_q : old.idx_q + old.nq] = ratio * values + offset if rule else values
    v, a = rng.normal(size=(2, model.nv))
    full, data = whole.createData(), model.createData()

    def both(upper):
        return np.triu(upper) + np.triu(upper, 1).T

    expected = g.T @ both(pin.crba(whole, full, q_whole)) @ g
    found = both(pin.crba(model, data, q))
    assert np.allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    expected = g.T @ pin.rnea(whole, full, q_whole, g @ v, g @ a)
    found = pin.rnea(model, data, q, v, a)
    assert np.allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    # What the joints dissipate: damping v^2, and dry friction |v|.
    assert np.allclose(model.damping * v @ v, whole.damping * (g @ v) @ (g @ v))
    assert np.allclose(
        model.upperDryFrictionLimit @ abs(v), whole.upperDryFrictionLimit @ abs(g @ v)
    )


MIMICKING = {
    "alex_psyonic_hands": 8,
    "baxter": 2,
    "panda": 1,
    "pr2": 10,
    "romeo": 22,
    "talos_full": 12,
    "tiago_pro": 10,
}


@pytest.mark.robots
@pytest.mark.parametrize("name", mostly_studies(MIMICKING, lambda name: name == "panda"))
def test_mimic_joints_of_the_library_are_exact(name):
    pytest.importorskip("example_robot_data")
    whole, robot = robots.load(name), robots.load(name, mimic=True)
    assert whole.model.nv - robot.model.nv == len(mimics(robot.model)) == MIMICKING[name]
    assert robot.q0.shape == (robot.model.nq,)
    check_reduced(whole.model, robot.model)


@pytest.mark.parametrize("name", ["one_finger", "hand", "gripper"])
def test_mimic_joints_of_files_are_exact(name):
    file = FOLDER / f"{name}.urdf.xacro"
    whole, model = robots.load_file(file).model, robots.load_file(file, mimic=True).model
    assert model.nv < whole.nv
    check_reduced(whole, model)
    # A geometry keeps its joint and frame.
    (tip, *_) = robots.end_spheres(robots.load_file(file, mimic=True))
    assert model.existFrame(tip.frame)


@pytest.mark.parametrize("name", ["gripper.xml", "hand.xml", "chained_fingers.xml"])
def test_mimic_joints_of_mjcf_are_exact(name):
    file = FOLDER.parent / "mjcf" / name
    check_reduced(robots.load_file(file).model, robots.load_file(file, mimic=True).model)


MIMIC = "<mimic joint='{0}' multiplier='{1}'/>"


@pytest.mark.parametrize(
    ("of", "ratio", "words"),
    [
        ("nix", 1, "mimics 'nix', but the robot has no joint 'nix'"),
        ("j", 1, "'j' mimics 'j', which in the end mimics 'j' again"),
        ("j", "a", "mimics 'j' by what is no number"),
    ],
)
def test_wrong_mimic_joints_are_named(tmp_path, of, ratio, words):
    file = arm(tmp_path)
    file.write_text(file.read_text().replace("</joint>", MIMIC.format(of, ratio) + "</joint>"))
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(file, mimic=True)
