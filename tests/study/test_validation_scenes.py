"""What the cases of the validation are built from."""

import math

import numpy as np
import pytest
from scipy.special import ellipk

from sphshell_pin.study.report.swing import GRAVITY
from tests.rolling import Ball, swing_period

pytest.importorskip("matplotlib")
from tests.validation import cam, rolling


@pytest.mark.parametrize("angle", [1e-3, 0.3, 2.0, 3.1])
def test_period_of_a_pendulum(angle):
    expected = 4 * math.sqrt(0.3 / GRAVITY) * ellipk(math.sin(angle / 2) ** 2)
    assert swing_period(angle, 0.3) == pytest.approx(expected, rel=1e-13)


def test_a_ball_is_solid():
    ball = Ball(0.3, 0.02)
    assert ball.beta() == pytest.approx(0.4)
    assert ball.beta(0.002) == pytest.approx(0.4 / 0.81)


def test_wall_is_a_cylinder():
    shell = rolling.wall(0.5, 0.4, 0.1, 20)
    assert shell.num_elements == 20
    # A ball inside it is as deep everywhere.
    out = np.array([math.sin(0.33), 0.0, -math.cos(0.33)])
    found = shell.contacts(0.45 * out + [0.0, 0.03, 0.0], 0.06)
    assert np.allclose(found.depth, [0.01], rtol=0, atol=3e-6)
    assert np.allclose(found.normal, [-out], rtol=0, atol=1e-4)


def test_cam_has_the_published_speed():
    assert pytest.approx(261.8, abs=0.05) == 1e3 * cam.ECCENTRICITY * cam.SPEED
    assert pytest.approx(1370.78, abs=0.005) == 1e3 * cam.ECCENTRICITY * cam.SPEED**2
