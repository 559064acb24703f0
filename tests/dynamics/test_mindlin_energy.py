"""MindlinFriction gives nothing back that it did not get."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sphshell_pin as sp
from sphshell_pin import _core
from tests.dynamics.test_mindlin import LAW, RUBBER, STEEL, STICKS, UP, R, disc
from tests.studies import mostly_studies


class Path:
    """Force, moment and work along a motion of one contact, by the law's own rates."""

    def __init__(self, friction: sp.MindlinFriction) -> None:
        self.friction = friction

    def at(self, z, depth: float, closing: float, slip, spin: float):  # type: ignore[no-untyped-def]
        velocity = np.array([*slip, -closing])
        law, friction = LAW._binding, self.friction._binding
        rest = np.zeros(3)
        return _core.contact_force(law, friction, depth, UP, velocity, spin, rest, z, R, 1e-5)

    def run(self, times, depth, slip, spin):  # type: ignore[no-untyped-def]
        """Work (n,) of friction on what moves the bodies; functions of time give value and rate."""

        def rate(t: float, y):  # type: ignore[no-untyped-def]
            value, closing = depth(t)
            _, drag, moment, z_rate = self.at(y[:3], value, closing, slip(t), spin(t))
            return [*z_rate, drag[:2] @ slip(t) + moment[2] * spin(t)]

        out = [np.zeros(4)]
        for begin, end in pairwise(times):
            step = solve_ivp(rate, (begin, end), out[-1], rtol=1e-9, atol=1e-16, method="LSODA")
            assert step.success
            out.append(step.y[:, -1])
        return np.array(out)


def test_cycle_of_elata_and_berryman() -> None:
    """Slip at a high load, back at a low one: incremental laws gain (k_1 - k_2) s^2 / 2.

    Here the force falls with the load, and that energy is lost.
    """
    high, low, shift = 4e-4, 1e-4, 1e-6
    depths = [high, high, low, low, high]
    slips = [0.0, shift, shift, 0.0, 0.0]

    def leg(values: list[float], t: float) -> tuple[float, float]:
        k = min(int(t), 3)
        return values[k] + (t - k) * (values[k + 1] - values[k]), values[k + 1] - values[k]

    path = Path(STICKS)
    rows = path.run(
        range(5), lambda t: leg(depths, t), lambda t: [leg(slips, t)[1], 0.0], lambda t: 0.0
    )
    k_1, k_2 = (STICKS.tangential_stiffness(disc(d)) for d in (high, low))
    assert rows[1, 3] == pytest.approx(-k_1 * shift**2 / 2, rel=1e-6)
    assert rows[3, 3] == pytest.approx(-(k_1 - k_2) * shift**2 / 2, rel=1e-6)
    # Back at the start nothing is left: the force that the bodies took apart is gone.
    assert np.abs(rows[-1, :3]).max() < 1e-6 * np.abs(rows[1, :3]).max()


@pytest.mark.parametrize(
    ("seed", "mu"), mostly_studies(product(range(6), [0.3, 1e3]), lambda both: both != (1, 0.3))
)
def test_no_closed_path_gains_energy(seed: int, mu: float) -> None:
    """Random loops in depth, slip and twist, again and again: friction only takes work."""
    rng = np.random.default_rng(seed)
    friction = sp.MindlinFriction(mu, mu, *RUBBER, *STEEL, torsional=True)
    phase = rng.uniform(0, 2 * math.pi, (4, 3))
    size = rng.normal(size=(4, 3)) * np.array([[0.3], [0.05], [0.05], [0.5]])
    number = np.arange(1, 4)
    depth_0 = 1e-4

    def wave(k: int, t: float) -> tuple[float, float]:
        angle = number * t + phase[k]
        return float(size[k] @ np.sin(angle)), float(size[k] @ (number * np.cos(angle)))

    def depth(t: float) -> tuple[float, float]:
        value, rate = wave(0, t)
        return depth_0 * math.exp(value), depth_0 * math.exp(value) * rate

    def slip(t: float) -> list[float]:
        return [depth_0 * wave(1, t)[1], depth_0 * wave(2, t)[1]]

    def spin(t: float) -> float:
        return depth_0 / disc(depth_0) * wave(3, t)[1]

    loops = 2 * math.pi * np.arange(4)
    work = Path(friction).run(loops, depth, slip, spin)[:, 3]
    size_of_work = friction.tangential_stiffness(disc(depth_0)) * (0.05 * depth_0) ** 2
    assert (np.diff(work) < 0).all()
    assert work[-1] < -1e-3 * size_of_work
