"""What a run is measured by, and whether it came out as the scenario expects."""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_columns import coordinates, state_titles
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import ScenarioError, add_origin
from sphshell_pin.scenario.format.build import Built

PAIR_FIGURES = {
    "contact_time": "s",
    "touches": "",
    "peak_force": "N",
    "mean_force": "N",
    "max_depth": "m",
    "max_depth_time": "s",
    "impulse": "N s",
    "peak_force_time": "s",
}
JOINT_FIGURES = {
    "stop_time": "s",
    "stops": "",
    "stop_impulse": "N m s",
    "peak_stop_force": "N m",
    "max_stop_depth": "rad",
    "cut_time": "s",
    "peak_speed": "rad/s",
}
_SLIDING = {"N m s": "N s", "N m": "N", "rad": "m", "rad/s": "m/s"}
"""Units of a joint that slides, by those of one that turns."""
SENSOR_FIGURES = ("min", "max", "mean", "last")
"""Figures of each value of a sensor's readings, in the unit of its column."""
RUN_FIGURES = {
    "energy.exchanged": "J",
    "energy.residual": "J",
    "energy.relative_residual": "",
    "stats.real_time_factor": "",
    "stats.steps": "",
    "stats.duration": "s",
    "stats.rejected": "",
    "stats.evaluations": "",
    "stats.dt": "s",
}
NOT_REPEATABLE = ("stats.real_time_factor",)
"""Figures that are no property of the motion: they differ from one time to the next."""


@dataclass(frozen=True)
class Verdict:
    """One expectation beside what came out."""

    figure: str
    expected: str
    measured: float
    met: bool


def figure_units(built: Built) -> dict[str, str]:
    """Return the units of all figures that a run of this scenario can be measured by, by name.

    Those without a unit, and those of the scenario's own routines, have an empty one.
    """
    model, joints = built.scene.model, built.scene.joints
    units = dict[str, str]()
    for pair in built.scene.pairs:
        units |= {f"pairs.{pair.name}.{one}": unit for one, unit in PAIR_FIGURES.items()}
    for name in dict.fromkeys((*joints.limits, *joints.effort, *joints.speed)):
        units |= {f"joints.{name}.{one}": unit for one, unit in _joint_units(name, model).items()}
    for sensor in built.simulation.sensors:
        units |= _sensor_units(sensor.name, sensor.columns(built.scene))
    units |= RUN_FIGURES | {f"figures.{name}": "" for name in built.figures}
    for titles in coordinates(model):
        units |= {f"final.{name}": unit for name, unit in map(quantity_of, titles)}
    return units


def _joint_units(name: str, model: pin.Model | None) -> dict[str, str]:
    """Return the units of a joint's figures; without a `model` those of one that turns."""
    if model is None or not joint_slides(model.joints[model.getJointId(name)]):
        return JOINT_FIGURES
    return {one: _SLIDING.get(unit, unit) for one, unit in JOINT_FIGURES.items()}


def _sensor_units(name: str, columns: Sequence[str]) -> dict[str, str]:
    """Return the units of the figures of a sensor with these columns, by their names."""
    quantities = [quantity_of(title) for title in columns]
    return {
        f"sensors.{name}.{label}.{one}": unit
        for label, unit in quantities
        for one in SENSOR_FIGURES
    }


def check_expectations(built: Built) -> None:
    """Refuse an expectation of a figure that no run of this scenario will have.

    Raises
    ------
    ScenarioError
        It names the unknown figure, and those that come nearest.
    """
    valid = list(figure_units(built))
    for name in built.scenario.expect:
        if name not in valid:
            near = difflib.get_close_matches(name, valid, n=5, cutoff=0.3) or valid[:10]
            raise ScenarioError(
                built.path,
                f'expect."{name}"',
                f"no such figure; the nearest ones are: {', '.join(near)}",
            )


def recorded_figures(
    result: Result, scene: Scene | None, row: int = -1
) -> dict[str, tuple[float, str]]:
    """Return the figures of `result` by their names, each with its unit, in SI.

    Those of a sensor without readings are nan. The last state is that of the recorded `row`;
    without a `scene` its coordinates have numbers as names, and no units.
    """
    stats, model = result.stats, None if scene is None else scene.model
    found: dict[str, tuple[float, str]] = {}
    for name, pair in stats.pairs.items():
        for one, unit in PAIR_FIGURES.items():
            found[f"pairs.{name}.{one}"] = getattr(pair, one), unit
    for name, joint in stats.joints.items():
        for one, unit in _joint_units(name, model).items():
            found[f"joints.{name}.{one}"] = getattr(joint, one), unit
    for name, log in result.sensors.items():
        readings = log.values if len(log.values) else np.full((1, len(log.columns)), np.nan)
        for title, values in zip(log.columns, readings.T, strict=True):
            ways = values.min(), values.max(), values.mean(), values[-1]
            units = _sensor_units(name, [title])
            found |= zip(units, zip(ways, units.values(), strict=True), strict=True)
    energy = measure_energy(result)
    for name, unit in RUN_FIGURES.items():
        kind, _, one = name.partition(".")
        found[name] = energy[one] if kind == "energy" else getattr(stats, one), unit
    for titles, state in zip(state_titles(result, scene), (result.q, result.v), strict=True):
        for title, number in zip(titles, state[row], strict=True):
            name, unit = quantity_of(title)
            found[f"final.{name}"] = number, unit
    return {name: (float(value), unit) for name, (value, unit) in found.items()}


def measuring(built: Built, result: Result) -> Callable[[str], float]:
    """Return a function of a figure's name that measures it of `result`, in SI."""
    recorded = recorded_figures(result, built.scene)

    def measure(name: str) -> float:
        kind, _, own = name.partition(".")
        if kind != "figures":
            return recorded[name][0]
        try:
            return float(built.figures[own](result, built.scene))
        except Exception as error:
            add_origin(error, f"the scenario's figure '{own}'")
            raise

    return measure


def measure_energy(result: Result) -> dict[str, float]:
    """Return the energy exchanged, the residual's largest size [J], and their ratio."""
    residual = float(np.max(np.abs(result.energy.residual), initial=0.0))
    exchanged = float(result.energy.exchanged)
    ratio = residual / exchanged if exchanged > 0 else 0.0
    return {"exchanged": exchanged, "residual": residual, "relative_residual": ratio}


def judge(built: Built, result: Result) -> list[Verdict]:
    """Return the verdict on each of the scenario's expectations."""
    verdicts, measure = [], measuring(built, result)
    for name, expected in built.scenario.expect.items():
        measured = measure(name)
        verdicts.append(Verdict(name, str(expected), measured, expected.met_by(measured)))
    return verdicts
