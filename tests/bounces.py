"""A ball that bounces off a plate at an angle, through the package's own runs."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.contact import Friction, NormalLaw
from tests import models


class Bounce(NamedTuple):
    """What became of a ball: speeds of its center over those of the approach, its spin [rad/s]."""

    tangential: float
    """v_t' / v_t."""
    normal: float
    """-v_n' / v_n, the restitution."""
    spin: float
    """About the axis of rolling, positive as the ball rolls on [rad/s]."""
    slip: float
    """Tangential velocity of the contact point (v_t' - r spin) / v_t; negative: turned round."""
    result: sp.Result


def bounce(
    angle: float,
    speed: float,
    radius: float,
    density: float,
    law: NormalLaw,
    friction: Friction | None,
    integrator=None,  # type: ignore[no-untyped-def]
    spin: float = 0.0,
) -> Bounce:
    """Throw a solid ball at a plate, without gravity.

    `angle` [rad] from the normal, in (0, pi/2); `speed` [m/s], `radius` [m], `density` [kg/m^3];
    `spin` [rad/s] before, about the axis of rolling. As Kharaz, Gorham and Salman's alumina ball
    on glass (Powder Technology 120 (2001) 281; test 4 of Chung and Ooi 2011):

        elastic = 380e9, 0.23, 70e9, 0.25
        law = sp.ImpactLaw.hertz(2.5e-3, *elastic, restitution=0.98, speed=3.9)
        friction = sp.MindlinFriction(0.092, 0.092, *elastic)
        bounce(np.radians(20), 3.9, 2.5e-3, 4000.0, law, friction).tangential
    """
    mass = density * 4 / 3 * np.pi * radius**3
    scene = sp.Scene(models.ball(gravity=0.0, mass=mass, radius=radius))
    half = 100 * radius
    corners = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    plate = sp.Shell(corners, [[0, 1, 2, 3]])
    scene.add_contact(sp.Sphere(radius, "ball"), plate, law=law, friction=friction, name="bounce")
    down, along = speed * np.cos(angle), speed * np.sin(angle)
    duration = law.contact_time(law.depth_of(0.5 * mass * down**2), down)
    gap = 1e-3 * duration * down
    run = sp.Simulation(scene, integrator or sp.Adaptive(1e-8)).run(
        models.free_q([0.0, 0.0, radius + gap]),
        np.array([along, 0.0, -down, 0.0, spin, 0.0]),
        2 * duration,
        record_dt=duration / 50,
    )
    assert [event.kind for event in run.events] == ["touch", "lift_off"]
    turn = pin.XYZQUATToSE3(run.q[-1]).rotation
    v, w = turn @ run.v[-1, :3], turn @ run.v[-1, 3:]
    return Bounce(v[0] / along, v[2] / down, w[1], (v[0] - radius * w[1]) / along, run)
