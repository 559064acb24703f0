"""Whole robots: the shipped ones pass, hard ones are told of honestly, wrong physics fails."""

import json
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import Scene, robots
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.study import robot_check
from sphshell_pin.study.robot_check import QUICK, RobotReport, Sizes, check_robot, contact_scene
from sphshell_pin.study.robot_check.checks import CHECKS
from sphshell_pin.study.robot_check.postures import massless_joints, random_posture, regularity
from sphshell_pin.study.robot_check.report import FAILED, NOT_CHECKED, PASS, as_json, remarks
from sphshell_pin.testing.finding import Finding
from tests import urdf
from tests.command import call, refused
from tests.studies import mostly_studies

ROOT = Path(__file__).parents[2]
TINY = Sizes(1, 1, 4)
JOINTS = ("revolute", "continuous", "prismatic", "planar", "floating")


def chain(tmp_path: Path, joints: tuple[str, ...], mimic: str = "", massless: str = "") -> Path:
    """A URDF of links on these joints in a row, each 0.2 m on, with meshes that are not there."""
    shape = urdf.mesh("package://nowhere/absent.stl")
    shapes = [urdf.shape(kind, shape) for kind in ("visual", "collision")]
    parts = []
    for k in range(len(joints) + 1):
        inertial = f"""<inertial><origin xyz="0.01 0.02 0.1"/><mass value="{1.0 + 0.3 * k}"/>
            <inertia ixx="0.01" iyy="0.012" izz="0.005" ixy="0.001" ixz="0" iyz="0"/></inertial>"""
        parts.append(urdf.link(f"link{k}", "" if f"link{k}" == massless else inertial, *shapes))
    for k, kind in enumerate(joints):
        more = '<mimic joint="joint0"/>' if f"joint{k}" == mimic else ""
        axis = "1 0 0" if k % 2 else "0 1 0"
        ends = f"link{k}", f"link{k + 1}"
        one = urdf.joint(f"joint{k}", kind, *ends, more, at="0 0.02 0.2", axis=axis)
        if kind in ("continuous", "floating", "planar"):
            one = re.sub("<limit[^>]*>", "", one)
        parts.append(re.sub("<axis[^>]*>", "", one) if kind == "floating" else one)
    return urdf.write(tmp_path / "chain.urdf", *parts)


def passes(report: RobotReport) -> bool:
    assert report.verdict == PASS, report.remarks
    assert set(report.findings) == set(CHECKS)
    return True


@pytest.mark.robots
@pytest.mark.parametrize("part", mostly_studies(range(8), lambda part: part == 0))
def test_every_robot_passes(part: int) -> None:
    """With few postures; `make robots` takes more, and docs/robots.md has the verdicts."""
    pytest.importorskip("example_robot_data")
    assert len(robots.names()) > 70
    for name in robots.names()[part::8]:
        report = check_robot(name, sizes=TINY)
        if report.verdict == NOT_CHECKED:
            # The one reason there is on this machine.
            assert "the wheel of pinocchio has no SDF reader" in str(report.reason)
            continue
        assert passes(report)


@pytest.mark.parametrize("name", robots.OWN)
def test_own_robots_pass_at_full_size(name: str) -> None:
    assert passes(check_robot(name))


def test_all_joints_in_one_on_a_free_root(tmp_path: Path) -> None:
    report = check_robot(str(chain(tmp_path, JOINTS)), free_flyer=True, sizes=QUICK)
    assert passes(report)
    assert report.nv == 6 + 1 + 1 + 1 + 3 + 6


def test_mimic_joints_are_exact(tmp_path: Path) -> None:
    report = check_robot(str(chain(tmp_path, ("revolute",) * 3, mimic="joint2")), sizes=TINY)
    assert passes(report)
    assert report.nv == 2
    kept = pin.buildModelFromUrdf(str(tmp_path / "chain.urdf"), mimic=True)
    assert passes(check_robot(kept, sizes=TINY))


DATA = Path(__file__).parents[1] / "data"
FILES = [*sorted((DATA / "mjcf").glob("*.xml")), *sorted((DATA / "xacro").glob("*.urdf.xacro"))]


@pytest.mark.parametrize(
    "file", mostly_studies(FILES, FILES[::3].__contains__), ids=lambda f: f.name
)
def test_mjcf_and_xacro_files_pass(file: Path) -> None:
    assert passes(check_robot(file, sizes=TINY, free_flyer="legged" in file.name))


@pytest.mark.parametrize(
    ("joints", "massless", "frame", "nv"),
    [
        (3, "link3", "link2", 2),
        (3, "link2", None, 3),  # the links behind it lend their mass: nothing is held
        (1, "link1", None, None),  # the sphere on what is held: nothing can move it
    ],
)
def test_massless_links_are_held_and_told(joints, massless, frame, nv, tmp_path: Path) -> None:
    file = chain(tmp_path, ("revolute",) * joints, massless=massless)
    report = check_robot(str(file), frame=frame, radius=0.02, sizes=TINY)
    if nv is None:
        assert report.verdict == NOT_CHECKED
        return
    assert passes(report)
    assert report.nv == nv
    held = [note for note in report.notes if "move no mass" in note and "'joint2'" in note]
    assert len(held) == 3 - nv


def test_which_joints_move_no_mass() -> None:
    """Against the rank of the mass matrix."""
    model = pin.Model()
    joint = 0
    for k in range(4):
        joint = model.addJoint(joint, pin.JointModelRZ(), pin.SE3.Identity(), f"j{k}")
        # All four turn about one axis: only their sum moves anything.
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(1.0, 0.1), pin.SE3.Identity())
    for j in range(1, 5):
        model.addJointFrame(j)
    rng = np.random.default_rng(0)
    postures = [random_posture(model, rng) for _ in range(3)]
    assert regularity(model, postures[0]) < 1e-12
    held = massless_joints(model, postures)
    assert len(held) == 3
    ids = [model.getJointId(name) for name in held]
    rest = pin.buildReducedModel(model, ids, postures[0])
    assert regularity(rest, np.zeros(1)) == pytest.approx(1.0)


def test_random_postures_are_legal(tmp_path: Path) -> None:
    model = pin.buildModelFromUrdf(str(chain(tmp_path, JOINTS)), pin.JointModelFreeFlyer())
    rng = np.random.default_rng(1)
    some = np.array([random_posture(model, rng) for _ in range(200)])
    assert all(pin.isNormalized(model, q, 1e-12) for q in some)
    limited = [j.idx_q for j in list(model.joints)[1:] if j.nq == j.nv == 1]
    assert len(limited) == 2
    assert np.abs(some[:, limited]).max() <= 1
    assert (np.abs([some[:, limited].min(axis=0), some[:, limited].max(axis=0)]) > 0.4).all()


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("depth", [0.1, 0.3])
def test_scenes_have_the_depth_asked_for(free: bool, depth: float) -> None:
    for seed in range(4):
        touch = contact_scene("three_link_finger", depth=depth, free=free, seed=seed)
        contacts = touch.scene.contacts(touch.q, touch.v)
        # The patch is curved where the depth is counted from, its elements are as good as it.
        assert contacts.depth == pytest.approx([depth * 0.01], rel=5e-3)
        assert contacts.normal_force[0] > 0


@pytest.mark.parametrize(
    ("names", "broken"),
    [
        (["forces", "reaction"], "external_forces"),
        (["derivatives"], "contact_derivatives"),
        (["contacts"], "contacts"),
    ],
)
def test_wrong_physics_fails(names, broken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(Scene, broken)

    def wrong(self, q, v=None):
        told = right(self, q, v)
        if broken == "external_forces":
            for joint in range(1, len(told)):
                told[joint] = pin.Force(told[joint].linear, 1.001 * told[joint].angular)
            return told
        if broken == "contact_derivatives":
            return told[0] * (1 + 1e-4), told[1]
        return type(told)(**{f.name: getattr(told, f.name)[:0] for f in fields(told)})

    monkeypatch.setattr(Scene, broken, wrong)
    report = check_robot("three_link_finger", sizes=Sizes(2, 1, 12))
    assert report.verdict == FAILED
    assert report.met("energy")
    for name in names:
        assert not report.met(name)
        with pytest.raises(AssertionError, match=f"failed: .*{name} failed"):
            report.require()


def test_the_same_seed_gives_the_same_figures() -> None:
    one, two = (as_json([check_robot("ball", sizes=TINY)], "it", 0, TINY) for _ in range(2))
    assert one == two
    assert one != as_json([check_robot("ball", seed=1, sizes=TINY)], "it", 0, TINY)


def test_wrong_input_is_told() -> None:
    with pytest.raises(InvalidParameter, match="must be a file"):
        check_robot("ball", free_flyer=True)
    with pytest.raises(InvalidParameter, match="must be a name, a file or a pinocchio"):
        check_robot(3)


SMALL = {k: Finding(min(1e-13, one.tolerance), "here") for k, one in CHECKS.items()}
REPORTS = [
    RobotReport("good", "tip", 0.01, 3, 3, {k: Finding(0.0, "here") for k in CHECKS}, ("odd",)),
    RobotReport("bad", "tip", 0.01, 7, 6, {k: Finding(np.inf, "there") for k in CHECKS}),
    RobotReport("absent", reason="it is not there"),
    RobotReport("fine", "tip", 0.01, 3, 3, SMALL, ("odd",)),
]


def test_the_figures_as_json() -> None:
    failed = "bad: forces failed: there (no figure, allowed 1e-08)."
    assert {"good, fine: odd.", "absent: it is not there.", failed} <= set(remarks(REPORTS))
    data = json.loads(as_json(REPORTS, "it", 7, QUICK))
    assert data["seed"] == 7
    assert data["sizes"] == {"postures": 1, "runs": 1, "poses": 12}
    assert [one["verdict"] for one in data["robots"]] == [PASS, FAILED, NOT_CHECKED, PASS]
    assert data["robots"][1]["checks"]["forces"] == {"error": None, "met": False, "where": "there"}


def run(*arguments: object):
    return call("check-robot", *arguments)


def test_the_command(tmp_path: Path) -> None:
    figures = tmp_path / "figures.json"
    result = run("ball", "turntable", "--quick", "--json", figures)
    assert result.exit_code == 0, result.output
    assert "2 of 2 robots pass" in result.output
    rows = [line.split() for line in result.output.splitlines()]
    assert [row[0] for row in rows if row and row[0] in CHECKS] == list(CHECKS)
    names = [one["name"] for one in json.loads(figures.read_text())["robots"]]
    assert names == ["ball", "turntable"]
    assert sorted(tmp_path.iterdir()) == [figures]


def test_exit_codes_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong, message in (
        (["ball", "--all"], "not both"),
        ([], "say which robots"),
        (["bal"], "no robot 'bal'"),
        ([tmp_path / "no.urdf"], "no such file"),
        (["ball", "--frame", "nose"], "no frame 'nose'"),
        (["ball", "--radius", "0"], "radius = 0.0 must be positive"),
        (["ball", "--radius", "wide"], "--radius = 'wide' must be a length"),
        (["ball", "--json", ROOT / "README.md" / "x.json"], "cannot be written"),
        (["ball", "--json", tmp_path], "is a folder"),
        ([tmp_path], "is a folder, not a file"),
    ):
        assert message in refused("check-robot", *wrong)
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot")
    result = run("ball", broken, "--quick")
    assert result.exit_code == 2
    assert "1 of 2 robots pass" in result.output
    assert "not a URDF that can be read" in result.output
    assert result.output.count("broken.urdf: ") == 1
    result = run("ball", "three_link_finger", "--frame", "tip", "--radius", "12mm", "--quick")
    assert result.exit_code == 2  # the finger is checked, though the ball has no such frame
    assert "ball: no frame 'tip'" in result.output
    assert "1 of 2 robots pass" in result.output
    found = {k: Finding(1.0, "there") for k in CHECKS}
    report = RobotReport("ball", "tip", 0.01, 7, 6, found)
    monkeypatch.setattr(robot_check, "check_robot", lambda *a, **k: report)
    result = run("ball")
    assert result.exit_code == 1
    assert "forces failed: there" in result.output


def test_ctrl_c_tells_what_is_done(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    done: list[str] = []

    def check(name: str, **_: object) -> RobotReport:
        if done:
            raise KeyboardInterrupt
        done.append(name)
        return REPORTS[0]

    monkeypatch.setattr(robot_check, "check_robot", check)
    result = run("ball", "turntable", "gear_pair", "--json", tmp_path / "x.json")
    assert result.exit_code == 130
    assert "1 of 1 robots pass" in result.output
    assert "interrupted: 2 of 3 robots were not checked" in result.output
    assert not list(tmp_path.iterdir())


def test_the_page_of_the_docs_is_of_these_robots() -> None:
    data = json.loads((ROOT / "docs" / "measured" / "robots.json").read_text(encoding="utf-8"))
    verdicts = {one["name"]: one["verdict"] for one in data["robots"]}
    assert "failed" not in verdicts.values()
    assert [name for name, verdict in verdicts.items() if verdict == NOT_CHECKED] == ["cassie"]
    if len(robots.names()) > len(robots.OWN):
        assert list(verdicts) == robots.names()


def test_the_armature_of_a_free_joint_is_named_and_no_momentum_is_missed(tmp_path):
    """MuJoCo's joint of type free takes the armature of the defaults, an inertia of no body."""
    file = tmp_path / "leg.xml"
    file.write_text(
        '<mujoco><default><joint armature="0.01"/></default><worldbody><body>'
        '<joint type="free"/><geom type="box" size=".1 .1 .1"/><body pos="0 0 -.1">'
        '<joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.3" size=".02"/>'
        '<body pos="0 0 -.3"><geom type="sphere" size=".03"/></body></body></body>'
        "</worldbody></mujoco>"
    )
    report = check_robot(file, sizes=QUICK)
    assert report.verdict == "pass"
    assert any("<freejoint/>" in note for note in report.remarks)
