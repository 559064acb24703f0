"""A finished run, played again in the scene that it came from."""

import warnings
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import Origin, Patches
from sphshell_pin.dynamics.result.result_scene import check_scene, sound_rows
from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
from sphshell_pin.errors import InvalidParameter, ResultError, SlowLawWarning, SphshellError
from sphshell_pin.scenario.format.build import Built, build_scenario
from sphshell_pin.scenario.format.functions import Loader, load_function, unloaded
from sphshell_pin.scenario.format.reading import find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.format.sliders import LiveParameter
from sphshell_pin.scenario.running.kept_scenario import restore
from sphshell_pin.scenario.running.rows import Rows, Series, series_of

# What moves the bodies, and what judges the outcome, is not needed to show them.
UNSHOWN = ("controller", "sensor", "figures", "expect", "knob")
HOW = "give its scenario with --scenario (in Python: scenario=...)"


class Replay:
    """Plays the rows of a Result: a player whose motion is known already.

    `result` is a Result or the path of one that was saved. The scene and its visual model are
    built from the settings of the run, and the robots and surfaces that the result holds; no other
    file is read, but those of this package and of example-robot-data. `scenario`, a shipped name or
    a path, takes their place. A Result of one's own scene is played in that scene.

    No code that a scenario names, a xacro file or a Python routine, is executed, as the recorded
    contacts need none: a file of results may be somebody else's. A pair of `scene` whose contacts a
    routine finds then raises an error where it is evaluated. With `trust_code` the routine is
    loaded, and `scenario` may have a xacro file.

    Raises
    ------
    ResultError
        It is unknown which scene ran, or the scenario's robot or contacts are not those of the run.
    SphshellError
        The result cannot be read, or `scenario` cannot be built.
    """

    def __init__(
        self,
        result: Result | str | PathLike[str],
        scenario: str | PathLike[str] | None = None,
        *,
        trust_code: bool = False,
    ) -> None:
        self.result = result if isinstance(result, Result) else Result.load(result)
        self._name = "the result" if isinstance(result, Result) else str(Path(result))
        with warnings.catch_warnings():
            if not trust_code:  # what stands in for a law's function is one of Python
                warnings.simplefilter("ignore", SlowLawWarning)
            built = self._build(scenario, trust_code=trust_code)
        self.speed = 1.0
        """Seconds of simulated time that a recording of it shows in one second."""
        if built is not None:
            self.scene: Scene = built.scene
            self.visual_model: pin.GeometryModel | None = built.visual_model
            self.title = built.scenario.title or built.name
            self.speed = built.scenario.run.recording_speed
        elif self.result.scene is not None:
            self.scene, self.visual_model = self.result.scene, None
            self.title = "A finished run"
        else:
            raise ResultError(self._name, f"does not say which scene it came from: {HOW}")
        self._check()
        # A run that diverged is shown up to where its numbers end.
        self._count = sound_rows(self._name, self.result.q, self.result.v)
        rows = Rows.from_result(self.result, self.result.energy.residual)
        self._rows = rows.select(slice(0, self._count))
        self._residual = self.result.energy.residual
        self._exchanged = self.result.energy.exchanged_until
        self._time, self._row, self._given = self.start, 0, 0

    parameters: tuple[LiveParameter, ...] = ()
    bodies: tuple[str, ...] = ()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._time

    @property
    def start(self) -> float:
        """Time of the first row [s]."""
        return float(self.result.t[0])

    @property
    def duration(self) -> float:
        """Simulated time from the first row to the last [s]."""
        return float(self.result.t[self._count - 1] - self.result.t[0])

    planned: float | None = None

    @property
    def row(self) -> int:
        """The recorded row that is shown: the last one that is not later than `time`."""
        return self._row

    @property
    def q(self) -> Array:
        """Configuration (nq,)."""
        return np.asarray(self.result.q[self._row])

    @property
    def v(self) -> Array:
        """Velocity (nv,)."""
        return np.asarray(self.result.v[self._row])

    @property
    def contacts(self) -> SceneContacts:
        """The contacts of the row that is shown."""
        return self.result.contacts.at_row(self._row)

    @property
    def patches(self) -> Patches | None:
        """The patches of `contacts`, None where they were not recorded."""
        if self.result.patch_rows is None:
            return None
        first, last = np.searchsorted(self.result.contacts.row, (self._row, self._row + 1))
        return self.result.patch_rows[first:last]

    @property
    def series(self) -> tuple[Series, ...]:
        """What charts can show of the run: torques where it recorded them."""
        sensors = {name: log.columns for name, log in self.result.sensors.items()}
        torque = self.result.torque is not None
        return series_of(self.result.pairs, self.scene.model, sensors, torque=torque)

    @property
    def now(self) -> Rows:
        """The row that is shown, at `time`."""
        shown = self._rows.select(slice(self._row, self._row + 1))
        return replace(shown, t=np.array([self._time]))

    @property
    def residual(self) -> float:
        """Change of the total energy since the start [J]: the integration's error."""
        return float(self._residual[self._row])

    @property
    def exchanged(self) -> float:
        """Energy that changed form since the start [J]."""
        return float(self._exchanged[self._row])

    @property
    def ended(self) -> str | None:
        """Why it cannot go on: at the last row, that it is the last."""
        return "The recorded run ends here." if self._row == self._count - 1 else None

    def advance(self, duration: float, wall: float = np.inf) -> Rows:
        """Go `duration` [s] on, to the end at most; return the rows passed on the way.

        Nothing is computed: `wall`, the time that a player may take, is not used up.
        """
        self._go_to(self._time + max(0.0, float(duration)))
        passed = self._rows.select(slice(self._given, self._row + 1))
        self._given = max(self._given, self._row + 1)
        return passed

    def seek(self, t: float) -> None:
        """Go to time `t` [s], or to the end that is nearer."""
        t = float(t)
        if not np.isfinite(t):
            raise InvalidParameter("t", t, "must be a time [s]")
        self._go_to(t)
        self._given = self._row

    def reset(self) -> None:
        """Go back to the first row."""
        self._given = 0
        self._go_to(self.start)

    def change(self, key: str, value: float | str) -> None:
        """Refuse: a finished run has nothing to change."""
        raise InvalidParameter(key, value, "cannot be changed: this is a finished run")

    def push(self, body: str, force_world: npt.ArrayLike, seconds: float) -> None:
        """Refuse: a finished run cannot be pushed."""
        raise InvalidParameter("body", body, "cannot be pushed: this is a finished run")

    def _go_to(self, t: float) -> None:
        self._time = min(max(t, self.start), self.start + self.duration)
        after = np.searchsorted(self.result.t[: self._count], self._time, side="right")
        self._row = max(0, int(after) - 1)

    def _build(self, scenario: str | PathLike[str] | None, *, trust_code: bool) -> Built | None:
        function = load_function if trust_code else unloaded
        if scenario is not None:
            path = find_scenario(scenario)
            shown = _shown(read_scenario(path))
            if not trust_code:
                _check_without_code(shown, path)
            return build_scenario(shown, path, function=function)
        origin = self.result.origin
        return None if origin is None else _build_again(origin, self._name, function)

    def _check(self) -> None:
        """Refuse a scene in which these rows mean nothing."""
        check_scene(self.result, self.scene, self._name)
        log = self.result.contacts
        for index, pair in enumerate(self.scene.pairs):
            touched = int(np.max(log.element[log.pair == index], initial=-1))
            for most in (len(one.shell.elements) for one in pair.shells):
                if touched >= most:
                    raise ResultError(
                        self._name,
                        f"contact '{pair.name}' touched element {touched}, but its shell has "
                        f"{most} elements: the surface has changed since",
                    )


def _shown(scenario: Scenario) -> Scenario:
    """Return what of `scenario` is needed to show it."""
    given = scenario.model_dump(exclude_unset=True)
    return Scenario.model_validate({k: v for k, v in given.items() if k not in UNSHOWN})


def _check_without_code(scenario: Scenario, path: Path) -> None:
    """Refuse a xacro file, whose expressions are Python's."""
    for one in scenario.robot:
        if Path(one.path or "").suffix.lower() == ".xacro":
            raise SphshellError(
                f"{path}: the robot '{one.path}' is not read, as a xacro file is code, and no code "
                "is executed to show a finished run: run the scenario again, or, if you trust it, "
                "use Replay(result, scenario, trust_code=True)"
            )


def _build_again(origin: Origin, name: str, function: Loader) -> Built:
    """Build the scene of `origin` from what is kept with it; `name` is the result's."""
    if origin.keep is None:
        why = "an earlier version saved it without its robots and surfaces: run it again, or "
        raise ResultError(name, f"{why}{HOW}")
    path = Path(origin.scenario)
    if path.suffix != ".toml":
        path = shipped_scenarios().get(origin.scenario, path)
    settings = {k: v for k, v in origin.settings.items() if k not in UNSHOWN}
    try:
        restored = restore(Scenario.model_validate(settings), origin.keep())
        return build_scenario(
            restored.scenario,
            path,
            function=function,
            robots=restored.robots,
            surfaces=restored.surfaces,
        )
    except SphshellError as fault:
        raise ResultError(name, f"its scene cannot be built again ({fault}): {HOW}") from fault
    except ValueError as fault:
        why = f"its settings are none that this version knows: {HOW}"
        raise ResultError(name, why) from fault
