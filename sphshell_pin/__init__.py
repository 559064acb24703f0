"""Exact contact of spheres with CAD surfaces, as wrenches for Pinocchio's dynamics."""

from sphshell_pin import _versions as _versions  # loads the core: Pinocchio and Coal first
from sphshell_pin.contact import (
    ContactSet,
    CoulombFriction,
    Feature,
    HuntCrossleyLaw,
    ImpactLaw,
    Sphere,
    contact_wrench,
)
from sphshell_pin.dynamics import (
    CartesianImpedance,
    GravityCompensation,
    JointPD,
    Result,
    RungeKutta4,
    Scene,
    SemiImplicitEuler,
    Simulation,
)
from sphshell_pin.errors import SphshellError
from sphshell_pin.shell import Shell

__version__ = "0.1.0"

__all__ = [
    "CartesianImpedance",
    "ContactSet",
    "CoulombFriction",
    "Feature",
    "GravityCompensation",
    "HuntCrossleyLaw",
    "ImpactLaw",
    "JointPD",
    "Result",
    "RungeKutta4",
    "Scene",
    "SemiImplicitEuler",
    "Shell",
    "Simulation",
    "Sphere",
    "SphshellError",
    "contact_wrench",
]
