"""What a run is measured by, and whether it came out as the scenario expects."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_columns import coordinates
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.errors import ScenarioError, add_origin
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.tables import quantity_of

PAIR_FIGURES = {
    "contact_time": "s",
    "touches": "",
    "peak_force": "N",
    "mean_force": "N",
    "max_depth": "m",
    "max_depth_time": "s",
}
PAIR_UNITS = {"impulse": "N s", "peak_force_time": "s"} | PAIR_FIGURES
"""Of all figures of a pair in `RunStats`."""
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
"""Of each value of a sensor's readings, in the unit of its column."""
RUN_FIGURES = {
    "energy.exchanged": "J",
    "energy.residual": "J",
    "energy.relative_residual": "",
    "stats.real_time_factor": "",
    "stats.steps": "",
    "stats.duration": "s",
}


@dataclass(frozen=True)
class Verdict:
    """One expectation beside what came out."""

    figure: str
    expected: str
    measured: float
    met: bool


def figure_names(built: Built) -> list[str]:
    """Return every figure that a run of this scenario can be measured by."""
    names = [f"pairs.{pair.name}.{one}" for pair in built.scene.pairs for one in PAIR_FIGURES]
    joints = built.scene.joints
    watched = dict.fromkeys((*joints.limits, *joints.effort, *joints.speed))
    names += [f"joints.{name}.{one}" for name in watched for one in JOINT_FIGURES]
    names += [
        f"sensors.{sensor.name}.{_label(column)}.{one}"
        for sensor in built.simulation.sensors
        for column in sensor.columns(built.scene)
        for one in SENSOR_FIGURES
    ]
    names += RUN_FIGURES
    names += [f"figures.{name}" for name in built.figures]
    model = built.scene.model
    for joint in list(model.names)[1:]:
        for kind, span in zip("qv", joint_spans(model, joint), strict=True):
            count = span.stop - span.start
            name = f"final.{kind}.{joint}"
            names += [f"{name}.{i}" for i in range(count)] if count > 1 else [name] * count
    return names


def figure_units(built: Built) -> dict[str, str]:
    """Return the units of the figures that are known to have one, by their names."""
    model = built.scene.model
    units = dict(RUN_FIGURES)
    for pair in built.scene.pairs:
        units |= {f"pairs.{pair.name}.{one}": unit for one, unit in PAIR_UNITS.items()}
    for name in list(model.names)[1:]:
        slides = joint_slides(model.joints[model.getJointId(name)])
        units |= {
            f"joints.{name}.{one}": _SLIDING.get(unit, unit) if slides else unit
            for one, unit in JOINT_FIGURES.items()
        }
    for sensor in built.simulation.sensors:
        for title in sensor.columns(built.scene):
            name = f"sensors.{sensor.name}.{_label(title)}"
            units |= {f"{name}.{one}": quantity_of(title)[1] for one in SENSOR_FIGURES}
    for titles in coordinates(model):
        units |= {f"final.{name}": unit for name, unit in map(quantity_of, titles)}
    return {name: unit for name, unit in units.items() if unit not in ("", "1")}


def check_expectations(built: Built) -> None:
    """Refuse an expectation of a figure that no run of this scenario will have.

    Raises
    ------
    ScenarioError
        It names the unknown figure, and those that come nearest.
    """
    valid = figure_names(built)
    for name in built.scenario.expect:
        if name not in valid:
            near = difflib.get_close_matches(name, valid, n=5, cutoff=0.3) or valid[:10]
            raise ScenarioError(
                built.path,
                f'expect."{name}"',
                f"no such figure; the nearest ones are: {', '.join(near)}",
            )


def measure(built: Built, result: Result, name: str) -> float:
    """Return the figure `name` of `result`, in SI units; see PAIR_FIGURES and those after it."""
    kind, _, rest = name.partition(".")
    if kind in ("pairs", "joints"):
        owner, _, figure = rest.rpartition(".")
        return float(getattr(getattr(result.stats, kind)[owner], figure))
    if kind == "sensors":
        return _of_sensor(result, rest)
    if kind == "figures":
        try:
            return float(built.figures[rest](result, built.scene))
        except Exception as error:
            add_origin(error, f"the scenario's figure '{rest}'")
            raise
    if kind == "final":
        return _final(built.scene.model, result, rest)
    if kind == "energy":
        return measure_energy(result)[rest]
    return float(getattr(result.stats, rest))


def measure_energy(result: Result) -> dict[str, float]:
    """Return the energy exchanged, the residual's largest size [J], and their ratio."""
    residual = float(np.max(np.abs(result.energy.residual), initial=0.0))
    exchanged = float(result.energy.exchanged)
    ratio = residual / exchanged if exchanged > 0 else 0.0
    return {"exchanged": exchanged, "residual": residual, "relative_residual": ratio}


def judge(built: Built, result: Result) -> list[Verdict]:
    """Return the verdict on each of the scenario's expectations."""
    verdicts = []
    for name, expected in built.scenario.expect.items():
        measured = measure(built, result, name)
        verdicts.append(Verdict(name, str(expected), measured, expected.met_by(measured)))
    return verdicts


def _label(column: str) -> str:
    """Return the name of a sensor's column without its unit."""
    return column.partition(" ")[0]


def _of_sensor(result: Result, rest: str) -> float:
    """Return a figure of the readings: `rest` is a sensor, a column, and one of SENSOR_FIGURES.

    It is nan where no reading arrived.
    """
    rest, _, figure = rest.rpartition(".")
    name, _, label = rest.rpartition(".")
    log = result.sensors[name]
    values = log.values[:, [_label(column) for column in log.columns].index(label)]
    if not len(values):
        return float("nan")
    return float(values[-1] if figure == "last" else getattr(values, figure)())


def _final(model: pin.Model, result: Result, rest: str) -> float:
    """Return the last `rest`: q or v, a joint, and an index where it has several."""
    kind, _, joint = rest.partition(".")
    index = 0
    if joint not in list(model.names):
        joint, _, last = joint.rpartition(".")
        index = int(last)
    in_q, in_v = joint_spans(model, joint)
    return float(result.q[-1, in_q][index] if kind == "q" else result.v[-1, in_v][index])
