"""Contacts of a sphere with a shell, the laws of their forces, and their wrenches."""

from sphshell_pin.contact import (
    bristle,
    foundation,
    friction,
    function_law,
    hertz_law,
    laws,
    materials,
    table_law,
)
from sphshell_pin.contact.bristle import *  # noqa: F403
from sphshell_pin.contact.foundation import *  # noqa: F403
from sphshell_pin.contact.friction import *  # noqa: F403
from sphshell_pin.contact.function_law import *  # noqa: F403
from sphshell_pin.contact.hertz_law import *  # noqa: F403
from sphshell_pin.contact.laws import *  # noqa: F403
from sphshell_pin.contact.materials import *  # noqa: F403
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.contact.table_law import *  # noqa: F403
from sphshell_pin.contact.wrench import BristleState, contact_wrench
from sphshell_pin.shell.contact_set import ContactSet, Feature, Method

__all__ = [
    "BristleState",
    "ContactSet",
    "Feature",
    "Method",
    "NormalLaw",
    "Sphere",
    "contact_wrench",
]
__all__ += bristle.__all__
__all__ += foundation.__all__
__all__ += friction.__all__
__all__ += function_law.__all__
__all__ += hertz_law.__all__
__all__ += laws.__all__
__all__ += materials.__all__
__all__ += table_law.__all__
