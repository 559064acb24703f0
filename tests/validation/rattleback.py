"""A rattleback: an ellipsoid whose axes of inertia are turned against its own, on a plane.

Spun against its sense it starts to rattle and turns round; spun in its sense it does so much
later. In axes of the body, with n the normal of the plane, w the angular velocity and r from the
center of mass to the lowest point, rolling is v = -w x r: the force is known, and the equations of
Newton and Euler are ones for n and w alone.
"""

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.models import model_of
from tests import meshes
from tests.validation.cases import Outcome, case, within
from tests.validation.pictures import Panel

AXES = np.array([0.2, 0.03, 0.02])  # [m]
MASS, GRAVITY = 1.0, 9.81  # [kg], [m/s^2]
MIDDLE = np.array([0.0, 0.0, -0.01])  # of mass, from that of the ellipsoid [m]
INERTIA = 1e-4 * np.array([[2.0, -0.2, 0.0], [-0.2, 16.0, 0.0], [0.0, 0.0, 17.0]])  # [kg m^2]
START = pin.rpy.rotate("x", math.radians(0.5)) @ pin.rpy.rotate("y", math.radians(0.5))
SPINS = {-5.0: 3.3, 5.0: 12.3}  # [rad/s], and how long [s]
STIFF, DAMPING, CELLS, STEP = 1e7, 50.0, 35, 5e-5  # [N/m], [N s/m], of a side, [s]


def roll(spin: float, duration: float) -> tuple[Array, Array, Array]:
    """Return t (n,), the spin about the vertical (n,) and its zeros (k,), of rigid rolling."""
    squares = np.diag(AXES**2)

    def rates(_: float, y: Array) -> Array:
        n, w = y[:3], y[3:]
        reach = math.sqrt(n @ squares @ n)
        turn = np.cross(n, w)
        r = -squares @ n / reach - MIDDLE
        moves = -squares @ turn / reach + squares @ n * (n @ squares @ turn) / reach**3
        # Force over mass, less what comes from w'.
        rest = np.cross(w, np.cross(r, w)) - np.cross(w, moves) + GRAVITY * n
        arm = pin.skew(r)
        moment = -np.cross(w, INERTIA @ w) + MASS * np.cross(r, rest)
        return np.concatenate((turn, np.linalg.solve(INERTIA - MASS * arm @ arm, moment)))

    def about_vertical(_: float, y: Array) -> float:
        return float(y[:3] @ y[3:])

    from scipy.integrate import solve_ivp

    start = np.concatenate((START[2], [0.0, 0.0, spin]))
    t = np.arange(0.0, duration, 0.001)
    found = solve_ivp(
        rates, (0.0, duration), start, "DOP853", t, events=about_vertical, rtol=1e-10, atol=1e-12
    )
    return found.t, np.sum(found.y[:3] * found.y[3:], axis=0), found.t_events[0]


def ellipsoid(cells: int, axes: Array) -> tuple[Array, Array, Array]:
    """Blow up a cube of `cells`^2 quads a side to the ellipsoid of these half axes [m].

    Return vertices (n, 3), of which the sides of the cube do not share any, quads (m, 4) and the
    normals (n, 3).
    """
    angle = np.tan(np.linspace(-math.pi / 4, math.pi / 4, cells + 1))
    u, v = np.meshgrid(angle, angle, indexing="ij")
    quads = meshes.grid_plate(cells, cells, quads=True)[1]
    sides = [np.dstack([sign * np.ones_like(u), sign * u, v]) for sign in (1.0, -1.0)]
    points = [np.roll(side, k, axis=2) for k in range(3) for side in sides]
    every = np.concatenate(points).reshape(-1, 3)
    every /= np.linalg.norm(every, axis=1)[:, None]
    normals = every / axes
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return every * axes, np.concatenate([quads + k * u.size for k in range(6)]), normals


def spin_on_plane(spin: float, duration: float) -> tuple[Array, Array, float]:
    """Return t (n,), the spin about the vertical (n,) and the energy lost [J], of the scene."""
    inertia = pin.Inertia(MASS, MIDDLE, INERTIA)
    scene = sp.Scene(model_of(("body", pin.JointModelFreeFlyer(), inertia), gravity=GRAVITY))
    vertices, quads, normals = ellipsoid(CELLS, AXES)
    scene.add_contact(
        sp.Plane("universe"),
        sp.Shell(vertices, quads, normals=normals, side="outside"),
        "body",
        law=sp.ImpactLaw(STIFF, 1.0, DAMPING, 1e-7),
        friction=sp.BristleFriction(5.0, 5.0, STIFF, DAMPING),
    )
    reach = float(np.linalg.norm(AXES * START[2]))
    height = reach - MASS * GRAVITY / STIFF
    q0 = np.concatenate(([0.0, 0.0, height], pin.Quaternion(START).coeffs()))
    w = np.array([0.0, 0.0, spin])
    v0 = np.concatenate((np.cross(w, AXES**2 * START[2] / reach), w))
    result = sp.Simulation(scene, sp.RungeKutta4(STEP)).run(q0, v0, duration, record_dt=0.001)
    up = [pin.Quaternion(q[3:7]).matrix()[2] for q in result.q]
    energy = result.energy.kinetic + result.energy.potential
    return result.t, np.sum(up * result.v[:, 3:6], axis=1), float(energy[0] - energy[-1])


def last_zero(t: Array, spin: Array) -> float:
    """Return when the spin is zero for the last time, as it wobbles where it turns round."""
    k = np.flatnonzero(np.sign(spin[1:]) != np.sign(spin[:-1]))[-1]
    return float(t[k] - spin[k] * (t[k + 1] - t[k]) / (spin[k + 1] - spin[k]))


@case("rattleback")
def rattleback() -> Outcome:
    """Spin it in both senses, until it has turned round."""
    findings, panels = [], []
    for start, duration in SPINS.items():
        t, rigid, zeros = roll(start, duration)
        ours = spin_on_plane(start, duration)
        error = abs(last_zero(*ours[:2]) - zeros[-1])
        what = f"when the spin of {start:+g} rad/s is zero for the last time, {zeros[-1]:.4g} s"
        findings += within(0.03, (what, error), unit="s")
        lines = [("sp.Plane", *ours[:2])]
        theory = [("rigid rolling", t, rigid)]
        panels.append(Panel("time [s]", "spin [rad/s]", (), lines, theory))
        lost = ours[2] / (0.5 * INERTIA[2, 2] * start**2)
        what = f"energy lost from {start:+g} rad/s, of that of the spin"
        findings += within(0.02, (what, lost))
    return Outcome(findings, panels)
