"""A hand about a part: forces in closed form, distances, and drafts that are run."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.contact.materials import find_material
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand
from sphshell_pin.scenario.drafting.hand import GAP, _pressed
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part
from sphshell_pin.scenario.format.shape_tables import Box, Cylinder
from tests.models import pose_of
from tests.scenario.files import run_well
from tests.studies import mostly_studies
from tests.texts import DATA

# Three fingers, two against one, each with two hinges about y.
GRIPPER = DATA / "robots" / "three_fingers.urdf"
NO_WEIGHT = np.zeros(6)


def shell_of(primitive):
    return primitive.shell(
        chord_error=None, segments=None, side="outside", crease_angle=0.5, name="part"
    )


def test_two_fingers_carry_a_weight_by_friction():
    """It takes the weight over all normal forces, and nothing less."""
    points, normals = np.array([[0.03, 0, 0], [-0.03, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
    weight = np.array([0, 0, -2.0, 0, 0, 0])
    mu, forces = least_friction(points, normals, weight, 10.0, 1.0)
    assert mu == pytest.approx(0.2, abs=1 / 2**9)
    assert np.allclose(forces.sum(axis=0), [0, 0, 2.0], atol=1e-6)
    assert least_friction(points, normals, weight, 10.0, 0.19) is None


@pytest.mark.parametrize("angle", [0.1, 0.3, 0.5])
def test_two_fingers_hold_where_their_line_is_in_both_cones(angle):
    """Nguyen 1988: the cones must contain the line between the points."""
    normals = np.array([[np.cos(angle), 0, np.sin(angle)], [-np.cos(angle), 0, np.sin(angle)]])
    points = np.array([[0.03, 0, 0], [-0.03, 0, 0]])
    mu, _ = least_friction(points, normals, NO_WEIGHT, 10.0, 1.0)
    assert mu == pytest.approx(np.tan(angle), abs=1 / 2**8)


def test_a_part_weighs_what_its_material_weighs():
    size = np.array([0.02, 0.03, 0.05])
    part = Part.of(shell_of(Box(size.tolist())), find_material("steel"))
    mass = 7850 * size.prod()
    assert part.inertia.mass == pytest.approx(mass)
    squares = size**2
    assert np.allclose(part.inertia.inertia, np.diag(mass / 12 * (squares.sum() - squares)))
    loaded = part.loaded()
    assert loaded.model.inertias[1].mass == pytest.approx(mass)
    assert loaded.model.nq == 7


ALONG_Y = pin.SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0, 0), np.array([0, 0, -0.1]))
ROD = Cylinder(radius=0.02, length=0.2)


def hand_of():
    loaded = robots.load_file(GRIPPER)
    tips = [Tip(s.frame, s.radius, np.array(s.offset), "") for s in robots.end_spheres(loaded)]
    return Hand(loaded.model, tips)


def test_fingers_close_on_a_part():
    """All centers stand a radius and the gap away from a cylinder: a distance to its axis."""
    hand, gaps = hand_of(), np.array([1e-4, 2e-4, -1e-4])
    q, points, normals = hand.close_on(np.tile([-0.3, 0.6], 3), shell_of(ROD), ALONG_Y, gaps)
    centers = hand.centers(q)
    away = np.hypot(centers[:, 0], centers[:, 2] + 0.1)
    # The cylinder is a mesh: curved elements, a micrometer off.
    assert away - 0.03 == pytest.approx(gaps, abs=2e-6)
    assert np.allclose(points, centers - (away - 0.02)[:, None] * normals, atol=2e-6)


def test_torques_do_the_work_of_the_forces():
    """Virtual work: of forces on points that move with the tips."""
    hand = hand_of()
    q, points, normals = hand.close_on(np.tile([-0.3, 0.6], 3), shell_of(ROD), ALONG_Y, 0.0)
    forces = np.random.default_rng(0).normal(size=(3, 3))
    torques = hand.torques(Grasp(q, ALONG_Y, points, normals, forces, 0.0))
    model, step = hand.model, 1e-6

    def moved(q):
        return [pose_of(model, q, tip.frame) for tip in hand.tips]

    local = [pose.actInv(point) for pose, point in zip(moved(q), points, strict=True)]
    for k in range(model.nv):
        change = np.zeros(model.nv)
        change[k] = step
        ahead, behind = (
            [pose.act(at) for pose, at in zip(moved(q + sign * change), local, strict=True)]
            for sign in (1, -1)
        )
        work = (forces * (np.array(ahead) - np.array(behind))).sum() / (2 * step)
        assert torques[k] == pytest.approx(work, abs=1e-8)


@pytest.mark.parametrize("dense", [1.0, 1e3])
def test_the_finger_that_presses_most_presses_as_asked(dense):
    """Of three around a post, each presses a third of all where it weighs little."""
    turns = 2 * np.pi / 3 * np.arange(3)
    normals = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    post = shell_of(Cylinder(0.02, 0.05))
    part = Part.of(post, replace(find_material("plastic"), density=dense))
    about = Grasp(np.zeros(3), pin.SE3.Identity(), 0.02 * normals, normals, 0 * normals, 0.0)
    found = _pressed(about, part, 5.0, 0.8)
    assert found.normal_forces().max() == pytest.approx(5.0, rel=1e-3)
    assert found.forces[:, 2].sum() == pytest.approx(9.81 * part.inertia.mass, rel=1e-4)


def test_what_is_out_of_reach_is_not_touched():
    hand, shell = hand_of(), shell_of(Box([0.02, 0.02, 0.02]))
    far = pin.SE3(np.eye(3), np.array([0, 0, -0.5]))
    assert hand.close_on(np.zeros(6), shell, far, GAP) is None


@pytest.mark.parametrize(
    "surface", mostly_studies(["box", "cylinder", "sphere"], lambda one: one != "cylinder")
)
def test_a_hand_holds_what_new_gives_it(surface, draft, tmp_path):
    made = draft(GRIPPER, surface, tips="all", against="plastic")
    assert (tmp_path / "a_part.urdf").is_file()
    built = build(made.path)  # what stands in the files, read again
    gaps = [pair.gap for pair in built.scene.explain(built.q0, built.v0).pairs]
    assert gaps == pytest.approx([GAP] * 3, abs=2e-6)
    result = run_well(built)
    log, last = result.contacts, len(result.t) - 1
    forces = log.normal_force[:, None] * log.normal_world + log.friction_force_world
    mass = built.scene.model.inertias[built.scene.model.getJointId("part/root_joint")].mass
    # At the end the tips carry the weight, and nothing else.
    assert np.allclose(-forces[log.row == last].sum(axis=0), [0, 0, 9.81 * mass], atol=0.02)


def test_a_part_that_is_too_heavy_of_steel_is_of_plastic(draft, tmp_path):
    import trimesh

    file = tmp_path / "block.stl"
    trimesh.creation.box((0.06, 0.06, 0.12)).export(file)
    made = draft(GRIPPER, file, tips="all", unit="m")
    assert made.why[0].startswith("the part is of plastic, as with steel no grasp of")
    with pytest.raises(SphshellError, match="a lighter --against"):
        draft(GRIPPER, file, tips="all", unit="m", against="steel")


def test_fingers_that_mimic_others_hold_too(draft, tmp_path):
    """Two fingers move as one; motors make up for friction that would keep them from pressing."""
    file, text = tmp_path / "gripper.urdf", GRIPPER.read_text("utf-8")
    for link in ("upper", "lower"):
        at = text.index("</joint>", text.index(f'<joint name="right_{link}_hinge"'))
        text = f'{text[:at]}<mimic joint="left_{link}_hinge"/>{text[at:]}'
    text = text.replace("</joint>", '<dynamics damping="0" friction="2"/></joint>')
    file.write_text(text, encoding="utf-8")
    made = draft(file, "cylinder", tips="all", against="plastic")
    built = build(made.path)
    assert built.scene.model.nv == 4 + 6
    assert built.scenario.robot[0].joints == ["limits", "friction", "effort", "speed"]
    run_well(built)
