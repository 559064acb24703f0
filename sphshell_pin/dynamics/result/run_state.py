"""States that a run can go on from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Fact, Summarized

_TIME, _STATE = 5, 17  # where a run's numbers have t, and q: see dynamics/run/simulation.cpp


@dataclass(frozen=True, repr=False, eq=False)
class RunState(Summarized):
    """All that the next steps of a run depend on, where one of its steps was accepted.

    `t` [s], `q` (nq,), `v` (nv,); `values` (m,) has these and the rest as numbers: stretches of
    bristles, contacts with their ids and sides, the next step's length, torques that are held, the
    work done. `Result.at` gives one, `Simulation.run` takes it in place of q0. Equal where all
    numbers are.
    """

    t: float
    q: Array
    v: Array
    values: Array

    @classmethod
    def from_values(cls, values: Array, nq: int, nv: int) -> RunState:
        """Return the state that a run with so many coordinates has recorded as `values` (m,)."""
        values = read_only(np.array(values, np.float64))
        q, v = values[_STATE : _STATE + nq], values[_STATE + nq : _STATE + nq + nv]
        return cls(float(values[_TIME]), q, v, values)

    def __eq__(self, other: object) -> bool:
        """Whether a run goes on from both with the same bits."""
        return isinstance(other, RunState) and np.array_equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]

    def _facts(self) -> list[Fact]:
        return [Fact("time", self.t, "s"), Fact("numbers", len(self.values))]


def split_states(
    values: NDArray[np.generic] | None, sizes: NDArray[np.generic] | None
) -> tuple[Array, ...] | None:
    """Return the numbers of each row, of which there are `sizes`, one behind the other."""
    if values is None or sizes is None:
        return None
    ends = np.cumsum(sizes.astype(np.int64))[:-1]
    return tuple(read_only(one) for one in np.split(values.astype(np.float64), ends))
