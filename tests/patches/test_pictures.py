"""Pictures of taxels."""

import pytest

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.patches import ShellTaxels, TaxelGrid
from sphshell_pin.plot.taxels import plot_taxels
from tests.patches.scenes import plate, slide


@pytest.fixture(scope="module")
def slid():
    return slide(plate(0.02))


def test_images_of_taxels_have_latitude_upwards(slid):
    grid = TaxelGrid("tip", (4, 6), axis=(0, 0, -1), up=(0, 1, 0), extent=(0.4, 0.6))
    figure = plot_taxels(grid.images(slid), [0, 10])
    shown = figure.axes[0].images[0]
    assert shown.origin == "lower"
    assert shown.get_array().shape == (4, 6)
    with pytest.raises(InvalidParameter, match="TaxelGrid"):
        plot_taxels(ShellTaxels("tip").images(slid), [0])
