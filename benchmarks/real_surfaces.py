"""Spheres on the surfaces of a folder: where the elastic potential jumps, and what energy is lost.

python -m benchmarks.real_surfaces FOLDER [--walks N] [--runs N] [--seconds S] [--methods M ...]
    [--only NAME ...]

Lengths in the files are taken in mm; CAD files need the extra `cad`. The numbers of walks and runs
are their seeds: `find_walk` and `find_run` make them again. 5 minutes on 22 files.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import Adaptive, ImpactLaw, JointPD, Scene, Shell, Simulation, Sphere
from sphshell_pin.benchmarks.models import model_of
from sphshell_pin.benchmarks.timing import one_core
from sphshell_pin.cases.machine import machine
from sphshell_pin.dynamics import Result
from sphshell_pin.errors import Interrupted, SphshellError
from sphshell_pin.shell.contact_set import ContactSet

Array = NDArray[np.float64]
Find = Callable[[Array], ContactSet]
MESHES, CAD = (".stl", ".obj", ".ply", ".off"), (".step", ".stp", ".iges", ".igs", ".brep", ".brp")
LENGTH, STRIDE, DEPTH = 30.0, 0.1, 0.05  # of a walk, in radii
JUMP, ENERGY = 1e-6, 1e-4  # shares above which a jump or a run is shown
# Of a run, in radii and s, with a mass of 1 kg. A spring pulls the center with 1 N for each radius
# where the ball touches first, to a point REACH behind: unlike gravity it keeps the ball there.
REACH, HEIGHT, IMPACT_DEPTH, DURATION = 6.0, 2.0, 0.07, 40.0
SLIDE_DEPTH, SLIDE_SPEED = 0.03, 0.7
SPRING = 1 / REACH  # [N/m]
RTOL = 1e-8


def surface_files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.suffix.lower() in MESHES + CAD)


def load(path: Path) -> Shell:
    """Return the surface; a header that states another unit than mm is of no interest here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Shell.from_file(path, unit="mm")


def unit_vector(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def mean_side(shell: Shell) -> float:
    corners = shell.vertices[shell.triangles]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def place(shell: Shell, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a place (3,) on the curved elements and one of the flat one's two normals (3,).

    Half of the places are chosen as the area is, half as the elements are.
    """
    corners = shell.vertices[shell.triangles]
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(spans, axis=1)
    chosen = int(rng.choice(len(areas), p=areas / areas.sum()))
    if rng.random() < 0.5:
        chosen = int(rng.integers(len(areas)))
    w, u, v = weights = rng.dirichlet([1.0, 1.0, 1.0])
    # Bernstein's polynomials of the control points, as `core.control_point_offsets` has them.
    sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
    bend = (
        np.array([*sides, 6 * u * v * w]) @ shell.core_for("smooth").control_point_offsets[chosen]
    )
    normal = shell.triangle_normals[chosen] * rng.choice([-1.0, 1.0])
    return weights @ corners[chosen] + bend, normal


def potential(found: ContactSet) -> float:
    """Return the elastic energy of stiffness one and exponent 1.5."""
    return float((found.terms.weight * found.terms.depth**2.5).sum() / 2.5)


def force(found: ContactSet) -> Array:
    push = found.terms.weight * found.terms.depth**1.5
    return np.asarray(push @ found.terms.normal)


def unexplained(before: ContactSet, after: ContactSet, move: Array) -> float:
    """Return the change of the potential that the forces at both ends do not account for."""
    lost = potential(after) - potential(before) + (force(before) + force(after)) @ move / 2
    return abs(float(lost))


def jump(before: ContactSet, after: ContactSet, move: Array) -> float:
    """Return the jump of the potential between two near centers, as a share of it."""
    most = max((c.terms.depth**1.5).sum() for c in (before, after)) * float(np.linalg.norm(move))
    scale = max(potential(before), potential(after))
    return max(unexplained(before, after, move) - most, 0.0) / scale if scale > 0 else 0.0


def steepest(find: Find, start: Array, end: Array, width: float) -> tuple[Array, Array]:
    """Return two centers `width` apart between which the potential changes most, by halving.

    It stops early where a tenth of a jump that counts is no longer unexplained.
    """
    first, last = find(start), find(end)
    while np.linalg.norm(end - start) > width:
        if unexplained(first, last, end - start) < 0.1 * JUMP * potential(first):
            break
        middle = (start + end) / 2
        found = find(middle)
        if unexplained(first, found, middle - start) > unexplained(found, last, end - middle):
            end, last = middle, found
        else:
            start, first = middle, found
    return start, end


@dataclass(frozen=True)
class Walk:
    """A sphere of `radius` [m] and its `centers` (n, 3) [m], STRIDE apart, as it rolls."""

    radius: float
    centers: Array


def find_walk(shell: Shell, seed: int) -> Walk:
    """Roll over the surface; turn back where it would be left."""
    rng = np.random.default_rng([seed, 1])
    radius = mean_side(shell) * float(np.exp(rng.uniform(np.log(0.2), np.log(20.0))))
    point, normal = place(shell, rng)
    center, along = point + (1 - DEPTH) * radius * normal, rng.normal(size=3)
    path: list[Array] = []
    for _ in range(round(LENGTH / STRIDE)):
        found = shell.contacts(center, radius)
        if not len(found):
            break
        normal = found.normal[0]
        along = along - along @ normal * normal
        if np.linalg.norm(along) < 1e-6:
            along = np.cross(normal, rng.normal(size=3))
        along = unit_vector(along)
        center = center + (found.depth[0] - DEPTH * radius) * normal
        path.append(center)
        center = center + STRIDE * radius * along
        if not len(shell.contacts(center, radius)):
            center, along = path[-1], rng.normal(size=3)
    return Walk(radius, np.array(path).reshape(-1, 3))


def shown(found: ContactSet) -> str:
    """Return the terms of a contact set: sign, element and depth / largest depth of each."""
    terms = found.terms
    signs = np.where(terms.weight > 0, "+", "-")
    depths = terms.depth / terms.depth.max(initial=1e-300)
    parts = [f"{s}{e}({d:.4f})" for s, e, d in zip(signs, terms.element, depths, strict=True)]
    return " ".join(parts[:8]) + (f" and {len(parts) - 8} more" if len(parts) > 8 else "")


@dataclass(frozen=True)
class Jump:
    """Jump / potential, the center (3,) beside it [m], and the terms on both sides."""

    share: float
    center: Array
    terms: str


def jumps_along(shell: Shell, walk: Walk) -> list[Jump]:
    """Return the largest jump of each stride that has one above JUMP."""

    def find(center: Array) -> ContactSet:
        return shell.contacts(center, walk.radius)

    jumps = []
    for start, end in pairwise(walk.centers):
        a, b = steepest(find, start, end, 1e-9 * walk.radius)
        before, after = find(a), find(b)
        if not (share := jump(before, after, b - a)) <= JUMP:
            jumps.append(Jump(share, a, f"{shown(before)} -> {shown(after)}"))
    return jumps


def walk_all(files: list[Path], count: int) -> None:
    """Print jumps of the potential along `count` walks a file."""
    print(f"Jumps of the potential above {JUMP:.0e} of it, {count} walks a file, depth {DEPTH} r")
    print(f"{'':40s} triangles  path / r  jumps  per 1000 r  largest  seconds")
    remarks = []
    for path in files:
        shell, began = load(path), time.perf_counter()
        length, sizes = 0.0, []
        for seed in range(count):
            walk = find_walk(shell, seed)
            jumps = jumps_along(shell, walk)
            length += np.linalg.norm(np.diff(walk.centers, axis=0), axis=1).sum() / walk.radius
            sizes += [found.share for found in jumps]
            if jumps:
                worst = max(jumps, key=lambda found: found.share)
                remarks.append(
                    f"  {path.name} walk {seed}: r = {walk.radius!r} m, {len(jumps)} jumps, the "
                    f"largest {worst.share:.1e} at {worst.center.tolist()}\n    {worst.terms}"
                )
        print(
            f"{path.name:40s} {len(shell.triangles):9d} {length:9.0f} {len(sizes):6d} "
            f"{1e3 * len(sizes) / max(length, 1e-9):11.2f}  {max(sizes, default=0.0):7.1e} "
            f"{time.perf_counter() - began:8.1f}",
            flush=True,
        )
    print("\n".join(remarks))


@dataclass(frozen=True)
class Run:
    """A frictionless run: what to start, and where; the origin is the ball's center at the start.

    `radius` [m], `start` (3,) of the center in the shell's frame [m], `speed` (3,) [m/s],
    `goal` (3,) of the spring, from the start [m], `stiffness` of the contact [N/m^1.5].
    """

    radius: float
    start: Array
    speed: Array
    goal: Array
    stiffness: float

    def simulate(self, shell: Shell, method: str, seconds: float, rtol: float = RTOL) -> Result:
        """Run; Interrupted, with what was computed, after so many seconds of computing."""
        inertia = pin.Inertia.FromSphere(1.0, self.radius)
        scene = Scene(model_of(("ball", pin.JointModelTranslation(), inertia)))
        law, there = ImpactLaw(self.stiffness, 1.5), pin.SE3(np.eye(3), -self.start)
        sphere = Sphere(self.radius, "ball")
        scene.add_contact(sphere, shell, "universe", there, law=law, method=method)
        end = time.perf_counter() + seconds

        def watch(_: float) -> None:
            if time.perf_counter() > end:
                raise KeyboardInterrupt  # what Ctrl-C does: the rows so far are kept

        simulation = Simulation(scene, Adaptive(rtol, atol=rtol * self.radius))
        spring = JointPD(SPRING, 0.0, self.goal, gravity_compensation=False)
        return simulation.run(np.zeros(3), self.speed, DURATION, spring, progress=watch)


def find_run(shell: Shell, seed: int) -> Run | None:
    """Return a drop (even seeds) or a slide (odd ones); None where no place for it was found."""
    rng = np.random.default_rng([seed, 2])
    radius = mean_side(shell) * float(np.exp(rng.uniform(np.log(1.0), np.log(20.0))))
    for _ in range(100):
        point, normal = place(shell, rng)
        lean = rng.normal(size=3)
        if seed % 2 == 0:
            start = point + (1 + HEIGHT) * radius * normal
            if len(shell.contacts(start, radius)):
                continue
            # So deep the ball comes to a stop.
            fall = SPRING * ((REACH + HEIGHT) ** 2 - REACH**2) / 2
            stiffness = 2.5 * fall / IMPACT_DEPTH**2.5 / radius**0.5
            speed, way = np.zeros(3), REACH + HEIGHT
        else:
            start = point + (1 - SLIDE_DEPTH) * radius * normal
            found = shell.contacts(start, radius)
            if not len(found) or found.depth[0] > 1.5 * SLIDE_DEPTH * radius:
                continue
            normal = found.normal[0]
            start = start + (found.depth[0] - SLIDE_DEPTH * radius) * normal
            stiffness = SLIDE_DEPTH**-1.5 / radius**0.5  # it carries the ball at that depth
            speed = SLIDE_SPEED * radius * unit_vector(lean - lean @ normal * normal)
            way = REACH
        down = -normal + 0.2 * unit_vector(lean)
        return Run(radius, start, speed, way * radius * down, stiffness)
    return None


@dataclass(frozen=True)
class Loss:
    """Largest change of energy / energy exchanged; touches; largest depth / radius; worst step.

    `center` (3,) is where the energy changed most within one step, in the shell's frame [m].
    """

    share: float
    touches: int
    depth: float
    t: float
    center: Array
    step_share: float


def audit(result: Result, run: Run) -> Loss:
    """Judge a run until its last contact, or until it is deeper than half a radius."""
    rows = np.flatnonzero(result.energy.elastic > 0)
    last = min(int(rows[-1]) + 2, len(result.t)) if len(rows) else 1
    deep = [e.t for e in result.events if e.kind in ("deep", "through")]
    if deep:
        last = min(last, max(int(np.searchsorted(result.t, deep[0])), 1))
    residual = result.energy.residual[:last]
    exchanged = max(float(result.energy.exchanged_until[last - 1]), 1e-300)
    steps = np.abs(np.diff(residual, prepend=0.0))
    worst = int(steps.argmax())
    touches = sum(e.kind == "touch" and e.t <= result.t[last - 1] for e in result.events)
    in_time = result.contacts.t <= result.t[last - 1]
    return Loss(
        float(np.abs(residual).max()) / exchanged,
        touches,
        float(result.contacts.depth[in_time].max(initial=0.0)) / run.radius,
        float(result.t[worst]),
        run.start + result.q[worst],
        float(steps[worst]) / exchanged,
    )


def run_all(files: list[Path], count: int, method: str, seconds: float) -> None:
    """Print the energy that `count` runs a file lose or make."""
    print(f'\nEnergy of frictionless drops and slides, Adaptive({RTOL:.0e}), method "{method}"')
    print(
        f"{'':40s}  runs stopped failed  touches  depth / r   median  largest "
        f"> {ENERGY:.0e}  seconds"
    )
    remarks = []
    for path in files:
        shell, began = load(path), time.perf_counter()
        losses: list[Loss] = []
        stopped = failed = 0
        for seed in range(count):
            run = find_run(shell, seed)
            if run is None:
                continue
            who = f"  {path.name} {method} run {seed}: r = {run.radius!r} m"
            limit = time.perf_counter() + seconds
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    result = run.simulate(shell, method, seconds)
            except Interrupted as error:
                if time.perf_counter() < limit:
                    raise
                stopped, result = stopped + 1, error.result
                remarks.append(f"{who}: stopped at t = {result.t[-1]:.3g} s")
            except SphshellError as error:
                failed += 1
                remarks.append(f"{who}: {type(error).__name__}: {error}")
                continue
            loss = audit(result, run)
            losses.append(loss)
            if not loss.share <= ENERGY:
                remarks.append(
                    f"{who}: {loss.share:.1e}, of it {loss.step_share:.1e} in the step to "
                    f"t = {loss.t:.6g} s at {loss.center.tolist()}"
                )
        shares = np.array([loss.share for loss in losses])
        print(
            f"{path.name:40s} {len(losses) + failed:5d} {stopped:7d} {failed:6d} "
            f"{sum(loss.touches for loss in losses):8d} "
            f"{max((loss.depth for loss in losses), default=0.0):10.2f}  "
            f"{np.median(shares) if len(shares) else 0:7.1e}  {shares.max(initial=0.0):7.1e} "
            f"{np.count_nonzero(~(shares <= ENERGY)):7d} {time.perf_counter() - began:8.1f}",
            flush=True,
        )
    print("\n".join(remarks), flush=True)


def main() -> None:
    """Measure and print both tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.real_surfaces", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("folder", type=Path, help="of surface files; lengths in mm")
    parser.add_argument("--walks", type=int, default=20, help="walks a file")
    parser.add_argument("--runs", type=int, default=12, help="runs a file and method")
    parser.add_argument("--seconds", type=float, default=10.0, help="of computing, at most, a run")
    parser.add_argument("--methods", nargs="*", default=["smooth", "facets"])
    parser.add_argument("--only", nargs="*", help="names of files to take")
    options = parser.parse_args()
    files = surface_files(options.folder)
    if options.only:
        files = [path for path in files if path.name in options.only]
    one_core()
    print(machine())
    if options.walks:
        walk_all(files, options.walks)
    for method in options.methods if options.runs else []:
        run_all(files, options.runs, method, options.seconds)


if __name__ == "__main__":
    main()
