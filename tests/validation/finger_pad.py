"""A finger pad against a plate: what measurements say, and what two laws make of it."""

import numpy as np

import sphshell_pin as sp
from tests.validation.balls import plane
from tests.validation.cases import WHY, Outcome, case, read, within
from tests.validation.ellipses import Touch, press
from tests.validation.pictures import Panel

RADIUS, MODULUS, POISSON, THICKNESS = 8e-3, 1e5, 0.49, 4e-3  # all cancel in what is compared
BOUND = 0.05


def exponent(touches: list[Touch]) -> float:
    """Return n of approach ~ force^n, from the first contact to the last."""
    first, last = touches[0], touches[-1]
    return float(np.log(last.approach / first.approach) / np.log(last.force / first.force))


@case("finger_pad")
def finger_pad() -> Outcome:
    """Compare how displacement grows with force, and the largest pressure with the mean one."""
    published = read("finger_pad").published
    plate, approaches = plane(1.0), RADIUS * np.geomspace(1e-3, 5e-2, 9)
    laws = sp.FoundationLaw(MODULUS, THICKNESS), sp.HertzLaw(MODULUS, POISSON)
    pressed = ([press(RADIUS, plate, law, approach) for approach in approaches] for law in laws)
    touches = dict(zip(("FoundationLaw", "HertzLaw"), pressed, strict=True))
    findings, measured = [], published["displacement_exponent"]
    for name, found in touches.items():
        last = found[-1]
        ratio = last.pressure * np.pi * last.a * last.b / last.force
        shape = f"{name}: largest over mean pressure, relative to that of a paraboloid"
        power = f"{name}: exponent of displacement over force, relative to the measured 2/3"
        errors = ratio / published["peak_over_mean"] - 1, exponent(found) / measured - 1
        hertz = name == "HertzLaw"
        findings += within(BOUND, (shape, errors[0]), why=WHY["bone"] if hertz else "")
        findings += within(BOUND, (power, errors[1]), why="" if hertz else WHY["layer"])
    x = np.linspace(-1, 1, 201)
    # The definition of FoundationLaw on a plane, at the largest approach.
    height = RADIUS - approaches[-1]
    from_center = np.hypot(height, x * np.sqrt(RADIUS**2 - height**2))
    pressure = (RADIUS**2 / from_center - from_center) / (RADIUS**2 / height - height)
    ours = [("FoundationLaw", x, pressure), ("HertzLaw", x, np.sqrt(1 - x**2))]
    bulge = [("paraboloid, as measured", x, 1 - x**2)]
    axes = "place / half width of the contact", "pressure / largest"
    pressures = Panel(*axes, (), ours, bulge)
    grown = []
    for name, found in touches.items():
        columns = np.array([(one.force, one.approach) for one in found])
        grown.append((name, *(columns / columns[-1]).T))
    line = np.geomspace(1e-3, 1, 9)
    power_law = [("power of 2/3, as measured", line, line**measured)]
    axes = "force / largest", "displacement / largest"
    return Outcome(findings, [pressures, Panel(*axes, (), grown, power_law, logarithmic=True)])
