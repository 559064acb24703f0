"""Cost of an elastic foundation's query and force against a point contact's, on 200 k triangles.

python -m benchmarks.foundation
"""

import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.study.report.contents import times_table
from sphshell_pin.study.report.machine import machine
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.surfaces import touching_centers, wavy_sheet
from sphshell_pin.study.report.timing import one_core, take_turns

DT, STEPS, CELLS, RADIUS = 1e-8, 2000, 316, 0.012
POINT = sp.ImpactLaw(1e6, 1.5)
PAD = sp.FoundationLaw(1e7, 5e-3)
FRICTION = sp.CoulombFriction(0.3, 0.2, 0.01, 0.1)


def runner(
    shell: sp.Shell,
    center: np.ndarray,
    law: sp.ImpactLaw | sp.FoundationLaw,
    friction: bool,
    method: str = "smooth",
) -> Callable[[], float]:
    """Seconds per step of a ball that creeps over the shell."""
    # No force moves it noticeably.
    heavy = ("ball", pin.JointModelFreeFlyer(), pin.Inertia.FromSphere(10.0, 1.0))
    scene = sp.Scene(model_of(heavy))
    used = FRICTION if friction else None
    ball = sp.Sphere(RADIUS, "ball")
    scene.add_contact(sphere=ball, shell=shell, law=law, friction=used, method=method)
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(DT))
    steps = STEPS if isinstance(law, sp.FoundationLaw) else 50 * STEPS
    q, v = np.r_[center, 0, 0, 0, 1.0], np.r_[1e-3, 5e-4, 0, 0, 0, 1.0]

    def run() -> float:
        # Of the processor's time: runs that last differently are interrupted differently.
        start = time.process_time()
        simulation.run(q, v, steps * DT, record_dt=steps * DT)
        return (time.process_time() - start) / steps

    return run


def main() -> None:
    """Print the cost of one query with its force, without the rest of a step, and its ratio."""
    one_core()
    print(machine())
    for size in (1.0, 0.4):
        shell = sp.Shell(*wavy_sheet(CELLS, size))
        for depth in (1e-4, 5e-4):
            center = touching_centers(1, size, RADIUS, depth)[0]
            cases = {
                "nothing touched": runner(shell, center + [0, 0, 1.0], POINT, False),
                "point": runner(shell, center, POINT, False),
                "foundation": runner(shell, center, PAD, False),
                "foundation, flat": runner(shell, center, PAD, False, "facets"),
                "point, friction": runner(shell, center, POINT, True),
                "foundation, friction": runner(shell, center, PAD, True),
            }
            times = take_turns(cases, 15)
            bare = times.pop("nothing touched")
            side = size / CELLS / np.sqrt(2 * RADIUS * depth)
            print(
                f"\n{len(shell.elements)} triangles, side / radius of the patch {side:.2f}, "
                f"depth / radius {depth / RADIUS:.3f}\n"
            )
            for friction in (False, True):
                some = {n: t - bare for n, t in times.items() if ("friction" in n) == friction}
                base = next(iter(some))
                table = times_table("", "", "contact", some, base, f"over_point: over {base}")
                print(table.markdown())


if __name__ == "__main__":
    main()
