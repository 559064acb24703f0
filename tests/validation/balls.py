"""Free balls that collide: what the cases of impacts share. No gravity; all in the world frame."""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.study.report.models import model_of
from tests.rolling import turned

GAP = 1e-3  # before the touch, over the radius
PRECISE = 1e-9


@dataclass(frozen=True)
class Ball:
    """A solid ball: its radius [m], density [kg/m^3], velocity [m/s] and spin [rad/s] (3,)."""

    radius: float
    density: float
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def mass(self) -> float:
        """Its mass [kg]."""
        return 4 / 3 * math.pi * self.radius**3 * self.density


@dataclass(frozen=True)
class Impact:
    """A collision: of each ball the velocity [m/s] and spin [rad/s] (n, 3) after it, and more.

    `duration` [s] is from touch to lift-off, `t` (n,) [s] since the touch, `depth` [m] and `force`
    [N] are those of the contact at its recorded rows, `result` is the run.
    """

    velocities: Array
    spins: Array
    duration: float
    t: Array
    depth: Array
    force: Array
    result: Result


def plane(half: float) -> sp.Shell:
    """Return a flat square z = 0 with sides of twice `half` [m]."""
    corners = [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]
    return sp.Shell(corners, [[0, 1, 2, 3]])


def on_plane(ball, law, friction=None, *, rows=0):
    """Shoot the ball down at the plane z = 0; `rows` of the contact are recorded."""
    model = _free([ball])
    scene = sp.Scene(model)
    shell = plane(20 * ball.radius)
    scene.add_contact(sp.Sphere(ball.radius, "ball0"), shell, law=law, friction=friction)
    height = ball.radius * (1 + GAP)
    plain, speed = law.on_plane(ball.radius), -ball.velocity[2]
    return _run(scene, [ball], [(0.0, 0.0, height)], plain, ball.mass, speed, rows)


def head_on(first, second, law, friction=None, *, rows=0):
    """Let two balls collide along z, the first from above; `rows` of the contact are recorded."""
    scene = sp.Scene(_free([first, second]))
    balls = sp.Sphere(first.radius, "ball0"), sp.Sphere(second.radius, "ball1")
    scene.add_contact(*balls, law=law, friction=friction)
    away = (first.radius + second.radius) + GAP * min(first.radius, second.radius)
    mass = first.mass * second.mass / (first.mass + second.mass)
    speed = second.velocity[2] - first.velocity[2]
    centers = [(0.0, 0.0, away), (0.0, 0.0, 0.0)]
    plain = law.on_plane(first.radius * second.radius / (first.radius + second.radius))
    return _run(scene, [first, second], centers, plain, mass, speed, rows)


def _free(balls: list[Ball]) -> pin.Model:
    inertias = [pin.Inertia.FromSphere(ball.mass, ball.radius) for ball in balls]
    free = pin.JointModelFreeFlyer()
    return model_of(*((f"ball{k}", free, one) for k, one in enumerate(inertias)))


def _run(scene, balls, centers, plain, mass, speed, rows):
    """Run until well after lift-off; `plain` is the law of a ball on a plane as stiff as these."""
    gap = GAP * min(ball.radius for ball in balls)
    expected = plain.contact_time(plain.depth_of(0.5 * mass * speed**2), speed)
    # A lossy impact lasts longer than the undamped one, without end where nothing comes back.
    duration = gap / speed + 4 * expected
    q0 = np.concatenate([[*center, 0, 0, 0, 1] for center in centers])
    v0 = np.concatenate([[*ball.velocity, *ball.spin] for ball in balls])
    every = expected / rows if rows else duration / 50
    result = sp.Simulation(scene, sp.Adaptive(PRECISE)).run(q0, v0, duration, record_dt=every)
    times = {kind: [e.t for e in result.events if e.kind == kind] for kind in ("touch", "lift_off")}
    (touch,), (left,) = times["touch"], times["lift_off"]
    quaternions, v = result.q[-1].reshape(-1, 7)[:, 3:], result.v[-1].reshape(-1, 6)
    log = result.contacts
    return Impact(
        velocities=turned(quaternions, v[:, :3]),
        spins=turned(quaternions, v[:, 3:]),
        duration=left - touch,
        t=log.t - touch,
        depth=log.depth,
        force=log.normal_force,
        result=result,
    )
