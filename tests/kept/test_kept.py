"""What results hold of their scene is what ran; changes raise an error, no file is written."""

import copy
import dataclasses
import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.result.result_parts import Kept
from sphshell_pin.errors import ResultError, RobotWarning, SphshellError
from sphshell_pin.robots.plain_mesh import plain_mesh
from sphshell_pin.scenario import Built, build
from sphshell_pin.scenario.running import kept_scenario as kept
from sphshell_pin.scenario.running.replay import Replay
from sphshell_pin.scenario.running.run import origin_of, simulate
from tests.kept.scenes import DATA, write

CUBE = DATA / "xacro" / "finger_description" / "meshes" / "cube.stl"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    return build(write(tmp_path_factory.mktemp("home")))


@pytest.fixture(scope="module")
def result(built: Built) -> sp.Result:
    found, stopped = simulate(built)
    assert stopped is None
    return found


def kept_of(result: sp.Result) -> Kept:
    return copy.deepcopy(result.origin.keep())


def with_kept(result: sp.Result, changed: Kept) -> sp.Result:
    origin = dataclasses.replace(result.origin, keep=lambda: changed)
    return dataclasses.replace(result, origin=origin)


def test_the_scene_is_the_one_that_ran(built: Built, result: sp.Result, tmp_path: Path) -> None:
    result.save(tmp_path / "first.npz")
    sp.Result.load(tmp_path / "first.npz").save(tmp_path / "run.npz")
    replay = Replay(tmp_path / "run.npz")
    ran, shown = built.scene, replay.scene
    assert list(shown.model.names) == list(ran.model.names)
    # Locked joints are at the pose of the SRDF, whose file is not kept.
    for one, other in zip(ran.model.jointPlacements, shown.model.jointPlacements, strict=True):
        np.testing.assert_array_equal(one.homogeneous, other.homogeneous)
    for one, other in zip(ran.model.inertias, shown.model.inertias, strict=True):
        np.testing.assert_array_equal(one.toDynamicParameters(), other.toDynamicParameters())
    drawn = replay.visual_model.geometryObjects
    for one, other in zip(built.visual_model.geometryObjects, drawn, strict=True):
        assert (one.name, one.parentJoint) == (other.name, other.parentJoint)
        np.testing.assert_array_equal(one.placement.homogeneous, other.placement.homogeneous)
        np.testing.assert_array_equal(one.meshScale, other.meshScale)
        if os.path.isfile(one.meshPath):  # of a primitive, it is the name of its kind
            suffix, content = Path(one.meshPath).suffix, Path(one.meshPath).read_bytes()
            assert Path(other.meshPath).read_bytes() == plain_mesh(suffix, content)
            assert one.meshPath != other.meshPath
    assert [pair.name for pair in shown.pairs] == [pair.name for pair in ran.pairs]
    with pytest.raises(SphshellError, match="build the scenario again"):
        shown.contacts(result.q[0])  # it needs the routine
    for one, other in zip(ran.pairs, shown.pairs, strict=True):
        assert (one.law, one.friction) == (other.law, other.friction)
        assert [a.sphere for a in one.spheres] == [a.sphere for a in other.spheres]


@pytest.mark.parametrize("method", ["facets", "smooth", "elements"])
@pytest.mark.parametrize("name", ["plate", "valve"])
def test_surfaces_are_the_same_bits(built, result, name, method):
    sides = (one for pair in Replay(result).scene.pairs for one in pair.shells)
    before, after = built.shells[name], next(one.shell for one in sides if one.shell.name == name)
    for value in ("side", "crease_angle", "size"):
        assert getattr(after, value) == getattr(before, value)
    for center in np.random.default_rng(0).uniform(*before.box, (200, 3)):
        one, other = (shell.contacts(center, 0.02, method=method) for shell in (before, after))
        assert pickle.dumps(one) == pickle.dumps(other)
    assert len(before.faces) == len(after.faces)


def test_meshes_beyond_the_limit_are_named(result, monkeypatch):
    for most in (3000, 1000, 100):
        monkeypatch.setattr(kept, "MOST_FILES", most)
        few = kept_of(result)
        assert sum(len(one) for k, one in few.arrays.items() if k.startswith("file.")) <= most
    digest = few.contents["robots"][0]["meshes"]["package://finger_description/meshes/cube.stl"]
    assert digest == hashlib.sha256(plain_mesh(".stl", CUBE.read_bytes()) or b"").hexdigest()
    assert f"file.{digest}" not in few.arrays
    monkeypatch.undo()
    whole = kept_of(result)
    assert f"file.{digest}" in whole.arrays
    urdf = whole.contents["robots"][0]
    urdf["meshes"] = dict.fromkeys(urdf["meshes"], "0" * 64)  # of one that is not kept
    said = r"which the results do not hold: .*package://finger.*cube"
    with pytest.warns(RobotWarning, match=said):
        Replay(with_kept(result, whole))


Parts = dict[str, Any]
Change = Callable[[Parts, Parts], object]
"""Changes contents and arrays of what is kept."""


def in_text(robot: int, old: str, new: str) -> Change:
    """Return what replaces the text of a robot."""
    return lambda contents, _: contents["robots"][robot].update(
        text=contents["robots"][robot]["text"].replace(old, new)
    )


def added(name: str, number: float) -> Change:
    """Return what adds to an array."""
    return lambda _, arrays: arrays.update({name: arrays[name] + arrays[name].dtype.type(number)})


def posture(*q0: float) -> Change:
    return lambda contents, _: contents["robots"][0].update(q0=list(q0))


def part(name: str, value: object) -> Change:
    return lambda contents, _: contents.update({name: value})


PLATE, VALVE = "shell.plate.", "shell.valve."
WRONG: dict[str, tuple[Change, str]] = {
    "include": (in_text(2, "<asset>", '<include file="a"/><asset>'), "it includes other files"),
    "posture": (posture(0.0), r"its posture \[0\.0\] is not one of 2 numbers"),
    "no number": (posture(np.nan, 0.0), r"its posture \[nan, 0\.0\] is not one of 2 numbers"),
    "no robot": (part("robots", [None] * 3), "does not hold the robot 'arm/arm.urdf.xacro'"),
    "fewer robots": (part("robots", []), "it has 0 robots, not 3"),
    "part": (part("robots", "x"), "a wrong part, 'robots'"),
    "urdf": (in_text(0, "</robot>", ""), "not well-formed XML"),
    "no surface": (lambda c, _: c["surfaces"].pop("plate"), "does not hold the surface 'plate'"),
    "no table": (part("tables", {}), "does not hold the file 'law.csv' of a law"),
    "crease angle": (lambda c, _: c["surfaces"]["plate"].update(crease_angle=-1.0), "crease_angle"),
    "index": (added(f"{PLATE}elements", 100), "element 0 uses vertex 100"),
    "triangle": (added(f"{PLATE}triangles", 7), "its triangles do not fit"),
    "face": (added(f"{VALVE}element_face", 999), "its element_face do not fit"),
    "normal": (added(f"{VALVE}normals", np.nan), "its normals do not fit"),
    "kind of face": (added(f"{VALVE}face_shapes", 77.0), "its face_shapes do not fit"),
    "numbers": (
        lambda _, arrays: arrays.update({f"{PLATE}vertices": np.zeros((4, 3), np.int32)}),
        "of its arrays 'vertices' holds int32, not float64",
    ),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_does_not_fit_is_said(result: sp.Result, what: str) -> None:
    found, (change, words) = kept_of(result), WRONG[what]
    contents, arrays = found.contents, dict(found.arrays)
    change(contents, arrays)
    with pytest.raises(ResultError, match=words + r".*its scene can be given"):
        Replay(with_kept(result, Kept(contents, arrays)))


@pytest.mark.parametrize("place", [str(CUBE), f"file://{CUBE}", "package://finger/cube.stl"])
def test_a_mesh_that_is_not_kept_is_not_read_from_elsewhere(result: sp.Result, place: str) -> None:
    found = kept_of(result)
    urdf = found.contents["robots"][0]
    urdf["text"] = urdf["text"].replace("package://finger_description/meshes/cube.stl", place)
    with pytest.warns(RobotWarning, match=f"do not hold: {place}"):
        replay = Replay(with_kept(result, found))
    assert str(CUBE) not in [one.meshPath for one in replay.visual_model.geometryObjects]
    # The inertia of a body of the MJCF is that of its mesh.
    found = kept_of(result)
    mjcf = found.contents["robots"][2]
    mjcf["text"] = mjcf["text"].replace("cube.stl", str(CUBE))
    with pytest.raises(ResultError, match=r"mesh 'cube', which cannot be read"):
        Replay(with_kept(result, found))


def test_arrays_that_are_none_of_these_are_refused(result: sp.Result, tmp_path: Path) -> None:
    found = kept_of(result)
    text = Kept(found.contents, {**found.arrays, "file.x": np.array(["a"])})
    with pytest.raises(ResultError, match=r"'kept\.file\.x' holds <U1"):
        with_kept(result, text).save(tmp_path / "run.npz")
    assert not (tmp_path / "run.npz").exists()


def test_a_run_without_files_keeps_none() -> None:
    assert not origin_of(build("ball_on_turntable")).keep().arrays
