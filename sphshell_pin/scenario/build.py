"""From a scenario file to what runs: the scene, its start state, its controller, its simulation."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt

import sphshell_pin as sp
from sphshell_pin.dynamics.controllers import Controller
from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError, UnitWarning
from sphshell_pin.scenario import schema
from sphshell_pin.scenario.bodies import (
    Assembly,
    assemble,
    blamed_on,
    by_joint,
    origin,
    reduce_visual,
    restrict,
    to_se3,
)
from sphshell_pin.scenario.functions import load_function
from sphshell_pin.scenario.knobs import check_knobs
from sphshell_pin.scenario.reading import (
    change_scenario,
    find_scenario,
    item_key,
    read_scenario,
)

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Built:
    """A scenario ready to run."""

    name: str
    path: Path
    scenario: schema.Scenario
    scene: sp.Scene
    q0: Array
    v0: Array
    controller: Any
    simulation: sp.Simulation
    visual_model: Any
    """pinocchio.GeometryModel of the scene's model."""
    assembly: Assembly
    """The robots as one model; the same object as before where a rebuild could keep it."""
    shells: Mapping[str, sp.Shell]
    """The surfaces by name; the same objects as before where a rebuild could keep them."""
    functions: Mapping[str, Callable[..., Any]]
    """The user's own functions by "file.py:function", loaded once."""
    figures: Mapping[str, Callable[[Any, Any], float]]
    """The scenario's own figures: functions of (result, scene)."""


def build(
    name: str | PathLike[str],
    changes: Mapping[str, str] | None = None,
    *,
    reuse: Built | None = None,
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
    path = find_scenario(name)
    scenario = read_scenario(path, changes)
    check_knobs(scenario, path, ranges=not changes)
    return build_scenario(
        scenario, path, reuse if reuse is not None and reuse.path == path else None
    )


def rebuild(built: Built, changes: Mapping[str, str]) -> Built:
    """Build the scenario of `built` with more values changed; its file is not read again.

    What the changes leave alone is the same object as before: `shells`, `assembly`,
    `visual_model`, `functions`. `built` stays as it is.

    Raises
    ------
    ScenarioError
        A key or a value is wrong; the text names it and what would be valid.
    """
    scenario = change_scenario(built.scenario, changes, built.path)
    check_knobs(scenario, built.path, ranges=False)
    return build_scenario(scenario, built.path, built)


def build_scenario(
    scenario: schema.Scenario,
    path: Path,
    reuse: Built | None = None,
    *,
    function: Callable[[str, Path, str], Callable[..., Any]] = load_function,
) -> Built:
    """Build a scenario that is already read; `path` is its file, which others stand beside.

    Robots, shells and functions of `reuse` are taken over where their tables are the same.
    `function(where, path, key)` gives what "file.py:function" names: `load_function` runs the file,
    `functions.unloaded` does not.
    """
    assembly = _assemble(scenario, path, reuse)
    functions = {} if reuse is None else dict(reuse.functions)

    def load(where: str, key: str) -> Callable[..., Any]:
        if where not in functions:
            functions[where] = function(where, path, key)
        return functions[where]

    with blamed_on(path, "robot"):
        q_lock = assembly.q0 if assembly.lock else None
        scene = sp.Scene(assembly.model, lock=assembly.lock, q_lock=q_lock)
    shells = {
        section.name: (
            _kept_shell(section, reuse)
            or _build_shell(section, path, item_key("shell", scenario.shell, i)),
            section,
        )
        for i, section in enumerate(scenario.shell)
    }
    if len(shells) < len(scenario.shell):
        raise ScenarioError(path, "shell", "two shells share a name")
    for i, contact in enumerate(scenario.contact):
        key = item_key("contact", scenario.contact, i)
        _add_contact(scene, contact, shells, path, key)
    for i, source in enumerate(scenario.source):
        key = item_key("source", scenario.source, i)
        find = load(source.find, f"{key}.find")
        with blamed_on(path, key):
            scene.add_contact_source(
                find,
                source.frame_i,
                source.frame_j,
                _build_law(source.law),
                _build_friction(source.friction),
                name=source.name,
            )
    q0, v0 = restrict(assembly.model, scene.model, assembly.q0, assembly.v0)
    controller = _build_controller(scenario.controller, scene, q0, shells, path, load)
    if isinstance(controller, Controller):
        with blamed_on(path, "controller"):
            # A wrong frame or joint is told now, not when the run starts.
            controller.to_core(scene, q0)
    run = scenario.run
    with blamed_on(path, "run"):
        simulation = sp.Simulation(scene, integrator=_build_integrator(run))
    figures = {
        figure: load(where, f"figures.{figure}") for figure, where in scenario.figures.items()
    }
    if reuse is not None and assembly.visual_model is reuse.assembly.visual_model:
        visual = reuse.visual_model
    else:
        visual = reduce_visual(assembly)
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
        {name: shell for name, (shell, _) in shells.items()},
        functions,
        figures,
    )


def _assemble(scenario: schema.Scenario, path: Path, reuse: Built | None) -> Assembly:
    if reuse is None:
        return assemble(scenario, path)
    if reuse.scenario.robot != scenario.robot:
        loaded = zip(map(origin, reuse.scenario.robot), reuse.assembly.loaded, strict=True)
        return assemble(scenario, path, dict(loaded))
    if reuse.scenario.gravity == scenario.gravity:
        return reuse.assembly
    model = reuse.assembly.model.copy()
    model.gravity.linear = np.array(scenario.gravity)
    return replace(reuse.assembly, model=model)


def _kept_shell(section: schema.ShellSection, reuse: Built | None) -> sp.Shell | None:
    """Return the shell of the same table in `reuse`; where it stands is no part of a shell."""
    if reuse is None:
        return None
    for old in reuse.scenario.shell:
        stands = {"frame": section.frame, "placement": section.placement}
        if old.model_copy(update=stands) == section:
            return reuse.shells[old.name]
    return None


def explain_built(built: Built) -> Any:
    """Return Scene.explain's answer for the start: what is modelled, time scales, warnings."""
    stepper = built.simulation.integrator
    # The recommended step is the first-order stepper's: no other is judged by it.
    dt = stepper.dt if isinstance(stepper, sp.SemiImplicitEuler) else None
    return built.scene.explain(built.q0, built.v0, dt)


def _build_shell(section: schema.ShellSection, path: Path, key: str) -> sp.Shell:
    options: dict[str, Any] = {
        "side": section.side,
        "crease_angle": np.deg2rad(section.crease_angle_deg),
        "name": section.name,
    }
    with blamed_on(path, key):
        if section.file is not None:
            file = path.parent / section.file
            if not os.path.isfile(file):
                raise SphshellError(f"no such surface file: {file}")
            shell = sp.Shell.from_file(
                file,
                unit=section.unit,
                scale=section.scale,
                chord_error=section.chord_error,
                bodies=section.bodies,
                faces=section.faces,
                time_limit=section.time_limit,
                memory_limit=section.memory_limit,
                **options,
            )
        else:
            if section.chord_error is not None:
                options["chord_error"] = section.chord_error
            if section.segments is not None:
                options["segments"] = section.segments
            if isinstance(section.primitive, schema.HalfSpace):
                options["extent"] = section.primitive.extent
            shell = sp.Shell.from_geometry(_to_coal(section.primitive), **options)
        return shell if section.magnify == 1.0 else shell.transformed(scale=section.magnify)


def _to_coal(primitive: Any) -> Any:
    match primitive:
        case schema.Box():
            return coal.Box(*primitive.size)
        case schema.SphereSurface():
            return coal.Sphere(primitive.radius)
        case schema.Cylinder():
            return coal.Cylinder(primitive.radius, primitive.length)
        case schema.Capsule():
            return coal.Capsule(primitive.radius, primitive.length)
        case schema.Cone():
            return coal.Cone(primitive.radius, primitive.length)
        case schema.Ellipsoid():
            return coal.Ellipsoid(*primitive.radii)
        case _:
            return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


def _add_contact(
    scene: sp.Scene,
    contact: schema.ContactSection,
    shells: Mapping[str, tuple[sp.Shell, schema.ShellSection]],
    path: Path,
    key: str,
) -> None:
    with blamed_on(path, f"{key}.shell"):
        if contact.shell not in shells:
            raise NameNotFound("shell", contact.shell, "the scenario", shells)
    shell, section = shells[contact.shell]
    with blamed_on(path, key), warnings.catch_warnings():
        warnings.simplefilter("ignore", UnitWarning)  # Scene.explain tells it for every scenario
        sphere = contact.sphere
        x, y, z = sphere.offset
        scene.add_contact(
            sphere=sp.Sphere(sphere.radius, frame=sphere.frame, offset=(x, y, z)),
            shell=shell,
            frame=section.frame,
            placement=to_se3(section.placement),
            law=_build_law(contact.law),
            friction=_build_friction(contact.friction),
            method=contact.method,
            name=contact.name,
        )


def _build_law(law: schema.Law) -> Any:
    values = law.model_dump(exclude={"type"})
    match law:
        case schema.Impact():
            return sp.ImpactLaw(**values)
        case schema.Adams():
            return sp.ImpactLaw.from_adams(**values)
        case schema.Hertz():
            return sp.ImpactLaw.hertz(**values)
        case _:
            return sp.HuntCrossleyLaw(**values)


def _build_friction(friction: schema.Friction) -> Any:
    values = friction.model_dump(exclude={"type"})
    match friction:
        case schema.Coulomb():
            return sp.CoulombFriction(**values)
        case schema.Bristle():
            return sp.BristleFriction(**values)
        case _:
            return None


_INTEGRATORS = {
    "semi-implicit-euler": sp.SemiImplicitEuler,
    "runge-kutta-4": sp.RungeKutta4,
    "linearly-implicit-euler": sp.LinearlyImplicitEuler,
    "adaptive": sp.Adaptive,
    "implicit": sp.Implicit,
}


def _build_integrator(run: schema.RunSection) -> Any:
    given = {k: getattr(run, k) for k in ("dt", "rtol", "atol")}
    chosen: Any = _INTEGRATORS[run.integrator]
    return chosen(**{k: v for k, v in given.items() if v is not None})


def _build_controller(
    section: schema.Controller,
    scene: sp.Scene,
    q0: Array,
    shells: Mapping[str, tuple[sp.Shell, schema.ShellSection]],
    path: Path,
    load: Callable[[str, str], Callable[..., Any]],
) -> Any:
    with blamed_on(path, "controller"):
        match section:
            case schema.GravityCompensationSection():
                return sp.GravityCompensation()
            case schema.PythonSection():
                return load(section.function, "controller.function")
            case schema.JointPDSection():
                return sp.JointPD(
                    _gain(scene.model, section.kp, path, "controller.kp"),
                    _gain(scene.model, section.kd, path, "controller.kd"),
                    _reference(scene.model, section.q_ref, q0, path),
                    gravity_compensation=section.gravity_compensation,
                )
            case schema.CartesianImpedanceSection():
                return _build_impedance(section, scene, q0, shells, path)
            case _:
                return None


def _build_impedance(
    section: schema.CartesianImpedanceSection,
    scene: sp.Scene,
    q0: Array,
    shells: Mapping[str, tuple[sp.Shell, schema.ShellSection]],
    path: Path,
) -> Any:
    options: dict[str, Any] = {}
    if section.shell is not None:
        with blamed_on(path, "controller.shell"):
            if section.shell not in shells:
                raise NameNotFound("shell", section.shell, "the scenario", shells)
        shell, stands = shells[section.shell]
        options = {
            "shell": shell,
            "shell_frame": stands.frame,
            "placement": to_se3(stands.placement),
        }
    return sp.CartesianImpedance(
        section.frame,
        np.array(section.path),
        section.stiffness,
        section.damping,
        section.normal_force,
        speed=section.speed,
        lead_in=section.lead_in,
        rotational_stiffness=section.rotational_stiffness,
        rotational_damping=section.rotational_damping,
        posture_stiffness=_gain(
            scene.model, section.posture_stiffness, path, "controller.posture_stiffness"
        ),
        joint_damping=_gain(scene.model, section.joint_damping, path, "controller.joint_damping"),
        q_ref=_reference(scene.model, section.q_ref, q0, path),
        **options,
    )


def _gain(model: Any, gain: schema.Gain, path: Path, key: str) -> Array:
    """Return a gain per velocity coordinate (nv,); free-flying bodies have no motor."""
    if isinstance(gain, dict):
        with blamed_on(path, key):
            return by_joint(model, gain, "v", 0.0)
    if isinstance(gain, list):
        if len(gain) != model.nv:
            raise ScenarioError(path, key, f"takes {model.nv} numbers (nv), not {len(gain)}")
        return np.array(gain)
    motors = {name: gain for j, name in enumerate(model.names) if j and model.joints[j].nv < 6}
    return by_joint(model, motors, "v", 0.0)


def _reference(
    model: Any, given: list[float] | dict[str, float] | None, q0: Array, path: Path
) -> Array:
    if given is None:
        return q0.copy()
    if isinstance(given, list):
        if len(given) != model.nq:
            raise ScenarioError(
                path, "controller.q_ref", f"takes {model.nq} numbers (nq), not {len(given)}"
            )
        return np.array(given)
    with blamed_on(path, "controller.q_ref"):
        return by_joint(model, given, "q", q0)
