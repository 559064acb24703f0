"""xacro files: what is read of them, what their expressions may do, and what is refused."""

import sys
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import MissingExtra
from sphshell_pin.robots import xacro_file
from tests.tables import cases_of

FOLDER = Path(__file__).parents[1] / "data" / "xacro"


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
    assert (robot.model.name, robot.model.nq) == (name, nq)
    assert len(robots.end_spheres(robot)) == spheres
    assert all(inertia.mass > 0 for inertia in list(robot.model.inertias)[1:])


def test_xacro_has_arguments_and_finds_packages():
    file = FOLDER / "hand.urdf.xacro"
    robot = robots.load_file(file, xacro_args={"fingers": 2, "with_wrist": False})
    model = robot.model
    assert list(model.names)[1:] == ["f1_base", "f1_end", "f2_base", "f2_end"]
    # The meshes of its visual geometry, by package://.
    assert robot.visual_model.ngeoms == 4
    assert np.all(model.damping == 0.02)
    assert np.all(model.upperDryFrictionLimit == 0.01)
    assert np.all(model.upperEffortLimit == 2)
    assert np.all(model.velocityLimit == 3)
    assert np.all(model.lowerPositionLimit == -0.3)
    assert model.inertias[1].mass == pytest.approx(2700 * np.pi * 0.01**2 * 0.05)


EXPRESSIONS = cases_of("xacro_expressions")
HOSTILE = EXPRESSIONS["hostile"] | {"nested": "${" + "-" * 3000 + "(lambda: 1)()}"}
SYSTEM = "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == '_wrap_close'][0]"
SYSTEM += ".__init__.__globals__['system']"


def xacro(tmp_path, inside):
    """Return the file of a xacro robot."""
    path = tmp_path / "r.xacro"
    path.write_text(f"<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>{inside}</robot>")
    return path


@pytest.mark.parametrize("how", HOSTILE)
def test_xacro_expressions_compute_and_do_nothing_else(how, tmp_path):
    made = tmp_path / "made"
    attempt = HOSTILE[how].replace("SYSTEM", SYSTEM).replace("FILE", str(made))
    expression = escape(attempt, {"'": "&apos;", '"': "&quot;"})
    values = {"p": expression, "f1": "{0.real}", "f2": "{0[0]}", "f3": "{:99999999999}"}
    given = "".join(f"<xacro:property name='{k}' value='{v}'/>" for k, v in values.items())
    path = xacro(tmp_path, given + "<link name='a'/><link name='${p}'/>")
    # What is in $(eval ...) ends at the first parenthesis, and is no expression then.
    said = "refused in the expression|too deeply|is not defined"
    with pytest.raises(robots.RobotError, match=said if "${" in expression else "cannot expand"):
        robots.load_file(path)
    assert not made.exists()


@pytest.mark.parametrize(("expression", "words"), EXPRESSIONS["costly"].items())
def test_what_a_xacro_file_takes_is_limited(tmp_path, monkeypatch, expression, words):
    monkeypatch.setattr(xacro_file, "TIME_LIMIT", 3.0)  # 300000 steps take less beside others
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(xacro(tmp_path, f'<link name="${{{expression}}}"/>'))


def test_a_busy_machine_is_not_taken_for_a_long_expression(tmp_path, monkeypatch):
    monkeypatch.setattr(xacro_file, "WAIT", 0.001)
    with pytest.raises(robots.RobotError, match=r"not expanded it after 0\.001 s: the machine"):
        robots.load_file(xacro(tmp_path, '<link name="a"/>'))


UNCHECKED = """
from sphshell_pin.robots import xacro_child
def attempt(path):
    try:
        open(path, "w")
    except Exception as error:
        return type(error).__name__
def unchecked(xacro, substitution_args):
    xacro.safe_eval = lambda text, *_: eval(text, globals())
xacro_child.install = unchecked
serve = xacro_child.serve
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel has no such means")
def test_an_expression_that_escapes_is_in_a_process_that_does_nothing(tmp_path, monkeypatch):
    """What else such a process is refused: tests/test_sandbox.py."""
    (tmp_path / "unchecked_xacro.py").write_text(UNCHECKED)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(xacro_file, "CHILD", "unchecked_xacro")
    link = f"""<link name="${{attempt('{tmp_path / "made"}')}}"/>"""
    (found,) = robots.read(xacro(tmp_path, link)).root.iter("link")
    assert found.get("name") == "PermissionError"
    assert not (tmp_path / "made").exists()


def test_xacro_expressions_compute(tmp_path):
    values = EXPRESSIONS["computed"]
    start = "<xacro:property name='_tmp_' value='3'/>"
    start += "<xacro:property name='f' value='{} {name:5.2f}'/>"
    texts = "".join(f'<a b="${{{escape(text)}}}"/>' for text in values)
    texts += "<a b=\"$(eval 'b2')\"/><link name='l'/>"
    expanded = robots.read(xacro(tmp_path, start + texts)).root
    assert [one.get("b") for one in expanded.iter("a")] == [*map(str, values.values()), "b2"]


def test_tags_without_prefix_are_read(tmp_path, capsys):
    """Versions of xacro before 2020 took its tags without `xacro:`, calls of macros too."""
    (tmp_path / "colors.xacro").write_text(
        '<robot><property name="size" value="2"/><macro name="body" params="name">'
        '<if value="${size == 2}"><link name="${name}"/></if></macro></robot>'
    )
    inside = '<include filename="colors.xacro"/><body name="l0"/>'
    links = robots.read(xacro(tmp_path, inside)).root.findall("link")
    assert [one.get("name") for one in links] == ["l0"]
    assert "colors.xacro: tags of xacro lack the prefix 'xacro:'" in capsys.readouterr().err


ARM = (
    "<xacro:macro name='arm'><link name='a'/><link name='b'/><joint name='j' type='revolute'>"
    "<parent link='a'/><child link='b'/><limit/></joint></xacro:macro>"
)


@pytest.mark.parametrize(
    "inside",
    [
        r'<xacro:include filename="parts\arm.xacro"/>',
        '<xacro:include filename="urdf/parts/arm.xacro"/>',  # from the folder above
        '<xacro:include filename="$(find of_another_name)/urdf/parts/arm.xacro"/>',
        '<xacro:include filename="parts/arm.xacro"/><xacro:include filename="$(find nix)/a.xacro"/>'
        '<xacro:camera parent="b"/>',
        '<xacro:include filename="parts/arm.xacro"/><xacro:property name="p" '
        "value=\"${xacro.load_yaml('nix.yaml')['at']}\"/>"
        "<ros2_control><a b='${p[0]}'/></ros2_control>",
    ],
)
def test_what_a_robot_needs_of_its_files_is_read(tmp_path, inside):
    """Folders of Windows, of another place or name, sensors of a missing package, drivers."""
    folder = tmp_path / "urdf" / "parts"
    folder.mkdir(parents=True)
    (folder / "arm.xacro").write_text(xacro(tmp_path, ARM).read_text())
    assert robots.load_file(xacro(folder.parent, f"{inside}<xacro:arm/>")).model.njoints == 2


def test_a_xacro_file_without_a_joint_that_moves_lists_its_arguments(tmp_path):
    file = xacro(tmp_path, '<xacro:arg name="model" default="none"/><link name="a"/>')
    with pytest.warns(robots.RobotWarning, match=r"arguments, which --xacro-arg .* model \(none\)"):
        assert robots.load_file(file).model.nv == 0


@pytest.mark.parametrize(("inside", "words"), EXPRESSIONS["unreadable"].items())
def test_what_xacro_cannot_expand_is_said(tmp_path, inside, words):
    with pytest.raises(robots.RobotError, match=words):
        robots.load_file(xacro(tmp_path, inside))


def test_arguments_and_the_package_xacro_are_asked_for_where_they_are_used(monkeypatch):
    with pytest.raises(robots.RobotError, match=r"arguments are for files that end in \.xacro"):
        robots.load_file(robots.URDF_FOLDER / "ball.urdf", xacro_args={"a": 1})
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(MissingExtra, match=r"needs xacro: .*sphshell-pin\[robots\]"):
        robots.load_file(FOLDER / "hand.urdf.xacro")
