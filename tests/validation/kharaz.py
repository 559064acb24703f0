"""Kharaz, Gorham and Salman (2001): alumina spheres bounce off glass at an angle, measured.

The same impacts as Chung and Ooi (2011, test 4) and MFIX (test DEM05) computed them.
"""

from dataclasses import replace

import numpy as np

from sphshell_pin.base.arrays import Array
from tests.validation.cases import WHY, Data, Figure, Outcome, case, read, within
from tests.validation.oblique import MOBILITY, Setting, rms, thrown
from tests.validation.pictures import Panel

SPEED = 3.9
RINGS = 8  # that slip for themselves, where micro-slip counts
GLASS = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, 7e10, 0.25, restitution=0.98, rings=RINGS)
OXIDE = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, restitution=0.98)
ALLOY = Setting(2.5e-3, 2700.0, 7.0e10, 0.33, 0.092, restitution=0.98)
ANGLES = np.linspace(1.0, 88.0, 44)  # [degrees], of the lines in the pictures
# Of each quantity the name in a picture, that of its error, and the unit of that.
QUANTITIES = {
    "restitution": ("v' / v along the plane", "v'/v along the plane", ""),
    "spin": ("spin [rad/s]", "spin, over the largest", ""),
    "rebound_angle": ("rebound angle of the center [deg]", "rebound angle", "degrees"),
    "patch_angle": ("rebound angle of the patch [deg]", "patch angle", "degrees"),
}
THEORY = "with micro-slip (Maw and others)"


def with_micro_slip(setting: Setting, quantity: str, angles: Array) -> Array:
    """Return what `thrown` does, by the theory in which each ring of the disc slips for itself."""
    radians = np.radians(angles)
    normal, along = SPEED * np.cos(radians), SPEED * np.sin(radians)
    back = setting.restitution or 1.0
    incident = along / (setting.mu * normal)
    patch = setting.mu * normal * setting.recoil(incident, setting.laws(1.0)[0].dissipation)
    tangential = along + (patch - along) / MOBILITY
    if quantity == "restitution":
        return tangential / along
    if quantity == "spin":
        return (tangential - patch) / setting.radius
    moved = {"rebound_angle": tangential, "patch_angle": patch}[quantity]
    return np.degrees(np.arctan2(moved, back * normal))


def figures(bound: float, quantity: str, ours: Array, theirs: Array, **more: str) -> list[Figure]:
    """Return the error of a quantity; `more` has the end of its name, and `why`."""
    _, name, unit = QUANTITIES[quantity]
    error = rms(ours - theirs) / (theirs.max() if quantity == "spin" else 1.0)
    what = f"rms of the {name}{more.pop('of', '')}"
    return within(bound, (what, error), unit=unit, **more)


def panel(quantity: str, marks, lines, theory=None) -> Panel:  # type: ignore[no-untyped-def]
    """Draw lines by angle over the points; the theory of a setting is dashed."""
    name = QUANTITIES[quantity][0]
    dashed = [(THEORY, ANGLES, with_micro_slip(theory, quantity, ANGLES))] if theory else ()
    ours = [(label, ANGLES, one[quantity]) for label, one in lines.items()]
    return Panel("angle of incidence [deg]", name, marks, ours, dashed)


@case("kharaz")
def measured() -> Outcome:
    """Compare with all three readings of the measured points."""
    data = read("kharaz")
    bounds = {"restitution": 0.02, "spin": 0.03, "rebound_angle": 1.0, "patch_angle": 1.0}
    lines = {"ours": thrown(GLASS, SPEED, ANGLES)}
    lines["ours, the disc as a whole"] = thrown(replace(GLASS, rings=1), SPEED, ANGLES)
    findings, panels, own = [], [], _own_error(data)
    for quantity, bound in bounds.items():
        points = data.where("quantity", quantity)
        angle, value = points["angle"], points["value"]
        (theory,) = figures(bound, quantity, with_micro_slip(GLASS, quantity, angle), value)
        why = WHY["spins"].format(own=own, theory=theory.value)
        why = why if quantity in ("spin", "patch_angle") else ""
        ours = thrown(GLASS, SPEED, angle)[quantity]
        findings += figures(bound, quantity, ours, value, why=why)
        marks = points.series("reading", "angle", "read by {}")
        panels.append(panel(quantity, marks, lines, GLASS))
    return Outcome(findings, panels)


def _own_error(data: Data) -> float:
    """Return by how much measured spins contradict measured velocities, over the largest."""
    mine = data.where("reading", "kratos")
    velocity, spin = (mine.where("quantity", one) for one in ("restitution", "spin"))
    ratio = np.interp(spin["angle"], velocity["angle"], velocity["value"])
    along = SPEED * np.sin(np.radians(spin["angle"]))
    error = rms(2.5 * (1 - ratio) * along / GLASS.radius - spin["value"])
    return error / float(spin["value"].max())


@case("chung_ooi_4")
def rigid() -> Outcome:
    """Run test 4, and at a tenth and a hundredth of its speed."""
    data, steep = read("chung_ooi_4"), ", from 10 degrees on"
    spheres = {"oxide": OXIDE, "alloy": ALLOY}
    lines = {f"ours, {name}": thrown(one, SPEED, ANGLES) for name, one in spheres.items()}
    why = f"It is the point at 5 degrees alone. {WHY['whole_displacement']}"
    findings: list[Figure] = []
    panels = []
    for quantity, bound in (("restitution", 0.02), ("spin", 0.03), ("patch_angle", 2.0)):
        marks = []
        for name, angle, given in data.where("quantity", quantity).series("sphere", "angle"):
            value = np.abs(given) if quantity == "spin" else given
            marks.append((name, angle, value))
            ours = thrown(spheres[name], SPEED, angle)[quantity]
            alone = why if quantity == "restitution" else ""
            findings += figures(bound, quantity, ours, value, of=f", {name}", why=alone)
            if quantity == "restitution":
                far = angle > 9
                findings += figures(bound, quantity, ours[far], value[far], of=f", {name}{steep}")
        panels.append(panel(quantity, marks, lines, OXIDE))
    angles, speeds = [5.0, 15.0, 25.0, 35.0, 60.0], SPEED * np.array([0.01, 0.1, 1.0])
    slow, less, whole = (thrown(OXIDE, speed, angles)["restitution"] for speed in speeds)
    what = "largest change of v'/v from 0.039 to 0.39 m/s", "the same from 0.039 to 3.9 m/s"
    findings += within(1e-3, (what[0], np.abs(less - slow).max()))
    findings += within(1e-3, (what[1], np.abs(whole - slow).max()), why=WHY["depth"])
    return Outcome(findings, panels)


@case("mfix_dem05")
def mfix() -> Outcome:
    """Compare with what MFIX prints."""
    data = read("mfix_dem05")
    angle, steep = data["angle"], data["angle"] > 9
    ours = thrown(replace(GLASS, restitution=None, rings=1), SPEED, angle)
    why = f"It is the points below 10 degrees. {WHY['whole_displacement']}"
    findings, panels = [], []
    for quantity, bound in (("restitution", 0.01), ("spin", 0.01), ("rebound_angle", 0.5)):
        here, there, name = ours[quantity], data[quantity], QUANTITIES[quantity][0]
        findings += figures(bound, quantity, here, there, why=why)
        # The spin still over its largest.
        most = there.max() if quantity == "spin" else 1.0
        error = rms((here - there)[steep]) / most
        what = f"{findings[-1].what}, from 10 degrees on"
        findings += within(bound, (what, error), unit=findings[-1].unit)
        line = [("MFIX", angle, there)], [("ours", angle, here)]
        panels.append(Panel("angle of incidence [deg]", name, *line))
    return Outcome(findings, panels)
