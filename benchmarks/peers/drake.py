"""The scenes in Drake: a compliant ball on a rigid mesh, by hydroelastic contact."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.peers.drake_plant import (
    advance,
    empty,
    motion_of,
    simulation,
    slide,
    sum_of_forces,
    wall_forces,
)
from benchmarks.peers.engine import Engine, Params, Trajectory
from benchmarks.peers.merged import MeshFiles, merged_urdf
from benchmarks.peers.press import FRAME, PressScene, at_the_end
from benchmarks.peers.scenes import Scene
from benchmarks.peers.shapes import Surface
from benchmarks.peers.truths import BallScene, Bowl, Cylinder, Groove, Impact
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.swing import BOWL

GUIDE = "Drake, Hydroelastic Contact User Guide"
# The table is light and its motor holds its rate: with a heavy one, the solvers of contact stop too
# early, their tolerance being a share of the momentum of all bodies together.
TABLE_INERTIA, MOTOR = 1e-3, 1e3  # [kg m^2], [N m s/rad]
FINE = 0.1  # edge of the ball's tetrahedra, in radii
# In the exact bowl, force ~ depth^2 that is matched at this many weights swings with the period of
# the linear spring, to 2e-6: the loads of a swing are 0.77 to 1.47 weights.
PERIOD_MATCH = 1.6
PRESS_STEPS = 1000  # of the arm: its steps are long


class Drake(Engine):
    """Drake's MultibodyPlant, stepped by its Simulator."""

    name, package = "Drake", "drake"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what was set, and the pages that recommend it."""
        settings = {
            "contact": f"hydroelastic, rigid mesh and compliant ball ({GUIDE}); point contact "
            "would take the mesh's convex hull",
            "modulus": f"{modulus(scene):.3g} Pa: under the load of the scene the ball sinks as "
            "deep as with its linear spring; pressure grows with depth, force as depth^2",
            "dissipation": f"{scene.damping / load(scene):.3g} s/m of Hunt and Crossley: the "
            "scene's dashpot at that load",
            "continuous": "runge_kutta3 with error control (SimulatorConfig)",
            "discrete": "SAP or Lagged (MultibodyPlant, DiscreteContactApproximation)",
        }
        if isinstance(scene, PressScene):
            settings["arm"] = "fixed links merged, gravity off for it in place of its compensation "
            settings["arm"] += "(MultibodyPlant.set_gravity_enabled); PD gains of its actuators"
        elif scene.mu:
            settings["patch"] = "friction acts over a patch and so resists spin about the normal, "
            settings["patch"] += "which a point does not: the truth is that of a point"
        return settings

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return integrators, with accuracy or time step [s], and the edge of tetrahedra [m]."""
        if isinstance(scene, PressScene):
            return [
                {"contact": contact, "dt": scene.dt, "edge": edge * scene.radius}
                for edge, contact in ((0.25, "kLagged"), (0.25, "kSap"), (1.0, "kLagged"))
            ]
        coarse: Params
        coarse, fine, finest = ({"edge": k * FINE * scene.radius} for k in (1, 0.5, 0.25))
        explicit: Params = {"integrator": "runge_kutta3", "max_step": 0.01}
        discrete: list[Params] = [
            {"contact": name, "dt": dt} for name in ("kLagged", "kSap") for dt in (1e-3, 2e-4)
        ]
        if isinstance(scene, Impact):
            steps = [explicit | {"max_step": dt, "accuracy": 1e-3} for dt in scene.dts[1:]]
            steps += [{"contact": "kSap", "dt": dt} for dt in scene.dts]
            return [params | coarse for params in steps]
        if isinstance(scene, Bowl):  # the best first: time may be short
            good = [explicit | {"accuracy": k} | fine for k in (1e-3, 1e-4)]
            cheap = [explicit | {"accuracy": k} | coarse for k in (1e-3, 1e-2)]
            return [*good, *cheap, *(params | coarse for params in discrete)]
        if scene.mu:
            param_sets = [params | coarse for params in discrete]
            if not scene.table_speed:  # stiff: it would take minutes on the table
                param_sets.append(explicit | {"accuracy": 1e-2} | coarse)
            return param_sets
        # At rest: a short step gains nothing, a fine ball does.
        resting = [explicit | {"accuracy": 1e-3}, *discrete[::2]]
        return [params | edge for edge in (finest, coarse) for params in resting]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Build the plant and run it."""
        if isinstance(scene, PressScene):
            return self._press(scene, params)
        return self._ball(scene, params)

    @cached_property
    def _arms(self) -> dict[tuple[Any, ...], Arm]:
        return {}

    @cached_property
    def _files(self) -> MeshFiles:
        return MeshFiles()

    def _mesh(self, surface: Surface) -> Any:
        """Return the shape of a surface."""
        from pydrake.geometry import Mesh

        return Mesh(self._files.of(surface))

    def _touch(self, plant: Any, scene: Scene, params: Params, ball: Any, ground: Any) -> None:
        """Give the ball (body and place of the center) and the ground their shapes and the law."""
        from pydrake.geometry import (
            AddCompliantHydroelasticProperties,
            AddContactMaterial,
            AddRigidHydroelasticProperties,
            ProximityProperties,
            Sphere,
        )
        from pydrake.math import RigidTransform
        from pydrake.multibody.plant import CoulombFriction

        body, center = ball
        for place, shape, stiff in (
            ((body, RigidTransform(center)), Sphere(scene.radius), False),
            ((ground, RigidTransform()), self._mesh(scene.surface), True),
        ):
            properties = ProximityProperties()
            if stiff:
                AddRigidHydroelasticProperties(properties)
            else:
                AddCompliantHydroelasticProperties(params["edge"], modulus(scene), properties)
            friction = CoulombFriction(scene.mu, scene.mu)
            dissipation = scene.damping / load(scene)
            AddContactMaterial(properties, dissipation, friction=friction)
            # SAP has a linear dashpot of its own: the time c / k.
            properties.AddProperty("material", "relaxation_time", scene.damping / scene.stiffness)
            plant.RegisterCollisionGeometry(*place, shape, "mesh" if stiff else "ball", properties)

    def _ball(self, scene: BallScene, params: Params) -> Trajectory:
        from pydrake.multibody.tree import PdControllerGains, RevoluteJoint, SpatialInertia

        builder, plant = empty(params, scene.gravity)
        inertia = SpatialInertia.SolidSphereWithMass(scene.mass, scene.radius)
        ball = plant.AddRigidBody("ball", inertia)
        ground = plant.world_body()
        if not scene.rolls:
            slide(plant, ball)
        if scene.table_speed:
            light = SpatialInertia.SolidBoxWithMass(6 * TABLE_INERTIA, 1.0, 1.0, 1.0)
            table = plant.AddRigidBody("table", light)
            hinge = RevoluteJoint(
                "table", ground.body_frame(), table.body_frame(), np.array([0.0, 0.0, 1.0])
            )
            hinge = plant.AddJoint(hinge)  # the plant's own
            motor = plant.AddJointActuator("motor", hinge)
            motor.set_controller_gains(PdControllerGains(p=1e-9, d=MOTOR))
            ground = table
        self._touch(plant, scene, params, (ball, np.zeros(3)), ground)
        plant.Finalize()
        simulator, context = simulation(builder, plant, params)
        if scene.rolls:
            from pydrake.math import RigidTransform
            from pydrake.multibody.math import SpatialVelocity

            plant.SetFreeBodyPose(context, ball, RigidTransform(np.array(scene.position)))
            motion = SpatialVelocity(np.array(scene.angular_velocity), np.array(scene.velocity))
            plant.SetFreeBodySpatialVelocity(context, ball, motion)
        else:
            plant.SetPositions(context, scene.position)
            plant.SetVelocities(context, scene.velocity)
        if scene.table_speed:
            hinge.set_angular_rate(context, scene.table_speed)
            wanted = plant.get_desired_state_input_port(table.model_instance())
            wanted.FixValue(context, [0.0, scene.table_speed])
        t, states, cpu, steps = advance(simulator, plant, scene, params)
        rows = [motion_of(plant, context, ball, state) for state in states]
        position, velocity, spin = (np.array(column) for column in zip(*rows, strict=True))
        force = None
        if not scene.mu and not isinstance(scene, (Bowl, Impact)):  # where they are asked for
            force = np.array([sum_of_forces(plant, context, state) for state in states])
        return Trajectory(
            t=t,
            position=position,
            velocity=velocity,
            angular_velocity=spin,
            cpu=cpu,
            simulated=t[-1],
            steps=steps,
            force=force,
            contact_forces=wall_forces(plant, context) if isinstance(scene, Groove) else None,
            energy=energy(scene, position, velocity) if isinstance(scene, Bowl) else None,
        )

    def _press(self, scene: PressScene, params: Params) -> Trajectory:
        arm = self._arm(scene, params)
        plant, context = arm.plant, arm.context
        arm.simulator.get_mutable_context().SetTime(0.0)
        plant.SetPositionsAndVelocities(context, np.r_[scene.q0, np.zeros(len(scene.q0))])
        short = replace(scene, steps=min(scene.steps, PRESS_STEPS))
        _, states, cpu, steps = advance(arm.simulator, plant, short, params)
        q, v = np.split(states[-1], 2)
        return at_the_end(short, q, v, cpu, steps, sum_of_forces(plant, context, states[-1]))

    def _arm(self, scene: PressScene, params: Params) -> Arm:
        """Return the arm, kept for runs that follow: the mesh takes seconds to load."""
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.tree import PdControllerGains

        key = (scene, *params.items())
        if key in self._arms:
            return self._arms[key]
        self._arms.clear()
        builder, plant = empty(params, scene.gravity)
        text = merged_urdf(scene, sphere=False)
        model = Parser(plant).AddModelsFromString(text, "urdf")[0]
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link0"))
        for i in range(1, len(scene.q0) + 1):
            actuator = plant.AddJointActuator(f"motor{i}", plant.GetJointByName(f"joint{i}"))
            actuator.set_controller_gains(PdControllerGains(p=scene.kp, d=scene.kd))
        plant.set_gravity_enabled(model, False)
        link, center = tip(scene)
        ball = plant.GetBodyByName(f"link{link}"), center
        self._touch(plant, scene, params, ball, plant.world_body())
        plant.Finalize()
        simulator, context = simulation(builder, plant, params)
        wanted = np.r_[scene.q_ref, np.zeros(len(scene.q_ref))]
        plant.get_desired_state_input_port(model).FixValue(context, wanted)
        self._arms[key] = Arm(plant, simulator, context)
        return self._arms[key]


@dataclass(frozen=True)
class Arm:
    """The plant of the press, its simulator and context."""

    plant: Any
    simulator: Any
    context: Any


def load(scene: Scene) -> float:
    """Return the force [N] at which Drake's law is matched to the scene's."""
    if isinstance(scene, PressScene):
        return scene.stiffness * scene.rise
    if isinstance(scene, Groove):
        return scene.load
    if isinstance(scene, Cylinder):
        return scene.stiffness * scene.depth
    if isinstance(scene, Bowl):
        return PERIOD_MATCH * scene.weight
    if isinstance(scene, Impact):  # what stops it
        return math.sqrt(scene.stiffness * scene.mass) * abs(scene.velocity[2])
    return scene.weight


def modulus(scene: Scene) -> float:
    """Return the hydroelastic modulus [Pa] with which the load sinks as deep as into the spring.

    Pressure modulus * depth / r over the patch where ball and surface overlap gives, while depth
    is far below r, the force pi modulus depth^2 / s. There s = sqrt((1 - r / R1) (1 - r / R2)),
    with the radii of curvature R1, R2 of the surface.
    """
    s = 1.0
    if isinstance(scene, Bowl):
        s = 1 - scene.radius / BOWL
    elif isinstance(scene, Cylinder):
        s = math.sqrt(1 - scene.radius / BOWL)
    return s * scene.stiffness**2 / (math.pi * load(scene))


def energy(scene: Bowl, position: Array, velocity: Array) -> Array:
    """Return kinetic energy, of gravity and of the compliant ball in the exact bowl (n,) [J]."""
    depth = np.maximum(np.linalg.norm(position, axis=1) - (BOWL - scene.radius), 0.0)
    stored = scene.stiffness**2 / load(scene) * depth**3 / 3
    high = -scene.mass * position @ np.array(scene.gravity)
    total: Array = 0.5 * scene.mass * (velocity**2).sum(axis=1) + high + stored
    return total


def tip(scene: PressScene) -> tuple[int, Array]:
    """Return the number of the fingertip's link and its place there (3,) [m]."""
    import pinocchio as pin

    model = pin.buildModelFromXML(scene.urdf)
    frame = model.frames[model.getFrameId(FRAME)]
    return int(frame.parentJoint), np.array(frame.placement.translation)
