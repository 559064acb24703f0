"""Contacts of a sphere with a shell, the laws of their forces, and their wrenches."""

from sphshell_pin.contact.friction import BristleFriction, CoulombFriction, Friction
from sphshell_pin.contact.laws import HuntCrossleyLaw, ImpactLaw, NormalLaw
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.contact.wrench import contact_wrench
from sphshell_pin.shell.contact_set import ContactSet, Feature, Method

__all__ = [
    "BristleFriction",
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
