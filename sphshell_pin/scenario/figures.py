"""What a run is measured by, and whether it came out as the scenario expects."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Any

import numpy as np

from sphshell_pin.errors import ScenarioError, add_origin
from sphshell_pin.scenario.build import Built

PAIR_FIGURES = {
    "contact_time": "s",
    "touches": "",
    "peak_force": "N",
    "mean_force": "N",
    "max_depth": "m",
    "max_depth_time": "s",
}
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
    names += RUN_FIGURES
    names += [f"figures.{name}" for name in built.figures]
    model = built.scene.model
    for j, joint in enumerate(model.names):
        if j == 0:
            continue
        for kind, n in (("q", model.joints[j].nq), ("v", model.joints[j].nv)):
            names += [f"final.{kind}.{joint}.{i}" for i in range(n)] if n > 1 else []
            names += [f"final.{kind}.{joint}"] if n == 1 else []
    return names


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


def measure(built: Built, result: Any, name: str) -> float:
    """Return the figure `name` of `result` [SI units, see PAIR_FIGURES and RUN_FIGURES]."""
    kind, _, rest = name.partition(".")
    if kind == "pairs":
        pair, _, figure = rest.rpartition(".")
        return float(getattr(result.stats.pairs[pair], figure))
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


def measure_energy(result: Any) -> dict[str, float]:
    """Return the energy exchanged, the residual's largest size [J], and their ratio."""
    residual = float(np.max(np.abs(result.energy.residual), initial=0.0))
    exchanged = float(result.energy.exchanged)
    ratio = residual / exchanged if exchanged > 0 else 0.0
    return {"exchanged": exchanged, "residual": residual, "relative_residual": ratio}


def judge(built: Built, result: Any) -> list[Verdict]:
    """Return the verdict on each of the scenario's expectations."""
    verdicts = []
    for name, expected in built.scenario.expect.items():
        measured = measure(built, result, name)
        verdicts.append(Verdict(name, str(expected), measured, expected.met_by(measured)))
    return verdicts


def _final(model: Any, result: Any, rest: str) -> float:
    kind, _, joint = rest.partition(".")
    index = 0
    if joint not in list(model.names):
        joint, _, last = joint.rpartition(".")
        index = int(last)
    entry = model.joints[model.getJointId(joint)]
    if kind == "q":
        return float(result.q[-1, entry.idx_q + index])
    return float(result.v[-1, entry.idx_v + index])
