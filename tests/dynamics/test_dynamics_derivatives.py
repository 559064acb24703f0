"""Derivatives of the accelerations by q, v, tau and all numbers of the contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import sphshell_pin as sp
from tests import differences, meshes, models
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.dynamics.test_contact_derivatives import (
    ARM_V,
    BRISTLES,
    FRICTIONS,
    assert_rate_jacobian,
    bowl,
    free_ball,
    left_out,
    stretched,
    three_contacts,
    turned,
)
from tests.dynamics.test_contact_derivatives import LAWS as OLD_LAWS
from tests.dynamics.test_external_forces import CASES, Case
from tests.dynamics.test_mimic import CASES as MIMIC
from tests.dynamics.test_mimic import with_contact
from tests.dynamics.test_two_spheres import in_touch, two_spheres
from tests.models import ARM_Q, free_q, two_free_bodies, two_free_state

Array = NDArray[np.float64]
State = tuple[sp.Scene, Array, Array]

DEPTHS = 0.1 * np.linspace(0.0, 1.0, 300) ** 2
LAWS: dict[str, sp.NormalLaw] = {
    **OLD_LAWS,
    "hertz": sp.HertzLaw(1e6, 0.3),
    "hertz, two materials": sp.HertzLaw(1e6, 0.3, 3e6, 0.45, restitution=0.7, speed=0.4),
    "hertz, loss tangent": sp.HertzLaw(1e6, 0.3, loss_tangent=0.2, frequency=5.0),
    "hertz of a plane": sp.HertzLaw(1e6, 0.3, 3e6, 0.45, radius=0.05),
    "foundation": sp.FoundationLaw(1e5, 0.05, 0.3),
    "table": sp.TableLaw(DEPTHS, 4e4 * DEPTHS**1.5),
}
COULOMB = FRICTIONS["coulomb"]
BRISTLE = sp.BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05)


def arm_on(shell: sp.Shell, point: Array, normal: Array, law, friction, **more) -> State:  # type: ignore[no-untyped-def]
    """An arm whose tip, off its frame's origin, is 5 mm deep at a point of the shell."""
    scene = sp.Scene(models.arm(), **more)
    data, offset = scene.model.createData(), np.array([0.01, -0.02, 0.015])
    pin.framesForwardKinematics(scene.model, data, ARM_Q)
    center = data.oMf[scene.model.getFrameId("ball")] * offset
    turn = meshes.random_rotation(3)
    place = pin.SE3(turn, center - turn @ (point + (0.05 - 0.005) * normal))
    sphere = sp.Sphere(0.05, "ball", tuple(offset.tolist()))
    scene.add_contact(sphere, shell, placement=place, law=law, friction=friction, name="tip")
    return scene, ARM_Q, ARM_V


def in_bowl(law, friction, **more) -> State:  # type: ignore[no-untyped-def]
    return arm_on(*bowl(), law, friction, **more)


def moving(law, friction) -> State:  # type: ignore[no-untyped-def]
    """A ball on a plate; both are free, and spin fast."""
    return two_free_bodies(law, friction), *two_free_state()


def assert_derivatives(
    scene: sp.Scene, q: Array, v: Array, *, tolerance: float = 1e-6, depth: float | None = None
) -> sp.DynamicsDerivatives:
    """Every column against differences of ABA, relative to the column's largest entry.

    The contact forces F alone are differentiated by `contact_derivatives`: of F = rnea(q, v, a) -
    tau that is exact algebra.
    """
    model = scene.model
    tau = np.random.default_rng(1).normal(size=model.nv)
    names = differences.names_of(scene)
    got = scene.dynamics_derivatives(q, v, tau, parameters=names)
    expected = differences.acceleration(scene, q, v, tau)
    np.testing.assert_allclose(got.acceleration, expected, rtol=0, atol=1e-9 * abs(expected).max())
    depth = differences.depth_of(scene, q, v) if depth is None else depth
    fast = max(float(np.abs(v).max(initial=0.0)), 1e-2)

    def a(scene: sp.Scene = scene, q: Array = q, v: Array = v, tau: Array = tau) -> Array:
        return differences.acceleration(scene, q, v, tau)

    blocks = {
        "q": (got.by_q, lambda e, x: a(q=pin.integrate(model, q, x * e)), depth),
        "v": (got.by_v, lambda e, x: a(v=v + x * e), fast),
        "tau": (got.by_tau, lambda e, x: a(tau=tau + x * e), 1.0),
    }
    errors = {}
    for block, (matrix, f, scale) in blocks.items():
        assert matrix.shape == (model.nv, model.nv)
        for k, e in enumerate(np.eye(model.nv)):
            floor = 1e-2 * float(np.abs(matrix).max())
            errors[f"{block}.{k}"] = differences.off(
                matrix[:, k], lambda x, e=e, f=f: f(e, x), scale, floor=floor, tolerance=tolerance
            )
    columns = [column for name in names for column in differences.columns_of(name)]
    assert list(got.parameters) == columns
    assert got.by_parameters.shape == (model.nv, len(columns))
    # Along the surface a place may not matter, and rounding is that of the others.
    places = [k for k, column in enumerate(columns) if differences.is_place(column)]
    among = 1e-2 * float(np.abs(got.by_parameters[:, places]).max(initial=0.0))
    for k, column in enumerate(columns):
        floor = among if k in places else 0.0
        errors[column] = differences.by_number(
            got.by_parameters[:, k], a, scene, column, depth, tolerance=tolerance, floor=floor
        )
    wrong = {name: error for name, error in errors.items() if not error <= tolerance}
    assert not wrong
    supports = model.supports.tolist()
    depth_first = all(model.parents[j] in supports[j - 1] for j in range(1, model.njoints))
    if depth_first and not (scene.joints.kinds() or list(model.mimicking_joints)):
        data = model.createData()
        pin.computeRNEADerivatives(model, data, q, v, got.acceleration)
        inertia = np.triu(data.M) + np.triu(data.M, 1).T
        whole = data.dtau_dq + inertia @ got.by_q, data.dtau_dv + inertia @ got.by_v
        size = max(np.abs(one).max() for one in (*whole, data.dtau_dq, data.dtau_dv))
        for of_force, by in zip(scene.contact_derivatives(q, v), whole, strict=True):
            np.testing.assert_allclose(of_force, by, rtol=0, atol=1e-10 * size)
    return got


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("make", [in_bowl, moving])
def test_every_law(make: Callable[..., State], law: str) -> None:
    scene, q, v = make(LAWS[law], COULOMB)
    assert len(scene.contacts(q, v)) == 1
    got = assert_derivatives(scene, q, v)
    assert np.abs(got.by_parameters).max() > 1.0


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("make", [in_bowl, moving])
def test_every_friction(make: Callable[..., State], friction: str) -> None:
    scene, q, v = make(LAWS["impact"], FRICTIONS[friction])
    assert_derivatives(scene, q, v)


@pytest.mark.parametrize("friction", ["soft finger", "mindlin", "rings"])
def test_friction_on_the_ellipses_of_hertz(friction: str) -> None:
    """Mindlin's disc follows the curvature of the shell, with its slopes."""
    law = sp.HertzLaw(1e5, 0.3, restitution=0.8, speed=1.0)
    for name in ("dome", "torus inside", "wavy above"):
        scene = free_ball(shell_of(name, 0.6), friction=friction, name="ball")
        scene.replace_pair("ball", law=law)
        q = turned(free_q(SURFACES[name].probes(1, 0.04, seed=3)[0][0]), 1)
        v = 0.3 * np.random.default_rng(3).normal(size=6)
        assert_derivatives(scene, q, v)
        assert_rate_jacobian(scene, q, v, stretched(scene, 1e-4), turning=1e-2)


@pytest.mark.parametrize("method", ["smooth", "facets"])
@pytest.mark.parametrize("surface", ["dome", "torus inside", "wavy above"])
def test_both_methods_on_curved_surfaces(surface: str, method: str) -> None:
    scene = free_ball(shell_of(surface, 0.6), friction="coulomb", method=method, name="ball")
    for seed, center in enumerate(SURFACES[surface].probes(2, 0.04, seed=3)[0]):
        v = 0.3 * np.random.default_rng(seed).normal(size=6)
        assert_derivatives(scene, turned(free_q(center), seed), v)


@pytest.mark.parametrize("method", ["smooth", "facets"])
@pytest.mark.parametrize("center", [[1.2, 1.15, 0.1], [1.2, 1.2, 1.1], [0.2, 0.3, 1.9]])
def test_at_edges_and_corners(center: list[float], method: str) -> None:
    shell = sp.Shell(*meshes.cube(2.0))
    scene = free_ball(shell, friction="coulomb", method=method, name="ball")
    assert_derivatives(scene, turned(free_q(center), 2), np.full(6, 0.1))


def test_several_contacts_of_one_pair_and_their_saddle() -> None:
    scene, q, v = three_contacts("coulomb")
    assert len(scene.contacts(q, v)) == 3
    assert_derivatives(scene, q, v)


@pytest.mark.parametrize(("friction", "tolerance"), [("none", 1e-6), ("coulomb", 1e-5)])
def test_a_cluster_shown_as_one(friction: str, tolerance: float) -> None:
    """With friction it acts as one contact, right but for the square of the normals' angle."""
    shell = sp.Shell(*meshes.v_groove(np.radians(0.1), size=8.0, cells=2), crease_angle=1e-5)
    scene = free_ball(shell, friction=friction, name="ball")
    found = shell.contacts(np.array([4e-4, 0.3, 0.97]), 1.0)
    assert (found.weight.tolist(), found.terms.weight.tolist()) == ([1.0], [1.0, 1.0, -1.0])
    # What merges changes on the distance from the edge.
    q, v = free_q([4e-4, 0.3, 0.97]), np.full(6, 0.1)
    assert_derivatives(scene, q, v, depth=4e-4, tolerance=tolerance)


@pytest.mark.parametrize("law", ["impact", "hertz, two materials"])
@pytest.mark.parametrize("friction", FRICTIONS)
def test_two_spheres(law: str, friction: str) -> None:
    scene = two_spheres(LAWS[law], FRICTIONS[friction])
    got = assert_derivatives(scene, *in_touch(3))
    assert "balls.other_sphere.offset.z" in got.parameters
    assert not [name for name in got.parameters if "placement" in name]
    if law == "impact" and friction in BRISTLES:
        z, turning = stretched(scene, 2e-6), left_out(friction, 1e-2)
        assert_rate_jacobian(scene, *in_touch(4, spin=2.0), z, turning=turning)


def test_two_pairs_that_touch_at_once() -> None:
    """Of each pair's numbers the column is its own."""
    scene, q, v = in_bowl(LAWS["impact"], COULOMB)
    data = scene.model.createData()
    pin.framesForwardKinematics(scene.model, data, q)
    tip = data.oMf[scene.model.getFrameId("ball")]
    place = pin.SE3(meshes.random_rotation(8), tip.translation)
    plate = models.plate()
    scene.add_contact(
        sp.Sphere(0.04, "ball", (0.02, 0.0, 0.01)),
        plate,
        placement=place,
        law=LAWS["hertz"],
        friction=FRICTIONS["soft finger"],
        name="second",
    )
    assert len(scene.contacts(q, v)) == 2
    assert_derivatives(scene, q, v)


@pytest.mark.parametrize(("joint_i", "joint_j", "tree", "seed"), CASES[::8])
def test_chains_of_joints(joint_i: str, joint_j: str, tree: str, seed: int) -> None:
    """Free-flyers, spherical and continuous joints; the shell moves as well."""
    case = Case(joint_i, joint_j, tree, seed)
    assert_derivatives(case.scene, case.q, case.v)


@pytest.mark.parametrize("name", MIMIC)
def test_mimic_joints(name: str) -> None:
    make, tip, other = MIMIC[name]
    scene = with_contact(make()[0], tip, other)
    # Less deep: the fingers push each other with less force than moves them.
    scene = differences.changed(scene, f"{scene.pairs[0].name}.placement.vz", -0.45)
    rng, nv = np.random.default_rng(3), scene.model.nv
    for _ in range(2):
        q, v = rng.uniform(-0.3, 0.3, scene.model.nq), 0.1 * rng.normal(size=nv)
        assert len(scene.contacts(q, v)) == 1
        assert_derivatives(scene, q, v)


STOPS = sp.JointComponents(
    limits={"two_joint": sp.JointLimits(-1.0, 1.5, sp.HuntCrossleyLaw(80.0, 1.3, 0.4))},
    damping={"one_joint": 0.2, "two_joint": 0.1},
    friction={"ball_joint": sp.JointFriction(0.5, stiffness=30.0, damping=0.4)},
    armature={"ball_joint": 0.03},
)


def test_joint_components() -> None:
    """In a stop, with damping, armature and dry friction; ARM_Q is 0.1 rad beyond the range."""
    scene, q, v = in_bowl(LAWS["impact"], COULOMB, joints=STOPS)
    assert scene.joint_forces(q, v)[1] < -1.0
    assert_derivatives(scene, q, v)


def test_locked_joints() -> None:
    scene = sp.Scene(models.arm(), lock=["one_joint"], q_lock=ARM_Q)
    data = scene.model.createData()
    pin.framesForwardKinematics(scene.model, data, ARM_Q[1:])
    tip = data.oMf[scene.model.getFrameId("ball")].translation
    place = pin.SE3(np.eye(3), tip - np.array([0.0, 0.0, 0.045]))
    sphere = sp.Sphere(0.05, "ball")
    scene.add_contact(
        sphere, models.plate(), placement=place, law=LAWS["impact"], friction=COULOMB, name="tip"
    )
    got = assert_derivatives(scene, ARM_Q[1:], ARM_V[1:])
    assert got.by_q.shape == (2, 2)


def test_only_the_shell_moves() -> None:
    model = models.ball()
    scene = sp.Scene(model)
    fixed = sp.Sphere(0.05, "universe", (0.1, 0.2, 0.04))
    scene.add_contact(fixed, models.plate(), "ball", law=LAWS["impact"], friction=COULOMB, name="c")
    move = np.array([0.1, 0.1, 0, 0.1, -0.05, 1])
    q = pin.integrate(model, free_q([0.0, 0.0, 0.0]), move)
    assert len(scene.contacts(q, np.full(6, 0.1))) == 1
    assert_derivatives(scene, q, np.full(6, 0.1))


def test_nothing_touches() -> None:
    """Then they are Pinocchio's own, to the last bits, and no parameter matters."""
    scene = two_free_bodies(LAWS["impact"], COULOMB)
    q, v = two_free_state(depth=-0.2)
    model, data, tau = scene.model, scene.model.createData(), np.arange(12.0)
    got = scene.dynamics_derivatives(q, v, tau, parameters=differences.names_of(scene))
    pin.computeABADerivatives(model, data, q, v, tau)
    minv = np.triu(data.Minv) + np.triu(data.Minv, 1).T
    for found, expected in (
        (got.acceleration, data.ddq),
        (got.by_q, data.ddq_dq),
        (got.by_v, data.ddq_dv),
        (got.by_tau, minv),
    ):
        size = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * size)
    assert not got.by_parameters.any()


def test_a_scene_without_contacts() -> None:
    scene = sp.Scene(models.arm())
    got = scene.dynamics_derivatives(ARM_Q, ARM_V)
    assert got.by_parameters.shape == (3, 0)
    assert tuple(got.parameters) == ()
    assert_derivatives(scene, ARM_Q, ARM_V)


def stuck(
    friction: sp.BristleFriction | sp.MindlinFriction = BRISTLE,
) -> tuple[State, sp.SceneState]:
    """An arm whose bristles have been stretched by ten steps, far below the limit."""
    scene, q, v = arm_on(
        models.plate(), np.zeros(3), np.array([0.0, 0.0, 1.0]), LAWS["undamped"], friction
    )
    v = 0.01 * v
    state = scene.state(q, v)
    for _ in range(10):
        state.advance(q, v, 5e-3)
    return (scene, q, v), state


def test_bristles_of_a_state() -> None:
    """Their stretch is held, in the shell's frame: by all numbers, the shell's place too."""
    (scene, q, v), state = stuck()
    model, tau, names = scene.model, np.array([0.3, -0.2, 0.1]), differences.names_of(scene)
    got = scene.dynamics_derivatives(q, v, tau, parameters=names, state=state)
    without = scene.dynamics_derivatives(q, v, tau, parameters=names)
    assert np.abs(got.acceleration - without.acceleration).max() > 0.1
    # At rest the force along the plate is that of the springs alone.
    resting = scene.contacts(q, np.zeros(3), state=state)
    force, normal = resting.force_world[0], resting.normal_world[0]
    along = force - normal * (normal @ force)
    z = np.zeros(scene._binding.bristle_size)
    z[:3] = -scene.pairs[0].placement.rotation.T @ along / BRISTLE.stiffness
    expected = differences.acceleration(scene, q, v, tau, state)
    scale = np.abs(expected).max()
    found = scene._binding.rates(q, v, z, tau)[:3]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(got.acceleration, expected, rtol=0, atol=1e-9 * scale)
    depth, errors = differences.depth_of(scene, q, v), {}
    for k, e in enumerate(np.eye(3)):
        errors[f"q.{k}"] = differences.off(
            got.by_q[:, k],
            lambda x, e=e: differences.acceleration(
                scene, pin.integrate(model, q, x * e), v, tau, state
            ),
            depth,
        )
        errors[f"v.{k}"] = differences.off(
            got.by_v[:, k],
            lambda x, e=e: differences.acceleration(scene, q, v + x * e, tau, state),
            0.01,
        )
    for k, column in enumerate(got.parameters):
        errors[column] = differences.by_number(
            got.by_parameters[:, k],
            lambda scene: scene._binding.rates(q, v, z, tau)[:3],
            scene,
            column,
            depth,
        )
    assert max(errors.values()) <= 1e-6, errors


def test_a_state_without_stretch_is_none() -> None:
    scene, q, v = in_bowl(LAWS["impact"], BRISTLE)
    names = differences.names_of(scene)
    one = scene.dynamics_derivatives(q, v, parameters=names)
    other = scene.dynamics_derivatives(q, v, parameters=names, state=scene.state(q, v))
    for name in ("acceleration", "by_q", "by_v", "by_tau", "by_parameters"):
        size = np.abs(getattr(one, name)).max()
        np.testing.assert_allclose(
            getattr(other, name), getattr(one, name), rtol=0, atol=1e-12 * size
        )


GEARS = ("law.stiffness", "friction.mu_static")


def source_scene() -> State:
    """A contact source has a law and friction, and neither sphere nor placement."""
    scene = sp.Scene(models.ball())

    def find(
        pose_i: pin.SE3, pose_j: pin.SE3
    ) -> tuple[list[Array], list[list[float]], list[float]]:
        depth = 0.05 - pose_i.translation[2]
        return [pose_i.translation - [0, 0, 0.05]], [[0.0, 0.0, 1.0]], [depth]

    scene.add_contact_source(
        find, "ball", "universe", law=LAWS["impact"], friction=COULOMB, name="own"
    )
    return scene, free_q([0.0, 0.0, 0.045]), np.full(6, 0.1)


def test_a_contact_source() -> None:
    scene, q, v = source_scene()
    assert [name for name in differences.names_of(scene) if "placement" in name] == []
    got = scene.dynamics_derivatives(q, v, parameters=[f"own.{name}" for name in GEARS])
    for k, name in enumerate(GEARS):
        error = differences.by_number(
            got.by_parameters[:, k],
            lambda scene: differences.acceleration(scene, q, v, np.zeros(6)),
            scene,
            f"own.{name}",
            1.0,
        )
        assert error <= 1e-6
