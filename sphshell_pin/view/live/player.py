"""What the live page plays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from sphshell_pin.base.arrays import Array

if TYPE_CHECKING:
    import pinocchio as pin

    from sphshell_pin.dynamics.result.result_parts import Patches
    from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
    from sphshell_pin.scenario.format.sliders import LiveParameter
    from sphshell_pin.scenario.live.acting import Dragged, Target
    from sphshell_pin.scenario.running.rows import Rows


class Player(Protocol):
    """A scene in motion, advanced piece by piece; SI units, world frame.

    `scene` may become another object when a parameter changes; its model stays the same.
    """

    @property
    def title(self) -> str:
        """One line on what there is to see."""

    @property
    def visual_model(self) -> pin.GeometryModel | None:
        """Visual geometry of scene.model, or None for a skeleton."""

    @property
    def scene(self) -> Scene:
        """What is simulated now."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def start(self) -> float:
        """Time at which it starts [s]."""

    @property
    def q(self) -> Array:
        """Configuration (nq,)."""

    @property
    def contacts(self) -> SceneContacts:
        """The contacts at this state."""

    @property
    def patches(self) -> Patches | None:
        """The patches of `contacts`, None where they are not recorded."""

    @property
    def residual(self) -> float:
        """Change of the total energy since the start [J]: the integration's error."""

    @property
    def exchanged(self) -> float:
        """Energy that changed form since the start [J]."""

    @property
    def parameters(self) -> tuple[LiveParameter, ...]:
        """The parameters with sliders, with their present values."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Frames that can be pushed."""

    @property
    def planned(self) -> float | None:
        """Length of the motion that the scenario states [s], None if it states none."""

    @property
    def ended(self) -> str | None:
        """Why it cannot go on, in one sentence; None while it can."""

    def advance(self, duration: float, wall: float) -> Rows:
        """Go `duration` [s] on, computing for `wall` [s] at most; return what was recorded."""

    def reset(self) -> None:
        """Go back to the start."""

    def change(self, key: str, value: float | str) -> None:
        """Set a parameter; raise SphshellError, and go on unchanged, where it cannot be."""

    def push(self, body: str, force_world: Array, seconds: float) -> None:
        """Push the origin of a body with `force_world` (3,) [N] for `seconds` [s]."""


@runtime_checkable
class Interactive(Player, Protocol):
    """A player whose bodies can be dragged and whose joints have targets, while it goes on."""

    @property
    def targets(self) -> tuple[Target, ...]:
        """The joints that the controller pulls to a posture, with their present targets."""

    @property
    def drag(self) -> Dragged | None:
        """What pulls at a body now; None if nothing does."""

    @property
    def can_record_patches(self) -> bool:
        """Whether `record_patches` has an effect."""

    def aim(self, joint: str, value: float) -> None:
        """Move a target [rad or m]; raise SphshellError, and go on unchanged, where it cannot."""

    def pull(self, frame: str, point: Array, target_world: Array, stiffness: float) -> None:
        """Pull a point (3,) [m] of a frame to a target, until `release` or another pull or push.

        `stiffness` [N/m] is that for each kg which has to be moved.
        """

    def release(self) -> None:
        """End a pull."""

    def record_patches(self, on: bool) -> None:
        """Compute `patches` from now on, or no longer."""
