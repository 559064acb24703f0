"""Packages of a workspace, found from a file in it without ROS and without options."""

import os
import re
import shutil
from pathlib import Path
from urllib.parse import quote

import pytest

from sphshell_pin import robots
from sphshell_pin.errors import RobotWarning
from sphshell_pin.robots.finding import find_robots
from sphshell_pin.robots.packages import Folders
from tests import urdf
from tests.command import call
from tests.tables import cases_of
from tests.texts import DATA


def package(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name></package>")
    return folder


def workspace(root: Path, resources: str) -> Path:
    """Write an arm that needs a package at root/`resources`; return its file."""
    shutil.copytree(DATA / "workspace" / "arm_resources", root / resources)
    support = root / "src" / "vendor" / "arm_support"
    return Path(shutil.copytree(DATA / "workspace" / "arm_support", support)) / "urdf" / "arm.xacro"


MESH = Path("src/vendor/arm_resources/meshes/one.obj")


@pytest.mark.parametrize("place", ["vendor", "other_clone", "vendor/deep"])
@pytest.mark.parametrize("here", ["", "src/vendor/arm_support/urdf"])
def test_packages_of_the_workspace_are_found_from_any_folder(tmp_path, monkeypatch, place, here):
    file = workspace(tmp_path, f"src/{place}/arm_resources")
    (file.parents[2] / ".git").mkdir()
    monkeypatch.chdir(tmp_path / here)
    relative = os.path.relpath(file, Path.cwd())
    assert robots.load_file(relative).model.inertias[1].lever[0] == pytest.approx(0.3)


def test_a_relative_package_folder_is_that_of_the_working_folder_then(tmp_path, monkeypatch):
    file = workspace(tmp_path, "elsewhere/arm_resources")
    monkeypatch.chdir(tmp_path)
    folders = Folders.of(file, ["elsewhere"])
    monkeypatch.chdir(file.parent)
    assert folders.package("arm_resources") == tmp_path / "elsewhere" / "arm_resources"


def test_the_search_ends_at_the_workspace(tmp_path: Path) -> None:
    folders = Folders.of(workspace(tmp_path / "one", "../other/arm_resources"))
    assert folders.package("arm_resources") is None
    assert str(tmp_path / "one" / "src") in folders.searched()


def test_a_uri_of_a_file_is_that_file_wherever_it_is(tmp_path: Path) -> None:
    file, mesh = workspace(tmp_path / "one", "src/arm_resources"), tmp_path / "far off" / "a b.stl"
    mesh.parent.mkdir()
    mesh.touch()
    assert Folders.of(file).find(f"file://{quote(str(mesh))}") == mesh


def test_a_workspace_lists_its_robots(tmp_path: Path) -> None:
    file = workspace(tmp_path, "src/vendor/arm_resources")
    links = urdf.link("a"), urdf.link("b", urdf.shape("visual", '<sphere radius="1"/>'))
    urdf.write(file.with_name("bare.urdf"), *links, urdf.joint("j", "continuous", "a", "b"))
    asking = file.with_name("asking.xacro")
    far = '<xacro:include filename="$(find far)/a.xacro"/><xacro:a/>'
    asking.write_text(file.read_text().replace("<link", f"{far}<link", 1))
    found = {one.file.name: one for one in find_robots(tmp_path)}
    assert sorted(found) == ["arm.xacro", "asking.xacro", "bare.urdf"]
    assert found["arm.xacro"].frames == ("tip",)
    assert not found["arm.xacro"].missing
    assert "--density" in found["bare.urdf"].missing
    assert "there is no package 'far'" in found["asking.xacro"].missing
    assert "say which of these 3 robots" in call("new", "--robot", tmp_path).output


def test_names_of_robot_descriptions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = "arm_of_mine_description"
    for command in (["check-robot", name], ["new", "--robot", name]):
        assert "pip install robot_descriptions" in call(*command).output
    file = workspace(tmp_path / "repo", "arm_resources")
    package = tmp_path / "lib" / "robot_descriptions"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / f"{name}.py").write_text(
        f"REPOSITORY_PATH = {str(tmp_path / 'repo')!r}\n"
        f"PACKAGE_PATH = {str(file.parents[1])!r}\nXACRO_PATH = {str(file)!r}\n"
    )
    (package / "broken_description.py").write_text("raise OSError('no network')")
    monkeypatch.syspath_prepend(str(tmp_path / "lib"))
    assert robots.load(name, mimic=True).model.nv == 1
    with pytest.raises(robots.RobotError, match="no network"):
        robots.load("broken_description")
    with pytest.raises(robots.RobotError, match="has no robot"):
        robots.load("other_description")


@pytest.mark.parametrize(
    ("uri", "near"),
    [
        ("package://renamed/meshes/one.obj", "arm_support/meshes"),
        ("package://no/urdf/one.obj", "arm_support/urdf"),
        ("package://no/folder/one.obj", "arm_support/urdf"),
        ("file:///elsewhere/another/arm%20support/meshes/one.obj", "arm_support/meshes"),
        ("/elsewhere/another/arm_support/meshes/one.obj", "arm_support/meshes"),
        ("file:///opt/ros/share/arm_resources/folder/one.obj", "arm_resources/folder"),
    ],
)
def test_a_mesh_of_a_package_that_is_nowhere_is_found_beside_the_robot(tmp_path, uri, near):
    file = workspace(tmp_path, "src/vendor/arm_resources")
    (tmp_path / MESH.parents[2] / near).mkdir(exist_ok=True)
    (tmp_path / MESH).rename(tmp_path / MESH.parents[2] / near / "one.obj")
    file.write_text(file.read_text().replace("package://arm_resources/meshes/one.obj", uri))
    assert len(robots.load_file(file).collision_model.geometryObjects) == 1


@pytest.mark.parametrize(("other", "uri"), [("urdf/one.obj", "meshes"), ("one.obj", "folder")])
def test_a_mesh_of_another_folder_is_not_taken_for_a_missing_one(tmp_path, other, uri):
    """Its own folder is there without it, or several files have its name."""
    file = workspace(tmp_path, "src/vendor/arm_resources")
    shutil.copy(tmp_path / MESH, file.with_name("one.obj"))
    (tmp_path / MESH).rename(file.parents[1] / other)
    file.write_text(file.read_text().replace("resources/meshes/", f"resources/{uri}/"))
    with pytest.warns(RobotWarning, match=rf"missing or broken: .*{uri}/one\.obj"):
        robots.load_file(file)


@pytest.mark.parametrize(("line", "said"), cases_of("wrong_robots")["xacro"])
def test_a_xacro_that_fails_says_which_arguments_it_has(tmp_path, line, said):
    file = urdf.xacro(tmp_path / "arm.xacro", '<xacro:arg name="kind" default="none"/>', line)
    with pytest.raises(robots.RobotError, match=re.escape(said)):
        robots.load_file(file)


def test_arguments_without_a_default_are_taken_from_the_package_and_said(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>arms</name></package>")
    (tmp_path / "up.launch").write_text('<launch><arg name="kind" default="long"/></launch>')
    crane = '<xacro:if value="$(arg crane)"><link name="crane"/></xacro:if>'
    file = urdf.xacro(tmp_path / "arm.xacro", crane, '<link name="$(arg kind)_$(arg prefix)"/>')
    said = "taken as --xacro-arg crane=false --xacro-arg kind=long --xacro-arg prefix=prefix"
    with pytest.warns(robots.RobotWarning, match=said):
        assert robots.load_file(file).model.existFrame("long_prefix")
    given = robots.load_file(file, xacro_args={"crane": False, "kind": "a", "prefix": "b"})
    assert given.model.existFrame("a_b")


def test_an_argument_that_names_a_file_takes_one_that_is_there(tmp_path: Path) -> None:
    for name in ("big", "small"):
        (tmp_path / "models" / name).mkdir(parents=True)
        urdf.xacro(tmp_path / "models" / name / f"{name}_arm.xacro", f'<link name="{name}"/>')
    include = '<xacro:include filename="models/$(arg kind)/$(arg kind)_arm.xacro"/>'
    file = urdf.xacro(tmp_path / "arm.xacro", '<xacro:arg name="kind" default="none"/>', include)
    with pytest.warns(RobotWarning, match=r"kind=big: or give others; kind may be big, small$"):
        assert robots.load_file(file).model.existFrame("big")
    assert robots.load_file(file, xacro_args={"kind": "small"}).model.existFrame("small")
    with pytest.raises(robots.RobotError, match=r"kind may be big, small$"):
        robots.load_file(file, xacro_args={"kind": "medium"})


def test_an_argument_has_the_default_of_the_launch_file_that_names_the_robot(tmp_path):
    arm, launches = package(tmp_path / "src" / "arm"), tmp_path / "src" / "bringup" / "launch"
    package(launches.parent)
    launches.mkdir()
    for name, names, value in (("a", "other.xacro", "mk1"), ("b", "arm.xacro", "mk2")):
        declared = f'DeclareLaunchArgument("model",\n  default_value="{value}")  # {names}'
        (launches / f"{name}.launch.py").write_text(declared)
    file = urdf.xacro(arm / "arm.xacro", '<link name="$(arg model)"/>')
    with pytest.warns(RobotWarning, match="model=mk2"):
        assert robots.load_file(file).model.existFrame("mk2")


def test_the_source_of_a_missing_package_is_named(tmp_path: Path) -> None:
    url = "https://example.org/far.git"
    (tmp_path / "arms.repos").write_text(f"repositories:\n  far:\n    type: git\n    url: {url}\n")
    include = '<xacro:include filename="$(find far)/far.xacro"/>'
    file = urdf.xacro(package(tmp_path / "arm") / "arm.xacro", include)
    with pytest.raises(robots.RobotError, match=f"package 'far' .*; arms.repos says .* in {url}$"):
        robots.load_file(file)


def test_files_of_a_missing_package_that_nothing_calls_are_left_out(tmp_path, capsys):
    """Colors, and sensors that are not asked for; not macros, properties or links that are."""
    file = tmp_path / "arm.xacro"
    include = '<xacro:include filename="$(find far)/{}.xacro"/>'
    visual = '<visual><geometry><sphere radius="1"/></geometry><xacro:orange/></visual>'
    urdf.xacro(file, include.format("common_materials"), urdf.link("a", visual))
    assert robots.load_file(file).visual_model.ngeoms == 1
    said = "without common_materials.xacro: there is no package 'far' (see --package-dir)"
    assert said in capsys.readouterr().err
    head = include.format("laser"), '<link name="a"/>'
    urdf.xacro(file, *head, "<xacro:if value='0'><xacro:laser/></xacro:if>")
    assert robots.load_file(file).model.existFrame("a")
    to_b = "<joint name='j' type='fixed'><parent link='b'/><child link='a'/></joint>"
    for needed in ("<xacro:laser/>", "<link name='${nix}'/>", to_b):
        urdf.xacro(file, *head, needed)
        with pytest.raises(robots.RobotError, match="there is no package 'far'"):
            robots.load_file(file)


@pytest.mark.parametrize(
    ("parts", "link"),
    [
        ("<gazebo><plugin><parameters>$(find far)/a.yaml</parameters></plugin></gazebo>", "arm"),
        (
            '<link name="${root}"/><xacro:property name="root" value="${part}_link"/>'
            '<xacro:property name="part" value="base"/>',
            "base_link",
        ),
    ],
)
def test_packages_of_simulators_may_be_missing_and_properties_stated_below(tmp_path, parts, link):
    file = urdf.xacro(tmp_path / "arm.xacro", "" if link != "arm" else '<link name="arm"/>', parts)
    assert robots.load_file(file).model.existFrame(link)


@pytest.mark.parametrize("name", ["part.xacro", "part.xml"])
def test_a_part_of_a_robot_names_the_robot_that_includes_it(tmp_path: Path, name: str) -> None:
    part, whole = tmp_path / name, tmp_path / f"robot{Path(name).suffix}"
    if part.suffix == ".xml":
        part.write_text('<mujocoinclude><body name="a"/></mujocoinclude>')
        whole.write_text(f'<mujoco><worldbody><include file="{name}"/></worldbody></mujoco>')
    else:
        urdf.xacro(whole, '<xacro:include filename="macro.xacro"/>')
        nameless = whole.read_text().replace(' name="arm"', "")
        (tmp_path / "macro.xacro").write_text(nameless.replace("macro.xacro", name))
        part.write_text('<robot xmlns:xacro="http://wiki.ros.org/xacro"/>')
    with pytest.raises(robots.RobotError, match=f"that includes this one: {re.escape(str(whole))}"):
        robots.load_file(part)


def test_a_package_whose_meshes_were_put_into_more_folders_and_the_nearer_of_two(tmp_path):
    file, mesh = workspace(tmp_path, "src/vendor/arm_resources"), tmp_path / MESH
    shutil.copytree(DATA / "workspace" / "arm_resources", tmp_path / "src/another/arm_resources")
    for name in ("collision", "visual"):
        (mesh.parent / name / "large").mkdir(parents=True)
        shutil.copy(mesh, mesh.parent / name / "large")
    mesh.unlink()
    file.write_text(file.read_text().replace("/one.obj", "/collision/one.obj"))
    (geometry,) = robots.load_file(file).collision_model.geometryObjects
    assert geometry.meshPath.endswith("vendor/arm_resources/meshes/collision/large/one.obj")
    # Where two fit, neither is taken.
    shutil.copytree(mesh.parent / "collision" / "large", mesh.parent / "collision" / "small")
    with pytest.warns(RobotWarning, match="without these meshes.*collision/one.obj"):
        robots.load_file(file)
