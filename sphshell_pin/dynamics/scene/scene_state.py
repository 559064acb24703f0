"""What the forces of a scene depend on besides q and v, along a motion that others integrate."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_floats, check_not_negative, read_only
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.scene.explain import core_pairs
from sphshell_pin.errors import InvalidParameter, NotPicklable

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import Scene


class SceneState(Summarized):
    """The memory of a scene in your own loop, as `pinocchio.Data` is that of a model.

    It holds the contacts with their ids, on which side of its shell each sphere is, and the
    stretch of each bristle, those of joints included. `Scene.state` makes one;
    `Scene.external_forces`, `joint_forces`, `contacts` and `contact_derivatives` take it and do not
    change it. `advance` moves it on, once for each accepted step:

        state = scene.state(q, v)
        for _ in range(steps):
            fext = scene.external_forces(q, v, state=state)
            v += dt * pin.aba(model, data, q, v, tau, fext)
            q = pin.integrate(model, q, dt * v)
            state.advance(q, v, dt)

    This loop makes the motion of `Simulation(scene, SemiImplicitEuler(dt))`; where the scene has
    joint components, add `scene.joint_forces(q, v, state=state)` to tau. `copy` gives a second
    state, to try a step; `values` and `restore` keep and bring back what it remembers. A state is
    for one user at a time (else Busy), and cannot be pickled.
    """

    def __init__(
        self, scene: Scene, q: ArrayLike | None = None, v: ArrayLike | None = None
    ) -> None:
        self._scene = scene
        self._pairs = scene.pairs
        self.start = scene.check_state(scene.neutral if q is None else q, v)
        """Where it began: q (nq,), v (nv,)."""
        pairs, _ = core_pairs(scene, *self.start)
        self._core = scene._compile(_core.SceneState, pairs)
        if q is not None:
            self._core.advance(*self.start, 0.0)

    def _facts(self) -> list[Fact]:
        return [Fact("contact pairs", len(self._pairs))]

    def advance(self, q: ArrayLike, v: ArrayLike, dt: float) -> None:
        """Move on to q (nq,), v (nv,), the end of an accepted step of `dt` >= 0 [s].

        Bristles are stretched by the new velocity at the contacts where the step began, which is
        of order 1; contacts that began within the step are unstretched.
        """
        core = self.core_of(self._scene)
        core.advance(q, v, check_not_negative("dt", dt, "s"))

    @property
    def values(self) -> Array:
        """All that is remembered, as numbers (m,): to be kept, compared, and given to `restore`.

        Whether the motion has begun, its last q (nq); of each pair how many contacts it has had,
        how many there are now (twice), and the sphere's center (3) in the shell's frame [m]; pair
        by pair, of each contact its id, 4 feature + 2 rim + saddle, depth, point and normal (3
        each, in the shell's frame), and the stretch of its bristle (3 for each ring) [m]; then
        the stretches of joints.
        """
        return read_only(self._core.save())

    def restore(self, values: ArrayLike) -> None:
        """Remember what a state of the same scene had as `values` (m,), and nothing else.

        Raises InvalidParameter where they are not of a scene with the same pairs and joints.
        """
        if not self._core.restore(check_floats("values", values, "must be numbers (m,)").ravel()):
            must = "must be the values of a state of a scene with the same pairs and joints"
            raise InvalidParameter("values", values, must)

    def __eq__(self, other: object) -> bool:
        """Whether both are of one scene, and remember the same."""
        if not isinstance(other, SceneState) or other._pairs is not self._pairs:
            return NotImplemented
        return np.array_equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]

    def copy(self) -> SceneState:
        """Return an independent state with the same memory."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._core = self._core.copy()
        return other

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, object]) -> SceneState:
        """Return `copy()`: the scene, which does not change, is shared."""
        return self.copy()

    def __reduce__(self) -> NoReturn:
        """Refuse to be pickled: the memory is with the compiled core."""
        raise NotPicklable(
            "a SceneState cannot be pickled: pickle the scene, q and v, and make another with "
            "scene.state(q, v), whose bristles begin unstretched"
        )

    def core_of(self, scene: Scene) -> _core.SceneState:
        """Return the C++ binding; InvalidParameter unless `scene` is the one it was made of."""
        if scene.pairs is not self._pairs or scene._model is not self._scene._model:
            raise InvalidParameter(
                "state",
                self,
                "must be a state of this scene as it is now: make another with scene.state(q, v)",
            )
        return self._core
