"""A new scenario works as it is written: it touches, presses as promised, and keeps its energy."""

import shutil
import tomllib
from unittest.mock import patch

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import NameNotFound, ResultError, ScenarioError
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.running.run import simulate
from tests.command import refused, succeed
from tests.scenario.files import arm_urdf, pose_of, run_well
from tests.shell.surfaces import surface_file
from tests.studies import mostly_studies

SURFACES = next(iter(shipped_scenarios().values())).parent / "surfaces"
BLADE, BOWL = SURFACES / "bladex_upper.stl", SURFACES / "bowl.shl"

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
def test_what_is_written_works(robot, surface, options, draft, arm):
    if robot not in AT_HAND:
        pytest.importorskip("example_robot_data")
    made = draft(arm if robot == "arm" else robot, surface, **options)
    built = build(made.path)  # what stands in the file, read again
    assert len(built.scenario.expect) >= 2
    run_well(built)
    assert made.explanation.warnings == ()
    gaps = [pair.gap for pair in built.scene.explain(built.q0, built.v0).pairs]
    radius = built.scene.pairs[0].side_i.sphere.radius
    assert 0 < min(gaps) <= 2.01 * radius


@pytest.mark.parametrize("robot", ["ball", "arm"])
def test_a_cad_file_works_without_a_unit(robot, draft, arm):
    pytest.importorskip("OCP")
    step = surface_file("trimesh_featuretype.STEP")
    built = draft(arm if robot == "arm" else robot, step, radius=0.012).built
    run_well(built)
    # The part measures 5 inches; its file says so.
    sizes = np.ptp(built.shells["trimesh_featuretype"].box, axis=0)
    assert sizes.max() == pytest.approx(5 * 0.0254, rel=1e-3)


@pytest.mark.parametrize("place", ["below", "above", "+x", "-x", "+y", "-y"])
def test_the_surface_stands_where_it_was_asked_for(place, draft, arm):
    built = draft(arm, "plane", radius=0.01, place=place).built
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
    assert any("the base is floating" in one for one in made.why)
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
    assert data["robot"]["urdf"] == "parts/arm.urdf"
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


def test_a_file_that_is_there_stays(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("precious", encoding="utf-8")
    with pytest.raises(ScenarioError, match="--force"):
        new_scenario("ball", out=path)
    with pytest.raises(NameNotFound):
        new_scenario("ball", "blub", out=path, force=True)
    assert path.read_text(encoding="utf-8") == "precious"
    full = OSError(28, "No space left on device")
    with patch("os.replace", side_effect=full), pytest.raises(ResultError, match="No space left"):
        new_scenario("ball", out=path, force=True)
    assert path.read_text(encoding="utf-8") == "precious"
    assert list(tmp_path.iterdir()) == [path]
    new_scenario("ball", out=path, force=True)
    assert build(path).scenario.title == "ball falls on plane"


def test_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(BOWL, "bowl.shl")
    command = ["new", "--robot", "ball", "--surface", "bowl.shl", "--unit=mm", "--radius=12mm"]
    printed = succeed(*command).output
    for words in ("sphshell-pin run ball_on_bowl.toml", "verdict", "Recommended dt"):
        assert words in printed
    sphere = build("ball_on_bowl.toml").scene.pairs[0].side_i.sphere
    assert sphere.radius == pytest.approx(0.012, rel=1e-12)
    assert "is there already" in refused(*command)
    for radius, said in (("12xx", "must be one of"), ("abc", "must be a length")):
        assert said in refused("new", "--robot", "ball", "--radius", radius)


@pytest.mark.parametrize(("out", "match"), [("a.txt", r"\.toml"), ("no/a.toml", "does not exist")])
def test_a_place_that_cannot_be_written(out, match, tmp_path):
    with pytest.raises(ScenarioError, match=match):
        new_scenario("ball", out=tmp_path / out)
