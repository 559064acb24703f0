"""A sphere in a socket of nearly its own size: cost of a curved query against a flat one.

python -m benchmarks.conforming
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell, _core
from sphshell_pin.benchmarks.surfaces import icosphere
from sphshell_pin.benchmarks.timing import Spread, machine, one_core
from sphshell_pin.shell.contact_set import Method

Array = NDArray[np.float64]
LEVEL = 4  # of the icosphere of radius 1: 5120 triangles
SHARES = (0.3, 0.9, 0.97, 0.99, 0.999, 1.001)  # radius of the sphere
DEPTH = 0.05  # in radii of the sphere
PLACES, ROUNDS = 24, 5


def seconds(core: _core.Shell, center: Array, radius: float, method: Method) -> float:
    """Return the least time of a few queries [s]."""
    core.contacts(center, radius, int(method))
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        core.contacts(center, radius, int(method))
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Print a line for every radius."""
    one_core()
    print(machine())
    mesh = icosphere(LEVEL, 1.0)
    shell = Shell(mesh.vertices, mesh.triangles, normals=mesh.normals)
    curved, flat = shell.core_for("smooth"), shell.core_for("facets")
    rng = np.random.default_rng(0)
    print(f"Socket of {len(mesh.triangles)} triangles, sphere {DEPTH:g} r deep")
    print("   r / R    curved [us]    flat [us]    ratio, median [quartiles]    sum of weights")
    for radius in SHARES:
        times, weights = [], []
        for direction in rng.normal(size=(PLACES, 3)):
            offset = 1 - radius + DEPTH * radius
            center = offset * direction / np.linalg.norm(direction)
            times.append(
                [
                    seconds(curved, center, radius, Method.SMOOTH),
                    seconds(flat, center, radius, Method.FACETS),
                ]
            )
            weights.append(shell.contacts(center, radius).weight.sum())
        taken = np.array(times)
        ratio = Spread.of(taken[:, 0] / taken[:, 1])
        smooth, plain = 1e6 * np.median(taken, axis=0)
        print(
            f"  {radius:6.3f} {smooth:14.1f} {plain:12.1f}    {ratio.median:9.2f} "
            f"[{ratio.low:.2f}, {ratio.high:.2f}]    {min(weights):g} to {max(weights):g}"
        )


if __name__ == "__main__":
    main()
