"""From a scenario file to what runs: the scene, its start state, its controller, its simulation."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin import errors
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.parameters import Component, parameters_of
from sphshell_pin.base.regular_file import StrPath, why_no_file
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.contact.friction import Friction
from sphshell_pin.contact.function_laws import FunctionFile, FunctionFrictionFile
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.dynamics.control import controllers
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.run.advance import many_rows
from sphshell_pin.dynamics.run.simulation import Simulation
from sphshell_pin.dynamics.scene.explain import Explanation
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.sensing.sensors import Sensor, check_sensors
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.scenario.format import bodies, reading, schema
from sphshell_pin.scenario.format.components import joint_components, spheres_of, to_end, to_sphere
from sphshell_pin.scenario.format.functions import Loader, Modules, load_function
from sphshell_pin.scenario.format.sliders import check_knobs, has_number, number_in, with_numbers
from sphshell_pin.shell.shell import Shell

# A user's own; what it takes depends on where the scenario names it.
Function = Callable[..., Any]


@dataclass(frozen=True, repr=False)
class Built(Summarized):
    """A scenario ready to run."""

    name: str
    path: Path
    scenario: schema.Scenario
    scene: Scene
    q0: Array
    v0: Array
    controller: controllers.Controller | controllers.Callback | None
    simulation: Simulation
    visual_model: pin.GeometryModel
    """Geometry of the scene's model."""
    assembly: bodies.Assembly
    """The robots as one model; the same object as before where a rebuild could keep it."""
    shells: Mapping[str, Shell]
    """The surfaces by name; the same objects as before where a rebuild could keep them."""
    functions: Mapping[str, Function]
    """The user's own functions by "file.py:function", loaded once."""
    figures: Mapping[str, Callable[[Result, Scene], float]]
    """The scenario's own figures: functions of (result, scene)."""

    @property
    def _title(self) -> str:
        return f"Built '{self.name}'"

    def _facts(self) -> list[Fact]:
        return [
            Fact("title", self.scenario.title),
            Fact("duration", self.scenario.run.duration, "s"),
            *(fact for fact in self.simulation._facts() if fact.label != "title"),
        ]


def build(
    name: StrPath, changes: Mapping[str, str] | None = None, *, reuse: Built | None = None
) -> Built:
    """Build the scenario called `name` (shipped, or a path), with `changes` by dotted key.

    Robots, shells and functions of `reuse`, built of the same file before, are taken over where
    their tables are the same.

    Raises
    ------
    ScenarioError
        The file, a key, or a value is wrong; the text names them and what would be valid.
    NameNotFound
        No such scenario.
    MissingExtra
        The scenario needs an optional package that is not installed.
    """
    path = reading.find_scenario(name)
    scenario = reading.read_scenario(path, changes)
    check_knobs(scenario, path, ranges=not changes)
    return build_scenario(
        scenario, path, reuse if reuse is not None and reuse.path == path else None
    )


def rebuild(built: Built, changes: Mapping[str, str], *, anew: bool = False) -> Built:
    """Build the scenario of `built` with more values changed; its file is not read again.

    What the changes leave alone is the same object as before: `shells`, `assembly`,
    `visual_model`, `functions`. `built` stays as it is. With `anew` the user's own functions are
    loaded again, unless they are figures alone: what they remember must not reach another run.

    Raises
    ------
    ScenarioError
        A key or a value is wrong; the text names it and what would be valid.
    """
    if anew and built.functions.keys() - built.scenario.figures.values():
        built = replace(built, functions={})
    elif (same := with_numbers(built, changes) or _with_controller(built, changes)) is not None:
        return same
    scenario = reading.change_scenario(built.scenario, changes, built.path)
    check_knobs(scenario, built.path, ranges=False)
    return build_scenario(scenario, built.path, built)


def _with_controller(built: Built, changes: Mapping[str, str]) -> Built | None:
    """Return `built` with other numbers of its controller; None as `with_numbers`."""
    stated, values = built.scenario.controller, dict[str, float]()
    for key, text in changes.items():
        name, value = key.removeprefix("controller."), number_in(text)
        if name == key or value is None or not has_number(stated, name):
            return None
        values[name] = value
    try:
        new = stated.changed(**values)
    except errors.InvalidParameter:
        return None
    scenario = built.scenario.model_copy(update={"controller": new})
    shells = {
        one.name: (built.shells[one.name], one.frame, bodies.to_se3(one.placement))
        for one in scenario.shell
    }
    load = built.functions.__getitem__
    controller = _build_controller(
        new, built.scene, built.q0, shells, built.path, lambda where, _: load(where)
    )
    return replace(built, scenario=scenario, controller=controller)


def build_scenario(
    scenario: schema.Scenario,
    path: Path,
    reuse: Built | None = None,
    *,
    function: Loader = load_function,
    robots: Mapping[tuple[object, ...], LoadedRobot] | None = None,
    surfaces: Mapping[str, Shell] | None = None,
) -> Built:
    """Build a scenario that is already read; `path` is its file, which others stand beside.

    Robots, shells and functions of `reuse` are taken over where their tables are the same.
    `function(where, path, key, modules)` gives what "file.py:function" names: `load_function` runs
    a file once for all its functions, `functions.unloaded` does not. `robots` at hand, by the
    `origin` of their table, and `surfaces`, by name, are not read from files.
    """
    assembly = _assemble(scenario, path, reuse, robots)
    functions = {} if reuse is None else dict(reuse.functions)
    modules: Modules = {}

    def load(where: str, key: str) -> Function:
        if where not in functions:
            functions[where] = function(where, path, key, modules)
        return functions[where]

    with bodies.blamed_on(path, "robot"):
        q_lock = assembly.q0 if assembly.lock else None
        if scenario.contact:
            bodies.check_masses(assembly, assembly.lock)
        joints = joint_components(scenario, assembly, path)
        scene = Scene(
            assembly.model,
            lock=assembly.lock,
            q_lock=q_lock,
            joints=joints,
            # What is only looked at starts no compiler.
            compiled=function is load_function and any(one.compiled for one in scenario.robot),
        )
    shells: dict[str, controllers.ShellPlace] = {}
    for i, section in enumerate(scenario.shell):
        key = reading.item_key("shell", scenario.shell, i)
        if section.name in shells:
            raise errors.ScenarioError(path, key, "two shells have this name: rename one")
        shell = (
            (surfaces or {}).get(section.name)
            or _kept_shell(section, reuse)
            or _build_shell(section, path, key)
        )
        shells[section.name] = shell, section.frame, bodies.to_se3(section.placement)
    for i, contact in enumerate(scenario.contact):
        key = reading.item_key("contact", scenario.contact, i)
        laws = _build_laws(contact, path, key, load)
        _add_contact(scene, contact, laws, shells, assembly, path, key)
    for i, source in enumerate(scenario.source):
        key = reading.item_key("source", scenario.source, i)
        find = load(source.find, f"{key}.find")
        laws = _build_laws(source, path, key, load)
        with bodies.blamed_on(path, key):
            scene.add_contact_source(find, source.frame_i, source.frame_j, *laws, name=source.name)
    q0, v0 = bodies.restrict(assembly.model, scene.model, assembly.q0, assembly.v0)
    controller = _build_controller(scenario.controller, scene, q0, shells, path, load)
    sensors = _build_sensors(scenario.sensor, scene, path)
    with bodies.blamed_on(path, "run"):
        simulation = Simulation(scene, scenario.run.made(), sensors)
    figures = {
        figure: load(where, f"figures.{figure}") for figure, where in scenario.figures.items()
    }
    if reuse is not None and assembly.visual_model is reuse.assembly.visual_model:
        visual = reuse.visual_model
    else:
        visual = bodies.reduce_visual(assembly)
    return Built(
        path.stem,
        path,
        scenario,
        scene,
        q0,
        v0,
        controller,
        simulation,
        visual,
        assembly,
        {name: shell for name, (shell, *_) in shells.items()},
        functions,
        figures,
    )


def _assemble(
    scenario: schema.Scenario,
    path: Path,
    reuse: Built | None,
    robots: Mapping[tuple[object, ...], LoadedRobot] | None,
) -> bodies.Assembly:
    if reuse is None:
        return bodies.assemble(scenario, path, robots)
    if reuse.scenario.robot != scenario.robot:
        loaded = zip(map(bodies.origin, reuse.scenario.robot), reuse.assembly.loaded, strict=True)
        return bodies.assemble(scenario, path, dict(loaded))
    if reuse.scenario.gravity == scenario.gravity:
        return reuse.assembly
    model = reuse.assembly.model.copy()
    model.gravity.linear = np.array(scenario.gravity)
    return replace(reuse.assembly, model=model)


def _kept_shell(section: schema.ShellSection, reuse: Built | None) -> Shell | None:
    """Return the shell of the same table in `reuse`; where it stands is no part of a shell."""
    if reuse is None:
        return None
    for old in reuse.scenario.shell:
        stands = {"frame": section.frame, "placement": section.placement}
        if old.model_copy(update=stands) == section:
            return reuse.shells[old.name]
    return None


def explain_built(built: Built) -> Explanation:
    """Return Scene.explain's answer for the start: what is modelled, time scales, warnings."""
    said = built.scene.explain(built.q0, built.v0, built.simulation.integrator.limited_dt)
    assumed = tuple(one.assumed for one in built.assembly.loaded if one.assumed)
    run = built.scenario.run
    rows = many_rows(built.simulation.integrator, run.duration, run.record_dt)
    told = said.warnings if rows is None else (*said.warnings, rows)
    said = replace(said, modelled=(*said.modelled, *assumed), warnings=told)
    if not isinstance(built.controller, controllers.Controller):
        return said
    setup = built.controller._setup_warnings(built.scene, built.q0)
    return replace(said, warnings=(*said.warnings, *setup))


def _build_shell(section: schema.ShellSection, path: Path, key: str) -> Shell:
    options: dict[str, Any] = {
        name: getattr(section, name) for name in ("chord_error", "side", "name")
    }
    options["crease_angle"] = float(np.deg2rad(section.crease_angle_deg))
    with bodies.blamed_on(path, key):
        if section.primitive is not None:
            shell = section.primitive.shell(segments=section.segments, **options)
        else:
            file = path.parent / str(section.file)
            if reason := why_no_file(file):
                raise errors.SphshellError(f"surface {file}: {reason}")
            of_files = ("unit", "scale", "bodies", "faces", "time_limit", "memory_limit")
            options |= {name: getattr(section, name) for name in of_files}
            shell = Shell.from_file(file, **options)
        return shell if section.magnify == 1.0 else shell.transformed(scale=section.magnify)


def _build_laws(
    stated: schema.ContactSection | schema.SourceSection,
    path: Path,
    key: str,
    load: Callable[[str, str], Function],
) -> tuple[NormalLaw, Friction | None]:
    def built(part: str) -> Any:
        law = getattr(stated, part)
        if isinstance(law, FunctionFile | FunctionFrictionFile):
            return law.loaded(lambda where, field: load(where, f"{key}.{part}.{field}"))
        return law._build(path.parent)

    with bodies.blamed_on(path, key):
        return built("law"), built("friction")


def _find_shell(
    shells: Mapping[str, controllers.ShellPlace], name: str, path: Path, key: str
) -> controllers.ShellPlace:
    with bodies.blamed_on(path, f"{key}.shell"):
        if name not in shells:
            raise errors.NameNotFound("shell", name, "the scenario", shells)
    return shells[name]


def _add_contact(
    scene: Scene,
    contact: schema.ContactSection,
    laws: tuple[NormalLaw, Friction | None],
    shells: Mapping[str, controllers.ShellPlace],
    assembly: bodies.Assembly,
    path: Path,
    key: str,
) -> None:
    touched: tuple[Any, ...]
    if contact.other_sphere is not None:
        touched, carrier = (to_sphere(contact.other_sphere),), contact.other_sphere.frame
    else:
        touched = _find_shell(shells, contact.shell or "", path, key)
        carrier = touched[1]
    with bodies.blamed_on(path, f"{key}.spheres"):
        several = spheres_of(contact, assembly, carrier)
    with bodies.blamed_on(path, key), warnings.catch_warnings():
        # Scene.explain reports it for every scenario.
        warnings.simplefilter("ignore", errors.UnitWarning)
        law, friction = laws
        how: dict[str, Any] = {"law": law, "friction": friction, "name": contact.name}
        how["method"], one = contact.method, contact.sphere or contact.plane
        if one is not None:
            scene.add_contact(to_end(one), *touched, **how)
        else:
            scene.add_contacts(several, *touched, **how)


def _build_sensors(stated: Sequence[Component], scene: Scene, path: Path) -> tuple[Sensor, ...]:
    for i, one in enumerate(stated):
        with bodies.blamed_on(path, reading.item_key("sensor", stated, i)):
            assert isinstance(one, Sensor)
            # A wrong frame or joint is reported now, not when the run starts.
            one._bind(scene)
    with bodies.blamed_on(path, "sensor"):
        return check_sensors(stated)


def _build_controller(
    stated: Component,
    scene: Scene,
    q0: Array,
    shells: Mapping[str, controllers.ShellPlace],
    path: Path,
    load: Callable[[str, str], Function],
) -> controllers.Controller | Function | None:
    with bodies.blamed_on(path, "controller"):
        if isinstance(stated, controllers.PythonFunction):
            function = load(stated.function, "controller.function")
            controllers.check_callable(function)
            return function
        controller: controllers.Controller | None = stated._build(path.parent)
        if controller is None:
            return None
        controller = controller.in_scenario(
            lambda name: _find_shell(shells, name, path, "controller")
        )
        try:
            # A wrong frame, joint or size is reported now, not when the run starts.
            controller._bind(scene, q0)
        except errors.InvalidParameter as error:
            name = error.name.partition(".")[0].partition("[")[0]
            known = name in parameters_of(stated)
            raise errors.ScenarioError(
                path, f"controller.{name}" if known else "controller", str(error)
            ) from None
        return controller
