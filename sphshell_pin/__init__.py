"""Exact contact of spheres with CAD surfaces, as wrenches for Pinocchio's dynamics.

The public names are loaded when they are first used.
"""

from sphshell_pin._interrupts import interrupts_delayed

# isort: split
from importlib import import_module
from typing import TYPE_CHECKING, Any

with interrupts_delayed():  # Pinocchio and Coal load first, then the core
    from sphshell_pin._versions import __version__ as __version__

from sphshell_pin.base import upward
from sphshell_pin.upper_layers import UpperLayers

if TYPE_CHECKING:
    from sphshell_pin import results as results
    from sphshell_pin.contact import *  # noqa: F403
    from sphshell_pin.contact.laws import *  # noqa: F403
    from sphshell_pin.dynamics import *  # noqa: F403
    from sphshell_pin.dynamics.control.controllers import *  # noqa: F403
    from sphshell_pin.dynamics.run.integrators import *  # noqa: F403
    from sphshell_pin.dynamics.sensing.sensors import *  # noqa: F403
    from sphshell_pin.errors import InvalidParameter as InvalidParameter
    from sphshell_pin.errors import SphshellError as SphshellError
    from sphshell_pin.patches import *  # noqa: F403
    from sphshell_pin.shell import Shell as Shell
    from sphshell_pin.study.fit import Experiment as Experiment
    from sphshell_pin.study.fit import fit as fit

upward.layers = UpperLayers()

_PARTS = (
    "contact",
    "dynamics",
    "errors",
    "patches",
    "results",
    "robots",
    "scenario",
    "shell",
    "units",
    "view",
)
# What a type checker sees above; tests compare the two.
_NAMES = {
    "contact": "BristleFriction BristleState CoulombFriction Feature FoundationLaw Friction "
    "FunctionFriction FunctionLaw HertzLaw MATERIALS Material Method MindlinFriction NormalLaw "
    "Plane Sphere TableLaw contact_wrench find_material foundation_pressure "
    "friction_between restitution_between",
    "contact.laws": "HuntCrossleyLaw ImpactLaw",
    "dynamics": "CartesianImpedance JointComponents JointFriction JointLimits Result Scene "
    "Simulation",
    "dynamics.control.controllers": "GravityCompensation JointPD",
    "dynamics.run.integrators": "Adaptive Implicit LinearlyImplicitEuler RungeKutta4 "
    "SemiImplicitEuler",
    "dynamics.sensing.sensors": "ContactSwitch ForceTorqueSensor JointTorqueSensor",
    "errors": "InvalidParameter SphshellError",
    "patches": "ShellTaxels TaxelGrid",
    "shell": "Shell",
    "study.fit": "Experiment fit",
}
_HOME = {name: part for part, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_HOME)  # noqa: PLE0605


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Load a public name or a part of the package at its first use."""
        if name in _HOME:
            value = getattr(import_module(f"sphshell_pin.{_HOME[name]}"), name)
            globals()[name] = value
            return value
        if name in _PARTS:
            return import_module(f"sphshell_pin.{name}")
        raise AttributeError(f"module 'sphshell_pin' has no attribute '{name}'")


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted([*_HOME, *_PARTS, "__version__"])
