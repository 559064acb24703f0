"""Parameters of sensors that differ from run to run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

from sphshell_pin import _core
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.variations import has_length
from sphshell_pin.dynamics.sensing.sensors import Sensor, SensorSet
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.parameters import parameters_of

_PREFIX = "sensors."
_NUMBERS = ("float", "float | None", "int")


class VariedSensors:
    """The sensors of each of `count` runs: what `vary` says of names "sensors.NAME.FIELD".

    Raises NameNotFound for a name that the sensors do not have, InvalidParameter for a wrong number
    of values and for values out of range, which says in which run.
    """

    def __init__(
        self, sensors: SensorSet, scene: Scene, vary: Mapping[str, object], count: int
    ) -> None:
        self.base = sensors
        self._scene = scene
        self.columns: dict[str, Sequence[object]] = {}
        self._parts: list[tuple[str, int, str]] = []
        valid = {
            f"{_PREFIX}{one.name}.{field.name}": (k, field.name)
            for k, one in enumerate(sensors.sensors)
            for field in fields(one)
            if field.name in parameters_of(one) and field.type in _NUMBERS
        }
        for name, values in vary.items():
            if not name.startswith(_PREFIX):
                continue
            if name not in valid:
                raise NameNotFound("varied parameter", name, "the sensors", list(valid))
            if not has_length(values) or len(values) != count:
                raise InvalidParameter(
                    f"vary['{name}']", values, f"must be {count} numbers, one a run"
                )
            self.columns[name] = values
            self._parts.append((name, *valid[name]))
        for run in range(count if self._parts else 0):
            self._sensors(run)

    @staticmethod
    def others(vary: Mapping[str, object]) -> dict[str, object]:
        """Return what `vary` says of other things than sensors."""
        return {name: values for name, values in vary.items() if not name.startswith(_PREFIX)}

    def core(self, run: int) -> list[_core.Sensor]:
        """Return the C++ bindings for one run."""
        return SensorSet(self._sensors(run), self._scene).core if self._parts else self.base.core

    def _sensors(self, run: int) -> tuple[Sensor, ...]:
        sensors = list(self.base.sensors)
        for name, at, field in self._parts:
            value = self.columns[name][run]
            # A number of NumPy is as good.
            value = value.item() if hasattr(value, "item") else value
            try:
                sensors[at] = replace(sensors[at], **{field: value})  # type: ignore[arg-type]
            except InvalidParameter as error:
                raise InvalidParameter(
                    f"vary['{name}'] of run {run}", value, f"cannot be taken: {error}"
                ) from None
        return tuple(sensors)
