"""The arrays of numbers that the package computes with; shapes are stated where they are used."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double precision."""
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]
