"""The scenes in EXUDYN: one sphere against all triangles in its GeneralContact."""

import math
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.peers.engine import CannotDo, CpuClock, Engine, Params, Trajectory
from benchmarks.peers.press import PressScene
from benchmarks.peers.scenes import Scene

HEAVY = 1e4  # moment of inertia of what does not turn, or keeps its rate [kg m^2]
MOST_CELLS = 40  # of the search tree along a side
REGULARIZED = 1e-3  # slip below which friction is proportional to it [m/s]: the default


class Exudyn(Engine):
    """EXUDYN's multibody dynamics; a solver call runs the whole scene."""

    name, package = "EXUDYN", "exudyn"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what was set, and the pages that recommend it."""
        return {
            "contact": "GeneralContact: for many contacts (page of ObjectContactSphereSphere)",
            "edges": "excludeDuplicatedTrigSphereContactPoints as swept: more exact at edges",
            "law": f"2 x {scene.stiffness:g} N/m of sphere and of triangles, in series; damping is "
            "added (AddSphereWithMarker)",
            "friction": f"regularized below {REGULARIZED:g} m/s, the default",
        }

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return solvers, steps [s] and the treatment of edges; raises CannotDo."""
        if isinstance(scene, PressScene):
            raise CannotDo("its reader of URDF needs roboticstoolbox-python, which is not set up")
        return [
            {"solver": solver, "dt": dt, "exact edges": exact}
            for solver in ("GeneralizedAlpha", "RK44")
            for exact in (True, False)
            for dt in scene.dts
        ]

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run the scene in a system of its own."""
        exu: Any = import_module("exudyn")
        if isinstance(scene, PressScene):
            raise CannotDo("see param_sets")
        system = exu.SystemContainer().AddSystem()
        contact = general_contact(system, scene, params["exact edges"])
        held = not scene.rolls and scene.mu  # without friction nothing turns it
        moves = scene.position, scene.velocity, scene.angular_velocity, scene.gravity
        node, marker = body(system, scene.mass, HEAVY if held else scene.inertia, *moves)
        contact.AddSphereWithMarker(marker, scene.radius, 2 * scene.stiffness, scene.damping, 0)
        kinds = exu.OutputVariableType
        sensor = {"sensorType": "Node", "nodeNumber": node, "storeInternal": True}
        sensors = [
            system.AddSensor(sensor | {"outputVariableType": kind})
            for kind in (kinds.Position, kinds.Velocity, kinds.AngularVelocity)
        ]
        system.Assemble()
        steps = round(scene.duration / params["dt"])
        with CpuClock() as clock:
            system.SolveDynamic(
                settings_of(scene, params["dt"], steps),
                solverType=getattr(exu.DynamicSolverType, params["solver"]),
            )
        rows = [np.array(system.GetSensorStoredData(sensor)) for sensor in sensors]
        position, velocity, spin = (row[:, 1:] for row in rows)
        return Trajectory(
            t=rows[0][:, 0],
            position=position,
            velocity=velocity,
            angular_velocity=spin,
            cpu=clock.spent,
            simulated=steps * params["dt"],
            steps=steps,
        )


def settings_of(scene: Any, dt: float, steps: int) -> Any:
    """Return the settings of a run: one thread, rows of `record_dt`, nothing printed."""
    settings: Any = import_module("exudyn").SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = max(scene.record_dt, dt)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * dt
    settings.parallel.numberOfThreads = 1
    return settings


def body(
    system: Any, mass: float, inertia: float, place: Any, velocity: Any, spin: Any, gravity: Any
) -> tuple[int, int]:
    """Add a free body; return the numbers of its node and of a marker on it."""
    numbers = system.CreateRigidBody(
        inertia=import_module("exudyn.utilities").RigidBodyInertia(mass, inertia * np.eye(3)),
        nodeType=import_module("exudyn").NodeType.RotationRotationVector,
        referencePosition=list(place),
        initialVelocity=list(velocity),
        initialAngularVelocity=list(spin),
        gravity=list(gravity),
        returnDict=True,
    )
    node = numbers["nodeNumber"]
    return node, system.AddMarker({"markerType": "NodeRigid", "nodeNumber": node})


def general_contact(system: Any, scene: Any, exact_edges: bool) -> Any:
    """Add the triangles, on the ground or on a heavy body that turns; return the contact."""
    surface = scene.surface
    contact = system.AddGeneralContact()
    contact.verboseMode = 0
    contact.frictionProportionalZone = REGULARIZED
    contact.excludeDuplicatedTrigSphereContactPoints = exact_edges
    contact.SetFrictionPairings(scene.mu * np.ones((1, 1)))
    low = surface.vertices.min(axis=0) - 3 * scene.radius
    high = surface.vertices.max(axis=0) + 3 * scene.radius
    cells = [min(MOST_CELLS, math.ceil(x / scene.radius)) for x in high - low]
    contact.SetSearchTreeCellSize(numberOfCells=cells)
    contact.SetSearchTreeBox(pMin=low.tolist(), pMax=high.tolist())
    if scene.table_speed:
        still = np.zeros(3)
        _, ground = body(system, HEAVY, HEAVY, still, still, [0, 0, scene.table_speed], still)
    else:
        node = system.AddNode({"nodeType": "PointGround", "referenceCoordinates": [0.0] * 3})
        ground = system.AddMarker({"markerType": "NodeRigid", "nodeNumber": node})
    contact.AddTrianglesRigidBodyBased(
        ground, 2 * scene.stiffness, 0.0, 0, surface.vertices.tolist(),
        surface.triangles.tolist(), staticTriangles=not scene.table_speed,
    )  # fmt: skip
    return contact
