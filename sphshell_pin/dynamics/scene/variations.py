"""Parameters of a scene's contact pairs, and of sensors, that differ from run to run."""

from collections.abc import Mapping, Sequence
from typing import TypeGuard, TypeVar

import numpy as np
import pinocchio as pin

from sphshell_pin.base.checks import check_floats, check_placement, check_type
from sphshell_pin.base.named_numbers import (
    Names,
    find_name,
    names_of_pairs,
    names_of_sensors,
    with_value,
)
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.errors import InvalidParameter

T = TypeVar("T")


def check_names_of(vary: object) -> Mapping[str, object]:
    """Return `vary`, {} for None; raise InvalidParameter unless it maps names to values."""
    if vary is None:
        return {}
    if not isinstance(vary, Mapping) or not all(isinstance(name, str) for name in vary):
        raise InvalidParameter(
            "vary", vary, "must map names to n values, as {'PAIR.law.stiffness': [1e5, 2e5]}"
        )
    return vary


def has_length(values: object) -> TypeGuard[Sequence[object]]:
    """Whether `values` are several; an array without dimensions only looks as if."""
    return hasattr(values, "__len__") and getattr(values, "ndim", 1) > 0


class Variations:
    """The pairs of `scene` and the `sensors` in each of `count` runs.

    `vary` is that of Simulation.rollout. Raises NameNotFound for a name that neither has,
    InvalidParameter for a wrong number of values and for values out of range, which says in which
    run.
    """

    def __init__(
        self, scene: Scene, vary: Mapping[str, object], count: int, sensors: tuple[Sensor, ...] = ()
    ) -> None:
        self._scene, self._sensors = scene, sensors
        of_pairs, of_sensors = names_of_pairs(scene.pairs), names_of_sensors(sensors)
        known = of_pairs | of_sensors
        found: dict[str, str] = {}
        for given in vary:
            name = find_name(given, known)
            if name in found:
                raise InvalidParameter("vary", given, f"must not vary '{name}' twice")
            found[name] = given
        # A whole law comes before its fields.
        order = sorted(found, key=lambda name: name.count("."))
        self.columns = {
            name: _values(name, vary[found[name]], count, known[name].shape) for name in order
        }
        """What varies, by name: the values of all runs."""
        self._of_pairs = {name: of_pairs[name] for name in order if name in of_pairs}
        self._of_sensors = {name: of_sensors[name] for name in order if name in of_sensors}
        for run in range(count if vary else 0):
            self.pairs(run)
            self.sensors(run)

    def pairs(self, run: int) -> tuple[ContactPair, ...]:
        """Return the pairs of one run."""
        return self._changed(self._scene.pairs, self._of_pairs, run)

    def sensors(self, run: int) -> tuple[Sensor, ...]:
        """Return the sensors of one run; where nothing of them varies, the object given."""
        return self._changed(self._sensors, self._of_sensors, run)

    def scene(self, run: int) -> Scene:
        """Return the scene of one run, which shares the model."""
        return self._scene.with_pairs(self.pairs(run)) if self._of_pairs else self._scene

    def _changed(self, objects: tuple[T, ...], numbers: Names, run: int) -> tuple[T, ...]:
        if not numbers:
            return objects
        out = list(objects)
        for name, number in numbers.items():
            value = self.columns[name][run]
            try:
                if number.path[-1] == "placement":
                    check_type("placement", value, pin.SE3, "must be a pinocchio.SE3")
                    value = check_placement("placement", value)
                out[number.at] = with_value(out[number.at], number.path, value)
            except InvalidParameter as error:
                raise InvalidParameter(
                    f"vary['{name}'] of run {run}", value, f"cannot be taken: {error}"
                ) from None
        return tuple(out)


def _values(
    name: str, given: object, count: int, shape: tuple[int, ...] | None
) -> Sequence[object]:
    """Return one value for each run."""
    called = f"vary['{name}']"
    if shape is None:
        if isinstance(given, str | bytes | Mapping) or not has_length(given):
            raise InvalidParameter(called, given, f"must be a list of {count} values, one a run")
        if len(given) != count:
            raise InvalidParameter(
                called, given, f"must be {count} values, one a run", given=f"of {len(given)} values"
            )
        return [one.item() if isinstance(one, np.generic) else one for one in given]
    values = check_floats(called, given, f"must be {count} numbers, one a run")
    if values.shape != (count, *shape):
        wanted = (count, *shape)
        raise InvalidParameter(
            called, given, f"must have shape {wanted}", given=f"of shape {values.shape}"
        )
    return list(values) if shape else list(values.tolist())
