"""Scenes in Crocoddyl: derivatives against differences, steps against Simulation, refusals."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import FrameNotFound, InvalidParameter, NameNotFound
from tests import meshes, models
from tests.differences import acceleration
from tests.models import pose_of

crocoddyl = pytest.importorskip("crocoddyl")

from sphshell_pin.adapters.crocoddyl import (  # noqa: E402
    ContactDynamics,
    ContactForceResidual,
    ContactStep,
    FrameResidual,
)
from tests.programs import python  # noqa: E402

LAW = sp.ImpactLaw(2e6, 1.5, damping=10.0, full_damping_depth=1e-4)
SLIDING = sp.CoulombFriction(0.4, 0.3, 0.01, 0.1)


BENT = meshes.dome(4, 0.4, 1.0)


def arm_on_moving_plate(joints: sp.JointComponents | None = None) -> tuple[sp.Scene, np.ndarray]:
    """Return an arm whose tip touches a bent plate that slides and turns, and a state."""
    model = models.arm()
    slide = models.add_body(model, "slide", pin.JointModelPX())
    box = pin.Inertia.FromBox(2.0, 0.4, 0.4, 0.02)
    models.add_body(model, "plate", pin.JointModelRY(), slide, inertia=box)
    q = np.array([0.2, 0.9, 1.2, 0.1, 0.05])
    tip = pose_of(model, q, "plate").actInv(pose_of(model, q, "ball").translation)
    tilt = pin.rpy.rpyToMatrix(0.1, -0.2, 0.3)
    scene, place = sp.Scene(model, joints=joints), pin.SE3(tilt, tip - tilt @ [0.02, 0.01, 0.0193])
    more = {"law": LAW, "friction": SLIDING, "name": "touch"}
    scene.add_contact(sp.Sphere(0.02, "ball"), sp.Shell(*BENT), "plate", place, **more)
    return pressed(scene, q, [0.1, -0.2, 0.15, 0.05, 0.1])


def free_ball() -> tuple[sp.Scene, np.ndarray]:
    """Return a ball that rolls and slides on a plate, and a state: a free-flyer."""
    scene = sp.Scene(models.ball(mass=0.3, radius=0.02))
    more = {"law": LAW, "friction": SLIDING, "name": "touch"}
    scene.add_contact(sp.Sphere(0.02, "ball"), models.plate(), **more)
    quaternion = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.5, 0.9)).coeffs()
    q = np.concatenate(([0.03, 0.04, 0.02 - 2e-4], quaternion))
    return pressed(scene, q, [0.2, -0.1, 0.05, 1.0, -2.0, 0.5])


def ball_in_a_corner(joints: sp.JointComponents | None = None) -> tuple[sp.Scene, np.ndarray]:
    """Return a ball on slides that presses into two walls, and a state."""
    slides = pin.JointModelTranslation()
    scene = sp.Scene(models.ball(mass=0.3, radius=0.02, joint=slides), joints=joints)
    upright = pin.SE3(pin.rpy.rpyToMatrix(0.0, np.pi / 2, 0.0), np.zeros(3))
    for name, placement in (("wall", upright), ("touch", None)):
        more = {"law": LAW, "friction": SLIDING, "name": name}
        scene.add_contact(sp.Sphere(0.02, "ball"), models.plate(), placement=placement, **more)
    return scene, np.array([0.02 - 3e-4, 0.03, 0.02 - 2e-4, 0.05, 0.1, -0.05])


def pressed(scene: sp.Scene, q: np.ndarray, v: list[float]) -> tuple[sp.Scene, np.ndarray]:
    """Return the scene and the state, where there is a force and friction."""
    contacts = scene.contacts(q, v)
    assert contacts.normal_force.sum() > 1.0
    assert np.linalg.norm(contacts.friction_force_world) > 0.3
    return scene, np.concatenate((q, v))


class ActuationModelDamped(crocoddyl.ActuationModelAbstract):
    """Motors with springs and dampers: tau = u - 3 x, of a model whose q is a vector."""

    def __init__(self, state):
        super().__init__(state, state.nv)

    def calc(self, data, x, u):
        data.tau = u - 3.0 * (x[: self.nu] + x[self.nu :])

    def calcDiff(self, data, x, u):  # noqa: N802
        data.dtau_dx = -3.0 * np.hstack((np.eye(self.nu), np.eye(self.nu)))
        data.dtau_du = np.eye(self.nu)


def dynamics(scene: sp.Scene, actuation: str = "Full") -> ContactDynamics:
    """Return a model with every residual of the adapter."""
    return ContactDynamics(scene, *parts(scene, actuation))


def bare(scene: sp.Scene, actuation: str = "Full"):
    """Return state, actuation, and no costs."""
    state = crocoddyl.StateMultibody(scene.model)
    name = f"ActuationModel{actuation}"
    actuated = (getattr(crocoddyl, name, None) or globals()[name])(state)
    return state, actuated, crocoddyl.CostModelSum(state, actuated.nu)


def parts(scene: sp.Scene, actuation: str = "Full"):
    """Return state, actuation, and costs with every residual of the adapter."""
    state, actuated, costs = bare(scene, actuation)
    nu = actuated.nu
    placement = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.1, 0.2, 0.1]))
    residuals = {
        "normal": ContactForceResidual(scene, state, "touch", 3.0, nu),
        "world": ContactForceResidual(scene, state, "touch", [1.0, 0.5, 2.0], nu),
        "place": FrameResidual(scene, state, "ball", [0.3, 0.0, 0.1], nu),
        "placement": FrameResidual(scene, state, "ball", placement, nu),
        "state": crocoddyl.ResidualModelState(state, nu),
    }
    if nu:
        residuals["control"] = crocoddyl.ResidualModelControl(state, nu)
    for name, residual in residuals.items():
        costs.addCost(name, crocoddyl.CostModelResidual(state, residual), 1.0)
    return state, actuated, costs


CASES = {
    "arm": (arm_on_moving_plate, "Full"),
    "arm with damped motors": (arm_on_moving_plate, "Damped"),
    "corner": (ball_in_a_corner, "Full"),
    "ball": (free_ball, "Full"),
    "ball-without-motors": (free_ball, "FloatingBase"),
}


def differences(f, state, x: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Return central differences of order 4 of f(x), in the tangent space of x."""
    columns = []
    for e in step * np.eye(state.ndx):
        near = (f(state.integrate(x, e)) - f(state.integrate(x, -e))) * 8
        far = f(state.integrate(x, 2 * e)) - f(state.integrate(x, -2 * e))
        columns.append((near - far) / (12 * step))
    return np.transpose(columns)


KINDS = {
    "dynamics": None,
    "euler": sp.SemiImplicitEuler(1e-4),
    "runge-kutta": sp.RungeKutta4(1e-4),
    "implicit": sp.LinearlyImplicitEuler(1e-3),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_differences(case, kind):
    make, actuation = CASES[case]
    scene, x = make()
    if KINDS[kind] is None:
        model = dynamics(scene, actuation)
    else:
        simulation = sp.Simulation(scene, KINDS[kind])
        model = ContactStep(simulation, *parts(scene, actuation))
    u = np.linspace(-1.0, 2.0, model.nu)
    data, other = model.createData(), model.createData()
    model.calc(data, x, u)
    model.calcDiff(data, x, u)

    def at(what, x=x, u=u):
        model.calc(other, x, u)
        return np.array(what(other), dtype=float)

    def out(data):
        """Return the acceleration, or the displacement to the next state."""
        return data.xout if KINDS[kind] is None else model.state.diff(x, data.xnext)

    def close(got, expected):
        np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())

    # The displacement is from x, the derivative in the tangent space at the end.
    end = np.eye(len(data.Fx))
    if KINDS[kind] is not None:
        _, end = model.state.Jdiff(x, data.xnext)
    close(end @ data.Fx, differences(lambda x: at(out, x), model.state, x))
    if model.nu:
        step = 1e-2
        by_u = [(at(out, u=u + e) - at(out, u=u - e)) / (2 * step) for e in step * np.eye(model.nu)]
        close(end @ data.Fu, np.transpose(by_u))
    for name in ("normal", "world", "place", "placement"):
        residual = data.costs.costs[name].residual
        told = lambda d, name=name: d.costs.costs[name].residual.r  # noqa: E731
        expected = differences(lambda x, told=told: at(told, x), model.state, x)
        close(np.reshape(residual.Rx, expected.shape), expected)
    close(data.Lx, differences(lambda x: at(lambda d: [d.cost], x), model.state, x)[0])


@pytest.mark.parametrize("joints", [None, sp.JointComponents(damping={"ball_joint": 7.0})])
def test_forces_of_several_pairs_and_of_joints(joints):
    """Each pair has its own force; the acceleration is ABA's with the scene's forces."""
    scene, x = ball_in_a_corner(joints)
    q, v = x[:3], x[3:]
    state, actuation, costs = parts(scene)
    force = ContactForceResidual(scene, state, "wall", [0.0, 0.0, 0.0])
    costs.addCost("wall", crocoddyl.CostModelResidual(state, force), 1.0)
    model = ContactDynamics(scene, state, actuation, costs)
    data, last = model.createData(), model.createData()  # of a last node
    tau = np.array([1.0, 2.0, 3.0])
    model.calc(data, x, tau)
    model.calc(last, x)
    model.calcDiff(last, x)
    contacts = scene.contacts(q, v)
    assert sorted(contacts.pair) == [0, 1]
    for pair, name, reference in ((0, "wall", [0.0, 0.0, 0.0]), (1, "world", [1.0, 0.5, 2.0])):
        row = contacts.force_world[contacts.pair == pair][0]
        for one in (data, last):
            residual = one.costs.costs[name].residual.r
            np.testing.assert_allclose(residual, row - reference, rtol=1e-14)
    np.testing.assert_allclose(data.xout, acceleration(scene, q, v, tau), rtol=1e-12)


def test_a_reference_can_be_changed_and_nothing_that_touches_has_no_derivative():
    scene, x = free_ball()
    model = dynamics(scene)
    data = model.createData()
    residual = model.costs.costs["normal"].cost.residual
    assert isinstance(residual, ContactForceResidual)
    residual.reference = 1.0
    u = np.zeros(model.nu)
    model.calc(data, x, u)
    contacts = scene.contacts(x[: scene.model.nq], x[scene.model.nq :])
    found = data.costs.costs["normal"].residual
    assert found.r[0] == contacts.normal_force.sum() - 1.0
    with pytest.raises(InvalidParameter, match="reference"):
        residual.reference = [1.0, 2.0]
    x[2] += 0.1
    model.calc(data, x, u)
    model.calcDiff(data, x, u)
    assert found.r[0] == -1.0
    assert not found.Rx.any()


def step_of(integrator, scene, dt):
    """Return a step of Crocoddyl's own, or the adapter's where Crocoddyl has none."""
    if integrator is sp.SemiImplicitEuler:
        return crocoddyl.IntegratedActionModelEuler(dynamics(scene), dt)
    if integrator is sp.RungeKutta4:
        return crocoddyl.IntegratedActionModelRK(dynamics(scene), crocoddyl.RKType.four, dt)
    return ContactStep(sp.Simulation(scene, integrator(dt)), *parts(scene))


@pytest.mark.parametrize(
    "integrator", [sp.SemiImplicitEuler, sp.RungeKutta4, sp.LinearlyImplicitEuler]
)
def test_its_steps_are_those_of_a_simulation(integrator):
    scene, x = arm_on_moving_plate()
    dt, steps, nq = 1e-4, 50, scene.model.nq
    model = step_of(integrator, scene, dt)
    data = model.createData()
    torque = np.array([0.1, -2.0, -1.0, 0.3, 0.2])
    motors = {"controller": lambda t, q, v, contacts: torque, "control_dt": dt}
    result = models.run(scene, integrator(dt), x[:nq], x[nq:], steps * dt, **motors)
    for _ in range(steps):
        model.calc(data, x, torque)
        x = data.xnext.copy()
    assert len(result.contacts.t) > 10
    np.testing.assert_allclose(x, [*result.q[-1], *result.v[-1]], rtol=0, atol=1e-12)


def test_a_solver_presses_with_a_force_within_bounds_of_its_motor():
    """SolverBoxFDDP brings a ball on a slide to 5 N; the law says at which depth."""
    scene = sp.Scene(models.slider(mass=0.5))
    law = sp.ImpactLaw(2e5, 1.5, damping=30.0, full_damping_depth=1e-4)
    scene.add_contact(sp.Sphere(0.02, "ball"), models.plate(), law=law, name="touch")
    state, actuation, _ = bare(scene)
    x0, dt, steps = np.array([0.02 + 1e-4, 0.0]), 1e-3, 60
    at_depth = [0.0, 0.0, 0.02 - law.depth_at(5.0)]

    def node(last):
        costs = crocoddyl.CostModelSum(state)
        rest = crocoddyl.ActivationModelWeightedQuad(np.array([0.0, 1e3 if last else 1e-2]))
        for name, weight, *of in (
            ("force", 1e3 if last else 1e-2, ContactForceResidual(scene, state, "touch", 5.0)),
            ("place", 1e6 if last else 1e2, FrameResidual(scene, state, "ball", at_depth)),
            ("rest", 1.0, rest, crocoddyl.ResidualModelState(state)),
            ("effort", 0.0 if last else 1e-6, crocoddyl.ResidualModelControl(state)),
        ):
            if weight:
                costs.addCost(name, crocoddyl.CostModelResidual(state, *of), weight)
        whole = ContactDynamics(scene, state, actuation, costs)
        made = crocoddyl.IntegratedActionModelEuler(whole, 0.0 if last else dt)
        made.u_lb, made.u_ub = np.array([-6.0]), np.array([6.0])
        return made

    problem = crocoddyl.ShootingProblem(x0, [node(False)] * steps, node(True))
    solver = crocoddyl.SolverBoxFDDP(problem)
    solver.solve([x0] * (steps + 1), [np.array([9.81 * 0.5])] * steps, 100)
    us = np.array(solver.us)
    assert np.abs(us).max() <= 6.0 + 1e-12
    motor = {"controller": lambda t, q, v, c: us[min(round(t / dt), steps - 1)]}
    result = models.run(scene, sp.SemiImplicitEuler(dt), x0[:1], x0[1:], steps * dt, **motor)
    contacts = scene.contacts(result.q[-1], result.v[-1])
    assert contacts.normal_force.sum() == pytest.approx(5.0, rel=0.01)


def test_a_step_has_the_costs_of_its_start():
    """dt times them, and without controls them, as of a last node; it then stays."""
    scene, x = arm_on_moving_plate()
    dt = 1e-3
    whole, step = dynamics(scene), step_of(sp.LinearlyImplicitEuler, scene, dt)
    u = np.linspace(-1.0, 1.0, whole.nu)
    expected, data = whole.createData(), step.createData()
    for controls, weight in (((u,), dt), ((), 1.0)):
        for model, memory in ((whole, expected), (step, data)):
            model.calc(memory, x, *controls)
            model.calcDiff(memory, x, *controls)
        for name in ("cost", "Lx", "Lxx", *(("Lu", "Luu") if controls else ())):
            got, wanted = getattr(data, name), getattr(expected, name)
            np.testing.assert_allclose(got, weight * np.array(wanted), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(data.xnext, x)


def with_bristles(scene):
    scene.replace_pair("touch", friction=sp.BristleFriction(0.4, 0.3, 0.01))
    return scene


def test_bristles_may_be_taken_without_their_history():
    scene, x = free_ball()
    model = ContactDynamics(with_bristles(scene), *bare(scene), without_history=True)
    data, u = model.createData(), np.zeros(model.nu)
    model.calc(data, x, u)
    q, v = x[: scene.model.nq], x[scene.model.nq :]
    np.testing.assert_allclose(data.xout, acceleration(scene, q, v, u), rtol=1e-9)


def with_cost(scene, name, residual):
    """Return dynamics whose costs have a residual, made for their state."""
    state, actuation, costs = bare(scene)
    costs.addCost(name, crocoddyl.CostModelResidual(state, residual(state)), 1.0)
    return ContactDynamics(scene, state, actuation, costs)


def translation(state):
    return crocoddyl.ResidualModelFrameTranslation(state, 1, np.zeros(3))


def of_another_scene(state):
    return ContactForceResidual(free_ball()[0], state, "touch", 1.0)


DRY = sp.JointComponents(friction={"slide_joint": sp.JointFriction(1.0)})


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: dynamics(arm_on_moving_plate(DRY)[0]), "dry friction in its joints"),
        (lambda s: dynamics(with_bristles(s)), r"bristles in the friction of touch.*Coulomb"),
        (lambda s: ContactStep(sp.Simulation(s, sp.Adaptive()), *parts(s)), r"RungeKutta4\(dt\)"),
        (lambda s: ContactStep(s, *parts(s)), r"must be a sphshell_pin\.Simulation"),
        (
            lambda s: ContactDynamics(arm_on_moving_plate()[0], *bare(s)),
            r"crocoddyl.StateMultibody\(scene.model\)",
        ),
        (lambda s: ContactDynamics(s.model, *bare(s)), r"must be a sphshell_pin\.Scene"),
        (lambda s: ContactForceResidual(s, bare(s)[0], "tuch", 1.0), "touch"),
        (lambda s: FrameResidual(s, bare(s)[0], "bal", [0.0, 0.0, 0.0]), "ball"),
        (lambda s: with_cost(s, "place", translation), "place.*ResidualModelFrameT.*FrameResidual"),
        (lambda s: with_cost(s, "force", of_another_scene), "'force'.*same scene"),
    ],
)
def test_wrong_arguments_get_a_sentence(call, said):
    with pytest.raises((InvalidParameter, FrameNotFound, NameNotFound), match=said):
        call(free_ball()[0])


@pytest.mark.parametrize("package", ["crocoddyl", "casadi"])
def test_a_missing_package_names_its_extra(package):
    program = f"import sys; sys.modules['{package}'] = None\nimport sphshell_pin.adapters.{package}"
    done = python(program)
    assert done.returncode == 1
    assert f"pip install 'sphshell-pin[{package}]'" in done.stderr.splitlines()[-1]
