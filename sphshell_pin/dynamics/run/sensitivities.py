"""How the rows of a run change with parameters and with its start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import pinocchio as pin

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
from sphshell_pin.errors import InvalidParameter, ResultError

if TYPE_CHECKING:
    from sphshell_pin import _core
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene


# The share of its size by which a row is moved where a figure is differenced.
_STEP = 1e-6


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
    result: Result | None = None

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

    def of(self, figure: Callable[[Result], float]) -> Array:
        """Return the derivatives (p,) of a figure of the result by the parameters.

        `figure` gets results whose rows q, v and contacts are moved a little along each column; it
        is differenced between them. What is no row has no derivative here: `stats`, `events`,
        `energy`, `sensors` and `patches` raise ResultError. A result that was loaded has no scene,
        and its q cannot be moved (ResultError). InvalidParameter for what returns no number.
        """
        if not callable(figure):
            raise InvalidParameter("figure", figure, "must be a function of a Result")
        return np.array([self._of(figure, k) for k in range(len(self.parameters))])

    def _of(self, figure: Callable[[Result], float], column: int) -> float:
        result = self.result
        assert result is not None
        log = result.contacts
        sizes = [
            _largest(self.q[..., column]),
            _largest(self.v[..., column]) / (_largest(result.v) or 1.0),
            _largest(self.force_world[..., column]) / (_largest(log.normal_force) or 1.0),
            _largest(self.depth[..., column]) / (_largest(log.depth) or 1.0),
        ]
        if max(sizes) == 0:
            return 0.0
        step = _STEP / max(sizes)
        more, less = (_number(figure(self._moved(result, column, sign * step))) for sign in (1, -1))
        return (more - less) / (2 * step)

    def _moved(self, result: Result, column: int, step: float) -> Result:
        if result.scene is None:
            raise ResultError("the result", "has no scene, so that its rows cannot be moved")
        model, log = result.scene.model, result.contacts
        force, normal = self.force_world[..., column], self.normal_force[..., column]
        by_q = self.q[..., column]
        moved = [pin.integrate(model, q, step * by) for q, by in zip(result.q, by_q, strict=True)]
        contacts = replace(
            log,
            depth=log.depth + step * self.depth[..., column],
            normal_force=log.normal_force + step * normal,
            friction_force_world=log.friction_force_world
            + step * (force - normal[:, None] * log.normal_world),
        )
        others: dict[str, Any] = {
            part: _NoRow(part) for part in ("stats", "events", "energy", "sensors")
        }
        return replace(
            result,
            q=np.array(moved),
            v=result.v + step * self.v[..., column],
            contacts=contacts,
            patch_rows=None,
            sensitivity_rows=None,
            **others,
        )


class _NoRow:
    """Stands for a part of a result that has no derivative."""

    def __init__(self, name: str) -> None:
        self._name = name

    def _refuse(self, *_: object) -> NoReturn:
        raise ResultError(
            f"result.{self._name}",
            "has no derivatives: a figure can take t, q, v and contacts of the result",
        )

    __getattr__ = __getitem__ = __iter__ = __len__ = _refuse


def _number(value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        given = f"returned {type(value).__name__},"
        raise InvalidParameter("figure", value, "must return a number", given) from None


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


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
