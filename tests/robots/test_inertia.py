"""Masses that a file does not state, and files that need mending."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter, RobotWarning
from sphshell_pin.robots.inertia import lacks_masses
from sphshell_pin.robots.mending import mended
from sphshell_pin.study.robot_check import QUICK, check_robot
from tests import meshes, urdf
from tests.command import call
from tests.texts import text_of


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


def write_obj(path: Path, vertices: Array, elements: Array) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in np.asarray(vertices).tolist()]
    lines += ["f " + " ".join(str(int(k) + 1) for k in row) for row in elements]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("what", ["box", "mesh", "open mesh"])
def test_links_get_the_inertia_of_their_solid(tmp_path: Path, what: str) -> None:
    size, density = 0.1, 2000.0
    geometry = f'<box size="{size} {size} {size}"/>'
    if what != "box":
        vertices, elements = meshes.cube(size)
        kept = elements if what == "mesh" else elements[:-1]
        write_obj(tmp_path / "cube.obj", vertices, kept)
        geometry = urdf.mesh("cube.obj")
    robot = robots.load_file(arm(tmp_path, geometry), density=density)
    mass = density * size**3
    placed = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, 0.3), np.array([0.05, 0.0, 0.0]))
    expected = placed.act(pin.Inertia.FromBox(mass, size, size, size))
    for joint in (1, 2):
        found = robot.model.inertias[joint]
        np.testing.assert_allclose(found.matrix(), expected.matrix(), rtol=1e-6, atol=1e-9)
    assert "upper, lower" in robot.assumed
    assert "2000 kg/m^3" in robot.assumed


def test_a_stated_mass_stays(tmp_path: Path) -> None:
    file = arm(tmp_path, '<sphere radius="0.1"/>')
    stated = urdf.link("upper", urdf.inertial(3)).removesuffix("</link>")
    file.write_text(file.read_text().replace('<link name="upper">', stated))
    robot = robots.load_file(file, density=1000.0)
    assert robot.model.inertias[1].mass == 3.0
    assert robot.model.inertias[2].mass == pytest.approx(1000.0 * 4 / 3 * np.pi * 1e-3, rel=1e-2)


def test_masses_without_moments_of_inertia_get_those_of_the_geometry(tmp_path: Path) -> None:
    write_obj(tmp_path / "box.obj", *meshes.cube(0.1))
    file = arm(tmp_path, '<mesh filename="box.obj"/>')
    zero = 'ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"'
    stated = f'<inertial><origin xyz="0.05 0 0"/><mass value="3"/><inertia {zero}/></inertial>'
    text = file.read_text()
    for name in ("upper", "lower"):
        text = text.replace(f'<link name="{name}">', f'<link name="{name}">{stated}')
    file.write_text(text)
    robot = robots.load_file(file, density=1000.0)
    assert robot.model.inertias[2].mass == 3.0
    np.testing.assert_allclose(robot.model.inertias[2].inertia, 0.005 * np.eye(3), atol=1e-8)
    assert "the moments of inertia of links upper, lower are those of their" in robot.assumed
    out = tmp_path / "a.toml"
    done = call("new", "--robot", str(file), "--out", str(out))
    assert done.exit_code == 0, done.output
    assert "density = 2700" in out.read_text()


def test_without_masses_one_sentence_lists_the_links(tmp_path: Path) -> None:
    file = arm(tmp_path, '<box size="0.1 0.1 0.1"/>')
    out = "--out", tmp_path / "a.toml"
    done = call("check-robot", file, "--quick")
    assert done.exit_code == 2
    said = " ".join(done.output.split())
    assert "none of links upper, lower" in said
    assert "--density 2700" in said
    with pytest.raises(InvalidParameter, match="density"):
        robots.load_file(file, density=-1.0)
    file = arm(tmp_path, urdf.mesh("lost.stl"))
    done = call("new", "--robot", file, "--density", "2700", *out)
    assert "whose meshes are missing or broken" in " ".join(done.output.split())


def test_new_gives_links_without_masses_those_of_their_geometry(tmp_path: Path) -> None:
    file, out = arm(tmp_path, '<box size="0.1 0.1 0.1"/>'), tmp_path / "a.toml"
    done = call("new", "--robot", file, "--out", out)
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert "upper, lower are those of their geometry at 2700 kg/m^3" in said
    assert "as the file states none: another with --density" in said
    assert "density = 2700" in out.read_text()
    assert "missing inertias from its geometry at 2700 kg/m^3" in out.read_text()


def test_new_floats_a_root_without_a_mass(tmp_path: Path) -> None:
    box, out = urdf.shape("collision", '<box size="0.2 0.2 0.1"/>'), tmp_path / "a.toml"
    file = urdf.write(tmp_path / "box.urdf", urdf.link("box", box))
    done = call("new", "--robot", file, "--base", "floating", "--out", out)
    assert done.exit_code == 0, done.output
    assert "link box are those of their geometry" in " ".join(done.output.split())


@pytest.mark.parametrize("link", ["upper", "lower"])
def test_new_gives_one_link_of_an_arm_the_mass_that_it_lacks(tmp_path: Path, link: str) -> None:
    file, out = arm(tmp_path, '<box size="0.1 0.1 0.1"/>'), tmp_path / "a.toml"
    stated = urdf.link(link, urdf.inertial(3)).removesuffix("</link>")
    file.write_text(file.read_text().replace(f'<link name="{link}">', stated))
    done = call("new", "--robot", file, "--out", out)
    assert done.exit_code == 0, done.output
    other = "lower" if link == "upper" else "upper"
    assert f"the masses of link {other} are those" in " ".join(done.output.split())


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
    made = mended(file, density=2700.0)
    assert "xmlns:gazebo=" in made
    assert "gone.stl" not in made
    assert "continuous" not in made
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
    file = arm(tmp_path, '<sphere radius="0.1"/>')
    bad = urdf.shape("visual", urdf.mesh("bad.stl"))
    bad += urdf.shape("visual", '<box size="1 1 1"/>')
    file.write_text(file.read_text().replace('<link name="upper">', f'<link name="upper">{bad}'))
    with pytest.warns(RobotWarning, match=r"bad\.stl"):
        robot = robots.load_file(file)
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


@pytest.mark.parametrize(
    ("ixz", "fault"), [("0.01\n", ""), (" 1e-2", ""), ("0,01", "has ixz = '0,01'")]
)
def test_an_inertia_is_never_dropped(tmp_path: Path, ixz: str, fault: str) -> None:
    stated = urdf.inertial(2).replace('ixz="0"', f'ixz="{ixz}"')
    links = urdf.link("a"), urdf.link("b", stated)
    file = urdf.write(tmp_path / "arm.urdf", *links, urdf.joint("j", "continuous", "a", "b"))
    file.write_text(f'<!-- a license -->\n<?xml version="1.0"?>{file.read_text()}')
    if fault:
        with pytest.raises(robots.RobotError, match=f"inertia of link 'b' {fault}"):
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
    part = urdf.shape(kind, '<mesh filename="part.dae" scale="1 1 2"/>')
    links = urdf.link("a"), urdf.link("b", part)
    file = urdf.write(tmp_path / "arm.urdf", *links, urdf.joint("j", "continuous", "a", "b"))
    mass = robots.load_file(file, density=2700.0).model.inertias[1].mass
    assert mass == pytest.approx(2 * 2700.0 * 0.05**3 / 6, rel=1e-6)


def test_a_speck_of_collision_geometry_is_no_mass_where_the_link_is_drawn(tmp_path: Path) -> None:
    drawn = urdf.shape("visual", '<box size="0.1 0.1 0.1"/>')
    solids = [
        urdf.shape("collision", f'<box size="{size} {size} {size}"/>') for size in (1.0, 1e-3)
    ]
    links = [urdf.link(*parts, drawn) for parts in zip("ab", solids, strict=True)]
    file = urdf.write(tmp_path / "arm.urdf", *links, urdf.joint("j", "continuous", "a", "b"))
    model = robots.load_file(file, density=1000.0).model
    assert model.inertias[1].mass == pytest.approx(1.0)


def test_a_mass_that_only_keeps_a_place_is_none(tmp_path: Path) -> None:
    box = urdf.shape("collision", '<box size="0.1 0.1 0.1"/>')
    links = urdf.link("a", urdf.inertial(100)), urdf.link("b", urdf.inertial(1e-6, 1e-6), box)
    file = urdf.write(tmp_path / "arm.urdf", *links, urdf.joint("j", "continuous", "a", "b"))
    robot = robots.load_file(file)
    assert lacks_masses(robot.model, robot.description, floating=False)
    model = robots.load_file(file, density=1000.0).model
    assert model.inertias[1].mass == pytest.approx(1.0)
