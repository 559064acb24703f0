"""How the rows of a run change with parameters and with its start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.named_numbers import (
    START,
    columns_of,
    every_column,
    names_of_pairs,
    names_of_start,
)
from sphshell_pin.base.summary import Fact, Summarized, names
from sphshell_pin.dynamics.control.controllers import reads_sensors
from sphshell_pin.dynamics.scene.derivatives import core_parameters
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin import _core
    from sphshell_pin.dynamics.scene.scene import Scene


@dataclass(frozen=True, repr=False)
class Sensitivities(Summarized):
    """Derivatives of a result's rows, a column for each of `parameters` (p of them).

    Of the n rows `q` (n, nv, p) in the tangent space of q, and `v` (n, nv, p); of the m entries of
    the contact log `force_world` (m, 3, p), the force on the sphere [N], `normal_force` and `depth`
    (m, p). The times of the rows are held. Columns "q0.0", ... are those of the initial position in
    its tangent space, "v0.0", ... those of the initial velocity.
    """

    parameters: tuple[str, ...]
    q: Array
    v: Array
    force_world: Array
    normal_force: Array
    depth: Array

    def _facts(self) -> list[Fact]:
        return [
            Fact("by", names(self.parameters)),
            Fact("rows", len(self.q)),
            Fact("contacts", len(self.depth)),
        ]

    def column(self, name: str) -> int:
        """Return the number of a column; InvalidParameter lists them."""
        if name not in self.parameters:
            must = f"must be one of {', '.join(self.parameters)}"
            raise InvalidParameter("column", name, must)
        return self.parameters.index(name)


class Asked:
    """What a run is to be differentiated by; checks the names."""

    def __init__(self, scene: Scene, names: object, controller: object) -> None:
        names = (names,) if isinstance(names, str) else names
        known = {**names_of_pairs(scene.pairs), **names_of_start(scene.model.nv)}
        self._scene, self._controller = scene, controller
        self.columns = columns_of(names, known, "sensitivities")
        """Names of all columns."""
        numbers = every_column(known)
        self._columns = [one for one in self.columns if numbers[one][0].path[0] not in START]
        self._starts = {
            half: tuple(half + end for end in known[half].ends or ())
            for half in START
            if any(numbers[one][0] is known[half] for one in self.columns)
        }
        if callable(controller) and reads_sensors(controller):
            must = (
                "cannot be differentiated, as it reads sensors, which have a memory: take one that "
                "computes its torques from t, q, v and contacts"
            )
            raise InvalidParameter("controller", controller, must)

    def __bool__(self) -> bool:
        return bool(self.columns)

    def begin(self, core: _core.Simulation) -> None:
        """Let a compiled run, which has not begun, follow its derivatives."""
        start = np.array(core.q), np.array(core.v)
        parameters = core_parameters(self._scene, self._columns, start)
        core.differentiate(parameters, *(half in self._starts for half in START))

    def check(self, core: _core.Simulation) -> None:
        """Raise InvalidParameter if the controller was seen to have a memory."""
        if core.controller_remembers:
            must = (
                "cannot be differentiated, as it gave two torques when it was asked twice at a "
                "state: it must compute them from t, q, v and contacts alone"
            )
            raise InvalidParameter("controller", self._controller, must)

    def rows(self, core: _core.Simulation) -> Sensitivities:
        """Return what the run has recorded."""
        self.check(core)
        record = core.take_sensitivities()
        nv, columns = self._scene.model.nv, self.columns
        # The core has the parameters first, then all columns of the start.
        recorded = [*self._columns, *(one for half in self._starts.values() for one in half)]
        order = [recorded.index(column) for column in columns]

        def rows(name: str, *shape: int) -> Array:
            return read_only(record[name].reshape(-1, *shape, len(recorded))[..., order])

        return Sensitivities(
            columns,
            q=rows("q", nv),
            v=rows("v", nv),
            force_world=rows("force_world", 3),
            normal_force=rows("normal_force"),
            depth=rows("depth"),
        )
