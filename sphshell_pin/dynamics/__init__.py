"""Scenes of contact pairs on a Pinocchio model, and their motion."""

from sphshell_pin.dynamics.control.controllers import GravityCompensation as GravityCompensation
from sphshell_pin.dynamics.control.controllers import JointPD as JointPD
from sphshell_pin.dynamics.control.impedance import CartesianImpedance as CartesianImpedance
from sphshell_pin.dynamics.result.result import Result as Result
from sphshell_pin.dynamics.run.integrators import Adaptive as Adaptive
from sphshell_pin.dynamics.run.integrators import Implicit as Implicit
from sphshell_pin.dynamics.run.integrators import LinearlyImplicitEuler as LinearlyImplicitEuler
from sphshell_pin.dynamics.run.integrators import RungeKutta4 as RungeKutta4
from sphshell_pin.dynamics.run.integrators import SemiImplicitEuler as SemiImplicitEuler
from sphshell_pin.dynamics.run.simulation import Simulation as Simulation
from sphshell_pin.dynamics.scene.joint_components import JointComponents as JointComponents
from sphshell_pin.dynamics.scene.joint_components import JointFriction as JointFriction
from sphshell_pin.dynamics.scene.joint_components import JointLimits as JointLimits
from sphshell_pin.dynamics.scene.scene import Scene as Scene
from sphshell_pin.dynamics.sensing.sensors import ContactSwitch as ContactSwitch
from sphshell_pin.dynamics.sensing.sensors import ForceTorqueSensor as ForceTorqueSensor
from sphshell_pin.dynamics.sensing.sensors import JointTorqueSensor as JointTorqueSensor
