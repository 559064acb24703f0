"""The array of numbers that most of the package computes with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double precision; shapes are stated where it is used."""
