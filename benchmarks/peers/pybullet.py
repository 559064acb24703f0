"""The scenes in PyBullet: its triangle meshes in a world ten times larger."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.peers.engine import CpuClock, Engine, Params, Trajectory
from benchmarks.peers.merged import MeshFiles, merged_urdf
from benchmarks.peers.press import PressScene, at_the_end
from benchmarks.peers.scenes import Scene
from benchmarks.peers.shapes import Surface
from benchmarks.peers.truths import BallScene, Bowl, Impact
from sphshell_pin.base.arrays import Array

SCALE = 10.0  # of lengths; masses and times stay, forces grow as lengths do, torques as squares
GUIDE = "PyBullet Quickstart Guide"
HEAVY = 1e6  # moment of inertia of what keeps its rate, in PyBullet's units
RIGID = 1e18  # [N/m]: springs act in series, and that of the surface counts for nothing


class PyBullet(Engine):
    """Bullet's multi-body dynamics, stepped from Python."""

    name, package = "PyBullet", "pybullet"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what was set, and the pages that recommend it."""
        settings = {
            "lengths": f"x {SCALE:g}: bodies below 0.05 units are too small "
            "(Bullet wiki, Scaling The World)",
            "mesh": "GEOM_FORCE_CONCAVE_TRIMESH and GEOM_CONCAVE_INTERNAL_EDGE "
            "(example internalEdge.py)",
            "law": f"contactStiffness {scene.stiffness:g} N/m, contactDamping "
            f"{scene.damping:g} N s/m: the scene's ({GUIDE}, changeDynamics)",
            "solver": "50 iterations, no early stop; contactBreakingThreshold as swept "
            f"({GUIDE}, setPhysicsEngineParameter)",
        }
        if isinstance(scene, PressScene):
            settings["arm"] = "fixed links merged, no joint limits, no gravity in place of its "
            settings["arm"] += "compensation; PD torques in C++ by pdControlPlugin (pdControl.py)"
            settings["stepping"] = "a Python loop of stepSimulation"
        elif isinstance(scene, Impact):
            settings["ccd"] = "ccdSweptSphereRadius as swept (experimentalCcdSphereRadius.py)"
        return settings

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return time steps [s], with the largest gap [m] of a contact point that is kept."""
        if isinstance(scene, PressScene):
            return [{"dt": scene.dt, "breaking": gap} for gap in (2e-3, 1e-4)]
        if isinstance(scene, Impact):
            return [
                {"dt": dt, "breaking": 2e-3, "ccd": on} for dt in scene.dts for on in (True, False)
            ]
        steps = (1e-3, 2e-4, 2e-3) if isinstance(scene, Bowl) else scene.dts[:2]
        gaps = (1e-3, 1e-4, 2e-3)  # the last is the default
        return [{"dt": dt, "breaking": gap} for dt in steps for gap in gaps]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run the scene in a world of its own."""
        with world(scene, params) as bullet:
            if isinstance(scene, PressScene):
                return self._press(bullet, scene)
            return self._ball(bullet, scene, params)

    @cached_property
    def _files(self) -> MeshFiles:
        return MeshFiles()

    def _mesh(self, bullet: Any, surface: Surface) -> int:
        """Return the collision shape of a surface."""
        shape: int = bullet.createCollisionShape(
            bullet.GEOM_MESH,
            fileName=self._files.of(surface),
            meshScale=[SCALE] * 3,
            flags=bullet.GEOM_FORCE_CONCAVE_TRIMESH | bullet.GEOM_CONCAVE_INTERNAL_EDGE,
        )
        return shape

    def _ball(self, bullet: Any, scene: BallScene, params: Params) -> Trajectory:
        surface = self._mesh(bullet, scene.surface)
        if scene.table_speed:
            ground = turning(bullet, surface, scene.table_speed)
        else:
            ground = bullet.createMultiBody(0, surface)
        held = not scene.rolls and scene.mu > 0  # without friction nothing turns it
        ball = bullet.createMultiBody(
            scene.mass,
            bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=scene.radius * SCALE),
            basePosition=scaled(scene.position),
            # A change of inertia takes effect in a multi-body at once, else after a step; but
            # continuous collision detection knows no multi-bodies.
            useMaximalCoordinates=not held,
        )
        bullet.resetBaseVelocity(ball, scaled(scene.velocity), list(scene.angular_velocity))
        soften(bullet, scene, ball, ground)
        if held:
            # Without the mass, too, it would be taken as zero: a body that never moves.
            bullet.changeDynamics(ball, -1, mass=scene.mass, localInertiaDiagonal=[HEAVY] * 3)
        if params.get("ccd"):
            bullet.changeDynamics(ball, -1, ccdSweptSphereRadius=0.5 * scene.radius * SCALE)

        def row() -> tuple[Array, Array, Array, Array]:
            place, _ = bullet.getBasePositionAndOrientation(ball)
            velocity, spin = bullet.getBaseVelocity(ball)
            force = point_forces(bullet.getContactPoints(ball, ground)).sum(axis=0)
            return np.array(place) / SCALE, np.array(velocity) / SCALE, np.array(spin), force

        dt = params["dt"]
        each = max(1, round(scene.record_dt / dt))
        count = -(-round(scene.duration / dt) // each)
        rows, cpu = stepped(bullet.stepSimulation, each, count, row)
        position, velocity, spin, force = (np.array(column) for column in zip(*rows, strict=True))
        return Trajectory(
            t=dt * each * np.arange(count + 1),
            position=position,
            velocity=velocity,
            angular_velocity=spin,
            cpu=cpu,
            simulated=dt * each * count,
            steps=each * count,
            force=force,
            contact_forces=point_forces(bullet.getContactPoints(ball, ground)),
        )

    def _press(self, bullet: Any, scene: PressScene) -> Trajectory:
        path = self._files.folder / "arm.urdf"
        path.write_text(merged_urdf(scene, SCALE))
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        arm = bullet.loadURDF(str(path), useFixedBase=True, flags=flags)
        ground = bullet.createMultiBody(0, self._mesh(bullet, scene.surface))
        joints = range(len(scene.q0))
        for joint, q in zip(joints, scene.q0, strict=True):
            bullet.resetJointState(arm, joint, q)
        soften(bullet, scene, arm, ground, joints)
        # The motor that every joint has by default brakes it.
        bullet.setJointMotorControlArray(
            arm, joints, bullet.VELOCITY_CONTROL, forces=[0.0] * len(joints)
        )
        bullet.loadPlugin("pdControlPlugin")
        for joint, q in zip(joints, scene.q_ref, strict=True):
            bullet.setJointMotorControl2(
                arm,
                joint,
                bullet.PD_CONTROL,
                targetPosition=q,
                targetVelocity=0.0,
                positionGain=scene.kp * SCALE**2,
                velocityGain=scene.kd * SCALE**2,
                force=1e9,
            )
        _, cpu = stepped(bullet.stepSimulation, scene.steps, 1, lambda: None)
        states = bullet.getJointStates(arm, joints)
        angles, rates = (np.array([state[k] for state in states]) for k in (0, 1))
        force = point_forces(bullet.getContactPoints(arm, ground)).sum(axis=0)
        return at_the_end(scene, angles, rates, cpu, scene.steps, force)


@contextmanager
def world(scene: Scene, params: Params) -> Iterator[Any]:
    """Connect to an empty world, and disconnect at the end."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    try:
        # The arm's gravity is compensated: it has none.
        gravity = (0.0, 0.0, 0.0) if isinstance(scene, PressScene) else scene.gravity
        pybullet.setGravity(*scaled(gravity))
        pybullet.setTimeStep(params["dt"])
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=50,
            solverResidualThreshold=0.0,
            contactBreakingThreshold=params["breaking"] * SCALE,
        )
        yield pybullet
    finally:
        pybullet.disconnect()


def scaled(vector: Any) -> list[float]:
    """Return a length, velocity or acceleration (3,) in PyBullet's world."""
    return [SCALE * float(x) for x in vector]


def soften(bullet: Any, scene: Scene, body: int, ground: int, links: Any = ()) -> None:
    """Give body and ground the scene's law; nothing else takes energy."""
    parts = [(ground, link) for link in range(-1, bullet.getNumJoints(ground))]
    # Damping of both bodies is added; friction is multiplied.
    for part in parts:
        bullet.changeDynamics(
            *part, contactStiffness=RIGID, contactDamping=0.0, lateralFriction=1.0
        )
    for part in ((body, link) for link in (-1, *links)):
        bullet.changeDynamics(
            *part,
            contactStiffness=scene.stiffness,
            contactDamping=scene.damping,
            lateralFriction=scene.mu,
        )
        parts.append(part)
    for part in parts:
        bullet.changeDynamics(
            *part,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            rollingFriction=0.0,
            spinningFriction=0.0,
            restitution=0.0,
        )


def turning(bullet: Any, shape: int, speed: float) -> int:
    """Return a heavy body that turns about z at `speed` [rad/s]."""
    table: int = bullet.createMultiBody(
        baseMass=0.0,
        linkMasses=[1.0],
        linkCollisionShapeIndices=[shape],
        linkVisualShapeIndices=[-1],
        linkPositions=[[0.0] * 3],
        linkOrientations=[[0.0, 0.0, 0.0, 1.0]],
        linkInertialFramePositions=[[0.0] * 3],
        linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]],
        linkParentIndices=[0],
        linkJointTypes=[bullet.JOINT_REVOLUTE],
        linkJointAxis=[[0.0, 0.0, 1.0]],
    )
    bullet.changeDynamics(table, 0, localInertiaDiagonal=[HEAVY] * 3)
    bullet.setJointMotorControl2(table, 0, bullet.VELOCITY_CONTROL, force=0.0)
    bullet.resetJointState(table, 0, 0.0, targetVelocity=speed)
    return table


def stepped(
    step: Callable[[], Any], each: int, count: int, row: Callable[[], Any]
) -> tuple[list[Any], float]:
    """Return `count` + 1 rows, `each` steps apart, and the CPU time [s] of the steps alone."""
    rows, clock = [row()], CpuClock()
    for _ in range(count):
        with clock:
            for _ in range(each):
                step()
        rows.append(row())
    return rows, clock.spent


def point_forces(points: Any) -> Array:
    """Return the force (k, 3) [N] of every contact point on the first body, in the real world."""
    forces = [
        point[9] * np.array(point[7])
        + point[10] * np.array(point[11])
        + point[12] * np.array(point[13])
        for point in points
    ]
    return np.reshape(forces, (-1, 3)) / SCALE
