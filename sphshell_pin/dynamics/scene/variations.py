"""Parameters of a scene's contact pairs that differ from run to run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeGuard

import pinocchio as pin

from sphshell_pin.checks import as_floats, check_finite, check_placement, check_type, check_vector
from sphshell_pin.contact import Sphere
from sphshell_pin.contact.friction import check_friction
from sphshell_pin.contact.normal_law import check_law
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.parameters import parameters_of

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import Scene

# Changes a pair to one value.
_Change = Callable[[ContactPair, object], ContactPair]


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
    """The pairs of `scene` in each of `count` runs; `vary` is that of Simulation.rollout.

    Raises NameNotFound for a name that the scene does not have, InvalidParameter for a wrong number
    of values and for values out of range, which says in which run.
    """

    def __init__(self, scene: Scene, vary: Mapping[str, object], count: int) -> None:
        self._scene = scene
        self._parts: list[tuple[str, int, _Change, Sequence[object]]] = []
        valid = _names_of(scene)
        # A whole law comes before its fields.
        for name in sorted(vary, key=lambda name: name.count(".")):
            if name not in valid:
                raise NameNotFound("varied parameter", name, "the scene", list(valid))
            pair, change, shape = valid[name]
            values = _values(name, vary[name], count, shape)
            self._parts.append((name, pair, change, values))
        for run in range(count if self._parts else 0):
            self.pairs(run)

    @property
    def columns(self) -> dict[str, Sequence[object]]:
        """What varies, by name: the values of all runs."""
        return {name: values for name, _, _, values in self._parts}

    def pairs(self, run: int) -> tuple[ContactPair, ...]:
        """Return the pairs of one run."""
        pairs = list(self._scene.pairs)
        for name, at, change, values in self._parts:
            try:
                pairs[at] = change(pairs[at], values[run])
            except InvalidParameter as error:
                raise InvalidParameter(
                    f"vary['{name}'] of run {run}", values[run], f"cannot be taken: {error}"
                ) from None
        return tuple(pairs)

    def scene(self, run: int) -> Scene:
        """Return the scene of one run, which shares the model."""
        return self._scene.with_pairs(self.pairs(run)) if self._parts else self._scene


def _names_of(scene: Scene) -> dict[str, tuple[int, _Change, tuple[int, ...] | None]]:
    """Return what may vary: the pair's place, how to change it, the shape of one value.

    The shape is None for what is no number.
    """
    out: dict[str, tuple[int, _Change, tuple[int, ...] | None]] = {}
    for k, pair in enumerate(scene.pairs):
        out[f"{pair.name}.law"] = k, _set_law, None
        out[f"{pair.name}.friction"] = k, _set_friction, None
        for part in ("law", "friction"):
            whole = getattr(pair, part)
            for name in parameters_of(whole):
                if isinstance(getattr(whole, name), float):
                    out[f"{pair.name}.{part}.{name}"] = k, _field(part, name), ()
        if pair.sphere is None:
            continue
        ends = ("sphere",) if pair.other_sphere is None else ("sphere", "other_sphere")
        for end in ends:
            out[f"{pair.name}.{end}.radius"] = k, _radius(end), ()
            out[f"{pair.name}.{end}.offset"] = k, _offset(end), (3,)
        if pair.shell is not None:
            out[f"{pair.name}.placement"] = k, _set_placement, None
    return out


def numbers_of(scene: Scene) -> dict[str, tuple[int, ...]]:
    """Return the shapes of what may vary in numbers alone, by name: () or (3,)."""
    return {name: shape for name, (_, _, shape) in _names_of(scene).items() if shape is not None}


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
        return list(given)
    try:
        values = as_floats(given)
    except (TypeError, ValueError, OverflowError):
        raise InvalidParameter(called, given, f"must be {count} numbers, one a run") from None
    if values.shape != (count, *shape):
        wanted = (count, *shape)
        raise InvalidParameter(
            called, given, f"must have shape {wanted}", given=f"of shape {values.shape}"
        )
    return list(values) if shape else list(values.tolist())


def _set_law(pair: ContactPair, law: object) -> ContactPair:
    return replace(pair, law=check_law(law))


def _set_friction(pair: ContactPair, friction: object) -> ContactPair:
    return replace(pair, friction=check_friction(friction))


def _field(part: str, name: str) -> _Change:
    def change(pair: ContactPair, value: object) -> ContactPair:
        whole = getattr(pair, part)
        if not hasattr(whole, name):
            raise InvalidParameter(f"{part}.{name}", value, f"is not a number of {whole!r}")
        changed = whole.changed(**{name: value})
        return replace(pair, law=changed) if part == "law" else replace(pair, friction=changed)

    return change


def _radius(end: str) -> _Change:
    def change(pair: ContactPair, radius: object) -> ContactPair:
        sphere = replace(getattr(pair, end), radius=check_finite("radius", radius))
        return _with_sphere(pair, end, sphere)

    return change


def _offset(end: str) -> _Change:
    def change(pair: ContactPair, offset: object) -> ContactPair:
        x, y, z = check_vector("offset", offset, 3).tolist()
        return _with_sphere(pair, end, replace(getattr(pair, end), offset=(x, y, z)))

    return change


def _with_sphere(pair: ContactPair, end: str, sphere: Sphere) -> ContactPair:
    if end == "sphere":
        return replace(pair, sphere=sphere)
    return replace(pair, other_sphere=sphere)


def _set_placement(pair: ContactPair, placement: object) -> ContactPair:
    check_type("placement", placement, pin.SE3, "must be a pinocchio.SE3")
    return replace(pair, placement=check_placement("placement", placement))
