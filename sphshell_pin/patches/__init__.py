"""What the recorded patches of a run did to tactile sensors."""

from sphshell_pin.patches.taxels import ShellTaxels as ShellTaxels
from sphshell_pin.patches.taxels import TaxelGrid as TaxelGrid
