"""A compiled robot against Pinocchio: python -m benchmarks.compiled.

Presses Panda's tool into a surface of 200 k triangles with both, in turn, and prints the time of a
step, the ratio, and how far the motions are apart; what the robot took to be compiled; and a loop
of one's own in C++ over the same, tests/cpp/press.cpp, which `make test` builds.
"""

import os
import resource
import subprocess
import tempfile
import time

import example_robot_data
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.base.cache import CACHE
from sphshell_pin.dynamics.compiled.robot import compile_robot

STEPS, ROUNDS, RADIUS = 4000, 15, 0.012
Q = np.array([0, 0.35, 0, -2.0, 0, 2.35, 0.8, 0.02, 0.02])


def surface(count: int = 317) -> sp.Shell:
    """Return waves over 2 m, of count^2 vertices."""
    x, y = (one.ravel() for one in np.meshgrid(*2 * [np.linspace(-1, 1, count)], indexing="ij"))
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = (one.ravel() for one in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    height = 0.05 * np.sin(5 * x) * np.cos(5 * y)
    return sp.Shell(np.stack([x, y, height], axis=1), triangles)


def press(compiled: bool, shell: sp.Shell) -> sp.Simulation:
    """Return Panda with a ball on its tool, which begins in the surface."""
    model = robots.load("panda").model
    data = model.createData()
    pin.framesForwardKinematics(model, data, Q)
    tip = data.oMf[model.getFrameId("panda_hand_tcp")].translation
    below = [-0.013, 0.007, 0.0009 - RADIUS - 0.05 * np.sin(0.065) * np.cos(0.035)]
    scene = sp.Scene(model, compiled=compiled)
    scene.add_contact(
        sp.Sphere(RADIUS, frame="panda_hand_tcp"),
        shell,
        placement=pin.SE3(np.eye(3), tip + below),
        law=sp.ImpactLaw(1e4, 1.5, 50.0, 1e-4),
        friction=sp.CoulombFriction(0.3, 0.2, 0.01, 0.1),
    )
    return sp.Simulation(scene, sp.SemiImplicitEuler(dt=1e-6))


def main() -> None:
    """Measure and print."""
    shell, end = surface(), STEPS * 1e-6
    with tempfile.TemporaryDirectory() as folder:
        os.environ[CACHE] = folder
        simulations = {name: press(name == "compiled", shell) for name in ("pinocchio", "compiled")}
        compiler = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    taken: dict[str, list[float]] = {name: [] for name in simulations}
    for _ in range(ROUNDS):
        for name, simulation in simulations.items():
            began = time.process_time()
            result = simulation.run(Q, None, end, record_dt=end)
            taken[name].append((time.process_time() - began) / STEPS * 1e6)
            assert len(result.contacts), "nothing touches"
    for name, values in taken.items():
        print(f"{name}: {np.median(values):.2f} us a step (least {min(values):.2f})")
    ratios = np.divide(taken["pinocchio"], taken["compiled"])
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    print(f"ratio: {middle:.2f} (quartiles {low:.2f} to {high:.2f})")
    ends = [simulation.run(Q, None, 0.01).q[-1] for simulation in simulations.values()]
    print(f"apart after 10 000 steps: {np.abs(ends[0] - ends[1]).max():.1e}")
    print(f"compiler: {compiler:.2f} CPU s", flush=True)
    panda = example_robot_data.load("panda")
    program = "build/cpp-tests/press", panda.urdf, compile_robot(panda.model), str(STEPS), "317"
    subprocess.run(program, check=True)


if __name__ == "__main__":
    main()
