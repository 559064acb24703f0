"""Sensitivities of runs, through touches, against differences of whole runs."""

from itertools import count, product

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import Interrupted, InvalidParameter
from tests import differences, meshes, models, sensitivities
from tests.dynamics.scenes import FRICTIONS
from tests.results import assert_same_bits
from tests.sensitivities import COULOMB, HUNT, IMPACT, INTEGRATORS, PAIR, Case, R, drop, thrown
from tests.studies import mostly_studies

NUMBERS = [f"{PAIR}.law.stiffness", f"{PAIR}.sphere.radius", f"{PAIR}.placement", "q0", "v0"]


@sensitivities.every_integrator
@pytest.mark.parametrize("law", [IMPACT, HUNT], ids=["impact", "hunt-crossley"])
def test_a_bounce(law: sp.NormalLaw, integrator: str) -> None:
    drop(law, INTEGRATORS[integrator], duration=0.05).check(NUMBERS, bounces=1)


LAWS = {
    "linear": sp.ImpactLaw(4e4, 1.0, 20.0, 1e-3),
    "exponent 2.2": sp.ImpactLaw(1e8, 2.2, 50.0, 1e-3),
    "hertz": sp.HertzLaw(2e7, 0.3, restitution=0.7, speed=0.5),
    "hertz, loss tangent": sp.HertzLaw(2e7, 0.3, loss_tangent=0.2, frequency=50.0),
    "foundation": sp.FoundationLaw(1e7, 0.05, 0.2),
    "table": sp.TableLaw(
        1e-2 * np.linspace(0, 1, 200) ** 2, 2e6 * (1e-2 * np.linspace(0, 1, 200) ** 2) ** 1.5
    ),
}


@pytest.mark.parametrize("law", mostly_studies(LAWS, lambda law: law != "foundation"))
def test_a_bounce_by_all_numbers_of_a_law(law: str) -> None:
    case = drop(LAWS[law], duration=0.05)
    names = [name for name in differences.names_of(case.scene) if ".law." in name]
    # Where damping comes on and ends runs are known less well: forces have kinks there.
    case.check([*names, f"{PAIR}.sphere.radius", "v0"], bounces=1, error=100.0)


@pytest.mark.parametrize(
    "integrator", mostly_studies(INTEGRATORS, lambda one: one in ("adaptive", "semi-implicit"))
)
def test_an_oblique_bounce_by_everything(integrator: str) -> None:
    case = thrown(HUNT, COULOMB, INTEGRATORS[integrator])
    case.check([*differences.names_of(case.scene), "q0", "v0"], bounces=1)


# Of a stretch that begins at the touch.
@pytest.mark.parametrize(
    "integrator", mostly_studies(INTEGRATORS, lambda one: one in ("adaptive", "implicit"))
)
def test_an_oblique_bounce_with_bristles(integrator: str) -> None:
    case = thrown(IMPACT, sensitivities.BRISTLE, INTEGRATORS[integrator])
    names = ["ball.law.stiffness", "ball.friction.mu_static", "ball.friction.stiffness", "v0"]
    case.check(names, bounces=1, error=100.0)


@pytest.mark.parametrize(
    ("friction", "integrator"),
    mostly_studies(
        product(["soft finger", "mindlin", "rings"], ["implicit", "adaptive"]),
        lambda both: both in (("mindlin", "implicit"), ("rings", "adaptive")),
    ),
)
def test_an_oblique_bounce_with_other_bristles(friction: str, integrator: str) -> None:
    """Stiff springs: explicit steps know less of them."""
    law = sp.HertzLaw(2e7, 0.3, restitution=0.7, speed=0.5)
    stiff = integrator == "implicit"
    case = thrown(law, FRICTIONS[friction], sp.Implicit(1e-10) if stiff else sp.Adaptive(1e-11))
    names = ["ball.law.young", "ball.friction.mu_static", "v0"]
    # Of friction that only sticks the coefficient does not matter, and errors of runs are all.
    case.check(names, bounces=1, tolerance=1e-5 if stiff else 1e-4, error=100.0)


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_a_bounce_off_a_curved_shell(method: str) -> None:
    vertices, triangles = meshes.dome(8, 1.0)
    below = np.array([0.0, 0.0, -2.0])
    normals = (vertices - below) / np.linalg.norm(vertices - below, axis=1, keepdims=True)
    shell = sp.Shell(vertices, triangles, normals=normals)
    law = sp.HertzLaw(2e7, 0.3, restitution=0.7, speed=0.5)
    # Adaptive's steps end where the fitted curvature is not smooth.
    case = thrown(law, COULOMB, sp.Implicit(1e-8), shell=shell, method=method)
    case.check(["ball.law.young", "ball.placement", "ball.sphere.offset", "v0"], bounces=1)


@pytest.mark.parametrize("integrator", ["adaptive", "implicit", "runge-kutta"])
def test_several_bounces(integrator: str) -> None:
    """Each stretches what the one before has left: by v0 it grows."""
    case = drop(HUNT, INTEGRATORS[integrator], duration=0.5, gap=0.005, speed=0.3)
    result = case.check([f"{PAIR}.law.stiffness", f"{PAIR}.law.dissipation", "v0"])
    assert len(result.events) >= 8


@sensitivities.every_integrator
def test_sliding(integrator: str) -> None:
    """A block that is braked by friction, in touch throughout."""
    scene = models.on_plate(models.block(), IMPACT, COULOMB)
    depth = IMPACT.depth_at(9.81)
    case = Case(scene, [0.0, 0.0, R - depth], [0.4, 0.1, 0.0], 0.04, INTEGRATORS[integrator])
    case.check([f"{PAIR}.friction.mu_static", f"{PAIR}.friction.mu_dynamic", "v0"], depth=depth)


def test_two_spheres_that_collide() -> None:
    model = models.empty(0.0)
    for name in ("one", "two"):
        models.add_body(model, name, pin.JointModelFreeFlyer())
    scene, balls = sp.Scene(model), (sp.Sphere(0.05, "one"), sp.Sphere(0.08, "two"))
    scene.add_contact(*balls, law=HUNT, friction=COULOMB, name="balls")
    q0 = np.r_[models.free_q([0.0, 0.0, 0.14]), models.free_q([0.03, 0.0, 0.0])]
    v0 = np.r_[0.1, 0.2, -0.6, 1, 2, 3.0, np.zeros(6)]
    names = ["balls.law.stiffness", "balls.other_sphere.radius", "balls.friction.mu_dynamic"]
    Case(scene, q0, v0, 0.04).check(names, bounces=1)


def sampled(t: float, q: Array, v: Array, contacts: object) -> Array:
    """A controller without a memory, whose torques follow the state."""
    return -30.0 * (q - 0.06) - 2.0 * v + 10.0


@pytest.mark.parametrize(
    ("control_dt", "integrator"),
    mostly_studies(product([None, 2e-3], INTEGRATORS), lambda both: both == (None, "adaptive")),
)
def test_a_controller_of_the_package(control_dt: float | None, integrator: str) -> None:
    model, q0 = models.arm(), models.ARM_Q
    height = models.pose_of(model, q0, "ball").translation[2]
    more = {"placement": pin.SE3(np.eye(3), np.array([0, 0, height - R - 1e-3])), "name": "tip"}
    scene = models.on_shell(model, models.plate(), HUNT, COULOMB, **more)
    control = sp.JointPD(80.0, 4.0, q_ref=q0 + [0.0, 0.1, 0.05])
    more = {"controller": control, "control_dt": control_dt}
    case = Case(scene, q0, np.zeros(3), 0.06, INTEGRATORS[integrator], **more)
    names = ["tip.law.stiffness", "tip.friction.mu_static", "tip.placement", "q0"]
    result = case.check(names, error=100.0)
    assert len(result.contacts.t) >= 3


@pytest.mark.parametrize("integrator", ["adaptive", "runge-kutta"])
def test_a_controller_of_the_users_own(integrator: str) -> None:
    case = drop(HUNT, INTEGRATORS[integrator], duration=0.05)
    case.options |= {"controller": sampled, "control_dt": 1e-3}
    case.check([f"{PAIR}.law.stiffness", "v0"])


def touched(torque, integrator: str = "adaptive") -> Case:
    """A light mass on a slide that falls on a plate, driven by torque(v, forces of contacts)."""
    scene = models.on_shell(models.slider(9.81, 0.3), models.plate(1.0), HUNT)
    more = {"controller": lambda t, q, v, contacts: np.array([torque(v, contacts.normal_force)])}
    return Case(scene, [R + 0.004], [-0.3], 0.06, INTEGRATORS[integrator], **more)


@pytest.mark.parametrize("integrator", ["adaptive", "implicit"])
def test_torques_that_jump_at_the_touch(integrator: str) -> None:
    """The acceleration jumps there; so do the derivatives of v."""
    case = touched(lambda v, force: 4.0 + 2.0 * v[0] if len(force) else 0.5, integrator)
    case.check(["q0", "v0", "ball.law.stiffness", "ball.sphere.radius"], bounces=1)


def test_torques_that_follow_a_force() -> None:
    """What a held state's force makes of a moved sphere and a moved shell."""
    case = touched(lambda v, force: -0.2 * force.sum())
    case.check(["ball.sphere.offset", "ball.placement"], bounces=1)


def test_a_joint_that_meets_its_stop() -> None:
    stop = sp.JointLimits(-0.1, 0.1, sp.HuntCrossleyLaw(2e5, 1.5, 0.3))
    joints = sp.JointComponents(limits={"ball_joint": stop})
    case = Case(sp.Scene(models.slider(0.0), joints=joints), [0.0], [2.0], 0.15)
    result = case.check(["q0", "v0"])
    assert "stop" in [event.kind for event in result.events]


def test_the_run_has_the_same_bits() -> None:
    for integrator in INTEGRATORS.values():
        case = drop(IMPACT, integrator, duration=0.03)
        one, other = case.run(), case.run(names=["v0", f"{PAIR}.law.stiffness"])
        assert_same_bits(one, other)
        assert one.sensitivities is None
        again = case.run(names=["v0", f"{PAIR}.law.stiffness"])
        assert other.sensitivities.q.tobytes() == again.sensitivities.q.tobytes()


def test_controllers_with_a_memory_and_those_that_read_sensors_are_refused() -> None:
    calls = count()
    for tau in (
        lambda t, q, v, contacts: 1e-3 * next(calls) + 0.0 * q,
        lambda t, q, v, contacts, sensors: 0.0 * q,
    ):
        case = drop(IMPACT, duration=0.03, controller=tau, control_dt=1e-3)
        with pytest.raises(InvalidParameter, match="controller"):
            case.run(names=["v0"])
        assert len(case.run().t) > 2


def test_an_interrupted_run_has_those_of_its_rows() -> None:
    case = drop(IMPACT, duration=0.03)
    simulation = sp.Simulation(case.scene, sp.RungeKutta4(1e-4))

    def stop(share: float) -> None:
        if share > 0:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stopped:
        simulation.run(case.q0, case.v0, 100.0, sensitivities=["v0"], progress=stop)
    result = stopped.value.result
    assert result.sensitivities.q.shape == (len(result.t), case.scene.model.nv, case.scene.model.nv)


# Where a contact begins, on a curved shell, its touch comes with no slope by the radius: there the
# rise of the shell beyond its element comes on with the square of the depth.
TOUCHING = {
    "hertz": LAWS["hertz"],
    "viscoelastic": sp.HertzLaw(2e7, 0.3, loss_tangent=0.1, frequency=100.0),
    "hunt": HUNT,
}
SLIPPING = {
    "coulomb": COULOMB,
    "bristle": sensitivities.BRISTLE,
    "mindlin": sp.MindlinFriction(0.4, 0.3, 2e7, 0.3, damping_time=1e-5),
}
# Half axes of an ellipsoid [m].
AXES = np.array([0.25, 0.2, 0.15])


def off_an_ellipsoid(law: sp.NormalLaw, friction: object, inside: bool, place: list[float]) -> Case:
    """A ball that meets an ellipsoid at an angle, from outside, or from inside a larger one."""
    vertices, triangles = meshes.icosphere(3, 1.0)
    axes, sign = (1.3 * AXES, -1.0) if inside else (AXES, 1.0)
    normals = vertices / axes
    normals *= sign / np.linalg.norm(normals, axis=1, keepdims=True)
    shell = sp.Shell(vertices * axes, triangles[:, :: int(sign)], normals=normals, faces=False)
    scene = models.on_shell(models.ball(gravity=0.0), shell, law, friction)
    at = np.array(place) / np.linalg.norm(place)
    normal = sign * at / axes / np.linalg.norm(at / axes)
    q0 = models.free_q(at * axes + 1.02 * R * normal)
    v0 = np.r_[-0.5 * normal + [0.15, -0.1, 0.1], 2.0, -3.0, 1.0]
    return Case(scene, q0, v0, 0.012, sp.Implicit(1e-9))


# Each law, each friction and both sides; studies combine all.
SOME = {("hertz", "coulomb", True), ("viscoelastic", "bristle", False), ("hunt", "mindlin", True)}


@pytest.mark.parametrize(
    ("law", "friction", "inside"),
    mostly_studies(product(TOUCHING, SLIPPING, (False, True)), SOME.__contains__),
)
def test_a_bounce_by_the_radius(law: str, friction: str, inside: bool) -> None:
    case = off_an_ellipsoid(TOUCHING[law], SLIPPING[friction], inside, [0.3, 0.5, 0.8])
    # A viscoelastic force begins like the square root of the depth.
    case.check(["ball.sphere.radius"], tolerance=1e-3 if law == "viscoelastic" else 1e-4)
