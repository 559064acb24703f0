"""Fast spheres at thin sheets.

Spheres of 0.1 to 50 mm fly at 1 to 1000 m/s at thin sheets and at bodies; the steps
are 0.1 to 10 ms, so that a step may be 1e5 radii long. The law can stop the sphere at 0.3 r. On
which side a center is, is decided from the triangles or the height of the sheet alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.study.report import surfaces
from tests import meshes, models
from tests.hard_cases.verdict import Verdicts, at_most, case
from tests.shell.surfaces import tetrahedron

STOPPED_AT = 0.3  # depth at which the law has taken up all of the sphere's energy, in radii
# Energy that may be gained: this share, and with explicit fixed steps besides a (step / depth)^b,
# as the sphere flies into the sheet for up to a step before a force acts on it. A step longer than
# r / 4 is cut.
GAIN = 1e-3
STEP_GAIN = {"SemiImplicitEuler": (2.0, 1), "RungeKutta4": (0.5, 2)}
LONGEST = 0.25
Mesh = tuple[Array, NDArray[np.int32]]


@dataclass(frozen=True)
class Target:
    """A surface for a sphere of radius one; without `height`(x, y) it is closed.

    Spheres are aimed at its triangles, those of a sheet at places within `reach` of its middle.
    """

    name: str
    mesh: Mesh
    height: Callable[[Array, Array], Array] | None = None
    reach: float = np.inf

    def sides(self, points: Array) -> NDArray[np.int64]:
        """Return on which side of a sheet points (n, 3) are, or how often a body encloses them."""
        if self.height is not None:
            x, y, z = points.T
            return np.sign(z - self.height(x, y)).astype(np.int64)
        vertices, elements = self.mesh
        return winding(points, vertices[elements])

    def aim(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return a place on it and a direction that leads away from it, not along a sheet."""
        vertices, elements = self.mesh
        while True:
            place = rng.dirichlet(np.ones(3)) @ vertices[rng.choice(elements)]
            away = rng.normal(size=3)
            away /= np.linalg.norm(away)
            if self.height is None or (np.abs(place).max() < self.reach and abs(away[2]) > 0.3):
                return place, away


def winding(points: Array, corners: Array) -> NDArray[np.int64]:
    """Return how often a closed surface of triangles (m, 3, 3) goes round points (n, 3): 0 outside.

    Sum of solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983).
    """
    a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
    dot = lambda x, y: np.einsum("nti,nti->nt", x, y)  # noqa: E731
    base = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    total = 2 * np.arctan2(dot(a, np.cross(b, c)), base).sum(axis=1) / (4 * np.pi)
    return np.rint(total).astype(np.int64)


def flat(x: Array, _y: Array) -> Array:
    return 0.0 * x


def wave(x: Array, y: Array) -> Array:
    return 0.3 * (np.sin(0.7 * x + 0.3) * np.cos(0.6 * y) + 0.2 * np.sin(0.5 * x - 0.8 * y))


@cache
def targets() -> list[Target]:
    """Return thin open sheets, then closed bodies."""
    x, y, halves = surfaces.random_grid(40, 10.0)
    vertices, sides = meshes.cube(4.0)
    small = tetrahedron(0.5, at=(-0.125, -0.125, -0.125))
    ring = surfaces.torus(6.0, 3.0, 1.2)
    return [
        Target("flat sheet", meshes.random_plate(200, seed=3, size=40.0), flat, 10.0),
        Target("flat sheet of two triangles, 400 r", meshes.grid_plate(1, 1, 400.0), flat, 150.0),
        Target("wavy sheet, moved vertices", (np.c_[x, y, wave(x, y)], halves), wave, 5.0),
        Target("box", (vertices, sides)),
        Target("plate of 0.2 r", (vertices * [3.0, 3.0, 0.05], sides)),
        Target("tetrahedron of r / 2", (small[0], small[1].astype(np.int32))),
        Target("torus, moved vertices", (ring.vertices, ring.triangles)),
    ]


@dataclass(frozen=True)
class Flight:
    """A sphere that flies straight at a target in the world; `dt` [s] of the fixed steps."""

    target: Target
    scene: sp.Scene
    placement: pin.SE3
    radius: float
    start: Array
    velocity: Array
    dt: float

    def run(self, integrator: Any) -> sp.Result:
        """Let it fly there and back, for three steps at least."""
        duration = max(3 * self.dt, 12 * self.radius / float(np.linalg.norm(self.velocity)))
        return sp.Simulation(self.scene, integrator).run(self.start, self.velocity, duration)

    def sides(self, centers: Array) -> NDArray[np.int64]:
        """Return the sides of centers (n, 3) in the world."""
        turn, shift = self.placement.rotation, self.placement.translation
        return self.target.sides((centers - shift) @ turn / self.radius)


def drawn(rng: np.random.Generator, target: Target) -> Flight:
    """Return a flight at a target that is turned at random, under a law that can stop it."""
    radius, speed = 10 ** rng.uniform(-4, np.log10(0.05)), 10 ** rng.uniform(0, 3)
    vertices, elements = target.mesh
    shell = sp.Shell(radius * vertices, elements, name=target.name)
    turn = meshes.random_rotation(int(rng.integers(2**31)))
    placement = pin.SE3(turn, radius * rng.uniform(-5, 5, 3))
    while True:
        place, away = target.aim(rng)
        start = radius * (place + rng.uniform(1.05, 5.0) * away)
        if abs(shell.closest_points([start], method="facets").distances[0]) > 1.01 * radius:
            break
    mass = rng.uniform(1000, 8000) * 4 / 3 * np.pi * radius**3
    law = law_for(rng, mass, speed, STOPPED_AT * radius)
    mu, friction = rng.uniform(0.1, 0.8), None
    if rng.random() < 2 / 3:
        friction = sp.BristleFriction(
            mu, 0.8 * mu, law.normal_stiffness(STOPPED_AT * radius), v_stribeck=0.01 * speed
        )
    model = models.empty(gravity=0.0)
    inertia = pin.Inertia.FromSphere(mass, radius)
    models.add_body(model, "ball", pin.JointModelTranslation(), inertia=inertia)
    scene = sp.Scene(model)
    scene.add_contact(
        sp.Sphere(radius, "ball"), shell, "universe", placement, law, friction, name="impact"
    )
    dt = 10 ** rng.uniform(-4, -2)
    return Flight(target, scene, placement, radius, placement.act(start), turn @ -away * speed, dt)


def law_for(
    rng: np.random.Generator, mass: float, speed: float, depth: float
) -> sp.ImpactLaw | sp.HuntCrossleyLaw:
    """Return an elastic or a damped law that stops the sphere at this depth [m] or earlier."""
    e = float(rng.choice([1.0, 1.5, 2.2]))
    k = 0.5 * (e + 1) * mass * speed**2 / depth ** (e + 1)
    if rng.random() < 0.5:
        return sp.HuntCrossleyLaw(k, e, rng.choice([0.0, rng.uniform(0.1, 1.0)]) / speed)
    return sp.ImpactLaw(k, e, rng.uniform(0.0, 1.0) * mass * speed / depth, 0.2 * depth)


def integrator_of(name: str, dt: float) -> Any:
    """Return the integrator; one of a fixed step with `dt` [s]."""
    return getattr(sp, name)(*(() if name in ("Adaptive", "Implicit") else (dt,)))


def judge(rng: np.random.Generator, name: str, count: int) -> Verdicts:
    """Let so many spheres fly, with the integrator called `name`."""
    lost: dict[str, list[str]] = {"none passes": [], "none flies by untouched": [], "runs end": []}
    gain, depth = [0.0], [0.0]
    for number in range(count):
        one = drawn(rng, targets()[number % len(targets())])
        try:
            result = one.run(integrator_of(name, one.dt))
        except SphshellError:
            lost["runs end"].append(one.target.name)
            continue
        sides = one.sides(np.vstack([one.start, result.q]))
        if not (sides == sides[0]).all():
            lost["none passes"].append(one.target.name)
        if all(event.kind != "touch" for event in result.events):
            lost["none flies by untouched"].append(one.target.name)
        step = min(np.linalg.norm(one.velocity) * one.dt / one.radius, LONGEST) / STOPPED_AT
        share, order = STEP_GAIN.get(name, (0.0, 1))
        energy = result.energy
        more = (energy.kinetic[-1] + energy.elastic[-1]) / energy.kinetic[0] - 1
        gain.append(more / (GAIN + share * step**order))
        depth.append(result.stats.pairs["impact"].max_depth / one.radius)
    tried = f"{name}, {count} impacts"
    for law, names in lost.items():
        yield at_most("fast spheres", tried, f"{law} {' '.join(names[:1])}", len(names), 0)
    yield at_most("fast spheres", tried, "energy gained, of what is allowed", max(gain), 1.0)
    yield at_most("fast spheres", tried, "depth, of the radius", max(depth), 0.5)


INTEGRATORS = (
    "SemiImplicitEuler",
    "RungeKutta4",
    "LinearlyImplicitEuler",
    "Adaptive",
    "Implicit",
)


@case("fast spheres")
def some() -> Verdicts:
    for k, name in enumerate(INTEGRATORS):
        yield from judge(np.random.default_rng([2, k]), name, 14)
