"""What is drafted for a tip that presses, against Hertz's law."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sphshell_pin.contact.materials import find_material
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.plan import Materials, force_rise, press_force, press_gap
from sphshell_pin.scenario.running.run import simulate
from tests.models import jacobian_of

PROBE = Path(__file__).parents[1] / "data" / "robots" / "arm_with_probe.urdf"
RADIUS = 0.01
MATERIALS = Materials(find_material("rubber"), find_material("steel"))


def hertz(depth: float) -> float:
    """Force [N] of a sphere of RADIUS: 4/3 E* (R depth^3)^0.5, 1/E* the sum of (1 - nu^2) / E."""
    softness = sum((1 - one.poisson**2) / one.young for one in MATERIALS)
    return 4 / 3 * np.sqrt(RADIUS) / softness * depth**1.5


def test_bristles_are_as_stiff_as_the_contact_and_damped_by_a_tenth():
    mass, depth, step = 2.0, 4e-4, 1e-8
    contact = MATERIALS.sticking(RADIUS, 0.1, hertz(depth), mass)
    stiffness, damping = contact.bristle
    slope = (hertz(depth + step) - hertz(depth - step)) / (2 * step)
    # Both are rounded to what one reads.
    assert stiffness == pytest.approx(slope, rel=0.05)
    assert damping / (2 * np.sqrt(stiffness * mass)) == pytest.approx(0.1, rel=0.1)


def test_a_tip_that_is_led_is_damped_by_seven_tenths(draft):
    """Of critical, with the geometric mean of its masses along the normal and where it slides."""
    built = draft(PROBE, "plane").built
    control, model, tip = built.controller, built.scene.model, built.scene.pairs[0].spheres[0]
    jacobian = jacobian_of(model, built.q0, tip.frame, tip.sphere.offset)[:3]
    mobility = jacobian @ np.linalg.solve(mass_matrix(model, built.q0), jacobian.T)
    slide = np.linalg.eigvalsh(mobility[:2, :2])[-1]
    mass = 1 / np.sqrt(mobility[2, 2] * slide)
    ratio = control.damping / (2 * np.sqrt(control.stiffness * mass))
    assert ratio == pytest.approx(0.7, rel=0.1)


@pytest.mark.parametrize("mass", [5.0, 100.0])
def test_a_large_mass_touches_with_a_seventh_of_force_times_depth(mass):
    """Moved from rest over the gap by a force that comes on as a smooth step, 3 s^2 - 2 s^3."""
    force = 1.0
    rise = force_rise(RADIUS, force, mass, MATERIALS)
    t = np.linspace(0.0, rise, 10001)
    # The first and second integrals of the step.
    speed = force / mass * rise * ((s := t / rise) ** 3 - s**4 / 2)
    way = force / mass * rise**2 * (s**4 / 4 - s**5 / 10)
    touch = np.interp(press_gap(RADIUS, force, mass, MATERIALS), way, speed)
    energy = mass * touch**2 / 2 / (force * MATERIALS.depth(force, RADIUS))
    assert 0.12 < energy < 0.15


@pytest.mark.parametrize("share", [0.1, 0.49, 0.51, 0.79])
def test_a_tip_is_pressed_in_by_half_its_radius_at_most(share):
    tip = SimpleNamespace(radius=RADIUS)
    stance = SimpleNamespace(force=1e9, approach=np.array([0.0, 0.0, -1.0]), tip=tip)
    press = float(hertz(share * RADIUS))
    if share < 0.5:
        assert press_force(stance, MATERIALS, press) == press
    else:
        with pytest.raises(SphshellError, match="by more than half of it"):
            press_force(stance, MATERIALS, press)


@pytest.mark.parametrize("heavier", [10, 50, 200])
def test_the_first_touch_of_a_heavy_arm_on_rubber_is_soft(draft, tmp_path, heavier):
    """The force comes on in periods of the mass on the contact: it would be a step beside them."""
    file, text = tmp_path / "arm.urdf", PROBE.read_text()
    number = r'((?:value|ixx|iyy|izz|ixy|ixz|iyz)|effort)="([^"]+)"'
    file.write_text(re.sub(number, lambda m: f'{m[1]}="{heavier * float(m[2])}"', text))
    built = draft(file, "plane", material="rubber", path="0,0,0").built
    result, _ = simulate(built)
    (pair,) = result.stats.pairs.values()
    assert pair.peak_force < 1.25 * built.scenario.controller.normal_force
