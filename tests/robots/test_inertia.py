"""Masses that a file does not state, and files that need mending."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import Shell, robots
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter, RobotWarning
from sphshell_pin.robots.inertia import lacks_masses
from sphshell_pin.robots.mending import mended
from sphshell_pin.study.robot_check import QUICK, check_robot
from tests import meshes, urdf
from tests.command import call, succeed
from tests.texts import text_of

BOX = '<box size="0.1 0.1 0.1"/>'


def arm(folder: Path, geometry: str) -> Path:
    """Write an arm of two links of which none has a mass."""
    part = urdf.shape("collision", geometry, "0.05 0 0").replace("<origin", '<origin rpy="0 0 0.3"')
    return urdf.write(
        folder / "arm.urdf",
        *(urdf.link("base"), urdf.link("upper", part), urdf.link("lower", part)),
        urdf.joint("j1", "revolute", "base", "upper", at="0.1 0 0.2"),
        urdf.joint("j2", "revolute", "upper", "lower", at="0.1 0 0.2"),
        *(urdf.link("tool0"), urdf.joint("flange", "fixed", "lower", "tool0", at="0.1 0 0")),
    )


def given(file: Path, parts: str, *links: str) -> Path:
    """Put `parts` into links of a file, "upper" if none is named."""
    text = file.read_text()
    for name in links or ("upper",):
        text = text.replace(f'<link name="{name}">', f'<link name="{name}">{parts}')
    file.write_text(text)
    return file


def pair(folder: Path, *parts: str, first: tuple[str, ...] = ()) -> Path:
    """Write a pendulum of these parts."""
    links = urdf.link("a", *first), urdf.link("b", *parts)
    return urdf.write(folder / "arm.urdf", *links, urdf.joint("j", "continuous", "a", "b"))


def new(file: Path, *options: object) -> tuple[str, str]:
    """Return what `new` says of a robot, and the scenario that it writes."""
    out = file.with_name("a.toml")
    said = succeed("new", "--robot", file, *options, "--out", out, "--force").output
    return " ".join(said.split()), out.read_text()


def write_obj(path: Path, vertices: Array, elements: Array) -> None:
    Shell(vertices, elements).to_file(path, unit="m")


@pytest.mark.parametrize("faces", [0, 12, 11])
def test_links_get_the_inertia_of_their_solid(tmp_path: Path, faces: int) -> None:
    """A box, its mesh, and one with a hole."""
    size, density = 0.1, 2000.0
    vertices, elements = meshes.cube(size)
    write_obj(tmp_path / "cube.obj", vertices, elements[: faces or 12])
    geometry = urdf.mesh("cube.obj") if faces else BOX
    robot = robots.load_file(arm(tmp_path, geometry), density=density)
    placed = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.3), np.array([0.05, 0.0, 0.0]))
    expected = placed.act(pin.Inertia.FromBox(density * size**3, size, size, size)).matrix()
    for joint in (1, 2):
        found = robot.model.inertias[joint].matrix()
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)
    assert "upper, lower" in robot.assumed
    assert "2000 kg/m^3" in robot.assumed


def test_a_stated_mass_stays(tmp_path: Path) -> None:
    file = given(arm(tmp_path, '<sphere radius="0.1"/>'), urdf.inertial(3))
    robot = robots.load_file(file, density=1000.0)
    assert robot.model.inertias[1].mass == 3.0
    assert robot.model.inertias[2].mass == pytest.approx(1000.0 * 4 / 3 * np.pi * 1e-3, rel=1e-2)


def test_masses_without_moments_of_inertia_get_those_of_the_geometry(tmp_path: Path) -> None:
    write_obj(tmp_path / "box.obj", *meshes.cube(0.1))
    file = arm(tmp_path, '<mesh filename="box.obj"/>')
    stated = urdf.inertial(3, 0).replace("<mass", '<origin xyz="0.05 0 0"/><mass')
    robot = robots.load_file(given(file, stated, "upper", "lower"), density=1000.0)
    assert robot.model.inertias[2].mass == 3.0
    np.testing.assert_allclose(robot.model.inertias[2].inertia, 0.005 * np.eye(3), atol=1e-8)
    assert "the moments of inertia of links upper, lower are those of their" in robot.assumed
    assert "density = 2700" in new(file)[1]


def test_without_masses_one_sentence_lists_the_links(tmp_path: Path) -> None:
    file = arm(tmp_path, BOX)
    done = call("check-robot", file, "--quick")
    assert done.exit_code == 2
    said = " ".join(done.output.split())
    assert "none of links upper, lower" in said
    assert "--density 2700" in said
    with pytest.raises(InvalidParameter, match="density"):
        robots.load_file(file, density=-1.0)
    file = arm(tmp_path, urdf.mesh("lost.stl"))
    done = call("new", "--robot", file, "--density", "2700", "--out", tmp_path / "a.toml")
    assert "whose meshes are missing or broken" in " ".join(done.output.split())


def test_new_gives_links_without_masses_those_of_their_geometry(tmp_path: Path) -> None:
    said, text = new(arm(tmp_path, BOX))
    assert "upper, lower are those of their geometry at 2700 kg/m^3" in said
    assert "as the file states none: another with --density" in said
    assert "density = 2700" in text
    assert "missing inertias from its geometry at 2700 kg/m^3" in text
    for link, other in (("upper", "lower"), ("lower", "upper")):
        said, _ = new(given(arm(tmp_path, BOX), urdf.inertial(3), link))
        assert f"the masses of link {other} are those" in said
    box = urdf.link("box", urdf.shape("collision", BOX))
    said, _ = new(urdf.write(tmp_path / "box.urdf", box), "--base", "floating")
    assert "link box are those of their geometry" in said


def test_a_mended_file_needs_no_options(tmp_path: Path) -> None:
    folder = tmp_path / "pkg"
    (folder / "meshes").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>pkg</name></package>")
    write_obj(folder / "meshes" / "cube.obj", *meshes.cube(0.05))
    file = arm(folder, urdf.mesh("package://pkg/meshes/cube.obj"))
    ball = urdf.shape("collision", '<sphere radius="0.02"/>')
    third = urdf.link("last", ball, urdf.shape("visual", urdf.mesh("gone.stl")))
    mimic = '<mimic joint="j2" multiplier="-0.5"/>'
    third += urdf.joint("j3", "continuous", "lower", "last", mimic, at="0.1 0 0.2")
    text = file.read_text()
    file.write_text(text.replace("</robot>", f'{third}<gazebo:plugin name="x"/></robot>'))
    made, changes = mended(file, density=2700.0)
    assert made.count("<!--") == len(changes)
    for part in ("mass of its geometry", "was continuous", "prefix gazebo", "gone.stl", "by its"):
        assert any(part in one for one in changes), part
    elsewhere = tmp_path / "elsewhere.urdf"
    elsewhere.write_text(made)
    with pytest.warns(RobotWarning, match="gone"):
        first = robots.load_file(file, density=2700.0, mimic=True).model
    second = robots.load_file(elsewhere, mimic=True).model
    assert (first.nq, list(first.names)) == (second.nq, list(second.names))
    for one, other in zip(first.inertias, second.inertias, strict=True):
        np.testing.assert_allclose(one.matrix(), other.matrix(), rtol=1e-6, atol=1e-12)
    assert check_robot(elsewhere, sizes=QUICK).verdict == "pass"


def test_a_broken_visual_mesh_is_left_out_with_a_warning(tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_text("solid")
    bad = "".join(urdf.shape("visual", one) for one in (urdf.mesh("bad.stl"), BOX))
    with pytest.warns(RobotWarning, match=r"bad\.stl"):
        robot = robots.load_file(given(arm(tmp_path, '<sphere radius="0.1"/>'), bad))
    assert len(robot.visual_model.geometryObjects) == 1


def test_a_continuous_joint_mimics_by_its_whole_angle(tmp_path: Path) -> None:
    file = arm(tmp_path, '<sphere radius="0.1"/>')
    text = file.read_text().replace('name="j2" type="revolute"', 'name="j2" type="continuous"')
    mimic = '<mimic joint="j1" multiplier="3.5"/></joint>'
    at = text.index("</joint>", text.index('name="j2"'))
    file.write_text(text[:at] + mimic + text[at + len("</joint>") :])
    model = robots.load_file(file, density=1000.0, mimic=True).model
    assert (model.nq, model.nv) == (1, 1)
    data = model.createData()
    pin.forwardKinematics(model, data, np.array([1.0]))
    turned = data.oMi[1].rotation.T @ data.oMi[2].rotation
    np.testing.assert_allclose(turned, pin.rpy.rpyToMatrix(0.0, 3.5, 0.0), atol=1e-12)
    assert robots.load_file(file, mimic=False).model.nv == 2


@pytest.mark.parametrize(("ixz", "fault"), [("0.01\n", ""), (" 1e-2", ""), ("0,01", "ixz '0,01'")])
def test_an_inertia_is_never_dropped(tmp_path: Path, ixz: str, fault: str) -> None:
    file = pair(tmp_path, urdf.inertial(2).replace('ixz="0"', f'ixz="{ixz}"'))
    file.write_text(f'<!-- a license -->\n<?xml version="1.0"?>{file.read_text()}')
    if fault:
        with pytest.raises(robots.RobotError, match=f"inertia of link 'b': {fault}"):
            robots.load_file(file)
    else:
        assert robots.load_file(file).model.inertias[1].inertia[0, 2] == 0.01


@pytest.mark.parametrize("kind", ["collision", "visual"])
def test_a_collada_mesh_has_the_unit_that_it_states(tmp_path: Path, kind: str) -> None:
    # A tetrahedron of 50 mm.
    text = text_of("robots/tetrahedron.dae").replace('meter="1"', 'meter="0.001"')
    numbers = "0 0 0 1 0 0 0 1 0 0 0 1"
    assert numbers in text
    (tmp_path / "part.dae").write_text(text.replace(numbers, numbers.replace("1", "50")))
    file = pair(tmp_path, urdf.shape(kind, '<mesh filename="part.dae" scale="1 1 2"/>'))
    mass = robots.load_file(file, density=2700.0).model.inertias[1].mass
    assert mass == pytest.approx(2 * 2700.0 * 0.05**3 / 6, rel=1e-6)


def test_a_speck_of_collision_geometry_is_no_mass_where_the_link_is_drawn(tmp_path: Path) -> None:
    drawn, large = urdf.shape("visual", BOX), urdf.shape("collision", BOX.replace("0.1", "1"))
    speck = urdf.shape("collision", BOX.replace("0.1", "1e-3"))
    file = pair(tmp_path, speck, drawn, first=(large, drawn))
    model = robots.load_file(file, density=1000.0).model
    assert model.inertias[1].mass == pytest.approx(1.0)


def test_a_mass_that_only_keeps_a_place_is_none(tmp_path: Path) -> None:
    own = urdf.inertial(1e-6, 1e-6), urdf.shape("collision", BOX)
    file = pair(tmp_path, *own, first=(urdf.inertial(100),))
    robot = robots.load_file(file)
    assert lacks_masses(robot.model, robot.description, floating=False)
    assert robots.load_file(file, density=1000.0).model.inertias[1].mass == pytest.approx(1.0)
