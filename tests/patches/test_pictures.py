"""Pictures of patches and taxels: what they show is where it was, and as large."""

from dataclasses import replace

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.patches import ShellTaxels, TaxelGrid
from sphshell_pin.plot import plot_contact_map
from sphshell_pin.plot.taxels import plot_taxels
from tests.patches.scenes import plate, slide
from tests.test_plot import texts


@pytest.fixture(scope="module")
def slid():
    return slide(plate(0.02))


def test_the_contact_map_shows_patches_true_to_size(slid):
    figure = plot_contact_map(slid)
    assert "peak pressure of patches [MPa]" in texts(figure)
    ellipses = figure.axes[0].collections[-1]
    corners = np.array(ellipses._faces)[:, :33]
    a = slid.patches["half_axes"][0, 0] * 1e3  # in the picture's millimeters
    np.testing.assert_allclose(np.ptp(corners[..., 1], axis=1), 2 * a, rtol=0.01)
    middles = corners[:, :-1].mean(axis=1)
    assert middles[:, 0].min() == pytest.approx(-10.0, abs=0.01)
    assert np.diff(np.sort(middles[:, 0])).min() > 1.4 * a


def test_the_contact_map_of_a_run_without_patches_has_none(slid):
    figure = plot_contact_map(replace(slid, patch_rows=None))
    assert not any("patches" in text for text in texts(figure))


def test_images_of_taxels_have_latitude_upwards(slid):
    grid = TaxelGrid("tip", (4, 6), axis=(0, 0, -1), up=(0, 1, 0), extent=(0.4, 0.6))
    figure = plot_taxels(grid.images(slid), [0, 10])
    shown = figure.axes[0].images[0]
    assert shown.origin == "lower"
    assert shown.get_array().shape == (4, 6)
    with pytest.raises(InvalidParameter, match="TaxelGrid"):
        plot_taxels(ShellTaxels("tip").images(slid), [0])
