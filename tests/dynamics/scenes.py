"""Scenes in which something touches, with a state: what the tests of derivatives share."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from tests import differences, meshes, models
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.dynamics.test_external_forces import Case
from tests.dynamics.test_mimic import CASES as MIMIC
from tests.dynamics.test_mimic import with_contact
from tests.models import ARM_Q, free_q

State = tuple[sp.Scene, Array, Array]

DEPTHS = 0.1 * np.linspace(0.0, 1.0, 300) ** 2
LAWS: dict[str, sp.NormalLaw] = {
    "undamped": sp.ImpactLaw(4e3, 1.5),
    "impact": sp.ImpactLaw(4e4, 1.5, 20.0, 2e-2),
    "impact, exponent 2.2": sp.ImpactLaw(1e6, 2.2, 20.0, 2e-3),
    "hunt-crossley": sp.HuntCrossleyLaw(4e4, 1.5, 0.5),
    "hertz": sp.HertzLaw(1e6, 0.3),
    "hertz, two materials": sp.HertzLaw(1e6, 0.3, 3e6, 0.45, restitution=0.7, speed=0.4),
    "hertz, loss tangent": sp.HertzLaw(1e6, 0.3, loss_tangent=0.2, frequency=5.0),
    "hertz of a plane": sp.HertzLaw(1e6, 0.3, 3e6, 0.45, radius=0.05),
    "foundation": sp.FoundationLaw(1e5, 0.05, 0.3),
    "table": sp.TableLaw(DEPTHS, 4e4 * DEPTHS**1.5),
}
MINDLIN = {"v_stribeck": 0.05, "damping_time": 3e-3, "rolling": 0.1, "rolling_speed": 0.2}
FRICTIONS = {
    "none": None,
    "coulomb": sp.CoulombFriction(0.3, 0.1, 0.1, 1.0),
    "bristle": sp.BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05),
    "soft finger": sp.BristleFriction(0.5, 0.3, 1e4, 30.0, 0.05, torsional=True),
    "mindlin": sp.MindlinFriction(0.5, 0.3, 5e3, 0.3, 2e4, 0.45, torsional=True, **MINDLIN),
    "rings": sp.MindlinFriction(0.5, 0.3, 5e3, 0.3, v_stribeck=0.05, torsional=True, rings=3),
    "many rings": sp.MindlinFriction(0.5, 0.3, 5e3, 0.3, damping_time=1e-3, rolling=0.1, rings=7),
}
COULOMB, BRISTLE = FRICTIONS["coulomb"], FRICTIONS["bristle"]
BRISTLES = [name for name in FRICTIONS if name not in ("none", "coulomb")]
STOPS = sp.JointComponents(
    limits={"two_joint": sp.JointLimits(-1.0, 1.5, sp.HuntCrossleyLaw(80.0, 1.3, 0.4))},
    damping={"one_joint": 0.2, "two_joint": 0.1},
    friction={"ball_joint": sp.JointFriction(0.5, stiffness=30.0, damping=0.4)},
    armature={"ball_joint": 0.03},
)
ARM_V = np.array([0.3, 0.2, -0.4])
UP = np.array([0.0, 0.0, 1.0])


def turned(q: Array, seed: int) -> Array:
    """A free-flyer's configuration turned about its own origin."""
    axis = np.random.default_rng(seed).normal(size=3)
    return np.asarray(pin.integrate(models.ball(), q, np.r_[np.zeros(3), axis]))


def free_ball(shell: sp.Shell, law=LAWS["impact"], friction=None, *, gravity=9.81, **more):  # type: ignore[no-untyped-def]
    """Free ball of radius one on a fixed shell."""
    model = models.ball(gravity, more.pop("mass", 1.0), 1.0)
    return models.on_shell(model, shell, law, friction, radius=1.0, **more)


def on_surface(name: str, law=LAWS["impact"], friction=None, seed: int = 0, **more) -> State:  # type: ignore[no-untyped-def]
    """The ball on a curved surface, at one of its probes."""
    scene = free_ball(shell_of(name, 0.6), law, friction, **more)
    center = SURFACES[name].probes(seed + 1, 0.04, seed=3)[0][seed]
    v = 0.3 * np.random.default_rng(seed + 3).normal(size=6)
    return scene, turned(free_q(center), seed + 1), v


def arm_on(shell: sp.Shell, point: Array, normal: Array, law, friction, **more) -> State:  # type: ignore[no-untyped-def]
    """An arm whose tip, off its frame's origin, is 5 mm deep at a point of the shell."""
    scene = sp.Scene(models.arm(), **more)
    offset = np.array([0.01, -0.02, 0.015])
    center = models.pose_of(scene.model, ARM_Q, "ball") * offset
    turn = meshes.random_rotation(3)
    place = pin.SE3(turn, center - turn @ (point + (0.05 - 0.005) * normal))
    sphere = sp.Sphere(0.05, "ball", tuple(offset.tolist()))
    scene.add_contact(sphere, shell, placement=place, law=law, friction=friction, name="tip")
    return scene, ARM_Q, ARM_V


def on_plate(law, friction) -> State:  # type: ignore[no-untyped-def]
    """The arm on a plate."""
    return arm_on(models.plate(), np.zeros(3), UP, law, friction)


def in_bowl(law, friction, **more) -> State:  # type: ignore[no-untyped-def]
    """The arm in a bowl of radius 2 with its exact normals."""
    vertices, triangles = meshes.bowl()
    normals = (2 * UP - vertices) / 2
    place = np.array([0.11, -0.07, 2 - np.sqrt(4 - 0.11**2 - 0.07**2)])
    shell = sp.Shell(vertices, triangles, normals=normals)
    return arm_on(shell, place, (2 * UP - place) / 2, law, friction, **more)


def moving(law, friction) -> State:  # type: ignore[no-untyped-def]
    """A ball on a plate; both are free, and spin fast."""
    return models.two_free_bodies(law, friction), *models.two_free_state()


def in_groove(law, friction) -> State:  # type: ignore[no-untyped-def]
    """Two contacts in a shallow groove and the saddle between them."""
    shell = sp.Shell(*meshes.v_groove(np.radians(5), size=8.0, cells=2), crease_angle=0.01)
    q = turned(free_q([0.03, 0.3, 0.97]), 1)
    return free_ball(shell, law, friction), q, 0.1 * np.array([1.0, 2, -3, 2, -1, 1])


def two_pairs(law, friction) -> State:  # type: ignore[no-untyped-def]
    """Two spheres on the arm touch two plates, one of them with bristles, one on a link."""
    scene, q, v = on_plate(law, friction)
    link, tip = (models.pose_of(scene.model, q, name) for name in ("two", "ball"))
    place = link.actInv(pin.SE3(meshes.random_rotation(8), tip.translation))
    sphere = sp.Sphere(0.04, "ball", (0.02, 0.0, 0.01))
    laws = (LAWS["hertz"], FRICTIONS["soft finger"])
    scene.add_contact(sphere, models.plate(), "two", place, *laws, name="second")
    return scene, q, v


def on_chain(joint_i: str, joint_j: str, tree: str, seed: int) -> State:
    """Two bodies on joints of these kinds, which touch."""
    case = Case(joint_i, joint_j, tree, seed)
    return case.scene, case.q, case.v


def mimicking(name: str, seed: int = 3) -> State:
    """Two fingers of a hand with mimic joints, which push each other less than moves them."""
    make, tip, other = MIMIC[name]
    scene = with_contact(make()[0], tip, other)
    scene = differences.changed(scene, f"{scene.pairs[0].name}.placement.vz", -0.45)
    rng, nv = np.random.default_rng(seed), scene.model.nv
    return scene, rng.uniform(-0.3, 0.3, scene.model.nq), 0.1 * rng.normal(size=nv)


def held_in_frame_j() -> State:
    """A source whose contact stays in frame j and is pressed by the motion of body i there."""
    scene = models.two_free_bodies(LAWS["impact"])
    model, (q, v) = scene.model, models.two_free_state()
    start_i, start_j = (models.pose_of(model, q, name) for name in ("ball", "table"))
    point, normal = start_j.actInv(start_i.translation + 0.02), meshes.random_rotation(5)[:, 0]
    in_i = start_i.actInv(start_j * point)

    def find(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[list[Array], list[Array], list[float]]:
        depth = 0.01 - normal @ (pose_j.actInv(pose_i * in_i) - point)
        return [pose_j * point], [pose_j.rotation @ normal], [depth]

    held = sp.Scene(model)
    held.add_contact_source(find, "ball", "table", LAWS["impact"], FRICTIONS["soft finger"])
    return held, q, v


def locked() -> State:
    """The arm, one of its joints held, on a plate."""
    scene = sp.Scene(models.arm(), lock=["one_joint"], q_lock=ARM_Q)
    tip = models.pose_of(scene.model, ARM_Q[1:], "ball").translation
    place = pin.SE3(np.eye(3), tip - 0.045 * UP)
    law, friction = LAWS["impact"], COULOMB
    scene.add_contact(sp.Sphere(0.05, "ball"), models.plate(), "universe", place, law, friction)
    return scene, ARM_Q[1:], ARM_V[1:]


def shell_alone_moves() -> State:
    """A sphere of the world on a plate that is free."""
    scene = sp.Scene(models.ball())
    fixed = sp.Sphere(0.05, "universe", (0.1, 0.2, 0.04))
    scene.add_contact(fixed, models.plate(), "ball", law=LAWS["impact"], friction=COULOMB)
    move = np.array([0.1, 0.1, 0, 0.1, -0.05, 1])
    return scene, pin.integrate(scene.model, free_q(np.zeros(3)), move), np.full(6, 0.1)


def through_a_sheet() -> State:
    """Pushed back through a shell with an outside."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    shell = sp.Shell(vertices, elements, normals=normals, side="outside")
    points, outward = SURFACES["dome"].points(np.random.default_rng(4), 1)
    q = turned(free_q((points - 0.1 * outward)[0]), 1)
    return free_ball(shell, friction=COULOMB), q, np.full(6, 0.1)


R, OTHER = 0.05, 0.08
OFFSET, OTHER_OFFSET = (0.01, -0.02, 0.03), (-0.03, 0.01, 0.02)
ONE, TWO = sp.Sphere(R, "one", OFFSET), sp.Sphere(OTHER, "two", OTHER_OFFSET)


def two_bodies(inertia: pin.Inertia | None = None) -> pin.Model:
    """Free bodies "one" and "two", no gravity; of the same inertia where one is given."""
    model = models.empty(0.0)
    lump = pin.Inertia(2.0, np.array([0.02, -0.03, 0.01]), np.diag([0.03, 0.02, 0.04]))
    models.add_body(model, "one", pin.JointModelFreeFlyer(), inertia=inertia)
    models.add_body(model, "two", pin.JointModelFreeFlyer(), inertia=inertia or lump)
    return model


def two_spheres(law, friction=None, *, turned: bool = False, **more) -> sp.Scene:  # type: ignore[no-untyped-def]
    """Scene of both spheres; `turned`: the second one is given first."""
    scene = sp.Scene(two_bodies())
    first, second = (TWO, ONE) if turned else (ONE, TWO)
    scene.add_contact(first, second, law=law, friction=friction, name="balls", **more)
    return scene


def in_touch(seed: int, depth: float = 0.004, spin: float = 20.0) -> tuple[Array, Array]:
    """State in which the spheres are `depth` deep in each other."""
    rng = np.random.default_rng(seed)
    turns = [pin.Quaternion(rng.normal(size=4)).normalized().matrix() for _ in range(2)]
    one, two = (pin.SE3(turn, rng.normal(size=3)) for turn in turns)
    way = rng.normal(size=3)
    way *= (R + OTHER - depth) / np.linalg.norm(way)
    one.translation = two * np.array(OTHER_OFFSET) + way - one.rotation @ np.array(OFFSET)
    v = np.concatenate([rng.normal(size=3), spin * rng.normal(size=3)] * 2)
    return np.concatenate([pin.SE3ToXYZQUAT(one), pin.SE3ToXYZQUAT(two)]), v


def balls(law: str, friction: str, seed: int = 3, spin: float = 20.0) -> State:
    """The two spheres in touch."""
    return two_spheres(LAWS[law], FRICTIONS[friction]), *in_touch(seed, spin=spin)


def stuck() -> tuple[State, sp.results.SceneState]:
    """An arm whose bristles have been stretched by ten steps, far below the limit."""
    scene, q, v = on_plate(LAWS["undamped"], BRISTLE)
    v = 0.01 * v
    state = scene.state(q, v)
    for _ in range(10):
        state.advance(q, v, 5e-3)
    return (scene, q, v), state


def columns(f: Callable[[Array], Array], count: int, step: float) -> Array:
    """The central differences of f at 0 by each of so many numbers."""
    steps = step * np.eye(count)
    return np.transpose([(f(one) - f(-one)) / (2 * step) for one in steps])


def assert_close(got: Array, expected: Array, tolerance: float = 1e-6, rounding: float = 0) -> None:
    """Each column right to the tolerance of its own size, or of a hundredth of the whole's."""
    sizes = np.abs(expected).max(axis=0) + 1e-2 * np.abs(expected).max()
    assert got.shape == expected.shape
    assert (np.abs(got - expected).max(axis=0) <= tolerance * sizes + rounding).all()


def stretched(scene: sp.Scene, size: float) -> Array:
    """Bristles, of three contacts where there is room for four, that are stretched at random."""
    z = np.zeros(scene._binding.bristle_size)
    filled = len(z) // 4 * 3
    z[:filled] = size * np.random.default_rng(2).normal(size=filled)
    return z


def assert_rate_jacobian(scene, q, v, z, *, step=1e-6, turning=1e-6):
    """The derivatives of accelerations and of bristles' rates by q, v and the stretches z.

    `turning`: tolerance of how the bristles' rates change with q.
    """
    core, model, nv = scene._binding, scene.model, scene.model.nv
    tau = np.random.default_rng(1).normal(size=nv)
    got = core.rate_jacobian(q, v, z, tau)
    assert got.shape == (nv + len(z), 2 * nv + len(z))
    by_q = columns(lambda u: core.rates(pin.integrate(model, q, u), v, z, tau), nv, step)
    by_v = columns(lambda u: core.rates(q, v + u, z, tau), nv, step)
    assert_close(got[:nv, :nv], by_q[:nv])
    assert_close(got[:nv, nv : 2 * nv], by_v[:nv])
    if len(z) == 0:
        return
    # Far over the limit a stretch gives way at a rate that is large against what differences it.
    rounding = 50 * np.finfo(float).eps * np.abs(core.rates(q, v, z, tau)[nv:]).max() / step
    assert_close(got[nv:, :nv], by_q[nv:], turning, rounding)
    assert_close(got[nv:, nv : 2 * nv], by_v[nv:], rounding=rounding)
    by_z = columns(lambda u: core.rates(q, v, z + u, tau), len(z), 1e-4 * np.abs(z).max())
    assert np.abs(by_z[:nv]).max() > 1 or not scene.pairs
    assert_close(got[:nv, 2 * nv :], by_z[:nv])
    assert np.abs(got[nv:, 2 * nv :] - by_z[nv:]).max() <= 1e-6 * max(1.0, np.abs(by_z[nv:]).max())
