"""Kharaz, Gorham and Salman (2001): alumina spheres bounce off glass at an angle, measured.

The same impacts as Chung and Ooi (2011, test 4) and MFIX (test DEM05) computed them.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import Finding
from tests.validation.cases import WHY, Data, Outcome, case, read, within
from tests.validation.oblique import MOBILITY, Rebound, Setting, of, rms, thrown
from tests.validation.pictures import Panel

SPEED = 3.9
RINGS = 8  # that slip for themselves, where micro-slip counts
GLASS = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, 7e10, 0.25, restitution=0.98, rings=RINGS)
OXIDE = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, restitution=0.98)
ALLOY = Setting(2.5e-3, 2700.0, 7.0e10, 0.33, 0.092, restitution=0.98)
ANGLES = np.linspace(1.0, 88.0, 44)  # [degrees], of the lines in the pictures
NAMES = {
    "restitution": "v' / v along the plane",
    "spin": "spin [rad/s]",
    "rebound_angle": "rebound angle of the center [deg]",
    "patch_angle": "rebound angle of the patch [deg]",
}
INCIDENCE = "angle of incidence [deg]"
THEORY = "with micro-slip (Maw and others)"


def values(setting: Setting, quantity: str, angles: Array, speed: float = SPEED) -> Array:
    """Return a quantity of the rebounds at angles (n,) [degrees]."""
    return taken(thrown(setting, speed, angles), quantity, angles, speed)


def taken(rebounds: list[Rebound], quantity: str, angles: Array, speed: float = SPEED) -> Array:
    """Return a quantity (n,) of rebounds from these angles [degrees]."""
    if quantity == "restitution":
        return of(rebounds, "tangential") / (speed * np.sin(np.radians(angles)))
    return of(rebounds, quantity)


def with_micro_slip(setting: Setting, quantity: str, angles: Array) -> Array:
    """Return what `values` does, by the theory in which each ring of the disc slips for itself."""
    radians = np.radians(angles)
    normal, along = SPEED * np.cos(radians), SPEED * np.sin(radians)
    back = setting.restitution or 1.0
    dissipation = setting.laws(1.0)[0].dissipation
    incident = along / (setting.mu * normal)
    patch = setting.mu * normal * setting.recoil(incident, dissipation)
    tangential = along + (patch - along) / MOBILITY
    if quantity == "restitution":
        return tangential / along
    if quantity == "spin":
        return (tangential - patch) / setting.radius
    moved = {"rebound_angle": tangential, "patch_angle": patch}[quantity]
    return np.degrees(np.arctan2(moved, back * normal))


@case("kharaz")
def measured() -> Outcome:
    """Compare with all three readings of the measured points."""
    data = read("kharaz")
    bounds = {"restitution": 0.02, "spin": 0.03, "rebound_angle": 1.0, "patch_angle": 1.0}
    lines = {
        "ours": thrown(GLASS, SPEED, ANGLES),
        "ours, the disc as a whole": thrown(replace(GLASS, rings=1), SPEED, ANGLES),
    }
    findings: list[Finding] = []
    panels, theory = [], {}
    for quantity, bound in bounds.items():
        points = data.where("quantity", quantity)
        angle, value = points["angle"], points["value"]
        scale = value.max() if quantity == "spin" else 1.0
        error = rms(values(GLASS, quantity, angle) - value) / scale
        findings += within(bound, (quantity, what(quantity), error), unit=unit(quantity))
        theory[quantity] = rms(with_micro_slip(GLASS, quantity, angle) - value) / scale
        marks = []
        for one in dict.fromkeys(points.texts("reading")):
            chosen = points.where("reading", one)
            marks.append((f"read by {one}", chosen["angle"], chosen["value"]))
        ours = [(name, ANGLES, taken(line, quantity, ANGLES)) for name, line in lines.items()]
        dashed = [(THEORY, ANGLES, with_micro_slip(GLASS, quantity, ANGLES))]
        panels.append(Panel(INCIDENCE, NAMES[quantity], marks, ours, dashed))
    own = _own_error(data)
    explained = {
        f.key: WHY["spins"].format(own=own, theory=theory[f.key])
        for f in findings
        if not f.met and f.key in ("spin", "patch_angle")
    }
    return Outcome(findings, panels, explained=explained)


def _own_error(data: Data) -> float:
    """Return by how much measured spins contradict measured velocities, over the largest."""
    velocity = data.where("quantity", "restitution").where("reading", "kratos")
    spin = data.where("quantity", "spin").where("reading", "kratos")
    ratio = np.interp(spin["angle"], velocity["angle"], velocity["value"])
    along = SPEED * np.sin(np.radians(spin["angle"]))
    return rms(2.5 * (1 - ratio) * along / GLASS.radius - spin["value"]) / float(
        spin["value"].max()
    )


def parts(angle: Array) -> list[tuple[str, NDArray[np.bool_], str]]:
    """Return ends of keys and of names, and which angles: all, and those from 10 degrees on."""
    return [("", angle > 0, ""), ("_from_10", angle > 9, ", from 10 degrees on")]


def what(quantity: str) -> str:
    """Return the name of an error figure of a quantity."""
    names = {"restitution": "v'/v along the plane", "spin": "spin, over the largest"}
    return f"rms of the {names.get(quantity, quantity.replace('_', ' '))}"


def unit(quantity: str) -> str:
    """Return the unit of an error figure of a quantity."""
    return "degrees" if quantity.endswith("angle") else ""


@case("chung_ooi_4")
def rigid() -> Outcome:
    """Run test 4, and at a tenth and a hundredth of its speed."""
    data = read("chung_ooi_4")
    findings: list[Finding] = []
    panels = []
    spheres = {"oxide": OXIDE, "alloy": ALLOY}
    lines = {name: thrown(one, SPEED, ANGLES) for name, one in spheres.items()}
    for quantity, bound in (("restitution", 0.02), ("spin", 0.03), ("patch_angle", 2.0)):
        marks = []
        for name in dict.fromkeys(data.where("quantity", quantity).texts("sphere")):
            points = data.where("quantity", quantity).where("sphere", name)
            angle = points["angle"]
            value = np.abs(points["value"]) if quantity == "spin" else points["value"]
            marks.append((name, angle, value))
            errors = values(spheres[name], quantity, angle) - value
            scale = value.max() if quantity == "spin" else 1.0
            for key, chosen, where in parts(angle)[: 1 + (quantity == "restitution")]:
                title = f"{what(quantity)}, {name}{where}"
                one = (f"{quantity}_{name}{key}", title, rms(errors[chosen]) / scale)
                findings += within(bound, one, unit=unit(quantity))
        ours = [
            (f"ours, {name}", ANGLES, taken(line, quantity, ANGLES)) for name, line in lines.items()
        ]
        theory = [(THEORY, ANGLES, with_micro_slip(OXIDE, quantity, ANGLES))]
        panels.append(Panel(INCIDENCE, NAMES[quantity], marks, ours, theory))
    findings += _speeds()
    steep = f"It is the point at 5 degrees alone. {WHY['whole_displacement']}"
    known = {"restitution_oxide": steep, "restitution_alloy": steep, "speed_at_3.9": WHY["depth"]}
    explained = {f.key: known[f.key] for f in findings if not f.met and f.key in known}
    return Outcome(findings, panels, explained=explained)


def _speeds() -> list[Finding]:
    """Return how much v'/v changes with the speed."""
    angles = np.array([5.0, 15.0, 25.0, 35.0, 60.0])
    seen = [values(OXIDE, "restitution", angles, part * SPEED) for part in (0.01, 0.1, 1.0)]
    changes = [float(np.abs(one - seen[0]).max()) for one in seen[1:]]
    return within(
        1e-3,
        ("speed", "largest change of v'/v from 0.039 to 0.39 m/s", changes[0]),
        ("speed_at_3.9", "the same from 0.039 to 3.9 m/s", changes[1]),
    )


@case("mfix_dem05")
def mfix() -> Outcome:
    """Compare with what MFIX prints."""
    data = read("mfix_dem05")
    setting = replace(GLASS, restitution=None, rings=1)
    angle = data["angle"]
    ours = thrown(setting, SPEED, angle)
    findings: list[Finding] = []
    panels = []
    for quantity, bound in (("restitution", 0.01), ("spin", 0.01), ("rebound_angle", 0.5)):
        here, there = taken(ours, quantity, angle), data[quantity]
        scale = there.max() if quantity == "spin" else 1.0
        for key, chosen, where in parts(angle):
            one = (quantity + key, what(quantity) + where, rms((here - there)[chosen]) / scale)
            findings += within(bound, one, unit=unit(quantity))
        theirs, line = [("MFIX", angle, there)], [("ours", angle, here)]
        panels.append(Panel(INCIDENCE, NAMES[quantity], theirs, line))
    shallow = f"It is the points below 10 degrees. {WHY['whole_displacement']}"
    explained = {f.key: shallow for f in findings if not f.met and "_from_10" not in f.key}
    return Outcome(findings, panels, explained=explained)
