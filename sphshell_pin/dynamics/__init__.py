"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from typing import TYPE_CHECKING

from sphshell_pin.deprecation import former_names
from sphshell_pin.dynamics.control import controllers, impedance
from sphshell_pin.dynamics.control.controllers import *  # noqa: F403
from sphshell_pin.dynamics.control.impedance import *  # noqa: F403
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import ContactLog, EnergyAudit, Event
from sphshell_pin.dynamics.result.run_stats import JointFigures, PairFigures, RunStats
from sphshell_pin.dynamics.run import integrators
from sphshell_pin.dynamics.run.integrators import *  # noqa: F403
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
from sphshell_pin.dynamics.sensing import sensors
from sphshell_pin.dynamics.sensing.sensor_log import Readings, SensorLog
from sphshell_pin.dynamics.sensing.sensors import *  # noqa: F403

__all__ = [
    "ContactForceDerivatives",
    "ContactLog",
    "ContactPair",
    "DynamicsDerivatives",
    "EnergyAudit",
    "Event",
    "JointComponents",
    "JointFigures",
    "JointFriction",
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

if not TYPE_CHECKING:
    __getattr__ = former_names(__name__, {"JointIngredients": "JointComponents"})
