"""Period and energy of a ball that swings in a bowl without friction, against the exact bowl."""

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicHermiteSpline

from sphshell_pin import ImpactLaw, RungeKutta4, Scene, Shell, Simulation, Sphere
from sphshell_pin.base.arrays import Array
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
# Of the exact bowl with its spring [s]; tests/contact/smooth/test_swing.py integrates it by SciPy.
PERIOD = 0.35882839627
DT, PERIODS = 1e-4, 4
AZIMUTHS = 0.1 + np.linspace(0, 2 * np.pi, 8, endpoint=False)
LEVELS = {0.6: 3, 0.3: 4, 0.15: 5}  # of the icosphere, by h / r


class Row(NamedTuple):
    """Runs in several directions: root mean square of the period's error / period, energy.

    The latter is the largest change of energy over the energy of the swing.
    """

    rms: float
    energy: float


def turned_icosphere(level: int, radius: float) -> Mesh:
    """Return a sphere [m] of 20 * 4^level triangles, no mirror plane of which holds a swing."""
    mesh = icosphere(level, radius)
    turn = pin.utils.rpyToMatrix(0.4, 1.1, 2.3).T
    return Mesh(mesh.vertices @ turn, mesh.triangles, mesh.normals @ turn)


def bowl(side: float) -> Mesh:
    """Return the sphere whose elements have sides of `side` radii of the ball, as in LEVELS."""
    return turned_icosphere(LEVELS[side], BOWL)


def ball_model() -> pin.Model:
    """Return the ball on a joint that moves along x, y, z: nothing turns it without friction."""
    inertia = pin.Inertia.FromSphere(MASS, RADIUS)
    return model_of(("ball", pin.JointModelTranslation(), inertia), gravity=GRAVITY)


def mesh_scene(mesh: Mesh, exact_normals: bool = True) -> Scene:
    """Return the ball and the surface of a mesh."""
    normals = mesh.normals if exact_normals else None
    shell = Shell(mesh.vertices, mesh.triangles, normals=normals)
    scene = Scene(ball_model())
    scene.add_contact(Sphere(RADIUS, "ball"), shell, law=LAW)
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


def swing(scene: Scene, azimuth: float, periods: int = PERIODS) -> tuple[float, float]:
    """Let the ball go at `azimuth` for a third of a period more than `periods`.

    Returns the mean period [s] and the largest change of energy / energy of the swing.
    """
    duration = (periods + 0.35) * PERIOD
    result = Simulation(scene, RungeKutta4(DT)).run(start(azimuth), duration=duration)
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    period = mean_period(result.t, result.q @ along, result.v @ along, periods)
    return period, float(np.abs(result.energy.residual).max() / ENERGY)


def measure(scene: Scene, azimuths: Array = AZIMUTHS, periods: int = PERIODS) -> Row:
    """Swing in every direction."""
    runs = np.array([swing(scene, float(azimuth), periods) for azimuth in azimuths])
    errors = runs[:, 0] / PERIOD - 1
    return Row(float(np.sqrt(np.mean(errors**2))), float(runs[:, 1].max()))
