"""A finished run in the scene that it came from, built again."""

import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import Origin
from sphshell_pin.dynamics.result.result_scene import check_scene
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import ResultError, SlowLawWarning, SphshellError
from sphshell_pin.scenario.format.build import Built, build_scenario
from sphshell_pin.scenario.format.functions import unloaded
from sphshell_pin.scenario.format.reading import shipped_scenarios
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.running.kept_scenario import restore

# What moves the bodies, and what judges the outcome, is not needed to show them.
UNSHOWN = ("controller", "sensor", "figures", "expect", "knob")
HOW = "in Python, its scene can be given: result.view(scene=...)"


class Replay:
    """A finished run and the scene that it came from.

    `result` is a Result or the path of one that was saved. The scene and its visual model are
    built from the settings of the run, and the robots and surfaces that the result holds; no other
    file is read, but those of this package and of example-robot-data. A Result of one's own scene
    has that scene.

    No code that a scenario names, a xacro file or a Python routine, is executed, as the recorded
    contacts need none: a file of results may be somebody else's. A pair of `scene` whose contacts a
    routine finds then raises an error where it is evaluated.

    Raises
    ------
    ResultError
        The result cannot be read, it is unknown which scene ran, or the scene's robot or contacts
        are not those of the run.
    """

    def __init__(self, result: Result | StrPath) -> None:
        self.result = result if isinstance(result, Result) else Result.load(result)
        self._name = "the result" if isinstance(result, Result) else str(Path(result))
        with warnings.catch_warnings():
            # What stands in for a law's function is one of Python.
            warnings.simplefilter("ignore", SlowLawWarning)
            origin = self.result.origin
            built = None if origin is None else _build_again(origin, self._name)
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


def _build_again(origin: Origin, name: str) -> Built:
    """Build the scene of `origin` from what is kept with it; `name` is the result's."""
    if origin.keep is None:
        raise ResultError(name, f"was saved without its robots and surfaces: {HOW}")
    path = Path(origin.scenario)
    if path.suffix != ".toml":
        path = shipped_scenarios().get(origin.scenario, path)
    settings = {k: v for k, v in origin.settings.items() if k not in UNSHOWN}
    try:
        restored = restore(Scenario.model_validate(settings), origin.keep())
        return build_scenario(
            restored.scenario,
            path,
            function=unloaded,
            robots=restored.robots,
            surfaces=restored.surfaces,
        )
    except SphshellError as fault:
        raise ResultError(name, f"its scene cannot be built again ({fault}): {HOW}") from fault
    except ValueError as fault:
        why = f"its settings are none that this version knows: {HOW}"
        raise ResultError(name, why) from fault
