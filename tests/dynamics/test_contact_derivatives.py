"""Derivatives of the contact forces and of the equations of motion, against differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from sphshell_pin import (
    BristleFriction,
    CoulombFriction,
    HuntCrossleyLaw,
    ImpactLaw,
    Scene,
    Shell,
    Sphere,
)
from tests import meshes, models
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.dynamics.test_external_forces import CASES, Case

Array = NDArray[np.float64]

LAWS = {
    "undamped": ImpactLaw(4e3, 1.5),
    "impact": ImpactLaw(4e4, 1.5, 20.0, 2e-2),
    "impact, exponent 2.2": ImpactLaw(1e6, 2.2, 20.0, 2e-3),
    "hunt-crossley": HuntCrossleyLaw(4e4, 1.5, 0.5),
}
FRICTIONS = {
    "none": None,
    "coulomb": CoulombFriction(0.3, 0.1, 0.1, 1.0),
    "bristle": BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05),
    "soft finger": BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05, torsional=True),
    "mindlin": BristleFriction.mindlin(
        0.5,
        0.3,
        5e3,
        0.3,
        2e4,
        0.45,
        v_stribeck=0.05,
        damping_time=3e-3,
        torsional=True,
        rolling=0.1,
        rolling_speed=0.2,
    ),
    "rings": BristleFriction.mindlin(0.5, 0.3, 5e3, 0.3, v_stribeck=0.05, torsional=True, rings=3),
    "many rings": BristleFriction.mindlin(
        0.5, 0.3, 5e3, 0.3, damping_time=1e-3, rolling=0.1, rings=7
    ),
}
BRISTLES = ["bristle", "soft finger", "mindlin", "rings", "many rings"]


def differences(
    f: Callable[[Array, Array], Array], model: pin.Model, q: Array, v: Array, step: float
) -> tuple[Array, Array]:
    """Central differences of f(q, v), by the tangent of q and by v."""
    moves = step * np.eye(model.nv)
    by_q = [f(pin.integrate(model, q, u), v) - f(pin.integrate(model, q, -u), v) for u in moves]
    by_v = [f(q, v + u) - f(q, v - u) for u in moves]
    return np.transpose(by_q) / (2 * step), np.transpose(by_v) / (2 * step)


def generalised_force(scene: Scene, q: Array, v: Array) -> Array:
    model, data = scene.model, scene.model.createData()
    forces = scene.external_forces(q, v)
    pin.computeJointJacobians(model, data, q)
    total = np.zeros(model.nv)
    for joint in range(1, model.njoints):
        total += pin.getJointJacobian(model, data, joint, pin.LOCAL).T @ forces[joint].vector
    return total


def assert_close(
    got: Array, expected: Array, tolerance: float = 1e-6, rounding: float = 0.0
) -> None:
    """Each column right to the tolerance of its own size, or of a hundredth of the whole's."""
    sizes = np.abs(expected).max(axis=0) + 1e-2 * np.abs(expected).max()
    assert got.shape == expected.shape
    assert (np.abs(got - expected).max(axis=0) <= tolerance * sizes + rounding).all()


def assert_derivatives(scene: Scene, q: Array, v: Array, step: float = 1e-6) -> None:
    def force(q: Array, v: Array) -> Array:
        return generalised_force(scene, q, v)

    got = scene.contact_derivatives(q, v)
    expected = differences(force, scene.model, q, v, step)
    assert np.abs(expected[0]).max() > 1
    for g, e in zip(got, expected, strict=True):
        assert_close(g, e)


def assert_rate_jacobian(
    scene: Scene, q: Array, v: Array, z: Array, *, step: float = 1e-6, turning: float = 1e-6
) -> None:
    """`turning`: tolerance of how the bristles' rates change with q."""
    core, model, nv = scene._binding, scene.model, scene.model.nv
    tau = np.random.default_rng(1).normal(size=nv)
    by_q, by_v = differences(lambda q, v: core.rates(q, v, z, tau), model, q, v, step)
    got = core.rate_jacobian(q, v, z, tau)
    assert got.shape == (nv + len(z), 2 * nv + len(z))
    assert_close(got[:nv, :nv], by_q[:nv])
    assert_close(got[:nv, nv : 2 * nv], by_v[:nv])
    if len(z) == 0:
        return
    assert_close(got[nv:, :nv], by_q[nv:], turning)
    # Far over the limit a stretch gives way at a rate that is large against what differences it.
    rounding = 50 * np.finfo(float).eps * np.abs(core.rates(q, v, z, tau)[nv:]).max() / step
    assert_close(got[nv:, nv : 2 * nv], by_v[nv:], rounding=rounding)
    step = 1e-4 * np.abs(z).max()
    moves = step * np.eye(len(z))
    changes = [core.rates(q, v, z + u, tau) - core.rates(q, v, z - u, tau) for u in moves]
    by_z = np.transpose(changes) / (2 * step)
    assert np.abs(by_z[:nv]).max() > 1
    assert_close(got[:nv, 2 * nv :], by_z[:nv])
    assert np.abs(got[nv:, 2 * nv :] - by_z[nv:]).max() <= 1e-6 * max(1.0, np.abs(by_z[nv:]).max())


def turned(q: Array, seed: int) -> Array:
    """A free-flyer's configuration turned about its own origin."""
    axis = np.random.default_rng(seed).normal(size=3)
    return np.asarray(pin.integrate(models.ball(), q, np.concatenate([np.zeros(3), axis])))


def free_ball(shell: Shell, law: str = "impact", friction: str = "none", **more: object) -> Scene:
    """Free ball of radius one."""
    scene = Scene(models.ball(radius=1.0))
    scene.add_contact(
        sphere=Sphere(1.0, frame="ball"),
        shell=shell,
        law=LAWS[law],
        friction=FRICTIONS[friction],
        **more,  # type: ignore[arg-type]
    )
    return scene


def arm_on(shell: Shell, point: Array, normal: Array, law: str, friction: str) -> Scene:
    """Arm whose tip is 5 mm deep at a point of the shell with this normal."""
    model, data = models.arm(), models.arm().createData()
    pin.framesForwardKinematics(model, data, models.ARM_Q)
    tip = data.oMf[model.getFrameId("ball")].translation
    rotation = meshes.random_rotation(3)
    place = pin.SE3(rotation, tip - rotation @ (point + (0.05 - 0.005) * normal))
    scene = Scene(model)
    scene.add_contact(
        sphere=Sphere(0.05, frame="ball"),
        shell=shell,
        placement=place,
        law=LAWS[law],
        friction=FRICTIONS[friction],
    )
    return scene


def bowl() -> tuple[Shell, Array, Array]:
    """Bowl of radius 2 with its exact normals, a point on it and the normal there."""
    vertices, triangles = meshes.bowl()
    normals = (np.array([0.0, 0.0, 2.0]) - vertices) / 2
    place = np.array([0.11, -0.07, 2 - np.sqrt(4 - 0.11**2 - 0.07**2)])
    return Shell(vertices, triangles, normals=normals), place, (np.array([0, 0, 2.0]) - place) / 2


ARM_V = np.array([0.3, 0.2, -0.4])


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("law", LAWS)
def test_arm_on_a_plate(law: str, friction: str) -> None:
    scene = arm_on(models.plate(), np.zeros(3), np.array([0.0, 0.0, 1.0]), law, friction)
    assert_derivatives(scene, models.ARM_Q, ARM_V)


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("surface", SURFACES)
def test_ball_on_curved_surfaces(surface: str, friction: str) -> None:
    scene = free_ball(shell_of(surface, 0.6), friction=friction)
    for seed, center in enumerate(SURFACES[surface].probes(3, 0.04, seed=3)[0]):
        v = 0.3 * np.random.default_rng(seed).normal(size=6)
        assert_derivatives(scene, turned(models.free_q(center), seed), v)


def three_contacts(friction: str) -> tuple[Scene, Array, Array]:
    """Two contacts in a shallow groove and the pass between them."""
    shell = Shell(*meshes.v_groove(np.radians(5), size=8.0, cells=2), crease_angle=0.01)
    scene = free_ball(shell, friction=friction)
    return (
        scene,
        turned(models.free_q([0.03, 0.3, 0.97]), 1),
        0.1 * np.array([1.0, 2, -3, 2, -1, 1]),
    )


@pytest.mark.parametrize("friction", FRICTIONS)
def test_with_a_saddle(friction: str) -> None:
    scene, q, v = three_contacts(friction)
    contacts = scene.contacts(q, v)
    assert np.sign(contacts.normal_force).tolist() == [1, 1, -1]
    assert_derivatives(scene, q, v, step=1e-7)


def test_pushed_back_through_a_sheet() -> None:
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    shell = Shell(vertices, elements, normals=normals, side="outside")
    points, outward = SURFACES["dome"].points(np.random.default_rng(4), 3)
    scene = free_ball(shell, friction="coulomb")
    for center in points - 0.1 * outward:
        assert_derivatives(scene, turned(models.free_q(center), 1), np.full(6, 0.1))


@pytest.mark.parametrize(("joint_i", "joint_j", "tree", "seed"), CASES[::4])
def test_chains_of_joints(joint_i: str, joint_j: str, tree: str, seed: int) -> None:
    case = Case(joint_i, joint_j, tree, seed)
    assert_derivatives(case.scene, case.q, case.v)
    # The joints of "apart" are not in depth-first order.
    assert_rate_jacobian(case.scene, case.q, case.v, np.zeros(0))


def composite() -> pin.JointModelComposite:
    joint = pin.JointModelComposite(2)
    turn = pin.SE3(meshes.random_rotation(1), np.array([0.1, 0.2, 0.3]))
    joint.addJoint(pin.JointModelRX(), turn)
    joint.addJoint(pin.JointModelTranslation(), turn)
    return joint


TURNING: dict[str, Callable[[], object]] = {
    "spherical zyx": pin.JointModelSphericalZYX,
    "universal": lambda: pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]),
    "composite": composite,
    "planar": pin.JointModelPlanar,
}


@pytest.mark.parametrize("tree", ["apart", "siblings", "chain"])
@pytest.mark.parametrize("joint", TURNING)
def test_joints_whose_axes_turn(joint: str, tree: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(models.JOINTS, joint, TURNING[joint])
    for seed, (i, j) in enumerate([(joint, "prismatic"), ("spherical", joint), (joint, joint)]):
        case = Case(i, j, tree, seed)
        assert_derivatives(case.scene, case.q, case.v)
        assert_rate_jacobian(case.scene, case.q, case.v, np.zeros(0))


def test_contact_source_is_held_in_frame_j() -> None:
    """A source whose contact stays in frame j and is pressed by the motion of body i there."""
    scene = models.two_free_bodies(LAWS["impact"])
    model, (q, v) = scene.model, models.two_free_state()
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    start_i, start_j = (data.oMf[model.getFrameId(name)].copy() for name in ("ball", "table"))
    point, normal = start_j.actInv(start_i.translation + 0.02), meshes.random_rotation(5)[:, 0]
    in_i = start_i.actInv(start_j * point)

    def find(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[list[Array], list[Array], list[float]]:
        depth = 0.01 - normal @ (pose_j.actInv(pose_i * in_i) - point)
        return [pose_j * point], [pose_j.rotation @ normal], [depth]

    held = Scene(model)
    held.add_contact_source(find, "ball", "table", LAWS["impact"], FRICTIONS["soft finger"])
    assert_derivatives(held, q, v)


def test_elements_are_exact_on_a_plane() -> None:
    shell = Shell(*meshes.grid_plate(1, 1, 4.0, quads=True))
    scene = free_ball(shell, friction="coulomb", method="elements")
    assert_derivatives(scene, turned(models.free_q([0.3, 0.1, 0.95]), 1), np.full(6, 0.1))


def test_nothing_touches() -> None:
    scene = models.two_free_bodies(LAWS["impact"], FRICTIONS["coulomb"])
    q, v = models.two_free_state(depth=-0.2)
    by_q, by_v = scene.contact_derivatives(q, v)
    assert by_q.shape == by_v.shape == (12, 12)
    assert not by_q.any()
    assert not by_v.any()
    assert_rate_jacobian(scene, q, v, np.zeros(0))


def test_at_rest_by_default() -> None:
    scene = free_ball(models.plate(4.0), friction="coulomb")
    q = models.free_q([0.1, 0.2, 0.97])
    got, expected = scene.contact_derivatives(q), scene.contact_derivatives(q, np.zeros(6))
    assert (got[0] == expected[0]).all()
    assert (got[1] == expected[1]).all()


def stretched(scene: Scene, size: float) -> Array:
    z = np.zeros(scene._binding.bristle_size)
    # Of three contacts, where there is room for four.
    filled = len(z) // 4 * 3
    z[:filled] = size * np.random.default_rng(2).normal(size=filled)
    return z


def left_out(friction: str, stretch: float) -> float:
    """Tolerance of the rates' change with q on curved shells; those of rings are smaller."""
    return stretch * (30 if "rings" in friction else 1)


# 1e-2 m of stretch are far over the limit, so that the sphere slides.
@pytest.mark.parametrize("stretch", [1e-4, 1e-2])
@pytest.mark.parametrize("friction", BRISTLES)
class TestRatesOfBristles:
    def test_arm_on_a_plate(self, friction: str, stretch: float) -> None:
        scene = arm_on(models.plate(), np.zeros(3), np.array([0.0, 0.0, 1.0]), "impact", friction)
        assert_rate_jacobian(scene, models.ARM_Q, ARM_V, stretched(scene, stretch))

    def test_on_a_shell_that_moves(self, friction: str, stretch: float) -> None:
        scene = models.two_free_bodies(LAWS["impact"], FRICTIONS[friction])
        assert_rate_jacobian(scene, *models.two_free_state(), stretched(scene, stretch))

    def test_with_a_saddle(self, friction: str, stretch: float) -> None:
        """About an edge normals turn fast, and how their turning changes is left out."""
        scene, q, v = three_contacts(friction)
        z = stretched(scene, stretch)
        assert_rate_jacobian(scene, q, v, z, step=1e-7, turning=left_out(friction, stretch))

    def test_on_curved_surfaces(self, friction: str, stretch: float) -> None:
        for name, surface in SURFACES.items():
            scene = free_ball(shell_of(name, 0.6), friction=friction)
            q = turned(models.free_q(surface.probes(1, 0.04, seed=3)[0][0]), 1)
            v = 0.3 * np.random.default_rng(3).normal(size=6)
            assert_rate_jacobian(
                scene, q, v, stretched(scene, stretch), turning=left_out(friction, stretch)
            )


def test_pairs_add_up() -> None:
    """Two spheres on the arm touch two plates, one of them with bristles, one on a link."""
    scene = arm_on(models.plate(), np.zeros(3), np.array([0.0, 0.0, 1.0]), "undamped", "coulomb")
    one = scene.contact_derivatives(models.ARM_Q, ARM_V)
    model, data = scene.model, scene.model.createData()
    pin.framesForwardKinematics(model, data, models.ARM_Q)
    link, tip = (data.oMf[model.getFrameId(name)] for name in ("two", "ball"))
    scene.add_contact(
        sphere=Sphere(0.04, frame="ball", offset=(0.02, 0.0, 0.01)),
        shell=models.plate(),
        frame="two",
        placement=link.actInv(pin.SE3(meshes.random_rotation(8), tip.translation)),
        law=LAWS["impact"],
        friction=FRICTIONS["soft finger"],
    )
    assert len(scene.contacts(models.ARM_Q, ARM_V)) == 2
    assert np.abs(scene.contact_derivatives(models.ARM_Q, ARM_V)[0] - one[0]).max() > 1
    assert_derivatives(scene, models.ARM_Q, ARM_V)
    assert_rate_jacobian(scene, models.ARM_Q, ARM_V, stretched(scene, 1e-4))


def test_rate_jacobian_without_bristles() -> None:
    scene = models.two_free_bodies(LAWS["hunt-crossley"], FRICTIONS["coulomb"])
    assert_rate_jacobian(scene, *models.two_free_state(), np.zeros(0))
