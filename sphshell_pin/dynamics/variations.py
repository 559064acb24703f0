"""Parameters of a scene's contact pairs that differ from run to run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pinocchio as pin

from sphshell_pin.checks import as_floats, check_placement, check_type
from sphshell_pin.contact.friction import check_friction
from sphshell_pin.contact.laws import check_law
from sphshell_pin.dynamics.scene import ContactPair, Scene
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.parameters import parameters_of

# Changes a pair to one value.
_Change = Callable[[ContactPair, Any], ContactPair]


def check_names_of(vary: Any) -> Mapping[str, Any]:
    """Return `vary`, {} for None; raise InvalidParameter unless it maps names to values."""
    if vary is None:
        return {}
    if not isinstance(vary, Mapping) or not all(isinstance(name, str) for name in vary):
        raise InvalidParameter(
            "vary", vary, "must map names to n values, as {'PAIR.law.stiffness': [1e5, 2e5]}"
        )
    return vary


def has_length(values: Any) -> bool:
    """Whether `values` are several; an array without dimensions only looks as if."""
    return hasattr(values, "__len__") and getattr(values, "ndim", 1) > 0


class Variations:
    """The pairs of `scene` in each of `count` runs; `vary` is that of Simulation.rollout.

    Raises NameNotFound for a name that the scene does not have, InvalidParameter for a wrong number
    of values and for values out of range, which says in which run.
    """

    def __init__(self, scene: Scene, vary: Mapping[str, Any], count: int) -> None:
        self._scene = scene
        self._parts: list[tuple[str, int, _Change, Sequence[Any]]] = []
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
    def columns(self) -> dict[str, Any]:
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
        out[f"{pair.name}.sphere.radius"] = k, _set_radius, ()
        out[f"{pair.name}.sphere.offset"] = k, _offset(scene), (3,)
        out[f"{pair.name}.placement"] = k, _placement(scene), None
    return out


def _values(name: str, given: Any, count: int, shape: tuple[int, ...] | None) -> Sequence[Any]:
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
    return values if shape else values.tolist()  # type: ignore[return-value]


def _set_law(pair: ContactPair, law: Any) -> ContactPair:
    check_law(law)
    return replace(pair, law=law)


def _set_friction(pair: ContactPair, friction: Any) -> ContactPair:
    check_friction(friction)
    return replace(pair, friction=friction)


def _field(part: str, name: str) -> _Change:
    def change(pair: ContactPair, value: float) -> ContactPair:
        whole = getattr(pair, part)
        if not hasattr(whole, name):
            raise InvalidParameter(f"{part}.{name}", value, f"is not a number of {whole!r}")
        changed: dict[str, Any] = {part: replace(whole, **{name: value})}
        return replace(pair, **changed)

    return change


def _set_radius(pair: ContactPair, radius: float) -> ContactPair:
    assert pair.sphere is not None
    return replace(pair, sphere=replace(pair.sphere, radius=radius))


def _offset(scene: Scene) -> _Change:
    def change(pair: ContactPair, offset: Any) -> ContactPair:
        assert pair.sphere is not None
        sphere = replace(pair.sphere, offset=tuple(offset))
        return replace(pair, sphere=sphere, sphere_placement=scene.place(sphere))

    return change


def _placement(scene: Scene) -> _Change:
    def change(pair: ContactPair, placement: Any) -> ContactPair:
        check_type("placement", placement, pin.SE3, "must be a pinocchio.SE3")
        placement = check_placement("placement", placement)
        in_joint = scene.frame_in_joint(pair.frame)[1] * placement
        return replace(pair, placement=placement, shell_placement=in_joint)

    return change
