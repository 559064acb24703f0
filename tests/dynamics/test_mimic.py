"""Mimic joints move exactly, in any tree: against the full model and recursive Newton-Euler."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import testing
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import Mimic, mimics, shortened, with_mimics
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import SphshellError
from tests import meshes, models
from tests.studies import mostly_studies
from tests.texts import text_of


def gripper() -> tuple[pin.Model, pin.Model]:
    """Return the gripper with exact mimic joints, and with free ones."""
    text = text_of("robots/two_fingers.urdf")
    return tuple(pin.buildModelFromXML(text, mimic=mimic) for mimic in (True, False))  # type: ignore[return-value]


def panda() -> tuple[pin.Model, pin.Model]:
    """Return example-robot-data's Panda, whose second finger mimics the first."""
    data = pytest.importorskip("example_robot_data")
    path = data.load("panda").urdf
    return tuple(pin.buildModelFromUrdf(path, mimic=mimic) for mimic in (True, False))  # type: ignore[return-value]


def with_contact(model: pin.Model, tip: str, other: str) -> sp.Scene:
    """A sphere on one finger against a shell on the other, which always touch."""
    scene = sp.Scene(model)
    sphere, shell = sp.Sphere(0.5, tip, (0.02, 0.01, 0.03)), sp.Shell(*meshes.grid_plate(4, 4, 2.0))
    law, friction = sp.HuntCrossleyLaw(1e4, 1.5, 0.3), sp.BristleFriction(0.5, 0.4, 1e4, 1.0, 1e-2)
    scene.add_contact(sphere, shell, other, law=law, friction=friction)
    return scene


CASES = {
    "panda": (panda, "panda_leftfinger", "panda_rightfinger"),
    "gripper": (gripper, "left_pad", "right_pad"),
}


@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-8, 1e-10), sp.Implicit(1e-7, 1e-9)])
def test_a_closing_grasp_keeps_its_energy(integrator: sp.Adaptive | sp.Implicit) -> None:
    model, full = gripper()
    scene, box = sp.Scene(model), sp.Shell(*meshes.cube(0.02))
    place = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.078]))
    law, friction = sp.HuntCrossleyLaw(1e6, 1.5, 0.5), sp.CoulombFriction(0.5, 0.4, 0.01, 0.1)
    # The right finger, of the smaller ratio, reaches less far.
    for side, radius in (("left", 0.006), ("right", 0.0095)):
        pad = sp.Sphere(radius, f"{side}_pad", (0.0, 0.0, 0.02))
        scene.add_contact(pad, box, "universe", place, law, friction, name=side)
    gains, goal = {"left_knuckle_joint": 2.0, "lift": 500.0}, {"left_knuckle_joint": 0.9}
    control = sp.JointPD(gains, 0.02, goal)
    result = sp.Simulation(scene, integrator).run(np.zeros(model.nq), None, 0.5, control)
    figures = result.stats.pairs
    assert figures["left"].touches
    assert figures["right"].touches
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged
    # Both pads stay where their ratio has them.
    data, free = model.createData(), full.createData()
    pin.forwardKinematics(model, data, result.q[-1])
    expanded = Tree(full, model).expanded(result.q[-1], result.v[-1])
    pin.forwardKinematics(full, free, expanded[0])
    for ours, theirs in zip(data.oMi, free.oMi, strict=True):
        assert ours.isApprox(theirs, 1e-12)


def test_joint_components_act_on_the_joint_that_is_mimicked() -> None:
    model, _ = gripper()
    joints = sp.JointComponents.from_model(model)
    assert set(joints.limits) == {"lift", "left_knuckle_joint"}
    scene = sp.Scene(model, joints=joints)
    assert "joints that mimic others, exactly" in str(scene.explain())
    control = sp.JointPD({"lift": 500.0}, {"lift": 1.0})
    result = sp.Simulation(scene, sp.Adaptive(1e-7)).run([0.0, 0.0], [0.0, 8.0], 1.0, control)
    assert result.stats.joints["left_knuckle_joint"].stops
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged


@pytest.mark.parametrize("off", [1e-5, -1e-3, 0.1])
def test_a_joint_that_follows_is_where_its_rule_puts_it(off: float) -> None:
    model, full = gripper()
    q = Tree(full, model).expanded(np.array([0.1, 0.4]), np.zeros(2))[0]
    np.testing.assert_allclose(shortened(model, q, check=True), [0.1, 0.4], rtol=0, atol=0)
    for joint in mimics(model):
        one = q.copy()
        one[full.joints[full.getJointId(joint)].idx_q] += off
        with pytest.raises(SphshellError, match=f"joint '{joint}' cannot be at .* it mimics"):
            shortened(model, one, check=True)


def test_chained_rules_are_one_rule() -> None:
    """c = 2 b + 0.1 and b = 3 a - 0.2 put c at 6 a - 0.3."""
    model = models.empty()
    for name in "abc":
        models.add_body(model, name, pin.JointModelRZ())
    b, c = model.names[2], model.names[3]
    rules = [Mimic(c, b, 2.0, 0.1), Mimic(b, model.names[1], 3.0, -0.2)]
    made = with_mimics(model, rules)
    assert shortened(made, [0.5, 1.3, 2.7], check=True) == pytest.approx([0.5])


pytestmark = pytest.mark.filterwarnings("ignore::sphshell_pin.errors.UnitWarning")


@dataclass(frozen=True)
class Tree:
    """A random tree, and the rules by which some of its joints mimic others."""

    free: pin.Model
    model: pin.Model

    def expanded(self, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Return q and v of all joints, and G (nv of all joints, nv)."""
        rules = mimics(self.model)
        q_all, matrix = np.zeros(self.free.nq), np.zeros((self.free.nv, self.model.nv))
        for name in list(self.free.names)[1:]:
            rule = rules.get(name, Mimic(name, name))
            joint = self.free.joints[self.free.getJointId(name)]
            leader = self.model.joints[self.model.getJointId(rule.of)]
            q_all[joint.idx_q] = rule.ratio * q[leader.idx_q] + rule.offset
            matrix[joint.idx_v, leader.idx_v] = rule.ratio
        return q_all, matrix @ v, matrix

    def energy(self, q: Array, v: Array) -> float:
        """Kinetic energy of the free model."""
        moved = self.expanded(q, v)[:2]
        return float(pin.computeKineticEnergy(self.free, self.free.createData(), *moved))

    def mass_and_bias(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return what recursive Newton-Euler says of the free model."""
        q_all, v_all, matrix = self.expanded(q, v)
        data = self.free.createData()
        bias = pin.rnea(self.free, data, q_all, v_all, np.zeros(self.free.nv))
        columns = [pin.rnea(self.free, data, q_all, v_all, one) - bias for one in matrix.T]
        mass = matrix.T @ np.stack(columns, axis=1) + np.diag(self.model.armature)
        return mass, matrix.T @ bias


def random_tree(rng: np.random.Generator) -> Tree:
    """Return a tree of 3 to 8 joints, each on any joint before it, of which about half mimic."""
    n = int(rng.integers(3, 9))
    free = pin.Model()
    for j in range(1, n + 1):
        placement = pin.SE3.Random()
        placement.translation = rng.uniform(-0.2, 0.2, 3)
        kind = pin.JointModelRZ() if rng.random() < 0.7 else pin.JointModelPX()
        joint = free.addJoint(int(rng.integers(0, j)), kind, placement, f"j{j}")
        free.addJointFrame(joint)
        inertia = pin.Inertia.FromBox(rng.uniform(0.5, 2.0), *rng.uniform(0.05, 0.3, 3))
        body = pin.SE3.Random()
        body.translation = rng.uniform(-0.1, 0.1, 3)
        free.appendBodyToJoint(joint, inertia, body)
        free.addFrame(pin.Frame(f"tip{j}", joint, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    order = rng.permutation(n) + 1
    rules = []
    for k, one in enumerate(order[1:], 1):
        if rng.random() < 0.5:
            followed, ratio = rng.choice(order[:k]), rng.uniform(0.3, 2) * rng.choice([-1, 1])
            rules.append(Mimic(f"j{one}", f"j{followed}", ratio, 0.1))
    return Tree(free, with_mimics(free, rules))


@pytest.mark.parametrize("seed", mostly_studies(range(1500), lambda seed: seed < 60))
def test_accelerations_of_random_trees_are_those_of_recursive_newton_euler(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    scene, nv = sp.Scene(tree.model), tree.model.nv
    for q, v, tau in rng.uniform(-1, 1, (2, 3, nv)):
        mass, bias = tree.mass_and_bias(q, v)
        expected = np.linalg.solve(mass, tau - bias)
        found = scene._binding.rates(q, v, np.zeros(0), tau)[:nv]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * abs(expected).max())


@pytest.mark.parametrize("seed", range(8))
def test_energy_forces_and_derivatives_use_the_same_mass(seed: int) -> None:
    rng = np.random.default_rng([3, seed])
    tree = random_tree(rng)
    model = tree.model
    tip = list(model.names)[-1].replace("j", "tip")
    scene = sp.Scene(model)
    law, friction = sp.ImpactLaw(100.0, 1.5, 1.0, 0.1), sp.CoulombFriction(0.3, 0.2, 0.1, 1.0)
    scene.add_contact(sp.Sphere(5.0, tip), models.square(20.0), law=law, friction=friction)
    q, v, tau = (rng.uniform(-1, 1, model.nv) for _ in range(3))
    testing.assert_forces_balance(scene, q, v, tau, tolerance=1e-8)
    testing.assert_derivatives(scene, q, v, tau)
    # Kinetic energy: the sum over the bodies of the model in which all joints move freely.
    assert 0.5 * v @ mass_matrix(model, q) @ v == pytest.approx(tree.energy(q, v), rel=1e-12)
    free = sp.Scene(model)
    run = models.run(free, sp.Adaptive(1e-9, 1e-11), q, 0.1 * v, 0.05, record_dt=0.025)
    for row, rate, kinetic in zip(run.q, run.v, run.energy.kinetic, strict=True):
        assert kinetic == pytest.approx(tree.energy(row, rate), rel=1e-9)
    assert abs(run.energy.residual).max() <= 1e-6 * max(run.energy.exchanged, 1e-9)
