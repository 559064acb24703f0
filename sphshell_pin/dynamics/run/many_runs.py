"""What many runs of one scene at once are made of: starts, controllers, and busy threads."""

import time
from collections.abc import Callable, Mapping, Sequence

from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_floats
from sphshell_pin.dynamics.run.advance import GLANCE, AnyController, CtrlC, bind_controller
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.variations import has_length
from sphshell_pin.dynamics.sensing.sensors import SensorSet
from sphshell_pin.errors import InvalidParameter, SphshellError
from sphshell_pin.shell.options import thread_count

Start = tuple[Array, Array]

# So many runs, for each thread, are made ready while others run.
_AHEAD = 32
# More would only wait for each other, and a system may not start them.
_MOST_THREADS = 1024


class Tasks:
    """Keeps the threads busy without making all runs ready at once."""

    def __init__(
        self,
        core: _core.Rollout,
        workers: int,
        progress: Callable[[float], object] | None,
        count: int,
        failures: Mapping[int, SphshellError],
    ) -> None:
        self.added = self.done = 0
        self._core, self._ahead = core, _AHEAD * workers
        self._progress, self._count, self._failures = progress, count, failures
        self._told = 0.0

    def make_room(self, ctrl_c: CtrlC) -> None:
        """Note one run more; wait where enough are waiting."""
        self.added += 1
        if self.added - self.done >= 2 * self._ahead:
            self.wait(self._ahead, ctrl_c)

    def wait(self, left: int, ctrl_c: CtrlC) -> None:
        """Wait until `left` runs or fewer are not done."""
        while True:
            self.done = self._core.wait(left, GLANCE)
            over = self.done + len(self._failures)
            finished = over == self._count
            if self._progress is not None and (
                finished or time.perf_counter() - self._told > GLANCE
            ):
                self._told = time.perf_counter()
                self._progress(1.0 if finished else over / self._count)
            if ctrl_c.pressed:
                raise KeyboardInterrupt
            if self.added - self.done <= left:
                return


def worker_count(threads: int | None) -> int:
    """Return how many threads are wanted."""
    workers = thread_count(threads)
    if workers > _MOST_THREADS:
        raise InvalidParameter("threads", threads, f"must be {_MOST_THREADS} at most")
    return workers


def not_begun(fault: Exception) -> SphshellError:
    """Return why a run could not begin: a fault of this package, or of a user's routine."""
    if isinstance(fault, SphshellError):
        return fault
    told = [f"{type(fault).__name__}: {fault}", *getattr(fault, "__notes__", ())]
    return SphshellError(f"the run could not begin, its routine raised {', '.join(told)}")


def check_controllers(
    scene: Scene,
    integrator: Integrator,
    controllers: Sequence[AnyController],
    control_dt: float | None,
    starts: list[Start],
    sensors: SensorSet,
) -> None:
    """Refuse a controller that cannot be, each of them once, before anything runs."""
    seen = set[int]()
    for run, controller in enumerate(controllers):
        if id(controller) in seen:
            continue
        seen.add(id(controller))
        try:
            bind_controller(scene, integrator, controller, control_dt, starts[run][0], sensors)
        except InvalidParameter as error:
            if run == 0:
                raise
            raise InvalidParameter(
                f"the controller of run {run}", controller, str(error), given="cannot be taken:"
            ) from None


def one_each(
    controller: AnyController | Sequence[AnyController], count: int
) -> Sequence[AnyController]:
    """Return the controller of each run."""
    if not isinstance(controller, Sequence):
        return [controller] * count
    if len(controller) != count:
        raise InvalidParameter(
            "controller",
            controller,
            f"must be one for all runs, or {count}, one a run",
            given=f"of {len(controller)} controllers",
        )
    return controller


def states_of(
    scene: Scene,
    q0s: ArrayLike,
    v0s: ArrayLike | None,
    vary: Mapping[str, object],
    controller: AnyController | Sequence[AnyController],
) -> list[Start]:
    """Return the checked starts; what is given once holds for all runs."""
    model = scene.model
    tables = {}
    for name, given, size in (("q0s", q0s, model.nq), ("v0s", v0s, model.nv)):
        if given is None:
            continue
        table = check_floats(name, given, f"must be numbers, (n, {size})")
        if table.ndim not in (1, 2) or table.shape[-1] != size:
            raise InvalidParameter(
                name, given, f"must have shape (n, {size})", given=f"of shape {table.shape}"
            )
        tables[name] = table
    if "q0s" not in tables:
        raise InvalidParameter("q0s", q0s, f"must be numbers, (n, {model.nq})")
    counts = {name: len(table) for name, table in tables.items() if table.ndim == 2}
    lengths = {f"vary['{name}']": len(v) for name, v in vary.items() if has_length(v)}
    if isinstance(controller, Sequence):
        lengths["controller"] = len(controller)
    count = next(iter({**counts, **lengths}.values()), 1)
    if len(set(counts.values())) > 1:
        raise InvalidParameter(
            "q0s, v0s", counts, "must have as many rows", given=f"of {counts} rows"
        )
    starts = []
    for run in range(count):
        row = {name: t if t.ndim == 1 else t[run] for name, t in tables.items()}
        try:
            starts.append(scene.check_state(row["q0s"], row.get("v0s")))
        except InvalidParameter as error:
            raise InvalidParameter(
                f"the start of run {run}", error.value, str(error), given="cannot be taken:"
            ) from None
    return starts
