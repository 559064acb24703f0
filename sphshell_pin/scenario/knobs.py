"""Knobs: the numbers of a scenario that one turns while looking at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario.reading import look_up
from sphshell_pin.scenario.schema import KnobSection, Scenario

if TYPE_CHECKING:
    from sphshell_pin.scenario.build import Built

# A knob without a range goes from a tenth of its value to ten times as much.
DECADE = 10.0

# What the last word of a key means: label, unit. The table's own words come first.
_LAW = {
    "exponent": ("exponent", ""),
    "damping": ("damping", "N s/m"),
    "full_damping_depth": ("full damping depth", "m"),
    "dissipation": ("dissipation", "s/m"),
    "radius": ("Hertz radius", "m"),
    "young_1": ("Young's modulus 1", "Pa"),
    "young_2": ("Young's modulus 2", "Pa"),
    "poisson_1": ("Poisson's ratio 1", ""),
    "poisson_2": ("Poisson's ratio 2", ""),
    "restitution": ("restitution", ""),
    "speed": ("speed of the restitution", "m/s"),
}
_FRICTION = {
    "mu_static": ("static friction", ""),
    "mu_dynamic": ("dynamic friction", ""),
    "v_static": ("static friction speed", "m/s"),
    "v_dynamic": ("dynamic friction speed", "m/s"),
    "stiffness": ("bristle stiffness", "N/m"),
    "damping": ("bristle damping", "N s/m"),
    "v_stribeck": ("Stribeck speed", "m/s"),
}
_SPHERE = {"radius": ("sphere radius", "m")}
_CONTROLLER = {
    "normal_force": ("normal force", "N"),
    "speed": ("path speed", "m/s"),
    "lead_in": ("lead-in", "s"),
    "stiffness": ("tip stiffness", "N/m"),
    "damping": ("tip damping", "N s/m"),
    "rotational_stiffness": ("rotational stiffness", "N m/rad"),
    "rotational_damping": ("rotational damping", "N m s/rad"),
    "posture_stiffness": ("posture stiffness", "N m/rad"),
    "joint_damping": ("joint damping", "N m s/rad"),
    "kp": ("joint stiffness", "N m/rad"),
    "kd": ("joint damping", "N m s/rad"),
}
_RUN = {
    "duration": ("duration", "s"),
    "dt": ("time step", "s"),
    "rtol": ("relative tolerance", ""),
    "atol": ("absolute tolerance", ""),
    "control_dt": ("control period", "s"),
    "record_dt": ("time between rows", "s"),
    "recording_speed": ("speed of the recording", ""),
}
_AXES = ("x", "y", "z")

# Keys whose new value holds from the start only: a run under way keeps its state and its clock.
_FROM_THE_START = ("robot", "shell", "run")


@dataclass(frozen=True)
class Knob:
    """A number of a scenario with the range to turn it in."""

    key: str
    """Dotted key, as --set takes it."""
    label: str
    unit: str
    """Unit of `value`, `low`, `high`; "" for a pure number."""
    low: float
    high: float
    log: bool
    """Whether equal turns multiply (else they add)."""
    value: float
    restart: bool
    """Whether a new value holds only in a run that starts anew: start states, places, clocks."""


def knobs_of(built: Built) -> tuple[Knob, ...]:
    """Return the knobs of a built scenario, in the file's order, with the values they stand at.

    A range is widened where the value, changed by --set, lies outside.
    """
    return tuple(_knob(one, built.scenario, built.path) for one in built.scenario.knob)


def check_knobs(scenario: Scenario, path: Path, *, ranges: bool) -> None:
    """Check the knobs of the `scenario` read from `path`; with `ranges` their values lie inside.

    Raises
    ------
    ScenarioError
        A key that the scenario has not or that is not a number, one given twice, or a range that
        cannot be.
    """
    seen: set[str] = set()
    for i, section in enumerate(scenario.knob):
        where = f"knob[{i}]"
        value, key = _value(section, scenario, path)
        if key in seen:
            raise ScenarioError(path, f"{where}.key", "is a knob already", section.key)
        seen.add(key)
        low, high, log = _range(section, value)
        if low is None or high is None:
            if not ranges:
                continue  # its author saw a range, which this value has left
            raise ScenarioError(
                path, where, f"needs min and max, as '{section.key}' is not positive", value
            )
        if not low < high:
            raise ScenarioError(path, where, f"min {low:g} must be less than max {high:g}")
        if log and low <= 0:
            raise ScenarioError(path, where, "min must be positive with log = true", low)
        if ranges and not low <= value <= high:
            raise ScenarioError(
                path,
                where,
                f"'{section.key}' = {value:g} lies outside its range {low:g} to {high:g}: change "
                "the knob's min and max",
            )


def _value(section: KnobSection, scenario: Scenario, path: Path) -> tuple[float, str]:
    value, key = look_up(scenario, section.key, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        shown = None if isinstance(value, dict | list) else value
        raise ScenarioError(path, section.key, "is not a number, so it cannot be a knob", shown)
    return float(value), key


def _range(section: KnobSection, value: float) -> tuple[float | None, float | None, bool]:
    low, high = section.min, section.max
    if value > 0:
        low = value / DECADE if low is None else low
        high = value * DECADE if high is None else high
    log = section.log
    if log is None:
        # A range that was given spans what one wants to see, in plain steps unless it is wide.
        log = low is not None and high is not None and low > 0 and high >= DECADE * low
    return low, high, log


def _knob(section: KnobSection, scenario: Scenario, path: Path) -> Knob:
    value, key = _value(section, scenario, path)
    low, high, log = _range(section, value)
    # A missing end, and a value that is not positive any more.
    if low is None:
        low = DECADE * value
    if high is None:
        high = value / DECADE if value < 0.0 else 1.0
    low, high = min(low, value), max(high, value)
    label, unit = _meaning(key, scenario)
    return Knob(
        key=section.key,
        label=label if section.label is None else section.label,
        unit=unit if section.unit is None else section.unit,
        low=low,
        high=high,
        log=log and low > 0,
        value=value,
        restart=key.partition(".")[0] in _FROM_THE_START,
    )


def _meaning(key: str, scenario: Scenario) -> tuple[str, str]:
    """Return label and unit of a key whose names are spelt out."""
    table, *middle, last = key.split(".")
    plain = (last.replace("_", " "), "")
    if table == "gravity":
        return f"gravity {_axis(last)}", "m/s^2"
    if table == "run":
        return _RUN.get(last, plain)
    if table == "controller":
        known: Mapping[str, tuple[str, str]] = _CONTROLLER
        for word in reversed([*middle, last]):
            if word in known:
                label, unit = known[word]
                return (label if word == last else f"{label} of {last}"), unit
        return plain
    if table in ("contact", "source"):
        return _meaning_in_contact(table, middle, last, scenario)
    if "placement" in middle:
        name = ".".join(middle[: middle.index("placement")])
        turned = middle[-1] == "rpy_deg"
        axis = ("roll", "pitch", "yaw")[int(last)] if turned else _axis(last)
        return f"{name} {axis}".strip(), "deg" if turned else "m"
    return (f"{'.'.join(middle)} {plain[0]}".strip(), plain[1])


def _meaning_in_contact(
    table: str, middle: list[str], last: str, scenario: Scenario
) -> tuple[str, str]:
    items: Any = getattr(scenario, table)
    part = next((p for p in reversed(middle) if p in ("law", "friction", "sphere")), "")
    name = ".".join(middle[: len(middle) - middle[::-1].index(part) - 1]) if part else ""
    of = f"{name}: " if len(scenario.contact) + len(scenario.source) > 1 else ""
    if part == "sphere" and middle[-1] == "offset":
        return f"{of}sphere offset {_axis(last)}", "m"
    if part == "law" and last in ("stiffness", "k", "c", "d", "e"):
        item = next((one for one in items if one.name == name), None)
        return _meaning_in_law(of, last, (item or items[int(name)]).law)
    known = {"law": _LAW, "friction": _FRICTION, "sphere": _SPHERE}.get(part, {})
    label, unit = known.get(last, (last.replace("_", " "), ""))
    return f"{of}{label}", unit


def _meaning_in_law(of: str, last: str, law: Any) -> tuple[str, str]:
    if last == "stiffness":
        return f"{of}stiffness", f"N/m^{law.exponent:g}"
    # ADAMS's own system of units, "mm-N-s": length, force, time.
    length, force, time = law.units.split("-")
    return {
        "k": (f"{of}stiffness", f"{force}/{length}^{law.e:g}"),
        "e": (f"{of}exponent", ""),
        "c": (f"{of}damping", f"{force} {time}/{length}"),
        "d": (f"{of}full damping depth", length),
    }[last]


def _axis(index: str) -> str:
    return _AXES[int(index)] if index in ("0", "1", "2") else index
