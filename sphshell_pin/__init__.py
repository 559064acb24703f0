"""Exact contact of spheres with CAD surfaces, as wrenches for Pinocchio's dynamics.

The public names are loaded when they are first used.
"""

from __future__ import annotations

from sphshell_pin._interrupts import interrupts_delayed

# isort: split
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

with interrupts_delayed():
    from sphshell_pin import _versions as _versions  # loads the core: Pinocchio and Coal first
    from sphshell_pin.deprecation import FormerModules

sys.meta_path.append(FormerModules())

if TYPE_CHECKING:
    from sphshell_pin.contact import MATERIALS as MATERIALS
    from sphshell_pin.contact import BristleFriction as BristleFriction
    from sphshell_pin.contact import BristleState as BristleState
    from sphshell_pin.contact import ContactSet as ContactSet
    from sphshell_pin.contact import CoulombFriction as CoulombFriction
    from sphshell_pin.contact import Feature as Feature
    from sphshell_pin.contact import FoundationLaw as FoundationLaw
    from sphshell_pin.contact import FunctionLaw as FunctionLaw
    from sphshell_pin.contact import HertzLaw as HertzLaw
    from sphshell_pin.contact import HuntCrossleyLaw as HuntCrossleyLaw
    from sphshell_pin.contact import ImpactLaw as ImpactLaw
    from sphshell_pin.contact import MindlinFriction as MindlinFriction
    from sphshell_pin.contact import Sphere as Sphere
    from sphshell_pin.contact import TableLaw as TableLaw
    from sphshell_pin.contact import contact_wrench as contact_wrench
    from sphshell_pin.contact import foundation_pressure as foundation_pressure
    from sphshell_pin.dynamics import Adaptive as Adaptive
    from sphshell_pin.dynamics import CartesianImpedance as CartesianImpedance
    from sphshell_pin.dynamics import ContactSwitch as ContactSwitch
    from sphshell_pin.dynamics import ForceTorqueSensor as ForceTorqueSensor
    from sphshell_pin.dynamics import GravityCompensation as GravityCompensation
    from sphshell_pin.dynamics import Implicit as Implicit
    from sphshell_pin.dynamics import JointComponents as JointComponents
    from sphshell_pin.dynamics import JointFriction as JointFriction
    from sphshell_pin.dynamics import JointLimits as JointLimits
    from sphshell_pin.dynamics import JointPD as JointPD
    from sphshell_pin.dynamics import JointTorqueSensor as JointTorqueSensor
    from sphshell_pin.dynamics import LinearlyImplicitEuler as LinearlyImplicitEuler
    from sphshell_pin.dynamics import Result as Result
    from sphshell_pin.dynamics import RungeKutta4 as RungeKutta4
    from sphshell_pin.dynamics import Scene as Scene
    from sphshell_pin.dynamics import SemiImplicitEuler as SemiImplicitEuler
    from sphshell_pin.dynamics import Simulation as Simulation
    from sphshell_pin.errors import SphshellError as SphshellError
    from sphshell_pin.patches import ShellTaxels as ShellTaxels
    from sphshell_pin.patches import TaxelGrid as TaxelGrid
    from sphshell_pin.patches import TaxelImages as TaxelImages
    from sphshell_pin.patches import WearMap as WearMap
    from sphshell_pin.patches import wear_maps as wear_maps
    from sphshell_pin.shell import Face as Face
    from sphshell_pin.shell import Shell as Shell
    from sphshell_pin.study.fit import Experiment as Experiment
    from sphshell_pin.study.fit import Fit as Fit
    from sphshell_pin.study.fit import fit as fit

__version__ = "0.2.0"

_HOME = {
    "MATERIALS": "contact",
    "Adaptive": "dynamics",
    "BristleFriction": "contact",
    "BristleState": "contact",
    "CartesianImpedance": "dynamics",
    "ContactSet": "contact",
    "ContactSwitch": "dynamics",
    "CoulombFriction": "contact",
    "Experiment": "study.fit",
    "Face": "shell",
    "Feature": "contact",
    "Fit": "study.fit",
    "ForceTorqueSensor": "dynamics",
    "FoundationLaw": "contact",
    "FunctionLaw": "contact",
    "GravityCompensation": "dynamics",
    "HertzLaw": "contact",
    "HuntCrossleyLaw": "contact",
    "ImpactLaw": "contact",
    "Implicit": "dynamics",
    "JointPD": "dynamics",
    "JointTorqueSensor": "dynamics",
    "JointLimits": "dynamics",
    "JointComponents": "dynamics",
    "JointFriction": "dynamics",
    "LinearlyImplicitEuler": "dynamics",
    "MindlinFriction": "contact",
    "Result": "dynamics",
    "RungeKutta4": "dynamics",
    "Scene": "dynamics",
    "SemiImplicitEuler": "dynamics",
    "Shell": "shell",
    "ShellTaxels": "patches",
    "Simulation": "dynamics",
    "Sphere": "contact",
    "SphshellError": "errors",
    "TableLaw": "contact",
    "TaxelGrid": "patches",
    "TaxelImages": "patches",
    "WearMap": "patches",
    "contact_wrench": "contact",
    "fit": "study.fit",
    "foundation_pressure": "contact",
    "wear_maps": "patches",
}
_PARTS = (
    "contact",
    "dynamics",
    "errors",
    "patches",
    "robots",
    "scenario",
    "shell",
    "units",
    "view",
)

__all__ = sorted(_HOME)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    """Load a public name or a part of the package at its first use."""
    if name in _HOME:
        value = getattr(import_module(f"sphshell_pin.{_HOME[name]}"), name)
        globals()[name] = value
        return value
    if name == "JointIngredients":
        from sphshell_pin.deprecation import warn_former

        warn_former(f"sphshell_pin.{name}", "it is called JointComponents")
        return __getattr__("JointComponents")
    if name in _PARTS:
        return import_module(f"sphshell_pin.{name}")
    raise AttributeError(f"module 'sphshell_pin' has no attribute '{name}'")


def __dir__() -> list[str]:
    """List the public names too, loaded or not."""
    return sorted({*globals(), *_HOME, *_PARTS})
