"""The patches in which bodies touch, as runs record them where they are asked to."""

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter

RECORDED = ("patch", "torque", "state")
"""What a run records only where it is asked to."""

PATCH = np.dtype(_core.patch_row_type())
"""One patch: `half_axes` (2,) a >= b [m], `axis_world` (3,) the direction of a, `peak_pressure` and
`mean_pressure` [Pa], `approach` [m]. Numbers are nan where a contact's geometry is unknown."""

Patches = NDArray[Any]  # (m,) of PATCH


def check_record(record: Collection[str]) -> frozenset[str]:
    """Return the names of RECORDED in `record`; InvalidParameter if it has others."""
    if isinstance(record, str) or not isinstance(record, Collection):
        raise InvalidParameter("record", record, "must be a list of names, such as ['patch']")
    for name in record:
        if name not in RECORDED:
            valid = " or ".join(f"'{one}'" for one in RECORDED)
            raise InvalidParameter("record", name, f"must be {valid}")
    return frozenset(record)


def patch_columns(patches: Patches) -> dict[str, Array]:
    """Return patches as named scalar columns, units in the names (for CSV, tables)."""
    columns = {
        "half_axis_a [m]": patches["half_axes"][:, 0],
        "half_axis_b [m]": patches["half_axes"][:, 1],
    }
    columns |= {f"patch_axis_{a} [1]": patches["axis_world"][:, i] for i, a in enumerate("xyz")}
    pressures = {f"{n} [Pa]": patches[n] for n in ("peak_pressure", "mean_pressure")}
    return columns | pressures | {"approach [m]": patches["approach"]}
