"""How noise on a scan decides which elements bend, and which joints of a file become creases.

python -m benchmarks.creases [FILE ...]    # files in millimeters
"""

import sys

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.study.report.convergence import EXPONENT
from sphshell_pin.study.report.surfaces import BALL, DEPTH, RADIUS, ball_places, icosphere

LEVEL = 4  # of the icosphere: its sides are 0.3 of the sphere's radius
SHARES = (0.0, 0.002, 0.005, 0.01, 0.02, 0.05)  # of a side
PLACES = 300


def direction_error(shell: Shell, method: str) -> float:
    """95 % quantile of the angle between the force on a sphere and the exact normal [deg]."""
    points, normals = ball_places(BALL, np.random.default_rng(0), PLACES)
    angles = []
    for point, normal in zip(points, normals, strict=True):
        found = shell.contacts(point + (RADIUS - DEPTH) * normal, RADIUS, method=method)
        force = (found.weight * found.depth**EXPONENT) @ found.normal
        length = np.linalg.norm(force)
        if length > 0:
            angles.append(np.degrees(np.arccos(np.clip(force @ normal / length, -1, 1))))
    return float(np.quantile(angles, 0.95))


def turning(shell: Shell) -> int:
    """Edges that turn, and are smooth by their angle."""
    return int(((shell.edge_class == 0) & (np.abs(shell.edge_angle) > 1e-5)).sum())


def noise_table() -> None:
    """Print what vertices that are off along the normal make of a dome."""
    mesh = icosphere(LEVEL, BALL)
    side = mesh.mean_side
    noise = np.random.default_rng(1).normal(size=len(mesh.vertices))[:, None] * mesh.normals
    print(f"Dome, R = 4 r, h = {side / RADIUS:.2f} r; 95 % of the directions are off by less than")
    print("  noise / h   creases   smooth [deg]   facets [deg]")
    for share in SHARES:
        shell = Shell(mesh.vertices + share * side * noise, mesh.triangles)
        smooth, flat = (direction_error(shell, method) for method in ("smooth", "facets"))
        creases = shell.core_for("smooth").creases / turning(shell)
        print(f"  {share:9.3f} {creases:8.0%} {smooth:13.2f} {flat:14.2f}")


def file_table(paths: list[str]) -> None:
    """Print the share of the joints of each file that became creases, and of flat elements."""
    print("  triangles   joints   creases   elements kept flat so")
    for path in paths:
        shell = Shell.from_file(path, unit="mm")
        core = shell.core_for("smooth")
        flat = np.mean(core.bending == 2)
        share = core.creases / max(turning(shell), 1)
        print(f"  {len(shell.triangles):9d} {turning(shell):8d} {share:8.0%} {flat:10.0%}  {path}")


def main() -> None:
    """Print both tables."""
    noise_table()
    if len(sys.argv) > 1:
        file_table(sys.argv[1:])


if __name__ == "__main__":
    main()
