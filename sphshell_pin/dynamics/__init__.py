"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from sphshell_pin.dynamics.control.controllers import GravityCompensation, JointPD
from sphshell_pin.dynamics.control.impedance import CartesianImpedance
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import ContactLog, EnergyAudit, Event
from sphshell_pin.dynamics.result.run_stats import JointFigures, PairFigures, RunStats
from sphshell_pin.dynamics.run.integrators import (
    Adaptive,
    Implicit,
    LinearlyImplicitEuler,
    RungeKutta4,
    SemiImplicitEuler,
)
from sphshell_pin.dynamics.run.rollout import Rollout
from sphshell_pin.dynamics.run.sensitivities import Sensitivities
from sphshell_pin.dynamics.run.simulation import Simulation
from sphshell_pin.dynamics.scene.derivatives import (
    ContactForceDerivatives,
    DynamicsDerivatives,
    StepDerivatives,
)
from sphshell_pin.dynamics.scene.joint_components import (
    JointComponents,
    JointFriction,
    JointLimits,
)
from sphshell_pin.dynamics.scene.scene import ContactPair, Scene, SceneContacts, SceneState
from sphshell_pin.dynamics.sensing.sensor_log import Readings, SensorLog
from sphshell_pin.dynamics.sensing.sensors import (
    ContactSwitch,
    ForceTorqueSensor,
    JointTorqueSensor,
)

__all__ = [
    "Adaptive",
    "CartesianImpedance",
    "ContactForceDerivatives",
    "ContactLog",
    "ContactPair",
    "ContactSwitch",
    "DynamicsDerivatives",
    "EnergyAudit",
    "Event",
    "ForceTorqueSensor",
    "GravityCompensation",
    "Implicit",
    "JointComponents",
    "JointFigures",
    "JointFriction",
    "JointLimits",
    "JointPD",
    "JointTorqueSensor",
    "LinearlyImplicitEuler",
    "PairFigures",
    "Readings",
    "Result",
    "Rollout",
    "RunStats",
    "RungeKutta4",
    "Scene",
    "SceneContacts",
    "SceneState",
    "SemiImplicitEuler",
    "Sensitivities",
    "SensorLog",
    "Simulation",
    "StepDerivatives",
]
