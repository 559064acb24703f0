"""Figures of a Result: forces and depth, the energy audit, where the contacts were.

Figures are made without pyplot: no window, no global state, any thread.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.checks import check_name
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.dynamics.result.result_scene import find_scene
from sphshell_pin.errors import NameNotFound
from sphshell_pin.plot.contact_map import plot_contact_map as plot_contact_map
from sphshell_pin.plot.figure import write_figure
from sphshell_pin.plot.over_time import plot_energy as plot_energy
from sphshell_pin.plot.over_time import plot_force_and_depth as plot_force_and_depth
from sphshell_pin.plot.over_time import plot_overview as plot_overview
from sphshell_pin.plot.over_time import plot_sensors as plot_sensors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene


KINDS: dict[str, Callable[..., Figure]] = {
    "overview": plot_overview,
    "force": plot_force_and_depth,
    "energy": plot_energy,
    "map": plot_contact_map,
    "sensors": plot_sensors,
}


def plot_result(result: Result, kind: str = "overview", scene: Scene | None = None) -> Figure:
    """Return one matplotlib Figure of `result`.

    `kind` is one of KINDS: force, depth and energy over time ("overview"), force and depth of each
    pair ("force"), the energy audit ("energy"), the path on the shells and the impulse that each
    element took ("map"), the readings over time ("sensors"). The map needs `scene` (default: the
    scene that ran, or that of the scenario the result came from).

    Raises NameNotFound for another kind, MissingExtra without matplotlib, ResultError where "map"
    has no scene.
    """
    check_name("kind", kind)
    if kind not in KINDS:
        raise NameNotFound("kind of figure", kind, "a result", KINDS)
    return KINDS[kind](result, *([scene] if kind == "map" else []))


def save_figures(result: Result, folder: StrPath, scene: Scene | None = None) -> list[Path]:
    """Write the figures of `result` as .png files into `folder`; return their paths.

    They are force_and_depth, energy, of a result that touched a shell contact_map, and of one with
    sensors sensors. The map needs `scene` (default: the scene that ran, or that of the scenario the
    result came from; without any there is no map). Raises MissingExtra without matplotlib,
    ResultError if a file cannot be written or the scene cannot be built again.
    """
    scene = find_scene(result, scene)
    figures = {
        "force_and_depth.png": plot_force_and_depth(result),
        "energy.png": plot_energy(result),
    }
    touched = {int(pair) for pair in result.contacts.pair}
    if scene is not None and any(scene.pairs[pair].shells for pair in touched):
        figures["contact_map.png"] = plot_contact_map(result, scene)
    if result.sensors:
        figures["sensors.png"] = plot_sensors(result)
    return [write_figure(Path(folder) / name, figure) for name, figure in figures.items()]
