"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from sphshell_pin.dynamics.controllers import CartesianImpedance, GravityCompensation, JointPD
from sphshell_pin.dynamics.integrators import (
    Adaptive,
    Implicit,
    LinearlyImplicitEuler,
    RungeKutta4,
    SemiImplicitEuler,
)
from sphshell_pin.dynamics.result import ContactLog, EnergyAudit, Event, Result
from sphshell_pin.dynamics.rollout import Rollout
from sphshell_pin.dynamics.run_stats import PairFigures, RunStats
from sphshell_pin.dynamics.scene import ContactPair, Scene, SceneContacts, SceneState
from sphshell_pin.dynamics.simulation import Simulation

__all__ = [
    "Adaptive",
    "CartesianImpedance",
    "ContactLog",
    "ContactPair",
    "EnergyAudit",
    "Event",
    "GravityCompensation",
    "Implicit",
    "JointPD",
    "LinearlyImplicitEuler",
    "PairFigures",
    "Result",
    "Rollout",
    "RunStats",
    "RungeKutta4",
    "Scene",
    "SceneContacts",
    "SceneState",
    "SemiImplicitEuler",
    "Simulation",
]
