"""Contacts of a sphere with a shell, the laws of their forces, and their wrenches."""

from sphshell_pin.contact.foundation import FoundationLaw as FoundationLaw
from sphshell_pin.contact.foundation import foundation_pressure as foundation_pressure
from sphshell_pin.contact.friction import BristleFriction as BristleFriction
from sphshell_pin.contact.friction import CoulombFriction as CoulombFriction
from sphshell_pin.contact.friction import Friction as Friction
from sphshell_pin.contact.friction import MindlinFriction as MindlinFriction
from sphshell_pin.contact.function_laws import FunctionFriction as FunctionFriction
from sphshell_pin.contact.function_laws import FunctionLaw as FunctionLaw
from sphshell_pin.contact.hertz_law import HertzLaw as HertzLaw
from sphshell_pin.contact.laws import HuntCrossleyLaw as HuntCrossleyLaw
from sphshell_pin.contact.laws import ImpactLaw as ImpactLaw
from sphshell_pin.contact.materials import MATERIALS as MATERIALS
from sphshell_pin.contact.materials import Material as Material
from sphshell_pin.contact.materials import find_material as find_material
from sphshell_pin.contact.materials import friction_between as friction_between
from sphshell_pin.contact.materials import restitution_between as restitution_between
from sphshell_pin.contact.normal_law import NormalLaw as NormalLaw
from sphshell_pin.contact.plane import Plane as Plane
from sphshell_pin.contact.sphere import Sphere as Sphere
from sphshell_pin.contact.table_law import TableLaw as TableLaw
from sphshell_pin.contact.wrench import BristleState as BristleState
from sphshell_pin.contact.wrench import contact_wrench as contact_wrench
from sphshell_pin.shell.contact_set import Feature as Feature
from sphshell_pin.shell.contact_set import Method as Method
