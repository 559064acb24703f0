"""Plants of Drake: built, stepped, and read afterwards."""

import time
from typing import Any

import numpy as np

from benchmarks.peers.engine import CannotDo, Params
from benchmarks.peers.scenes import Scene
from sphshell_pin.base.arrays import Array


def empty(params: Params, gravity: Any) -> tuple[Any, Any]:
    """Return a builder and its plant, continuous unless the params has a time step."""
    from pydrake.multibody.plant import (
        AddMultibodyPlantSceneGraph,
        ContactModel,
        DiscreteContactApproximation,
    )
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=params.get("dt", 0.0))
    plant.set_contact_model(ContactModel.kHydroelastic)
    if "dt" in params:
        approximation = getattr(DiscreteContactApproximation, params["contact"])
        plant.set_discrete_contact_approximation(approximation)
        # Forces are asked for afterwards, at states that were recorded.
        plant.SetUseSampledOutputPorts(False)
    plant.mutable_gravity_field().set_gravity_vector(np.array(gravity))
    return builder, plant


def slide(plant: Any, ball: Any) -> None:
    """Let the ball move along x, y, z alone."""
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia

    parent = plant.world_body()
    for name, axis in zip("xyz", np.eye(3), strict=True):
        child = ball if name == "z" else plant.AddRigidBody(name, SpatialInertia.Zero())
        joint = PrismaticJoint(name, parent.body_frame(), child.body_frame(), axis)
        plant.AddJoint(joint)
        parent = child


def simulation(builder: Any, plant: Any, params: Params) -> tuple[Any, Any]:
    """Return a simulator and the plant's context."""
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    simulator = Simulator(builder.Build())
    if "accuracy" in params:
        config = SimulatorConfig(
            integration_scheme=params["integrator"],
            accuracy=params["accuracy"],
            use_error_control=True,
            max_step_size=params["max_step"],
        )
        ApplySimulatorConfig(config, simulator)
    return simulator, plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())


def advance(
    simulator: Any, plant: Any, scene: Scene, params: Params
) -> tuple[Array, list[Array], float, int]:
    """Run; return times (n,) [s], states there, CPU time of the steps [s] and their number.

    Rows lie `record_dt` apart, or at every step that is longer.
    """
    root = simulator.get_context()
    context = plant.GetMyContextFromRoot(root)
    t: list[float] = []
    states: list[Array] = []
    reading = 0.0

    def row(_: Any = None) -> None:
        nonlocal reading
        before = time.process_time()
        now = root.get_time()
        if not t or now - t[-1] > 0.999 * scene.record_dt:
            t.append(now)
            states.append(plant.GetPositionsAndVelocities(context).copy())
        reading += time.process_time() - before

    simulator.Initialize()
    if scene.duration / scene.record_dt > 1.5:
        simulator.set_monitor(row)
    row()
    reading, before = 0.0, time.process_time()
    try:
        simulator.AdvanceTo(scene.duration)
    except RuntimeError as error:
        reason = str(error).partition("\n")[0]
        raise CannotDo(f"{params} stops at t = {root.get_time():.3g} s: {reason}") from error
    cpu = time.process_time() - before - reading
    row()
    return np.array(t), states, cpu, int(simulator.get_num_steps_taken())


def motion_of(plant: Any, context: Any, body: Any, state: Array) -> tuple[Array, Array, Array]:
    """Return place [m], velocity [m/s] and angular velocity [rad/s] of a body's origin."""
    plant.SetPositionsAndVelocities(context, state)
    pose = plant.EvalBodyPoseInWorld(context, body)
    motion = plant.EvalBodySpatialVelocityInWorld(context, body)
    return pose.translation(), motion.translational(), motion.rotational()


def contacts(plant: Any, context: Any) -> list[Any]:
    """Return what Drake reports of the contact surfaces."""
    results = plant.get_contact_results_output_port().Eval(context)
    count = results.num_hydroelastic_contacts()
    return [results.hydroelastic_contact_info(i) for i in range(count)]


def sum_of_forces(plant: Any, context: Any, state: Array) -> Array:
    """Return the force (3,) [N] on the ball, which was registered before the mesh."""
    plant.SetPositionsAndVelocities(context, state)
    total = np.zeros(3)
    for contact in contacts(plant, context):
        total += contact.F_Ac_W().translational()
    return total


def wall_forces(plant: Any, context: Any) -> Array:
    """Return the force (k, 3) [N] of each facet of the contact surfaces on the ball.

    Drake reports the sum of a surface; it is divided in proportion to pressure times area.
    """
    forces: list[Array] = []
    for contact in contacts(plant, context):
        surface = contact.contact_surface()
        triangles = surface.is_triangle()
        mesh = surface.tri_mesh_W() if triangles else surface.poly_mesh_W()
        field = surface.tri_e_MN() if triangles else surface.poly_e_MN()
        faces = range(surface.num_faces())
        centers = [mesh.element_centroid(i) for i in faces]
        pushes = np.array(
            [
                field.EvaluateCartesian(i, center) * surface.area(i) * surface.face_normal(i)
                for i, center in zip(faces, centers, strict=True)
            ]
        )
        whole = np.linalg.norm(contact.F_Ac_W().translational())
        forces.extend(pushes * whole / np.linalg.norm(pushes.sum(axis=0)))
    return np.reshape(forces, (-1, 3))
