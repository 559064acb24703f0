"""Real tosses of a cube: four numbers are fitted to 60 of them, and judged by 450 others.

python -m tests.validation.tosses   # fits again, 20 minutes; needs the extra `fit`
"""

import math
import warnings
from functools import cache

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import UnitWarning
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.swing import GRAVITY
from tests.rolling import turned
from tests.validation.balls import plane
from tests.validation.cases import DATA, Outcome, case, within
from tests.validation.pictures import Panel

MASS, INERTIA, WIDTH = 0.37, 0.00081, 0.1048  # [kg], [kg m^2], [m], as published with the data
STIFFNESS = 10800.0  # [N/m], as published with the data; half or twice of it changes little
INTERVAL = 1 / 148  # [s] between rows
LENGTH, ANGLE = 2e-5, 1 / 32767  # units of the stored positions [m] and quaternions
FITTED_TO, JUDGED_BY = range(60), range(100, 550)
NUMBERS = (5.64, 0.177, 0.00834, 0.318)
"""Fitted: dissipation [s/m], coefficient, radius of corners [m], speed of full friction [m/s]."""
START = (7.0, 0.187, 0.0035, 0.05)  # of the fit, which goes on with half the step from its end
STAGES = ((1e-4, (0.7, 0.25, 0.6, 1.0)), (5e-5, (0.3, 0.1, 0.3, 0.4)))  # [s], sides in logarithms
POSITION, ROTATION = 0.124, 15.6  # [widths], [deg]


@cache
def tosses() -> tuple[list[Array], Array]:
    """Return of each toss its poses (n, 7), position and quaternion x y z w, and v0 (550, 6).

    A published velocity is the difference to the row before, that is the one half an interval
    earlier: in flight, gravity has acted on the cube for that time since.
    """
    with np.load(DATA / "cube_tosses.npz") as file:
        rows, ends, given = file["poses"], np.cumsum(file["lengths"]), file["velocities"]
    poses = np.hstack([rows[:, :3] * LENGTH, rows[:, [4, 5, 6, 3]] * ANGLE])
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1)[:, None]
    split = np.split(poses, ends[:-1])
    back = np.array([one[0, 3:] for one in split]) * [-1, -1, -1, 1]
    linear = given[:, 3:] - [0.0, 0.0, GRAVITY * INTERVAL / 2]
    return split, np.hstack([turned(back, linear), given[:, :3]])


def cube(dissipation: float, mu: float, radius: float, speed: float) -> sp.Scene:
    """Return the cube over z = 0: eight spheres of `radius` [m] that touch its faces."""
    inertia = pin.Inertia(MASS, np.zeros(3), INERTIA * np.eye(3))
    scene = sp.Scene(model_of(("cube", pin.JointModelFreeFlyer(), inertia), gravity=GRAVITY))
    law = sp.HuntCrossleyLaw(STIFFNESS, 1.0, dissipation)
    friction = sp.CoulombFriction(mu, mu, speed, 2 * speed)
    for k in range(8):
        signs = np.array([(-1) ** k, (-1) ** (k // 2), (-1) ** (k // 4)])
        sphere = sp.Sphere(radius, "cube", offset=tuple((WIDTH / 2 - radius) * signs))
        scene.add_contact(sphere, plane(2.0), law=law, friction=friction, name=f"corner{k}")
    return scene


def misses(scene: sp.Scene, chosen: range, dt: float = 5e-5) -> tuple[Array, list[Array]]:
    """Return the errors (n, 2) of the chosen tosses, and their poses as computed.

    Of each toss the means over its rows, the first left out: distance over the width, and angle
    [deg] between the orientations.
    """
    seen, starts = tosses()
    start = [seen[k][0] for k in chosen]
    longest = max(len(seen[k]) for k in chosen) - 1
    runs = sp.Simulation(scene, sp.SemiImplicitEuler(dt)).rollout(
        start, starts[list(chosen)], (longest + 0.01) * INTERVAL, threads=1, record_dt=INTERVAL
    )
    errors, computed = [], []
    for k, run in zip(chosen, runs, strict=True):
        ours, theirs = run.q[: len(seen[k])], seen[k]
        away = np.linalg.norm(ours[1:, :3] - theirs[1:, :3], axis=1) / WIDTH
        cosine = np.abs(np.sum(ours[1:, 3:] * theirs[1:, 3:], axis=1))
        angle = 2 * np.degrees(np.arccos(np.minimum(cosine, 1.0)))
        errors.append((away.mean(), angle.mean()))
        computed.append(ours)
    return np.array(errors), computed


@case("cube_tosses")
def cube_tosses() -> Outcome:
    """Compute the 450 tosses from their first rows, and draw one of the middle error."""
    errors, computed = misses(cube(*NUMBERS), JUDGED_BY)
    position, rotation = errors.mean(axis=0)
    spread = errors.std(axis=0) / math.sqrt(len(errors))
    doubt = f"standard error of {spread[0]:.4f} and {spread[1]:.2f} deg"
    doubt = f"The mean over the tosses has a {doubt}"
    why = [
        f"{doubt}: the bound is within it." if mean - aim <= error else ""
        for mean, aim, error in zip((position, rotation), (POSITION, ROTATION), spread, strict=True)
    ]
    mu = "fitted coefficient", NUMBERS[1]
    findings = [
        *within(POSITION, ("mean distance over the width of the cube", position), why=why[0]),
        *within(
            ROTATION, ("mean angle between the orientations", rotation), unit="deg", why=why[1]
        ),
        *within(0.16, mu, sense=">="),
        *within(0.19, mu),
    ]
    middle = int(np.argsort(errors[:, 0])[len(errors) // 2])
    seen, ours = tosses()[0][JUDGED_BY[middle]], 1e3 * computed[middle]
    t, share = 1e3 * INTERVAL * np.arange(len(seen)), np.linspace(0, 100, len(errors))
    sizes = (("distance [% of the width]", 100 * errors[:, 0]), ("angle [deg]", errors[:, 1]))
    measured = [(f"{axis}, measured", t[::6], 1e3 * seen[::6, k]) for k, axis in enumerate("xyz")]
    panels = [
        Panel("tosses [%]", "error", (), [(name, share, np.sort(one)) for name, one in sizes]),
        Panel(
            "time [ms]", "center of the cube [mm]", measured,
            [(f"{axis}, ours", t, ours[:, k]) for k, axis in enumerate("xyz")],
        ),
    ]  # fmt: skip
    return Outcome(findings, panels, notes=[f"{doubt}."])


def main() -> None:
    """Fit again and print the numbers."""
    from scipy.optimize import minimize

    def cost(logarithms: Array, dt: float) -> float:
        errors, _ = misses(cube(*np.exp(logarithms)), FITTED_TO, dt)
        return float(np.sum(errors.mean(axis=0) / [0.125, 16.4]))

    warnings.simplefilter("ignore", UnitWarning)  # small corners on a wide plane
    numbers = np.log(START)
    for dt, sides in STAGES:
        corners = numbers + np.vstack([np.zeros(4), np.diag(sides)])
        limits = {"initial_simplex": corners, "xatol": 1e-3, "fatol": 1e-4, "maxfev": 200}
        found = minimize(cost, numbers, (dt,), method="Nelder-Mead", options=limits)
        numbers = found.x
        print(dt, found.fun, np.exp(numbers), found.nfev, flush=True)


if __name__ == "__main__":
    main()
