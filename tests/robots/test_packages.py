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


@pytest.mark.parametrize(
    "resources",
    ["src/vendor/arm_resources", "src/other_clone/arm_resources", "src/vendor/deep/arm_resources"],
)
@pytest.mark.parametrize("here", ["", "src/vendor/arm_support/urdf"])
def test_packages_of_the_workspace_are_found_from_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, resources: str, here: str
) -> None:
    file = workspace(tmp_path, resources)
    (file.parents[2] / ".git").mkdir()
    monkeypatch.chdir(tmp_path / here)
    relative = os.path.relpath(file, Path.cwd())
    assert robots.load_file(relative).model.inertias[1].lever[0] == pytest.approx(0.3)


def test_a_relative_package_folder_is_that_of_the_working_folder_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = workspace(tmp_path, "elsewhere/arm_resources")
    monkeypatch.chdir(tmp_path)
    folders = Folders.of(file, ["elsewhere"])
    monkeypatch.chdir(file.parent)
    assert folders.package("arm_resources") == tmp_path / "elsewhere" / "arm_resources"


def test_the_search_ends_at_the_workspace(tmp_path: Path) -> None:
    file = workspace(tmp_path / "one", "../other/arm_resources")
    folders = Folders.of(file)
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
    found = {file.name: said for file, said in find_robots(tmp_path)}
    assert sorted(found) == ["arm.xacro", "asking.xacro", "bare.urdf"]
    assert found["arm.xacro"].endswith("frames at its ends: tip")
    assert found["bare.urdf"].startswith("1 joints")
    assert "there is no package 'far'" in found["asking.xacro"]
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
    "uri",
    [
        "package://renamed/meshes/one.obj",
        "package://no/urdf/one.obj",
        "package://no/folder/one.obj",
        "file:///elsewhere/another/arm%20support/meshes/one.obj",
        "/elsewhere/another/arm_support/meshes/one.obj",
        "file:///opt/ros/share/arm_resources/folder/one.obj",
    ],
)
def test_a_mesh_of_a_package_that_is_nowhere_is_found_beside_the_robot(
    tmp_path: Path, uri: str
) -> None:
    file = workspace(tmp_path, "src/vendor/arm_resources")
    mesh = tmp_path / "src" / "vendor" / "arm_resources" / "meshes" / "one.obj"
    near = file.parents[1] / "meshes" if "meshes" in uri else file.parent
    near = tmp_path / "src" / "vendor" / "arm_resources" / "folder" if "share" in uri else near
    near.mkdir(exist_ok=True)
    mesh.rename(near / "one.obj")
    file.write_text(file.read_text().replace("package://arm_resources/meshes/one.obj", uri))
    assert len(robots.load_file(file).collision_model.geometryObjects) == 1


@pytest.mark.parametrize("other", ["urdf/one.obj", "one.obj"])
def test_a_mesh_of_another_folder_is_not_taken_for_a_missing_one(
    tmp_path: Path, other: str
) -> None:
    """Its own folder is there without it, or several files have its name."""
    file = workspace(tmp_path, "src/vendor/arm_resources")
    mesh = tmp_path / "src" / "vendor" / "arm_resources" / "meshes" / "one.obj"
    file.with_name("one.obj").write_bytes(mesh.read_bytes())
    mesh.rename(file.parents[1] / other)
    uri = "meshes" if other.startswith("urdf") else "folder"
    file.write_text(file.read_text().replace("resources/meshes/", f"resources/{uri}/"))
    with pytest.warns(RobotWarning, match=rf"missing or broken: .*{uri}/one\.obj"):
        robots.load_file(file)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('<xacro:include filename="$(arg kind).xacro"/>', "sets: kind (none)"),
        ('<xacro:arg name="size"/>', "xacro:arg: missing attribute 'default'"),
        ('<xacro:include filename="$(find far)/a.xacro"/>', "expand it: there is no package 'far'"),
    ],
)
def test_a_xacro_that_fails_says_which_arguments_it_has(
    tmp_path: Path, line: str, said: str
) -> None:
    file = tmp_path / "arm.xacro"
    head = '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><xacro:arg name="kind"'
    file.write_text(f'{head} default="none"/>{line}</robot>')
    with pytest.raises(robots.RobotError, match=re.escape(said)):
        robots.load_file(file)


def test_arguments_without_a_default_are_taken_from_the_package_and_said(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>arms</name></package>")
    (tmp_path / "up.launch").write_text('<launch><arg name="kind" default="long"/></launch>')
    file = tmp_path / "arm.xacro"
    file.write_text(
        '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><xacro:if value="$(arg crane)">'
        '<link name="crane"/></xacro:if><link name="$(arg kind)_$(arg prefix)"/></robot>'
    )
    said = "taken as --xacro-arg crane=false --xacro-arg kind=long --xacro-arg prefix=prefix"
    with pytest.warns(robots.RobotWarning, match=said):
        robot = robots.load_file(file)
    assert robot.model.existFrame("long_prefix")
    given = robots.load_file(file, xacro_args={"crane": False, "kind": "a", "prefix": "b"})
    assert given.model.existFrame("a_b")


def test_an_argument_that_names_a_file_takes_one_that_is_there(tmp_path: Path) -> None:
    for name in ("big", "small"):
        (tmp_path / "models" / name).mkdir(parents=True)
        macro = f'<robot name="m"><link name="{name}"/></robot>'
        (tmp_path / "models" / name / f"{name}_arm.xacro").write_text(macro)
    head = '<robot name="$(arg kind)" xmlns:xacro="http://wiki.ros.org/xacro">'
    head += '<xacro:arg name="kind" default="arm"/><xacro:include filename="models/$(arg kind)/'
    file = tmp_path / "arm.xacro"
    file.write_text(f'{head}$(arg kind)_arm.xacro"/></robot>')
    with pytest.warns(RobotWarning, match=r"kind=big: or give others; kind may be big, small$"):
        assert robots.load_file(file).model.existFrame("big")
    assert robots.load_file(file, xacro_args={"kind": "small"}).model.existFrame("small")
    with pytest.raises(robots.RobotError, match=r"kind may be big, small$"):
        robots.load_file(file, xacro_args={"kind": "medium"})


def test_an_argument_has_the_default_of_the_launch_file_that_names_the_robot(
    tmp_path: Path,
) -> None:
    arm = package(tmp_path / "src" / "arm")
    launches = package(tmp_path / "src" / "bringup") / "launch"
    launches.mkdir()
    for name, names, value in (("a", "other.xacro", "mk1"), ("b", "arm.xacro", "mk2")):
        declared = f'DeclareLaunchArgument("model",\n  default_value="{value}")  # {names}'
        (launches / f"{name}.launch.py").write_text(declared)
    file = arm / "arm.xacro"
    file.write_text(
        '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><link name="$(arg model)"/>'
        "</robot>"
    )
    with pytest.warns(RobotWarning, match="model=mk2"):
        assert robots.load_file(file).model.existFrame("mk2")


def test_the_source_of_a_missing_package_is_named(tmp_path: Path) -> None:
    arm = package(tmp_path / "arm")
    url = "https://example.org/far.git"
    (tmp_path / "arms.repos").write_text(f"repositories:\n  far:\n    type: git\n    url: {url}\n")
    file = arm / "arm.xacro"
    file.write_text(
        '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro">'
        '<xacro:include filename="$(find far)/far.xacro"/></robot>'
    )
    with pytest.raises(robots.RobotError, match=f"package 'far' .*; arms.repos says .* in {url}$"):
        robots.load_file(file)


def test_files_of_a_missing_package_that_nothing_calls_are_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Colors, and sensors that are not asked for; not macros, properties or links that are."""
    file = tmp_path / "arm.xacro"
    head = '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><xacro:include filename='
    link = '<link name="a"><visual><geometry><sphere radius="1"/></geometry>'
    body = f"{link}<xacro:orange/></visual></link></robot>"
    file.write_text(f'{head}"$(find far)/common_materials.xacro"/>{body}')
    assert robots.load_file(file).visual_model.ngeoms == 1
    said = "without common_materials.xacro: there is no package 'far' (see --package-dir)"
    assert said in capsys.readouterr().err
    head += '"$(find far)/laser.xacro"/><link name="a"/>'
    file.write_text(f"{head}<xacro:if value='0'><xacro:laser/></xacro:if></robot>")
    assert robots.load_file(file).model.existFrame("a")
    to_b = "<joint name='j' type='fixed'><parent link='b'/><child link='a'/></joint>"
    for needed in ("<xacro:laser/>", "<link name='${nix}'/>", to_b):
        file.write_text(f"{head}{needed}</robot>")
        with pytest.raises(robots.RobotError, match="there is no package 'far'"):
            robots.load_file(file)


def test_a_package_that_a_simulator_alone_needs_may_be_missing(tmp_path: Path) -> None:
    file = tmp_path / "arm.xacro"
    plugin = "<gazebo><plugin><parameters>$(find far)/a.yaml</parameters></plugin></gazebo>"
    head = '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><link name="a"/>'
    file.write_text(f"{head}{plugin}</robot>")
    assert robots.load_file(file).model.existFrame("a")


def test_a_property_may_be_stated_below_what_uses_it(tmp_path: Path) -> None:
    file = tmp_path / "arm.xacro"
    file.write_text(
        '<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro"><link name="${root}"/>'
        '<xacro:property name="root" value="${part}_link"/>'
        '<xacro:property name="part" value="base"/></robot>'
    )
    assert robots.load_file(file).model.existFrame("base_link")


@pytest.mark.parametrize("name", ["part.xacro", "part.xml"])
def test_a_part_of_a_robot_names_the_robot_that_includes_it(tmp_path: Path, name: str) -> None:
    part, whole = tmp_path / name, tmp_path / f"robot{Path(name).suffix}"
    if part.suffix == ".xml":
        part.write_text('<mujocoinclude><body name="a"/></mujocoinclude>')
        whole.write_text(f'<mujoco><worldbody><include file="{name}"/></worldbody></mujoco>')
    else:
        head = '<robot xmlns:xacro="http://wiki.ros.org/xacro"'
        part.write_text(f"{head}/>")
        (tmp_path / "macro.xacro").write_text(f'{head}><xacro:include filename="{name}"/></robot>')
        whole.write_text(f'{head} name="arm"><xacro:include filename="macro.xacro"/></robot>')
    with pytest.raises(robots.RobotError, match=f"that includes this one: {re.escape(str(whole))}"):
        robots.load_file(part)


def test_a_package_whose_meshes_were_put_into_more_folders_and_the_nearer_of_two(
    tmp_path: Path,
) -> None:
    file = workspace(tmp_path, "src/vendor/arm_resources")
    nearer = tmp_path / "src" / "another" / "arm_resources"
    shutil.copytree(DATA / "workspace" / "arm_resources", nearer)
    mesh = tmp_path / "src" / "vendor" / "arm_resources" / "meshes" / "one.obj"
    for name in ("collision/large/one.obj", "visual/large/one.obj"):
        (mesh.parent / name).parent.mkdir(parents=True)
        (mesh.parent / name).write_bytes(mesh.read_bytes())
    mesh.unlink()
    file.write_text(file.read_text().replace("/one.obj", "/collision/one.obj"))
    (geometry,) = robots.load_file(file).collision_model.geometryObjects
    assert geometry.meshPath.endswith("vendor/arm_resources/meshes/collision/large/one.obj")
    # Where two fit, neither is taken.
    twin = mesh.parent / "collision" / "small" / "one.obj"
    twin.parent.mkdir()
    twin.write_bytes((mesh.parent / "collision" / "large" / "one.obj").read_bytes())
    with pytest.warns(RobotWarning, match="without these meshes.*collision/one.obj"):
        robots.load_file(file)
