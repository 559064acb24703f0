"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from sphshell_pin.dynamics.control.controllers import GravityCompensation, JointPD
from sphshell_pin.dynamics.control.impedance import CartesianImpedance
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.run.integrators import (
    Adaptive,
    Implicit,
    LinearlyImplicitEuler,
    RungeKutta4,
    SemiImplicitEuler,
)
from sphshell_pin.dynamics.run.simulation import Simulation
from sphshell_pin.dynamics.scene.joint_components import JointComponents, JointFriction, JointLimits
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.sensing.sensors import (
    ContactSwitch,
    ForceTorqueSensor,
    JointTorqueSensor,
)

__all__ = [
    "Adaptive",
    "CartesianImpedance",
    "ContactSwitch",
    "ForceTorqueSensor",
    "GravityCompensation",
    "Implicit",
    "JointComponents",
    "JointFriction",
    "JointLimits",
    "JointPD",
    "JointTorqueSensor",
    "LinearlyImplicitEuler",
    "Result",
    "RungeKutta4",
    "Scene",
    "SemiImplicitEuler",
    "Simulation",
]
