"""The loop that one writes oneself: pinocchio.aba and coal.collide, from Python."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.peers.engine import CpuClock, Engine, Params, Trajectory
from benchmarks.peers.press import FRAME, PressScene, at_the_end
from benchmarks.peers.scenes import Scene
from benchmarks.peers.shapes import Surface
from benchmarks.peers.truths import BallScene, Bowl
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.primitives import coal_tree
from sphshell_pin.study.report.steps import bare

MOST = 1000  # contacts asked for
APART = np.cos(np.deg2rad(30))  # contacts whose normals are closer than this are one
CREEP = 1e-3  # [m/s]: up to here Coulomb friction grows in proportion to the slip
PYTHON, PARTS = "Python", "C++, parts alone"


class PythonLoop(Engine):
    """Semi-implicit Euler with `pin.aba`; of contacts with like normals the deepest counts."""

    name = "Python loop"

    def version(self) -> str:
        """Return names and versions."""
        import coal
        import pinocchio as pin

        return f"Pinocchio {pin.__version__} and Coal {coal.__version__}"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return how contacts become forces."""
        settings = {
            "contacts": "coal.collide, all of them; the deepest of those within 30 degrees of it",
            "law": "the scene's",
            "integrator": "semi-implicit Euler",
        }
        if scene.mu:
            settings["friction"] = f"Coulomb, in proportion to the slip up to {CREEP:g} m/s"
        if isinstance(scene, PressScene):
            settings[PARTS] = (
                "time of aba + integrate in a compiled loop and of coal.collide where the Python "
                "loop ends: less than a whole loop takes, which has control and forces, too"
            )
        return settings

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return the time steps; the Panda's loop also as the sum of its compiled parts."""
        if isinstance(scene, PressScene):
            return [{"dt": scene.dt, "loop": loop} for loop in (PARTS, PYTHON)]
        if isinstance(scene, Bowl):
            return [{"dt": dt} for dt in (1e-3, 2e-4)]
        return [{"dt": dt} for dt in scene.dts if dt > 5e-6]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run the loop."""
        if isinstance(scene, PressScene):
            if params["loop"] == PARTS:
                return compiled_parts(scene)
            return run_press(scene, params["dt"])
        return run_ball(scene, params["dt"])


@lru_cache(maxsize=2)
def mesh_of(surface: Surface) -> Any:
    """Return Coal's tree of a surface, kept for the runs that follow."""
    return coal_tree(surface.vertices, surface.triangles)


class Finder:
    """Contacts of a sphere and a mesh."""

    def __init__(self, surface: Surface, radius: float) -> None:
        import coal

        self.coal = coal
        self.mesh, self.sphere = mesh_of(surface), coal.Sphere(radius)
        self.placement, self.mesh_placement = coal.Transform3s(), coal.Transform3s()
        self.request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, MOST)
        self.result = coal.CollisionResult()

    def collide(self, center: Array) -> None:
        """Let Coal find all contacts."""
        self.placement.setTranslation(center)
        self.result.clear()
        self.coal.collide(
            self.mesh, self.mesh_placement, self.sphere, self.placement, self.request, self.result
        )

    def contacts(self, center: Array) -> list[tuple[float, Array]]:
        """Return depth [m] and normal (3,), towards the sphere, of each place of touch."""
        self.collide(center)
        found = [(-c.penetration_depth, c.normal) for c in self.result.getContacts()]
        found.sort(key=lambda one: -one[0])
        kept: list[tuple[float, Array]] = []
        for depth, normal in found:
            if depth > 0 and all(normal @ other < APART for _, other in kept):
                kept.append((depth, normal))
        return kept


def forces_of(
    scene: Scene, contacts: list[tuple[float, Array]], velocity: Array, spin: Array, table: Array
) -> tuple[Array, Array, list[Array]]:
    """Return force [N] and torque [N m] about the center on the sphere, and each contact's force.

    `velocity` of the center [m/s], `spin` [rad/s]; `table` is the surface's velocity there [m/s].
    """
    force, torque, each = np.zeros(3), np.zeros(3), []
    for depth, normal in contacts:
        lever = -(scene.radius - depth) * normal
        slip = velocity + np.cross(spin, lever) - table
        rate = float(slip @ normal)
        push = max(0.0, scene.stiffness * depth - scene.damping * rate)
        one = push * normal
        if scene.mu:
            along = slip - rate * normal
            one = one - scene.mu * push * along / max(float(np.linalg.norm(along)), CREEP)
        force = force + one
        torque = torque + np.cross(lever, one)
        each.append(one)
    return force, torque, each


def ball_model(scene: BallScene) -> Any:
    """Return the ball on joints along x, y, z and, if it rolls, a spherical joint after them."""
    import pinocchio as pin

    model = pin.Model()
    model.gravity.linear = np.array(scene.gravity)
    joint = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "place")
    if scene.rolls:
        joint = model.addJoint(joint, pin.JointModelSpherical(), pin.SE3.Identity(), "turn")
    inertia = pin.Inertia.FromSphere(scene.mass, scene.radius)
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    return model


def run_ball(scene: BallScene, dt: float) -> Trajectory:
    """Run a ball; the table, if any, is a plane and need not be turned."""
    import pinocchio as pin

    model = ball_model(scene)
    data, joint = model.createData(), model.njoints - 1
    finder = Finder(scene.surface, scene.radius)
    q, v = np.array(scene.position), np.array(scene.velocity)
    if scene.rolls:
        q, v = np.r_[q, 0.0, 0.0, 0.0, 1.0], np.r_[v, scene.angular_velocity]
    fext = pin.StdVec_Force()
    fext.extend([pin.Force.Zero()] * model.njoints)
    tau, axis = np.zeros(model.nv), np.array([0.0, 0.0, scene.table_speed])
    steps, every = round(scene.duration / dt), max(1, round(scene.record_dt / dt))
    rows: list[tuple[float, Array, Array, Array, Array]] = []
    each: list[Array] = []
    spin, turn = np.array(scene.angular_velocity), np.eye(3)
    with CpuClock() as clock:
        for k in range(steps + 1):
            if scene.rolls:
                turn = pin.Quaternion(q[3:7]).matrix()
                spin = turn @ v[3:]
            center = q[:3]
            contacts = finder.contacts(center)
            force, torque, each = forces_of(
                scene, contacts, v[:3], spin, np.cross(axis, center) if scene.table_speed else axis
            )
            if k % every == 0:
                rows.append((k * dt, center.copy(), v[:3].copy(), spin.copy(), force))
            fext[joint] = pin.Force(turn.T @ force, turn.T @ torque)
            v = v + dt * pin.aba(model, data, q, v, tau, fext)
            q = pin.integrate(model, q, dt * v)
    t, position, velocity, spins, forces = (np.array(column) for column in zip(*rows, strict=True))
    return Trajectory(
        t=t,
        position=position,
        velocity=velocity,
        angular_velocity=spins,
        cpu=clock.spent,
        simulated=steps * dt,
        steps=steps,
        force=forces,
        contact_forces=np.array(each).reshape(-1, 3),
    )


def run_press(scene: PressScene, dt: float) -> Trajectory:
    """Run a tenth of the Panda's run, enough for the time of a step; the only row is the last."""
    import pinocchio as pin

    model = pin.buildModelFromXML(scene.urdf)
    data, frame = model.createData(), model.getFrameId(FRAME)
    joint = model.frames[frame].parentJoint
    finder = Finder(scene.surface, scene.radius)
    fext = pin.StdVec_Force()
    fext.extend([pin.Force.Zero()] * model.njoints)
    q, v, q_ref = np.array(scene.q0), np.zeros(model.nv), np.array(scene.q_ref)
    still, steps = np.zeros(3), scene.steps // 10
    with CpuClock() as clock:
        for _ in range(steps):
            tau = scene.kp * (q_ref - q) - scene.kd * v
            tau = tau + pin.computeGeneralizedGravity(model, data, q)
            pin.forwardKinematics(model, data, q, v)
            tip = pin.updateFramePlacement(model, data, frame).translation
            motion = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            contacts = finder.contacts(tip)
            force, torque, _ = forces_of(scene, contacts, motion.linear, motion.angular, still)
            world = pin.Force(force, torque + np.cross(tip, force))
            fext[joint] = data.oMi[joint].actInv(world)
            v = v + dt * pin.aba(model, data, q, v, tau, fext)
            q = pin.integrate(model, q, dt * v)
    return at_the_end(scene, q, v, clock.spent, steps)


def compiled_parts(scene: PressScene) -> Trajectory:
    """Return what the compiled parts of the loop take, where the Python loop ends."""
    import pinocchio as pin

    import sphshell_pin as sp

    end = run_press(scene, scene.dt)
    finder, steps = Finder(scene.surface, scene.radius), scene.steps // 5
    dynamics = bare(sp.Scene(pin.buildModelFromXML(scene.urdf)))()
    with CpuClock() as clock:
        for _ in range(steps):
            finder.collide(end.position[0])
    cpu = dynamics * steps + clock.spent
    return replace(end, cpu=cpu, simulated=steps * scene.dt, steps=steps)
