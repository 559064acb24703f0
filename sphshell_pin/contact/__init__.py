"""Contacts of a sphere with a shell, the laws of their forces, and their wrenches."""

from sphshell_pin.contact.contact_set import ContactSet, Feature, Method
from sphshell_pin.contact.friction import BristleFriction, CoulombFriction, Friction
from sphshell_pin.contact.laws import HuntCrossleyLaw, ImpactLaw, NormalLaw
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.contact.wrench import BristleState, contact_wrench

__all__ = [
    "BristleFriction",
    "BristleState",
    "ContactSet",
    "CoulombFriction",
    "Feature",
    "Friction",
    "HuntCrossleyLaw",
    "ImpactLaw",
    "Method",
    "NormalLaw",
    "Sphere",
    "contact_wrench",
]
