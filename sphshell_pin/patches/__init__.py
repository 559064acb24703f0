"""What the recorded patches of a run did to tactile sensors."""

from sphshell_pin.patches.taxels import ShellTaxels, TaxelGrid

__all__ = [
    "ShellTaxels",
    "TaxelGrid",
]
