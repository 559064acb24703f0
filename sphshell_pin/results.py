"""Types of what the library returns, for annotations and isinstance."""

from sphshell_pin.dynamics.result.result_parts import ContactLog, EnergyAudit, Event
from sphshell_pin.dynamics.result.run_stats import JointFigures, PairFigures, RunStats
from sphshell_pin.dynamics.run.rollout import Rollout
from sphshell_pin.dynamics.run.sensitivities import Sensitivities
from sphshell_pin.dynamics.scene.derivatives import (
    ContactForceDerivatives,
    DynamicsDerivatives,
    StepDerivatives,
)
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts
from sphshell_pin.dynamics.scene.scene_state import SceneState
from sphshell_pin.dynamics.sensing.sensor_log import Readings, SensorLog
from sphshell_pin.patches.taxels import TaxelImages
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.contact_set import ContactSet
from sphshell_pin.shell.faces import Face
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.queries import ClosestPoints

__all__ = [
    "CleanedSurface",
    "ClosestPoints",
    "ContactForceDerivatives",
    "ContactLog",
    "ContactPair",
    "ContactSet",
    "DynamicsDerivatives",
    "EnergyAudit",
    "Event",
    "Face",
    "JointFigures",
    "PairFigures",
    "Readings",
    "Rollout",
    "RunStats",
    "SceneContacts",
    "SceneState",
    "Sensitivities",
    "SensorLog",
    "ShellHealth",
    "StepDerivatives",
    "TaxelImages",
]
