"""Fast spheres at thin sheets.

Ten thousand spheres of 0.1 to 50 mm fly at 1 to 1000 m/s at thin sheets, meshes and bodies; the
steps are 0.1 to 10 ms, so that a step may be 1e5 radii long. The law can stop the sphere at
0.3 r. Whether a center went through is decided from rows, events and triangles alone: at the rows
and where it lifted off, the triangles over and under it say on which side it is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.study.report.surfaces import torus
from sphshell_pin.testing.found import crossed, distances
from tests import meshes, models
from tests.contact.helpers import directions
from tests.contact.smooth.surfaces import wavy_mesh
from tests.hard_cases.verdict import Verdicts, at_most, case
from tests.rolling import turned
from tests.shell.surfaces import tetrahedron

STOPPED_AT = 0.3  # depth at which the law has taken up all of the sphere's energy [radii]
# Energy that may be gained: this share, and with explicit fixed steps besides a (step / depth)^b,
# as the sphere flies into the sheet for up to a step before a force acts on it. A step longer than
# r / 4 is cut.
GAIN, LONGEST = 1e-3, 0.25
STEP_GAIN = {"SemiImplicitEuler": (2.0, 1), "RungeKutta4": (0.5, 2)}
BOX, TUBE = 4.0, 3.0
Draw = Callable[[np.random.Generator], Array]


@dataclass(frozen=True)
class Target:
    """A surface for a sphere of radius one: `thin` ones have a lower and an upper side.

    `interior` draws a place that the sphere fits into.
    """

    name: str
    mesh: tuple[Array, Array]
    thin: bool = True
    interior: Draw | None = None

    def side(self, center: Array) -> int:
        """Count the triangles below, less those above of a thin one; of a body, inside is one."""
        corners, far = self.mesh[0][self.mesh[1]], np.array([0.0, 0.0, 1e3])
        below, above = (len(crossed(center, center + far * s, corners)) for s in (-1, 1))
        return below - above if self.thin else below % 2

    def aim(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """A place, in the middle of a thin one, and the direction of a path to it."""
        vertices, elements = self.mesh
        along = directions(rng)
        if not self.thin:
            return rng.dirichlet(np.ones(3)) @ vertices[rng.choice(elements)], along
        foot = np.array([*rng.uniform(-1, 1, 2), 0.0])
        element = crossed(foot + [0, 0, 50], foot - [0, 0, 50], vertices[elements])[0]
        a, b, c = vertices[elements[element]]
        normal = np.cross(b - a, c - a)
        # Not so flat that it meets the border first.
        while abs(along[2]) < 0.5:
            along = directions(rng)
        return foot + [0, 0, a[2] - (foot - a)[:2] @ normal[:2] / normal[2]], along


def in_torus(rng: np.random.Generator) -> Array:
    along, around = rng.uniform(0, 2 * np.pi, 2)
    out = np.array([np.cos(along), np.sin(along), 0.0])
    off = rng.uniform(0, 0.9) * (TUBE - 1)
    return 2 * TUBE * out + off * (np.cos(around) * out + [0.0, 0.0, np.sin(around)])


def targets() -> list[Target]:
    cube, ring = meshes.cube(BOX), torus(2 * TUBE, TUBE, 1.2)
    return [
        Target("flat sheet", meshes.random_plate(32, seed=3, size=12.0)),
        Target("flat sheet of two triangles, 400 r", meshes.grid_plate(1, 1, 400.0)),
        Target("dome", meshes.dome(8, 10.0, 8.0)),
        Target("bowl", meshes.bowl(8, 5.0, 4.0)),
        Target("wavy sheet, moved vertices", wavy_mesh(0.6)[:2]),
        Target("plate of 0.2 r", (cube[0] * [3.0, 3.0, 0.05], cube[1])),
        Target("box", cube, False, lambda rng: rng.uniform(-0.9, 0.9, 3) * (BOX / 2 - 1)),
        Target("tetrahedron of r / 2", tetrahedron(0.5, at=(-0.125, -0.125, -0.125))[:2], False),
        Target("torus, moved vertices", (ring.vertices, ring.triangles), False, in_torus),
    ]


@dataclass(frozen=True)
class Impact:
    """A sphere that flies straight from `start` [radii] with `speed` [m/s] and touches at `touch`.

    The target's frame is at `placement` in the world; `dt` [s] is that of fixed steps.
    """

    target: Target
    radius: float
    shell: sp.Shell
    placement: pin.SE3
    start: Array
    touch: Array
    speed: float
    dt: float
    law: sp.NormalLaw
    friction: sp.Friction | None
    mass: float
    turn: Array | None
    bounces: int

    @property
    def duration(self) -> float:
        """There and back, and three steps at least [s]."""
        way = np.linalg.norm(self.touch - self.start) + 4 + 8 * self.bounces
        return max(3 * self.dt, way * self.radius / self.speed)

    def run(self, integrator: Any) -> sp.Result:
        """Fly, free or without turning, at a target that stands still."""
        make = models.block if self.turn is None else models.ball
        more = {"radius": self.radius, "placement": self.placement, "name": "impact"}
        model = make(0.0, self.mass, self.radius)
        scene = models.on_shell(model, self.shell, self.law, self.friction, **more)
        q = self.placement.act(self.radius * self.start)
        v = self.placement.rotation @ (self.touch - self.start)
        v *= self.speed / np.linalg.norm(v)
        if self.turn is not None:
            turn = pin.Quaternion(self.turn).matrix()
            q, v = np.concatenate([q, self.turn]), np.concatenate([turn.T @ v, np.zeros(3)])
        return sp.Simulation(scene, integrator).run(q, v, self.duration)

    def passed(self, result: sp.Result, touched: float) -> bool:
        """Whether the center is on the other side, in a row or where it last lifted off."""
        at, v = result.q[:, :3], result.v[-1:, :3]
        if self.turn is not None:
            v = turned(result.q[-1:, 3:], v)
        centers = at[result.t > touched]
        last = max(result.events, key=lambda event: (event.t, event.kind == "touch"))
        if last.kind == "lift_off":
            centers = np.concatenate([centers, at[-1] - (result.t[-1] - last.t) * v])
        first = self.target.side(self.touch)
        local = (centers - self.placement.translation) @ self.placement.rotation / self.radius
        sides = [self.target.side(one) for one in local]
        return any(one * first < 0 if self.target.thin else one != first for one in sides)


def draw(rng: np.random.Generator, groups: int, each: int) -> list[Impact]:
    """Return `groups` times `each` impacts; a group shares target and radius."""
    impacts, every = [], targets()
    for k in range(groups):
        target, radius = every[k % len(every)], 10 ** rng.uniform(-4, np.log10(0.05))
        vertices, elements = target.mesh
        shell = sp.Shell(radius * vertices, elements, name=target.name)
        turn = meshes.random_rotation(int(rng.integers(2**31)))
        placement = pin.SE3(turn, radius * rng.uniform(-5, 5, 3))
        for _ in range(each):
            impacts.append(Impact(target, radius, shell, placement, *flight(rng, target, radius)))
    return impacts


def flight(rng: np.random.Generator, target: Target, radius: float) -> tuple[Any, ...]:
    """Draw the rest of an impact."""
    speed, dt = 10 ** rng.uniform(0, 3), 10 ** rng.uniform(-4, -2)
    inside = target.interior is not None and rng.random() < 0.3
    if inside:
        dt, start, along = min(dt, radius / speed), target.interior(rng), directions(rng)
    else:
        place, along = target.aim(rng)
        off = np.cross(along, directions(rng))
        start = place + rng.uniform(0, 0.8) * off / np.linalg.norm(off) - 30 * along
    touch, corners = start, target.mesh[0][target.mesh[1]]
    # Steps as long as the gap.
    while (gap := distances(touch[None], corners).min() - 1) > 1e-6:
        touch = touch + gap * along
    if not inside:
        ahead = max(rng.uniform(0.05, 4), rng.uniform(-2.5, 2.5) * speed * dt / radius)
        start = touch - ahead * along
    mass = rng.uniform(1000, 8000) * 4 / 3 * np.pi * radius**3
    law, friction = law_of(rng, mass, speed, radius)
    turn = rng.normal(size=4)
    turn = None if rng.random() < 0.5 else turn / np.linalg.norm(turn)
    return start, touch, speed, dt, law, friction, mass, turn, 3 if inside else 0


def law_of(rng: np.random.Generator, mass: float, speed: float, radius: float) -> tuple[Any, Any]:
    """Draw laws of contact and friction that can stop the sphere."""
    e, depth, mu = float(rng.choice([1.0, 1.5, 2.2])), STOPPED_AT * radius, rng.uniform(0.1, 0.8)
    k = 0.5 * (e + 1) * mass * speed**2 / depth ** (e + 1)
    damping = rng.uniform(0.1, 1.0)
    law = (
        sp.ImpactLaw(k, e),
        sp.ImpactLaw(k, e, damping * mass * speed / depth, 0.2 * depth),
        sp.HuntCrossleyLaw(k, e, damping / speed),
    )[rng.integers(3)]
    friction = (
        None,
        sp.CoulombFriction(mu, 0.8 * mu, 0.01 * speed, 0.1 * speed),
        sp.BristleFriction(mu, 0.8 * mu, law.normal_stiffness(depth), v_stribeck=0.01 * speed),
    )[rng.integers(3)]
    return law, friction


def steppers(dt: float) -> dict[str, Any]:
    """Return all integrators; those of a fixed step with `dt` [s]."""
    names = ("SemiImplicitEuler", "RungeKutta4", "LinearlyImplicitEuler")
    known: dict[str, Any] = {name: getattr(sp, name)(dt) for name in names}
    return known | {"Adaptive": sp.Adaptive(), "Implicit": sp.Implicit()}


def judge(impacts: list[Impact], name: str) -> Verdicts:
    """Fly all impacts with the integrator called `name`."""
    passed, lost, broken, gains, depths = [], [], [], [0.0], [0.0]
    for number, impact in enumerate(impacts):
        try:
            result = impact.run(steppers(impact.dt)[name])
        except SphshellError:
            broken.append(number)
            continue
        touched = min((e.t for e in result.events if e.kind == "touch"), default=np.inf)
        if not (np.isfinite(result.q).all() and np.isfinite(result.v).all()):
            broken.append(number)
        elif touched == np.inf:
            lost.append(number)
        elif impact.passed(result, touched):
            passed.append(number)
        energy = result.energy
        gain = (energy.kinetic[-1] + energy.elastic[-1]) / energy.kinetic[0] - 1
        step = min(impact.speed * impact.dt / impact.radius, LONGEST) / STOPPED_AT
        share, order = STEP_GAIN.get(name, (0.0, 1))
        gains.append(gain / (GAIN + share * step**order))
        depths.append(result.stats.pairs["impact"].max_depth / impact.radius)
    tried = f"{name}, {len(impacts)} impacts"
    found = {"none passes": passed, "none flies by untouched": lost}
    for law, wrong in (found | {"every run ends, and finite": broken}).items():
        where = [f" (first: impact {k}, {impacts[k].target.name})" for k in wrong[:1]]
        yield at_most("fast spheres", tried, "".join([law, *where]), len(wrong), 0)
    yield at_most("fast spheres", tried, "energy gained, of what is allowed", max(gains), 1.0)
    yield at_most("fast spheres", tried, "depth, of the radius", max(depths), 0.5)


@case("sides of the targets, to judge by")
def sides() -> Verdicts:
    """The judge must see a center that went through."""
    rng, missed = np.random.default_rng(1), 0
    for target in targets():
        for _ in range(50):
            place, along = target.aim(rng)
            step = (0.5 if target.thin else 1e-3) * along
            before, after = target.side(place - step), target.side(place + step)
            through = before * after < 0 if target.thin else 1 in (before, after)
            missed += not through
    yield at_most("lines", "50 lines through each target", "none is overlooked", missed, 0)


@case("10 000 fast spheres", slow=True)
def many() -> Verdicts:
    """Fly every impact once: the integrators take turns."""
    impacts = draw(np.random.default_rng(1), groups=1120, each=9)
    names = list(steppers(1.0))
    for k, name in enumerate(names):
        yield from judge(impacts[k :: len(names)], name)
