"""Cost of a step of 64 spheres over 200 k triangles: python -m benchmarks.many_spheres."""

import warnings

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.contact.normal_law import bisect
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.study.report.machine import machine
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.surfaces import wavy_sheet
from sphshell_pin.study.report.timing import one_core

COUNT, RADIUS, APART = 8, 0.006, 0.012
LAW = sp.ImpactLaw(1e5, 1.5, 10.0, 1e-4)
BRISTLE = sp.BristleFriction(0.5, 0.4, 1e5, 10.0, 1e-2)
PLACES = ("far", "5 mm off", "5 mm off, 2 m/s", "in touch")


def pad(count: int) -> list[sp.Sphere]:
    """Return a square of spheres below the frame "pad"."""
    places = (APART * (np.arange(count) - 0.5 * (count - 1))).tolist()
    return [sp.Sphere(RADIUS, "pad", (x, y, 0.0)) for x in places for y in places]


def scene_of(
    count: int, shell: sp.Shell, friction: sp.BristleFriction | None, *, together: bool
) -> sp.Scene:
    """Return a free body with count * count spheres, added one by one or `together`."""
    body = ("pad", pin.JointModelFreeFlyer(), pin.Inertia.FromSphere(1.0, 0.1))
    scene = sp.Scene(model_of(body))
    if together:
        scene.add_contacts(pad(count), shell, law=LAW, friction=friction)
    else:
        for sphere in pad(count):
            scene.add_contact(sphere, shell, law=LAW, friction=friction)
    return scene


def height(shell: sp.Shell, gap: float) -> float:
    """Return the height [m] at which the lowest of the 64 spheres is `gap` off the sheet."""
    offsets = np.array([one.offset for one in pad(COUNT)])

    def excess(z: float) -> float:
        distances = shell.closest_points(offsets + [-0.1, -0.1, z]).distances
        return float(np.min(distances)) - RADIUS - gap

    return bisect(excess, -0.1, 0.3)


def step_time(scene: sp.Scene, integrator: Integrator, z: float, speed: float) -> float:
    """Return the time of a step [us] of a run over the sheet."""
    fixed = integrator.limited_dt is not None
    duration = 0.05 if fixed else 0.01
    v = np.array([speed, 0, 0, 0, 0, 0.0])
    q = np.array([-0.1, -0.1, z, 0, 0, 0, 1.0])
    stats = sp.Simulation(scene, integrator).run(q, v, duration, record_dt=duration).stats
    return stats.wall_time / stats.steps * 1e6


def main() -> None:
    """Print the times of one sphere, of 64 added one by one, and of 64 added together."""
    warnings.simplefilter("ignore")
    one_core()
    print(machine())
    shell = sp.Shell(*wavy_sheet(316, 1.0))
    near = height(shell, 5e-3)
    heights = dict(zip(PLACES, (5.0, near, near, height(shell, -1e-3)), strict=True))
    integrators = {
        "SemiImplicitEuler(1e-4)": sp.SemiImplicitEuler(1e-4),
        "Adaptive(1e-6)": sp.Adaptive(1e-6),
        "Implicit(1e-6)": sp.Implicit(1e-6),
    }
    print("Time of a step [us]: one sphere, 64 by add_contact, 64 by add_contacts")
    for name, integrator in integrators.items():
        for friction in (None, BRISTLE):
            cases = [(1, False), (COUNT, False), (COUNT, True)]
            scenes = [scene_of(count, shell, friction, together=one) for count, one in cases]
            slow = friction is not None and name.startswith("Implicit")
            for place in PLACES:
                speed = 2.0 if "2 m/s" in place else 0.1
                best = np.full(3, np.inf)
                for _ in range(1 if slow else 7):
                    for k, scene in enumerate(scenes):
                        best[k] = min(best[k], step_time(scene, integrator, heights[place], speed))
                what = f"{name}, {'bristles' if friction else 'no friction'}, {place}"
                print(f"  {what:58s} {best[0]:9.2f} {best[1]:9.2f} {best[2]:9.2f}", flush=True)


if __name__ == "__main__":
    main()
