"""External forces through ABA are J^T f of forces by plain vectors, for every joint type."""

from itertools import product

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import CoulombFriction, ImpactLaw, Scene, Shell, Sphere, testing
from tests import meshes
from tests.models import JOINTS, TURNING, add_body, empty
from tests.oracle import laws, mechanics

RADIUS, DEPTH = 0.08, 0.01
K, E, C, D = 5e4, 1.5, 30.0, 2e-3
FRICTION = CoulombFriction(0.4, 0.2, 0.5, 3.0)


def normal_force(depth: float, gap_rate: float) -> float:
    return laws.impact(-depth, gap_rate, 0.0, K, E, C, D)


def coefficient(slip: float) -> float:
    return laws.coulomb(slip, 0.4, 0.2, 0.5, 3.0)


class Case:
    """Two bodies on their joints; a plate on body j so placed that body i's sphere is in it."""

    def __init__(self, joint_i: str, joint_j: str, tree: str, seed: int) -> None:
        rng = np.random.default_rng(seed)
        model = empty()

        def inertia() -> pin.Inertia:
            lump = pin.Inertia.Random()
            return pin.Inertia(rng.uniform(0.5, 2.0), rng.uniform(-0.1, 0.1, 3), lump.inertia)

        def somewhere() -> pin.SE3:
            return pin.SE3(meshes.random_rotation(rng.integers(10**6)), rng.uniform(-0.5, 0.5, 3))

        base = add_body(model, "base", pin.JointModelRY(), inertia=inertia())
        parents = {"apart": (base, 0), "siblings": (base, base), "chain": (None, base)}[tree]

        def add(name: str, joint: str, parent: int) -> int:
            places = {"placement": somewhere(), "inertia": inertia(), "frame": somewhere()}
            return add_body(model, name, (JOINTS | TURNING)[joint](), parent, **places)

        self.j = add("shell_body", joint_j, parents[1])
        self.i = add("tip", joint_i, self.j if parents[0] is None else parents[0])
        self.q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
        self.v = rng.normal(size=model.nv)
        self.tau = rng.normal(size=model.nv)
        data = model.createData()
        pin.forwardKinematics(model, data, self.q, self.v)
        pin.updateFramePlacements(model, data)
        offset = rng.uniform(-0.1, 0.1, 3)
        center = data.oMf[model.getFrameId("tip")] * offset
        rotation = meshes.random_rotation(seed + 7)
        self.normal = rotation[:, 2]
        self.point = center - (RADIUS - DEPTH) * self.normal
        pose = pin.SE3(rotation, self.point - rotation @ np.append(rng.uniform(-0.1, 0.1, 2), 0.0))
        self.motions = [mechanics.world_motion(model, data, k) for k in (self.i, self.j)]
        relative = [mechanics.point_velocity(motion, self.point) for motion in self.motions]
        if self.normal @ (relative[0] - relative[1]) > 0:  # closing keeps the law off its clamp
            self.v = -self.v
            self.motions = [-motion for motion in self.motions]
        self.model, self.data = model, data
        place = data.oMf[model.getFrameId("shell_body")].actInv(pose)
        shell = Shell(*meshes.random_plate(50, seed=seed, slivers=False))
        self.scene = Scene(model)
        more = {"law": ImpactLaw(K, E, C, D), "friction": FRICTION, "method": "facets"}
        self.scene.add_contact(Sphere(RADIUS, "tip", offset), shell, "shell_body", place, **more)
        forces = {"normal_force": normal_force, "coefficient": coefficient}
        where = self.point, self.normal, DEPTH
        self.force = mechanics.force_on_i(*where, *self.motions, **forces)


TREES = ("apart", "siblings", "chain")
CASES = [(*case, seed) for seed, case in enumerate(product(JOINTS, JOINTS, TREES))]


@pytest.mark.parametrize(("joint_i", "joint_j", "tree", "seed"), CASES)
def test_aba_with_external_forces(joint_i: str, joint_j: str, tree: str, seed: int) -> None:
    case = Case(joint_i, joint_j, tree, seed)
    assert np.linalg.norm(case.force) > 1.0
    testing.assert_forces_balance(case.scene, case.q, case.v, case.tau, tolerance=1e-10)
    testing.assert_wrenches_cancel(case.scene, case.q, case.v, tolerance=1e-10)
    contacts = case.scene.contacts(case.q, case.v)
    assert contacts.depth == pytest.approx([DEPTH], abs=1e-12)
    assert contacts.point_world == pytest.approx(case.point[None], abs=1e-12)
    assert contacts.normal_world == pytest.approx(case.normal[None], abs=1e-11)
    velocities = [mechanics.point_velocity(motion, case.point) for motion in case.motions]
    slip = velocities[0] - velocities[1]
    rate = slip @ case.normal
    assert contacts.slip_velocity_world[0] == pytest.approx(slip - rate * case.normal, abs=1e-10)
    assert contacts.normal_force == pytest.approx([normal_force(DEPTH, rate)], rel=1e-10)
    force = contacts.normal_force[0] * case.normal + contacts.friction_force_world[0]
    assert force == pytest.approx(case.force, rel=1e-9, abs=1e-9)
