"""Where methods of lower layers find the functions of upper ones, such as that of `Result.plot`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphshell_pin.upper_layers import UpperLayers

layers: UpperLayers
"""Registered by the package, which is above all of them."""
