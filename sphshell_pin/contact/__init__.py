"""Contacts of a sphere with a shell, the laws of their forces, and their wrenches."""

from sphshell_pin.contact.bristle import BristleFriction, MindlinFriction
from sphshell_pin.contact.foundation import FoundationLaw, foundation_pressure
from sphshell_pin.contact.friction import CoulombFriction, Friction
from sphshell_pin.contact.function_friction import FunctionFriction
from sphshell_pin.contact.function_law import FunctionLaw
from sphshell_pin.contact.hertz_law import HertzLaw
from sphshell_pin.contact.laws import HuntCrossleyLaw, ImpactLaw
from sphshell_pin.contact.materials import (
    MATERIALS,
    Material,
    find_material,
    friction_between,
    restitution_between,
)
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.contact.plane import Plane
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.contact.table_law import TableLaw
from sphshell_pin.contact.wrench import BristleState, contact_wrench
from sphshell_pin.shell.contact_set import Feature, Method

__all__ = [
    "MATERIALS",
    "BristleFriction",
    "BristleState",
    "CoulombFriction",
    "Feature",
    "FoundationLaw",
    "Friction",
    "FunctionFriction",
    "FunctionLaw",
    "HertzLaw",
    "HuntCrossleyLaw",
    "ImpactLaw",
    "Material",
    "Method",
    "MindlinFriction",
    "NormalLaw",
    "Plane",
    "Sphere",
    "TableLaw",
    "contact_wrench",
    "find_material",
    "foundation_pressure",
    "friction_between",
    "restitution_between",
]
