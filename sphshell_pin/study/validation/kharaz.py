"""Kharaz, Gorham and Salman (2001): alumina spheres bounce off glass at an angle, measured.

The same impacts as Chung and Ooi (2011, test 4) and MFIX (test DEM05) computed them.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from sphshell_pin.study.report.contents import Finding
from sphshell_pin.study.validation.cases import Array, Data, Outcome, case, read
from sphshell_pin.study.validation.chung_ooi_normal import PAPER
from sphshell_pin.study.validation.oblique import Rebound, Setting, of, rms, thrown
from sphshell_pin.study.validation.pictures import Panel, draw

SPEED = 3.9
GLASS = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, 7e10, 0.25, restitution=0.98)
OXIDE = Setting(2.5e-3, 4000.0, 3.8e11, 0.23, 0.092, restitution=0.98)
ALLOY = Setting(2.5e-3, 2700.0, 7.0e10, 0.33, 0.092, restitution=0.98)
ANGLES = np.linspace(1.0, 88.0, 59)  # [degrees], of the lines in the pictures
NAMES = {
    "restitution": "v' / v along the plane",
    "spin": "spin [rad/s]",
    "rebound_angle": "rebound angle of the center [deg]",
    "patch_angle": "rebound angle of the patch [deg]",
}
MICRO_SLIP = (
    "Micro-slip: our disc of contact sticks or slips as a whole, as in most codes, where by "
    "Mindlin and by Maw, Barber and Fawcett (Wear 38 (1976) 101) an annulus at its rim slips already. "
)


def values(setting: Setting, quantity: str, angles: Array, speed: float = SPEED) -> Array:
    """Return a quantity of the rebounds at angles (n,) [degrees]."""
    return taken(thrown(setting, speed, angles), quantity, angles, speed)


def taken(rebounds: list[Rebound], quantity: str, angles: Array, speed: float = SPEED) -> Array:
    """Return a quantity (n,) of rebounds from these angles [degrees]."""
    if quantity == "restitution":
        return of(rebounds, "tangential") / (speed * np.sin(np.radians(angles)))
    return of(rebounds, quantity)


@case(
    "kharaz",
    "Alumina on glass at an angle, measured (Kharaz, Gorham and Salman)",
    source="A. H. Kharaz, D. A. Gorham and A. D. Salman, An experimental study of the elastic "
    "rebound of spheres, Powder Technology 120 (2001) 281-291, "
    "https://doi.org/10.1016/S0032-5910(01)00283-2.",
    setting="Radius 2.5 mm, density 4000 kg/m^3, 3.9 m/s; E 380 GPa and Poisson's ratio 0.23 of "
    "alumina, 70 GPa and 0.25 of glass; mu 0.092, restitution 0.98 at every angle.",
    bound="0.02 in v'/v and 3 % of the largest spin; the three readings of the same printed points "
    "differ by up to 0.003 in v'/v. One degree for the angles.",
    leaves_out=MICRO_SLIP + "Waves in the glass, and the change of restitution with the angle.",
    files=("kharaz",),
)
def measured() -> Outcome:
    """Compare with all three readings of the measured points."""
    data = read("kharaz")
    bounds = {"restitution": 0.02, "spin": 0.03, "rebound_angle": 1.0, "patch_angle": 1.0}
    units = {"rebound_angle": "degrees", "patch_angle": "degrees"}
    lines = thrown(GLASS, SPEED, ANGLES)
    findings, panels = [], []
    for quantity, bound in bounds.items():
        points = data.where("quantity", quantity)
        angle, value = points["angle"], points["value"]
        ours = values(GLASS, quantity, angle)
        scale = np.abs(value).max() if quantity == "spin" else 1.0
        what = (
            "rms of the spin, over the largest"
            if quantity == "spin"
            else f"rms of the {quantity.replace('_', ' ')}"
        )
        findings.append(
            Finding(
                quantity,
                what,
                rms(ours - value) / scale,
                units.get(quantity, ""),
                aim=bound,
                headline=quantity == "restitution",
            )
        )
        panels.append(_panel(quantity, points, lines))
    return Outcome(
        findings,
        [draw("kharaz", panels, "Measured points, each as read by three codes, and our line.")],
    )


def _panel(quantity: str, points: Data, lines: list[Rebound]) -> Panel:
    readings = dict.fromkeys(points.texts("reading"))
    marks = [
        (
            f"read by {one}",
            points.where("reading", one)["angle"],
            points.where("reading", one)["value"],
        )
        for one in readings
    ]
    return Panel(
        "angle of incidence [deg]",
        NAMES[quantity],
        marks,
        [("ours", ANGLES, taken(lines, quantity, ANGLES))],
    )


@case(
    "chung_ooi_4",
    "A sphere on a rigid plane at an angle (Chung and Ooi, test 4)",
    source=f"{PAPER}4: spheres of aluminum oxide and aluminum alloy, 3.9 m/s.",
    setting="Radius 2.5 mm, mu 0.092, restitution 0.98 at every angle; oxide: E 380 GPa, Poisson's "
    "ratio 0.23, density 4000 kg/m^3; alloy: 70 GPa, 0.33, 2700 kg/m^3; the plane is rigid.",
    bound="0.02 in v'/v and 3 % of the largest spin, two degrees for the patch; theory: with "
    "restitution and mu the same, v'/v does not depend on the speed.",
    leaves_out="The benchmark's codes damp along the plane, too; we do not. " + MICRO_SLIP,
    files=("chung_ooi_4",),
)
def rigid() -> Outcome:
    """Run test 4, and at a tenth and ten times its speed."""
    data = read("chung_ooi_4")
    findings, panels = [], []
    spheres = {"oxide": OXIDE, "alloy": ALLOY}
    lines = {name: thrown(one, SPEED, ANGLES) for name, one in spheres.items()}
    for quantity, bound in (("restitution", 0.02), ("spin", 0.03), ("patch_angle", 2.0)):
        chosen = data.where("quantity", quantity)
        marks = []
        for name, one in spheres.items():
            points = chosen.where("sphere", name)
            angle, value = (
                points["angle"],
                np.abs(points["value"]) if quantity == "spin" else points["value"],
            )
            if not len(angle):
                continue
            marks.append((name, angle, value))
            scale = value.max() if quantity == "spin" else 1.0
            what = "spin, over the largest" if quantity == "spin" else quantity.replace("_", " ")
            findings.append(
                Finding(
                    f"{quantity}_{name}",
                    f"rms of the {what}, {name}",
                    rms(values(one, quantity, angle) - value) / scale,
                    "degrees" if quantity == "patch_angle" else "",
                    aim=bound,
                    headline=not findings,
                )
            )
        ours = [
            (f"ours, {name}", ANGLES, taken(line, quantity, ANGLES)) for name, line in lines.items()
        ]
        panels.append(Panel("angle of incidence [deg]", NAMES[quantity], marks, ours))
    few = np.array([5.0, 15.0, 25.0, 35.0, 60.0])
    there = values(OXIDE, "restitution", few)
    other = [values(OXIDE, "restitution", few, speed) for speed in (SPEED / 10, SPEED * 10)]
    apart = max(float(np.abs(one - there).max()) for one in other)
    findings.append(Finding("speed", "largest change of v'/v from 0.39 to 39 m/s", apart, aim=1e-3))
    return Outcome(
        findings, [draw("chung_ooi_4", panels, "Points computed by Chung and Ooi, and our lines.")]
    )


@case(
    "mfix_dem05",
    "Alumina on glass at an angle, computed by MFIX (DEM05)",
    source="MFIX, verification test DEM05, "
    "https://mfix.netl.doe.gov/doc/vvuq-manual/main/html/dem/dem-05.html.",
    setting="As measured by Kharaz, without damping: restitution 1.",
    bound="0.01 in v'/v, 1 % of the largest spin, half a degree: what is left between two codes.",
    leaves_out="The same as in MFIX, which multiplies the whole displacement along the plane by "
    "the present stiffness, also while the bodies part; our force falls with the stiffness instead, so "
    "that no path gains energy.",
    files=("mfix_dem05",),
)
def mfix() -> Outcome:
    """Compare with what MFIX prints."""
    data = read("mfix_dem05")
    setting = dataclasses.replace(GLASS, restitution=None)
    angle = data["angle"]
    ours = thrown(setting, SPEED, angle)
    findings, panels = [], []
    for quantity, bound in (("restitution", 0.01), ("spin", 0.01), ("rebound_angle", 0.5)):
        here, there = taken(ours, quantity, angle), data[quantity]
        scale = there.max() if quantity == "spin" else 1.0
        what = "spin, over the largest" if quantity == "spin" else quantity.replace("_", " ")
        findings.append(
            Finding(
                quantity,
                f"rms of the {what}",
                rms(here - there) / scale,
                "degrees" if quantity == "rebound_angle" else "",
                aim=bound,
                headline=not findings,
            )
        )
        panels.append(
            Panel(
                "angle of incidence [deg]",
                NAMES[quantity],
                [("MFIX", angle, there)],
                [("ours", angle, here)],
            )
        )
    assert math.isfinite(findings[0].value)
    return Outcome(findings, [draw("mfix_dem05", panels, "Points computed by MFIX, and our line.")])
