"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from sphshell_pin.dynamics import controllers, impedance, integrators, sensors
from sphshell_pin.dynamics.controllers import *  # noqa: F403
from sphshell_pin.dynamics.derivatives import (
    ContactForceDerivatives,
    DynamicsDerivatives,
    StepDerivatives,
)
from sphshell_pin.dynamics.impedance import *  # noqa: F403
from sphshell_pin.dynamics.integrators import *  # noqa: F403
from sphshell_pin.dynamics.joints import JointFriction, JointIngredients, JointLimits
from sphshell_pin.dynamics.result import Result
from sphshell_pin.dynamics.result_parts import ContactLog, EnergyAudit, Event
from sphshell_pin.dynamics.rollout import Rollout
from sphshell_pin.dynamics.run_stats import JointFigures, PairFigures, RunStats
from sphshell_pin.dynamics.scene import ContactPair, Scene, SceneContacts, SceneState
from sphshell_pin.dynamics.sensitivities import Sensitivities
from sphshell_pin.dynamics.sensor_log import Readings, SensorLog
from sphshell_pin.dynamics.sensors import *  # noqa: F403
from sphshell_pin.dynamics.simulation import Simulation

__all__ = [
    "ContactForceDerivatives",
    "ContactLog",
    "ContactPair",
    "DynamicsDerivatives",
    "EnergyAudit",
    "Event",
    "JointFigures",
    "JointFriction",
    "JointIngredients",
    "JointLimits",
    "PairFigures",
    "Readings",
    "Result",
    "Rollout",
    "RunStats",
    "Scene",
    "SceneContacts",
    "SceneState",
    "Sensitivities",
    "SensorLog",
    "Simulation",
    "StepDerivatives",
]
__all__ += controllers.__all__
__all__ += impedance.__all__
__all__ += integrators.__all__
__all__ += sensors.__all__
