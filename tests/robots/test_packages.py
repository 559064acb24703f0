"""Packages of a workspace, found from a file in it without ROS and without options."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sphshell_pin import robots
from sphshell_pin.robots.packages import Folders
from tests.command import call

XACRO = """<robot name="arm" xmlns:xacro="http://wiki.ros.org/xacro">
<xacro:include filename="$(find arm_resources)/urdf/length.xacro"/>
<link name="base"/><link name="tip"><inertial><origin xyz="${L} 0 0"/><mass value="1"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial><collision>
<geometry><mesh filename="package://arm_resources/meshes/one.obj"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="50" velocity="2"/></joint></robot>"""


def package(folder: Path) -> Path:
    (folder / "urdf").mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name></package>")
    return folder


def workspace(root: Path, resources: str) -> Path:
    """Write an arm that needs a package at root/`resources`; return its file."""
    other = package(root / resources)
    (other / "urdf" / "length.xacro").write_text(
        '<robot xmlns:xacro="http://wiki.ros.org/xacro"><xacro:property name="L" value="0.3"/>'
        "</robot>"
    )
    (other / "meshes").mkdir()
    (other / "meshes" / "one.obj").write_text(
        "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    file = package(root / "src" / "vendor" / "arm_support") / "urdf" / "arm.xacro"
    file.write_text(XACRO)
    return file


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


def test_a_relative_package_folder_is_that_of_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "")  # which --package-dir adds to
    file = workspace(tmp_path, "elsewhere/arm_resources")
    monkeypatch.chdir(tmp_path)
    relative = file.relative_to(tmp_path)
    assert robots.load_file(relative, ["elsewhere"]).model.nv == 1
    done = call("new", "--robot", relative, "--package-dir", "elsewhere", "--frame", "tip",
                "--radius", "10mm", "--offset", 0.3, 0, 0, "--out", "arm.toml")  # fmt: skip
    assert done.exit_code == 0, done.output
    monkeypatch.setenv("ROS_PACKAGE_PATH", "")
    (tmp_path / "runs").mkdir()
    monkeypatch.chdir(tmp_path / "runs")
    done = call("explain", "../arm.toml")
    assert done.exit_code == 0, done.output


def test_the_search_ends_at_the_workspace(tmp_path: Path) -> None:
    file = workspace(tmp_path / "one", "../other/arm_resources")
    folders = Folders.of(file)
    assert folders.package("arm_resources") is None
    assert str(tmp_path / "one" / "src") in folders.searched()
