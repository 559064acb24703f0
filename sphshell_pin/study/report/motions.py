"""Cases of work and precision that finer runs judge: what moves, and with which settings."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.dynamics.run.advance import AnyController
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.study.report import swing
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.steps import RADIUS, START, panda, tip_position


@dataclass(frozen=True, kw_only=True)
class Case:
    """A run, and its settings from coarse to fine.

    `figures` reads dimensionless vectors (n, k) off the rows of a result: the error is the largest
    length of the difference of one of them. Fixed steps divide `record_dt` [s]. `references` are
    two methods of different kinds; a result is judged by the one that is not of its own. A case
    with a closed form has that, `exact`, in their place: figures at the times t (n,).
    """

    name: str
    title: str
    judged: str  # what the error is of, and against what
    scene: sp.Scene
    controller: AnyController = None
    q0: Array
    v0: Array | None = None
    duration: float
    record_dt: float
    figures: Callable[[Result], list[Array]]
    references: tuple[Integrator, ...] = ()
    exact: Callable[[Array], list[Array]] | None = None
    integrators: tuple[Integrator, ...]
    quick_dt: float  # --quick makes no shorter steps

    def run(self, integrator: Integrator, duration: float | None = None) -> Result:
        """Run for `duration` [s], the case's own unless given."""
        duration = self.duration if duration is None else duration
        simulation = sp.Simulation(self.scene, integrator)
        return simulation.run(self.q0, self.v0, duration, self.controller, record_dt=self.record_dt)


def difference(a: list[Array], b: list[Array]) -> float:
    """Return the largest length of a difference of the figures at any row."""
    return max(float(np.linalg.norm(x - y, axis=1).max()) for x, y in zip(a, b, strict=True))


class Judge:
    """Judges the results of a case by its closed form, or by its references, much finer runs."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.known = [(type(i), case.figures(case.run(i))) for i in case.references]

    def error(self, integrator: Integrator, result: Result) -> float:
        """Return the largest error at any row of a result that `integrator` made."""
        figures = self.case.figures(result)
        if self.case.exact is not None:
            return difference(figures, self.case.exact(result.t))
        # Against the reference that another kind of method made.
        own = isinstance(integrator, self.known[0][0])
        return difference(figures, self.known[own][1])


def decades(kind: Callable[[float], Integrator], *exponents: float) -> tuple[Integrator, ...]:
    """Return an integrator for each tolerance 10^-exponent."""
    return tuple(kind(10.0**-e) for e in exponents)


def steps(kind: Callable[[float], Integrator], *dts: float) -> tuple[Integrator, ...]:
    """Return an integrator for each step [s]."""
    return tuple(kind(dt) for dt in dts)


def rectangle(x: float, y: float) -> sp.Shell:
    """Return the flat plate z = 0 of |x|, |y| up to these."""
    return sp.Shell([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], [[0, 1, 2, 3]])


def bowl() -> Case:
    """Let a ball without friction swing twice in a bowl of curved elements, h / r = 0.15."""
    amplitude = swing.ARM * math.sin(swing.ANGLE)
    return Case(
        name="bowl swing",
        title="Ball swings in a bowl",
        judged="error of position / amplitude",
        scene=swing.mesh_scene(swing.bowl(0.15)),
        q0=swing.start(float(swing.AZIMUTHS[0])),
        duration=0.72,
        record_dt=0.02,
        figures=lambda result: [result.q / amplitude],
        references=(sp.Adaptive(1e-12), sp.RungeKutta4(2e-5)),
        integrators=(
            *steps(sp.SemiImplicitEuler, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
            *steps(sp.RungeKutta4, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4),
            *steps(sp.LinearlyImplicitEuler, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5),
            *decades(sp.Adaptive, 2, 3, 4, 5, 6, 7, 8),
            *decades(sp.Implicit, 2, 3, 4, 5, 6, 7, 8),
        ),
        quick_dt=1e-4,
    )


TIP = "panda_hand_tcp"
# Steel on steel: Hertz's law, 20 N press 1.1 um deep, where the stiffness is 2.7e7 N/m.
YOUNG, POISSON = 210e9, 0.3  # [Pa]
STEEL = sp.ImpactLaw.hertz(RADIUS, YOUNG, POISSON, YOUNG, POISSON, restitution=0.9, speed=0.1)
PRESS, SPEED, LEAD_IN = 20.0, 0.05, 0.055  # [N], [m/s], [s]
CREEP = 1e-5  # v_static [m/s]

PRESS_SETTINGS = (
    *steps(sp.SemiImplicitEuler, 1e-4, 5e-5, 2.5e-5, 2e-5, 1e-5, 5e-6, 2.5e-6, 2e-6, 1e-6),
    *steps(sp.RungeKutta4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2.5e-6),
    *steps(sp.LinearlyImplicitEuler, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5),
    *decades(sp.Adaptive, 3, 4, 5, 6, 7),
    *decades(sp.Implicit, 2, 3, 4, 4.5, 5, 5.5, 6, 7, 8),
)


def press(duration: float = 0.4) -> Case:
    """Let a Panda press a steel ball on a steel plate, hold still, then slide.

    Regularised Coulomb friction creeps where it should stick: under half of its largest force at
    0.35 v_static. Up to v_static it is a damper of 1.5 mu N / v_static, and an explicit method is
    stable only with steps in proportion to v_static.
    """
    law, friction = STEEL, sp.CoulombFriction(0.3, 0.25, CREEP, 1e-2)
    scene = panda()
    tip = tip_position(scene, START)
    placement = pin.SE3(np.eye(3), tip - [0, 0, RADIUS - law.depth_at(PRESS)])
    ball, plate = sp.Sphere(RADIUS, TIP), rectangle(0.3, 0.3)
    scene.add_contact(ball, plate, placement=placement, law=law, friction=friction)
    controller = sp.CartesianImpedance(
        TIP,
        [(0, 0, 0), (0, 0.03, 0)],
        stiffness=1000.0,
        damping=60.0,
        normal_force=PRESS,
        shell=plate,
        placement=placement,
        speed=SPEED,
        lead_in=LEAD_IN,
        rotational_stiffness=30.0,
        rotational_damping=2.0,
        posture_stiffness=2.0,
        joint_damping=0.5,
    )
    way = SPEED * (duration - LEAD_IN)

    def figures(result: Result) -> list[Array]:
        log = result.contacts
        force = np.zeros((len(result.t), 3))
        np.add.at(force, log.row, log.normal_force[:, None] * log.normal_world)
        np.add.at(force, log.row, log.friction_force_world)
        tips = np.array([tip_position(scene, q) for q in result.q])
        return [force / PRESS, tips / way]

    return Case(
        name=f"press, v_static {CREEP * 1e6:g} um/s",
        title="Panda slides steel on steel",
        judged="error of force / 20 N, of position / way",
        scene=scene,
        controller=controller,
        q0=START,
        duration=duration,
        record_dt=0.01,
        figures=figures,
        references=(sp.Adaptive(1e-10), sp.Implicit(1e-9)),
        integrators=PRESS_SETTINGS,
        quick_dt=2e-6,
    )


BELT_SPEED, SPRING, BLOCK = 0.02, 1000.0, 1.0  # [m/s], [N/m], [kg]
MU_STATIC, MU_DYNAMIC = 0.5, 0.3
CONTACT = 1e6  # stiffness of the contact and of its bristles [N/m]: they give by 5 um


def stick_slip() -> Case:
    """Let a block on a spring ride on a belt and slip back, six times in two seconds.

    The belt is a plate that slides, too heavy to be slowed; the block does not turn.
    """
    model = model_of(
        ("block", pin.JointModelTranslation(), pin.Inertia.FromSphere(BLOCK, 0.01)),
        ("belt", pin.JointModelPX(), pin.Inertia(1e8, np.zeros(3), np.eye(3))),
        gravity=swing.GRAVITY,
    )
    damping = math.sqrt(CONTACT * BLOCK)  # half of the critical one
    law = sp.ImpactLaw(CONTACT, 1.0, damping, 1e-7)
    friction = sp.BristleFriction(MU_STATIC, MU_DYNAMIC, CONTACT, damping, v_stribeck=0.01)
    scene = sp.Scene(model)
    ball = sp.Sphere(0.01, "block")
    scene.add_contact(ball, rectangle(1.0, 0.1), "belt", law=law, friction=friction)
    weight = BLOCK * swing.GRAVITY
    stretch = MU_STATIC * weight / SPRING
    return Case(
        name="stick-slip",
        title="Block sticks and slips on a belt",
        judged="error of position / stretch of the spring",
        scene=scene,
        controller=sp.JointPD([SPRING, 0, 0, 0], 0.0, np.zeros(4), gravity_compensation=False),
        q0=np.array([0.0, 0.0, 0.01 - law.depth_at(weight), 0.0]),
        v0=np.array([BELT_SPEED, 0.0, 0.0, BELT_SPEED]),
        duration=2.0,
        record_dt=0.01,
        figures=lambda result: [result.q[:, :1] / stretch],
        references=(sp.Adaptive(1e-10), sp.Implicit(1e-9)),
        integrators=(
            *steps(sp.SemiImplicitEuler, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6),
            *steps(sp.RungeKutta4, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
            *steps(sp.LinearlyImplicitEuler, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5),
            *decades(sp.Adaptive, 2, 3, 4, 5, 6, 7, 8),
            *decades(sp.Implicit, 2, 3, 4, 5, 6, 7, 8),
        ),
        quick_dt=2e-5,
    )
