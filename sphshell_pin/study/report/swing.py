"""Period and energy of a ball that swings in a bowl without friction, against the exact bowl."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from sphshell_pin import ImpactLaw, RungeKutta4, Scene, Shell, Simulation, Sphere
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.surfaces import Mesh, icosphere

RADIUS, BOWL = 0.010, 0.040  # of the ball and of the bowl [m]
ARM = BOWL - RADIUS
MASS, STIFFNESS, GRAVITY = 0.050, 1e4, 9.81
LAW = ImpactLaw(STIFFNESS, exponent=1.0)
ANGLE = math.radians(40)
# At rest at the turning point the normal force is m g cos(40 deg): the ball starts in balance.
START_DEPTH = MASS * GRAVITY * math.cos(ANGLE) / STIFFNESS
ENERGY = MASS * GRAVITY * ARM * (1 - math.cos(ANGLE))
DT, PERIODS = 1e-4, 4
AZIMUTHS = 0.1 + np.linspace(0, 2 * np.pi, 8, endpoint=False)
LEVELS = {0.6: 3, 0.3: 4, 0.15: 5}  # of the icosphere, by h / r


@dataclass(frozen=True)
class Swing:
    """One run: mean period [s], largest change of energy / energy of the swing, CPU s per s."""

    period: float
    energy: float
    cpu: float


@dataclass(frozen=True)
class Row:
    """Runs in several directions: errors of the period / period, energy of the worst, mean cost."""

    rms: float
    mean: float
    largest: float
    energy: float
    cpu: float


def any_turn() -> Array:
    """Return a rotation that puts the mirror planes of the icosphere off every swing."""
    return np.asarray(pin.utils.rpyToMatrix(0.4, 1.1, 2.3))


def bowl(side: float, turn: Array | None = None) -> Mesh:
    """Return the sphere whose elements have sides of `side` radii of the ball, as in LEVELS."""
    mesh = icosphere(LEVELS[side], BOWL)
    turn = any_turn() if turn is None else turn
    return Mesh(mesh.vertices @ turn.T, mesh.triangles, mesh.normals @ turn.T)


def ball_model() -> pin.Model:
    """Return the ball on a joint that moves along x, y, z: nothing turns it without friction."""
    inertia = pin.Inertia.FromSphere(MASS, RADIUS)
    return model_of(("ball", pin.JointModelTranslation(), inertia), gravity=GRAVITY)


def mesh_scene(mesh: Mesh, method: str = "smooth", exact_normals: bool = True) -> Scene:
    """Return the ball and the surface of a mesh."""
    normals = mesh.normals if exact_normals else None
    shell = Shell(mesh.vertices, mesh.triangles, normals=normals)
    scene = Scene(ball_model())
    scene.add_contact(Sphere(RADIUS, "ball"), shell, law=LAW, method=method)
    return scene


def start(azimuth: float) -> Array:
    """Return the center (3,) [m] at the turning point of the exact bowl, in balance."""
    reach = ARM + START_DEPTH
    side = reach * math.sin(ANGLE)
    return np.array([side * math.cos(azimuth), side * math.sin(azimuth), -reach * math.cos(ANGLE)])


def downward_crossings(t: Array, x: Array, v: Array) -> Array:
    """Return when x falls through zero [s], by cubics through x and v at both ends of a step."""
    spline = CubicHermiteSpline(t, x, v)
    roots = spline.roots(discontinuity=False, extrapolate=False)
    return np.asarray(roots[spline(roots, 1) < 0])


def mean_period(t: Array, x: Array, v: Array, periods: int) -> float:
    """Return the mean of the first `periods` periods [s].

    From one fall through the middle to another: a slope of the surface there delays all of them
    alike. NaN where the run is too short.
    """
    crossings = downward_crossings(t, x, v)
    if len(crossings) <= periods:
        return math.nan
    return float(crossings[periods] - crossings[0]) / periods


def reference_period(periods: int = PERIODS) -> float:
    """Return the mean period [s] of the exact bowl with its spring, by SciPy, to 1e-10 of it."""

    def motion(t: float, state: Array) -> Array:
        at, v = np.split(state, 2)
        reach = math.hypot(*at)
        pull = STIFFNESS / MASS * max(0.0, reach - ARM) / reach * at
        return np.array([*v, -pull[0], -pull[1] - GRAVITY])

    def falls(t: float, state: Array) -> float:
        return float(state[0])

    falls.direction = -1.0  # type: ignore[attr-defined]
    end = (periods + 0.4) * closed_form()
    first = np.r_[start(0.0)[[0, 2]], 0.0, 0.0]
    found = solve_ivp(motion, (0.0, end), first, "DOP853", events=falls, rtol=1e-12, atol=1e-14)
    crossings = found.t_events[0]
    return float(crossings[periods] - crossings[0]) / periods


def closed_form() -> float:
    """Return the period [s] in closed form, to first order of e = m g / (k L), L = R - r.

        4 sqrt(L / g) K(sin 20 deg) (1 + e (15 <cos a> - 13 cos 40 deg) / 4).

    It has the sink s = m (g cos a + L a'^2) / k = e L (3 cos a - 2 cos 40 deg) into the spring,
    what the spring holds and gravity's work on the change of s. The mean <> over time is that over
    phi, sin(a / 2) = sin(20 deg) sin(phi), with the weights 1 / sqrt(1 - sin(a / 2)^2), of which K
    is the integral up to pi / 2.
    """
    phi = np.pi * (np.arange(64) + 0.5) / 128
    half = math.sin(ANGLE / 2) * np.sin(phi)
    weight = 1 / np.sqrt(1 - half**2)
    rigid = 4 * math.sqrt(ARM / GRAVITY) * float(weight.mean()) * math.pi / 2
    cosine = float((weight * (1 - 2 * half**2)).sum() / weight.sum())
    e = MASS * GRAVITY / (STIFFNESS * ARM)
    return rigid * (1 + e * (15 * cosine - 13 * math.cos(ANGLE)) / 4)


def energy_changes(result: Result, swing_energy: float = ENERGY) -> Array:
    """Return (E(t) - E(0)) / energy of the swing; E is kinetic, of gravity and of the contacts."""
    return np.asarray(result.energy.residual / swing_energy)


def swing(scene: Scene, azimuth: float, dt: float = DT, periods: int = PERIODS) -> Swing:
    """Let the ball go at `azimuth` for a third of a period more than `periods`."""
    duration = (periods + 0.35) * closed_form()
    before = time.process_time()
    result = Simulation(scene, RungeKutta4(dt)).run(start(azimuth), duration=duration)
    spent = time.process_time() - before
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    period = mean_period(result.t, result.q @ along, result.v @ along, periods)
    return Swing(period, float(np.abs(energy_changes(result)).max()), spent / duration)


def measure(
    scene: Scene,
    period: float,
    azimuths: Sequence[float] | Array = AZIMUTHS,
    dt: float = DT,
    periods: int = PERIODS,
) -> Row:
    """Swing in every direction; `period` [s] is the exact one."""
    runs = [swing(scene, float(azimuth), dt, periods) for azimuth in azimuths]
    errors = np.array([run.period for run in runs]) / period - 1
    return Row(
        rms=float(np.sqrt(np.mean(errors**2))),
        mean=float(np.mean(errors)),
        largest=float(np.abs(errors).max()),
        energy=max(run.energy for run in runs),
        cpu=float(np.mean([run.cpu for run in runs])),
    )
