"""What the forces of a scene depend on besides q and v, along a motion that others integrate."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.checks import check_not_negative
from sphshell_pin.dynamics.scene.explain import core_pairs, explain_pairs, has_state
from sphshell_pin.errors import InvalidParameter, NotPicklable
from sphshell_pin.summary import Fact, Summarized

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
    state, to try a step. A state is for one user at a time (else Busy), and cannot be pickled.
    """

    def __init__(
        self, scene: Scene, q: ArrayLike | None = None, v: ArrayLike | None = None
    ) -> None:
        self._scene = scene
        self._pairs = scene.pairs
        self.start = scene.check_state(scene.neutral if q is None else q, v)
        """Where it began: q (nq,), v (nv,)."""
        figures = explain_pairs(scene, *self.start) if has_state(scene) else ()
        self._core = scene._compile(_core.SceneState, core_pairs(scene, figures))
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

    def copy(self) -> SceneState:
        """Return an independent state with the same memory."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._core = self._core.copy()
        return other

    def __copy__(self) -> SceneState:
        """Return `copy()`."""
        return self.copy()

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
        if scene.pairs is not self._pairs or not scene.shares_model(self._scene):
            raise InvalidParameter(
                "state",
                self,
                "must be a state of this scene as it is now: make another with scene.state(q, v)",
            )
        return self._core
