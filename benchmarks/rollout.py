"""Many runs over threads: python -m benchmarks.rollout [--runs N] [--seconds S].

Drops a rubber ball from random places into the bowl of `sphere_on_shell`, with stiffness and radius
of each run its own; prints the memory, and the time with one thread and with all processors, in
turn, and whether both have the same bits.
"""

import argparse
import os

import numpy as np

import sphshell_pin as sp
from benchmarks.processes import resident
from sphshell_pin import robots, scenarios
from sphshell_pin.results import Rollout

RADIUS = 0.012


def drops(runs: int, seconds: float, threads: int) -> Rollout:
    """Make `runs` drops of `seconds` each."""
    bowl = sp.Shell.from_file(scenarios.__path__[0] + "/surfaces/bowl.shl", unit="mm")
    scene = sp.Scene(robots.load("ball").model)
    law = sp.ImpactLaw.hertz(RADIUS, 5e6, 0.49, 70e9, 0.33, restitution=0.7, speed=1.0)
    friction = sp.CoulombFriction(0.2, 0.15, 1e-3, 1e-2)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), bowl, law=law, friction=friction, name="drop")
    rng = np.random.default_rng(0)
    q0s = np.tile([0.0, 0.0, 0.1, 0, 0, 0, 1], (runs, 1))
    q0s[:, :2] = rng.uniform(-0.08, 0.08, (runs, 2))
    vary = {
        "drop.law.stiffness": law.stiffness * rng.uniform(0.5, 2.0, runs),
        "drop.sphere.radius": rng.uniform(0.010, 0.013, runs),
    }
    return sp.Simulation(scene, sp.Adaptive()).rollout(q0s, None, seconds, threads, vary=vary)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rollout", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="for the memory")
    parser.add_argument("--seconds", type=float, default=0.3, help="of each run, simulated")
    parser.add_argument("--rounds", type=int, default=7, help="for the speed-up, in turn")
    options = parser.parse_args()
    cores = os.cpu_count() or 1
    drops(options.runs // 10, options.seconds, cores)
    before = resident()[1] / 1e6
    all_runs = drops(options.runs, options.seconds, cores)
    print(
        f"{options.runs} drops of {options.seconds} s, {cores} threads: "
        f"{all_runs.wall_time:.0f} s, {len(all_runs.failures)} failed; memory at most "
        f"{resident()[1] / 1e6:.0f} MB, after a tenth of them "
        f"{before:.0f} MB"
    )
    ratios = []
    for _ in range(options.rounds):
        many, one = (drops(options.runs // 20, options.seconds, n) for n in (cores, 1))
        same = np.array_equal(one.q, many.q) and np.array_equal(one.v, many.v)
        ratios.append(one.wall_time / many.wall_time)
        print(
            f"  {len(one)} drops: 1 thread {one.wall_time:.1f} s, {cores} threads "
            f"{many.wall_time:.1f} s, {ratios[-1]:.2f} x; bits {'the same' if same else 'DIFFER'}"
        )
    low, middle, high = np.percentile(ratios, [25, 50, 75])
    print(f"  median {middle:.2f} x [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
