"""The scenes in this package."""

import math
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from benchmarks.peers.engine import CpuClock, Engine, Params, Trajectory
from benchmarks.peers.press import FRAME, PressScene, at_the_end
from benchmarks.peers.scenes import Scene
from benchmarks.peers.shapes import Surface
from benchmarks.peers.truths import BallScene, Bowl, Impact
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.run.advance import advance, start_run
from sphshell_pin.dynamics.sensing.sensors import SensorSet
from sphshell_pin.study.report.models import model_of

# Bristles are so much stiffer than the contact: what rolls should not slip.
STIFFER = 100.0
FULL_DAMPING_DEPTH = 1e-9  # [m]: the dashpot acts from the touch on
CREEP = 1e-3  # [m/s]: up to here the Panda's Coulomb friction is regularised, as the peers' is
TABLE_INERTIA = 1e4  # [kg m^2]: the ball does not slow the table


class Ours(Engine):
    """sphshell_pin: curved elements, one contact per place of touch."""

    name, package = "sphshell_pin", "sphshell-pin"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return the law, the friction and where their choice is explained."""
        settings = {"method": "smooth", "law": f"spring {scene.stiffness:g} N/m: the scene's"}
        if isinstance(scene, PressScene):
            settings["friction"] = f"CoulombFriction, full from {CREEP:g} m/s on"
        elif scene.mu:
            settings["friction"] = "BristleFriction (docs/laws.md)"
        settings["integrator"] = "docs/dynamics.md, choosing an integrator"
        return settings

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return integrators with their steps or tolerances."""
        if isinstance(scene, PressScene):
            euler = {"integrator": "SemiImplicitEuler", "dt": scene.dt}
            return [euler, euler | {"compiled": True}]
        adaptive = [{"integrator": "Adaptive", "rtol": 10.0**-e} for e in (4, 6, 8)]
        if isinstance(scene, Bowl):
            orders = {"SemiImplicitEuler": (4, 3, 2, 1, 0.5), "RungeKutta4": (4, 2, 1, 0.5, 0.2)}
            fixed = [(name, 1e-3 * dt) for name, dts in orders.items() for dt in dts]
            return [*({"integrator": name, "dt": dt} for name, dt in fixed), *adaptive]
        steps: list[Params] = [{"integrator": "SemiImplicitEuler", "dt": dt} for dt in scene.dts]
        if isinstance(scene, Impact) or not scene.mu:
            return [*steps, *adaptive]
        implicit = [{"integrator": "Implicit", "rtol": 10.0**-e} for e in (3, 4, 5, 6)]
        # Longer steps do not resolve the bristles.
        return [*(params for params in steps if params["dt"] < 2e-4), *implicit, *adaptive]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run twice: once timed, with the last row alone, once for the rows."""
        integrator = integrator_of(params)
        if isinstance(scene, PressScene):
            built = press_scene(scene, "compiled" in params)
            return run_press(scene, sp.Simulation(built, integrator))
        built, q0, v0 = ball_scene(scene)
        simulation = sp.Simulation(built, integrator)
        cpu = timed(simulation, q0, v0, scene.duration, None)
        record = max(scene.record_dt, params.get("dt", 0.0))
        result = simulation.run(q0, v0, scene.duration, record_dt=record)
        return read(scene, result, cpu)


def integrator_of(params: Params) -> Any:
    """Return the integrator that a params names."""
    settings = {name: params[name] for name in ("dt", "rtol") if name in params}
    return getattr(sp, params["integrator"])(**settings)


def timed(simulation: sp.Simulation, q0: Array, v0: Any, duration: float, control: Any) -> float:
    """Return the CPU time [s] of the compiled loop alone."""
    core = start_run(
        simulation.scene,
        simulation.integrator,
        q0,
        v0,
        duration,
        control,
        None,
        record_dt=duration,
        t0=0.0,
        sensors=SensorSet((), simulation.scene),
    )
    with CpuClock() as clock:
        advance(core)
    return clock.spent


@lru_cache(maxsize=2)
def shell_of(surface: Surface) -> sp.Shell:
    """Return the shell of a surface, kept for the runs that follow."""
    return sp.Shell(surface.vertices, surface.triangles, normals=surface.normals)


def friction_of(mu: float, stiffness: float, mass: float) -> sp.BristleFriction | None:
    """Return friction that sticks; `mass` [kg] is what the bristles move."""
    if not mu:
        return None
    bristles = STIFFER * stiffness
    return sp.BristleFriction(mu, mu, bristles, math.sqrt(bristles * mass))


def ball_scene(scene: BallScene) -> tuple[sp.Scene, Array, Array]:
    """Return the scene of a ball, q0 and v0."""
    kind = pin.JointModelFreeFlyer() if scene.rolls else pin.JointModelTranslation()
    bodies = [("ball", kind, pin.Inertia.FromSphere(scene.mass, scene.radius))]
    q0, v0 = np.array(scene.position), np.array(scene.velocity)
    if scene.rolls:
        q0, v0 = np.r_[q0, 0.0, 0.0, 0.0, 1.0], np.r_[v0, scene.angular_velocity]
    frame = "universe"
    if scene.table_speed:
        frame = "table"
        heavy = pin.Inertia(1.0, np.zeros(3), TABLE_INERTIA * np.eye(3))
        bodies.append((frame, pin.JointModelRUBZ(), heavy))
        q0, v0 = np.r_[q0, 1.0, 0.0], np.r_[v0, scene.table_speed]
    moved = scene.mass * (2 / 7 if scene.rolls else 1.0)
    model = model_of(*bodies)
    model.gravity.linear = np.array(scene.gravity)
    built = sp.Scene(model)
    built.add_contact(
        sphere=sp.Sphere(scene.radius, "ball"),
        shell=shell_of(scene.surface),
        frame=frame,
        law=sp.ImpactLaw(scene.stiffness, 1.0, scene.damping, FULL_DAMPING_DEPTH),
        friction=friction_of(scene.mu, scene.stiffness, moved),
    )
    return built, q0, v0


def read(scene: BallScene, result: sp.Result, cpu: float) -> Trajectory:
    """Return the rows of a run of `ball_scene`."""
    position, velocity = result.q[:, :3], result.v[:, :3]
    spin = np.zeros_like(position)
    if scene.rolls:
        turns = np.array([pin.XYZQUATToSE3(q[:7]).rotation for q in result.q])
        velocity, spin = (
            np.einsum("nij,nj->ni", turns, part) for part in (result.v[:, :3], result.v[:, 3:6])
        )
    log = result.contacts
    force = np.zeros_like(position)
    np.add.at(force, log.row, log.force_world)
    return Trajectory(
        t=result.t,
        position=position,
        velocity=velocity,
        angular_velocity=spin,
        cpu=cpu,
        simulated=scene.duration,
        steps=int(result.stats.steps),
        force=force,
        contact_forces=log.at_row(len(result.t) - 1).force_world,
    )


@lru_cache(maxsize=2)
def press_scene(scene: PressScene, compiled: bool = False) -> sp.Scene:
    """Return the scene of the Panda."""
    built = sp.Scene(pin.buildModelFromXML(scene.urdf), compiled=compiled)
    built.add_contact(
        sphere=sp.Sphere(scene.radius, FRAME),
        shell=shell_of(scene.surface),
        law=sp.ImpactLaw(scene.stiffness, 1.0, scene.damping, FULL_DAMPING_DEPTH),
        friction=sp.CoulombFriction(scene.mu, scene.mu, CREEP, 2 * CREEP),
    )
    return built


def run_press(scene: PressScene, simulation: sp.Simulation) -> Trajectory:
    """Time the run of the Panda; the only row is the last."""
    q0, control = np.array(scene.q0), sp.JointPD(scene.kp, scene.kd, scene.q_ref)
    cpu = timed(simulation, q0, None, scene.duration, control)
    result = simulation.run(q0, None, scene.duration, control, record_dt=scene.duration)
    force = result.contacts.at_row(len(result.t) - 1).force_world.sum(axis=0)
    return at_the_end(scene, result.q[-1], result.v[-1], cpu, int(result.stats.steps), force)
