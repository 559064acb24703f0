"""A new scenario works as it is written: it touches, presses as promised, and keeps its energy."""

import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import (
    FrameNotFound,
    InvalidParameter,
    NameNotFound,
    ResultError,
    ScenarioError,
    SphshellError,
    UnitMissing,
)
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.running.run import simulate
from tests import urdf
from tests.command import call, succeed
from tests.scenario.files import pose_of, run_well
from tests.shell.surfaces import surface_file
from tests.studies import mostly_studies

SURFACES = next(iter(shipped_scenarios().values())).parent / "surfaces"
PROBE = Path(__file__).parents[1] / "data" / "robots" / "arm_with_probe.urdf"
BLADE, BOWL = SURFACES / "bladex_upper.stl", SURFACES / "bowl.shl"

AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def arm_urdf(folder: Path, axes: str = "zyyzyz") -> Path:
    """Write an arm of links of 0.2 m that stands straight up at zero; return its URDF file."""
    parts = [urdf.link("base")]
    for k, axis in enumerate(axes):
        mass, ends = 2.0 / (k + 1), (f"link_{k - 1}" if k else "base", f"link_{k}")
        inertial = urdf.inertial(mass, mass / 250).replace("<mass", '<origin xyz="0 0 0.1"/><mass')
        inertial = re.sub('izz="[^"]*', f'izz="{mass / 900}', inertial)
        at = "0 0 0.2" if k else "0 0 0"
        joint = urdf.joint(f"joint_{k}", "revolute", *ends, at=at, axis=AXES[axis])
        limit = 'lower="-2.8" upper="2.8" effort="60" velocity="3"'
        parts += [urdf.link(ends[1], inertial), re.sub("lower=.*(?=/></joint>)", limit, joint)]
    return urdf.write(folder / "arm.urdf", *parts)


CASES = [
    ("panda", BLADE, {"unit": "mm"}),
    ("panda", "plane", {"material": "steel"}),
    ("ur5", "box", {}),
    ("allegro_right_hand", "sphere", {}),
    ("three_link_finger", "cylinder", {}),
    ("ball", BOWL, {"unit": "mm"}),
    ("ball", "box", {"material": "silicone"}),
    ("a1", "plane", {}),
    ("arm", "bowl", {"radius": 0.02}),
    ("arm", BLADE, {"radius": 0.003, "unit": "mm"}),
]
FEW = [CASES[k] for k in (0, 6, 7, 8)]
# Robots that come with the package itself, or with the tests.
AT_HAND = ("arm", "ball", "three_link_finger")


@pytest.mark.parametrize(("robot", "surface", "options"), mostly_studies(CASES, FEW.__contains__))
def test_what_is_written_works(robot, surface, options, draft, tmp_path):
    if robot not in AT_HAND:
        pytest.importorskip("example_robot_data")
    name = arm_urdf(tmp_path) if robot == "arm" else robot
    made = draft(name, surface, **options)
    built = build(made.path)  # what stands in the file, read again
    assert len(built.scenario.expect) >= 2
    run_well(built)
    assert made.explanation.warnings == ()
    gaps = [pair.gap for pair in built.scene.explain(built.q0, built.v0).pairs]
    radius = built.scene.pairs[0].side_i.sphere.radius
    assert 0 < min(gaps) <= 2.01 * radius


@pytest.mark.parametrize("robot", ["ball", "arm"])
def test_a_cad_file_works_without_a_unit(robot, draft, tmp_path):
    pytest.importorskip("OCP")
    step = surface_file("trimesh_featuretype.STEP")
    name = arm_urdf(tmp_path) if robot == "arm" else robot
    built = draft(name, step, radius=0.012).built
    run_well(built)
    # The part measures 5 inches; its file says so.
    sizes = np.ptp(built.shells["trimesh_featuretype"].box, axis=0)
    assert sizes.max() == pytest.approx(5 * 0.0254, rel=1e-3)


@pytest.mark.parametrize("place", ["below", "above", "+x", "-x", "+y", "-y"])
def test_the_surface_stands_where_it_was_asked_for(place, draft, tmp_path):
    built = draft(arm_urdf(tmp_path), "plane", radius=0.01, place=place).built
    (pair,) = built.scene.pairs
    tip = pose_of(built.scene.model, built.q0, "link_5").translation
    k = {"below": 2, "above": 2}.get(place, "xyz".find(place[-1]))
    sign = -1 if place in ("below", "-x", "-y") else 1
    away = pair.side_j.placement.translation - tip
    expected = np.zeros(3)
    expected[k] = sign * 1.02 * pair.side_i.sphere.radius
    np.testing.assert_allclose(away, expected, atol=2e-6)


def test_a_single_body_of_ones_own_floats(draft, tmp_path):
    shutil.copy(robots.URDF_FOLDER / "ball.urdf", tmp_path / "mine.urdf")
    made = draft(tmp_path / "mine.urdf", "plane")
    assert made.built.scenario.robot[0].base == "floating"
    assert any("the base is floating" in one for one in made.why)
    assert made.built.scene.model.nv == 6
    assert made.built.q0[2] == pytest.approx(0.012 + 2 * 0.012, rel=1e-3)


def test_files_are_named_relative_to_the_scenario(tmp_path):
    old = tmp_path / "old"
    (old / "parts").mkdir(parents=True)
    shutil.copy(BLADE, old / "parts" / "my blade.stl")
    made = new_scenario(
        arm_urdf(old / "parts"), old / "parts" / "my blade.stl", unit="mm", radius=0.01,
        out=old / "a.toml",
    )  # fmt: skip
    data = tomllib.loads(made.text)
    assert data["robot"]["file"] == "parts/arm.urdf"
    assert data["shell"][0]["file"] == "parts/my blade.stl"
    old.rename(tmp_path / "new")
    assert build(tmp_path / "new" / "a.toml").shells["my blade"].num_elements == 522


def test_materials_give_hertzs_law(draft):
    made = draft("ball", "plane", material="aluminium", against="rubber")
    (pair,) = made.built.scene.pairs
    softness = (1 - 0.33**2) / 7.0e10 + (1 - 0.49**2) / 1.0e7
    assert pair.law.stiffness == pytest.approx(4 / 3 * np.sqrt(0.012) / softness, rel=1e-12)
    turned = draft("ball", "plane", material="rubber", against="aluminium")
    assert turned.built.scene.pairs[0].friction == pair.friction


def test_the_ball_comes_back_as_high_as_its_material_says(draft):
    built = draft("ball", "plane", material="wood").built
    result, _ = simulate(built)
    touched = float(result.contact_columns()["t [s]"][0])
    after = result.t > touched + 0.01
    rising = result.v[after, 2][0] + 9.81 * (result.t[after][0] - touched)
    assert rising / np.sqrt(2 * 9.81 * 0.024) == pytest.approx(0.6, rel=0.03)


@pytest.mark.parametrize(
    ("arguments", "options", "error", "match"),
    [
        (("pandda",), {}, NameNotFound, "no robot 'pandda'"),
        (("nix.urdf",), {}, SphshellError, "nix.urdf: no such file"),
        (("ball", "blub"), {}, NameNotFound, "plane, box, sphere, cylinder, bowl"),
        (("ball", "blub.stl"), {}, SphshellError, "surface blub.stl: no such file"),
        (("ball", BLADE), {}, UnitMissing, "must be stated"),
        (("ball", "plane"), {"unit": "mm"}, SphshellError, "sized in meters"),
        (("ball", "plane"), {"faces": [3]}, SphshellError, "not to the plane"),
        ((BLADE,), {}, SphshellError, "is a mesh, without joints"),
        (("ball",), {"frame": "bal"}, FrameNotFound, "no frame 'bal'"),
        (("ball",), {"radius": -1.0}, InvalidParameter, "must be positive"),
        (
            (PROBE,),
            {"radius": 12.0},
            InvalidParameter,
            "radius = 12.0 .* more than the robot's reach",
        ),
        (("ball",), {"press": 3.0}, SphshellError, "leave out --press"),
        (("ball",), {"at": (0.0, 0.0, 0.0)}, SphshellError, "leave out --press, --place, --at and"),
        (("ball",), {"material": "iron"}, NameNotFound, "steel, aluminium"),
        (("ball",), {"against": "iron"}, NameNotFound, "steel, aluminium"),
        (("ball",), {"base": "fixed"}, SphshellError, "no joint: .* --base floating"),
        (("solo12",), {"press": 3.0}, SphshellError, "leave out --press, .* with --base fixed"),
        (("ball",), {"place": "left"}, NameNotFound, "below, above"),
        (("ball",), {"xacro_args": {"a": "1"}}, SphshellError, "belong to a file, not to ball"),
        (
            ("ball", BLADE),
            {"unit": "um"},
            SphshellError,
            r"less than the sphere's radius .* --radius [0-9.]+mm$",
        ),
        (
            ("gear_pair",),
            {"frame": "gear_1", "radius": 0.01},
            SphshellError,
            "gear_1. cannot move along any axis",
        ),
        pytest.param(
            ("three_link_finger",),
            {"press": 1e4},
            SphshellError,
            "allow a push of",
            marks=pytest.mark.study,
        ),
        (("three_link_finger",), {"frame": "base", "radius": 0.01}, SphshellError, "no joint"),
    ],
)
def test_what_cannot_be_found_out_is_asked_for_in_one_sentence(
    arguments, options, error, match, draft, tmp_path
):
    with pytest.raises(error, match=match) as caught:
        draft(*arguments, **options)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    path.write_text("precious", encoding="utf-8")
    with pytest.raises(ScenarioError, match="--force"):
        new_scenario("ball", out=path)
    with pytest.raises(NameNotFound):
        new_scenario("ball", "blub", out=path, force=True)
    assert path.read_text(encoding="utf-8") == "precious"

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", full)
        with pytest.raises(ResultError, match="No space left"):
            new_scenario("ball", out=path, force=True)
    assert path.read_text(encoding="utf-8") == "precious"
    assert list(tmp_path.iterdir()) == [path]
    new_scenario("ball", out=path, force=True)
    assert build(path).scenario.title == "ball falls on plane"


def test_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(BOWL, "bowl.shl")
    command = [
        "new",
        "--robot",
        "ball",
        "--surface",
        "bowl.shl",
        "--unit",
        "mm",
        "--radius",
        "12mm",
    ]
    result = succeed(*command)
    assert "sphshell-pin run ball_on_bowl.toml" in result.output
    assert "verdict" in result.output
    assert "Recommended dt" in result.output
    assert build("ball_on_bowl.toml").scene.pairs[0].side_i.sphere.radius == pytest.approx(
        0.012, rel=1e-12
    )
    again = call(*command)
    assert again.exit_code == 2
    assert "is there already" in again.output
    for radius, said in (("12xx", "must be one of"), ("abc", "must be a length")):
        wrong = call("new", "--robot", "ball", "--radius", radius)
        assert wrong.exit_code == 2
        assert said in wrong.output


@pytest.mark.parametrize(("out", "match"), [("a.txt", r"\.toml"), ("no/a.toml", "does not exist")])
def test_a_place_that_cannot_be_written(out, match, tmp_path):
    with pytest.raises(ScenarioError, match=match):
        new_scenario("ball", out=tmp_path / out)
