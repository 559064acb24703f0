"""What the recorded patches of a run did: tactile images, and wear."""

from sphshell_pin.patches.taxels import ShellTaxels, TaxelGrid, TaxelImages
from sphshell_pin.patches.wear import WearMap, wear_maps

__all__ = ["ShellTaxels", "TaxelGrid", "TaxelImages", "WearMap", "wear_maps"]
