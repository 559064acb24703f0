"""What an engine is asked, and what it answers."""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any, Protocol

from sphshell_pin.base.arrays import Array

if TYPE_CHECKING:
    from benchmarks.peers.scenes import Scene

Params = dict[str, Any]


class CannotDo(Exception):
    """The engine cannot do this scene; the message says why in one sentence."""


@dataclass(frozen=True)
class Trajectory:
    """How the ball moved, in the world, at n instants.

    `t` (n,) [s], `position` (n, 3) of the center [m], `velocity` (n, 3) [m/s], `angular_velocity`
    (n, 3) [rad/s] (zero where the ball cannot turn); `force` (n, 3) of all contacts on the ball [N]
    and `energy` (n,) [J] with what the contacts store, where the engine reports them;
    `contact_forces` (k, 3) [N] of the k contacts on the ball at the end, likewise. `cpu` [s] is the
    CPU time of the stepping alone, of `simulated` [s] in `steps` steps: neither building nor
    reading.
    """

    t: Array
    position: Array
    velocity: Array
    angular_velocity: Array
    cpu: float
    simulated: float
    steps: int
    force: Array | None = None
    contact_forces: Array | None = None
    energy: Array | None = None


class Engine(Protocol):
    """One engine. The module imports without the engine; methods import it."""

    name: str
    package: str = ""

    def version(self) -> str:
        """Return name and version; raise ImportError where the engine is not installed."""
        return f"{self.name} {metadata.version(self.package)}"

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what was set, and the page of the engine's documentation that recommends it.

        Raises CannotDo.
        """

    def param_sets(self, scene: Scene) -> list[Params]:
        """Return what is swept, from coarse to fine: time steps or tolerances, and integrators.

        Raises CannotDo.
        """

    def run(self, scene: Scene, params: Params) -> Trajectory:
        """Run the scene from its start for its duration.

        Rows are those of `scene.record_dt`, or of every step where that is longer. Anything that
        does not change between runs of one scene (a mesh) may be kept. Raises CannotDo.
        """


class CpuClock:
    """CPU time of this process [s] inside `with`: `spent`."""

    spent = 0.0

    def __enter__(self) -> CpuClock:
        self._start = time.process_time()
        return self

    def __exit__(self, *_: object) -> None:
        self.spent += time.process_time() - self._start
