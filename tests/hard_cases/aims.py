"""Random impacts at the targets: where from, how fast, under which laws."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from tests import meshes, models
from tests.hard_cases.targets import Target, all_targets, borders, sweep

# Depth at which the law has taken up all of the sphere's energy, in radii.
STOPPED_AT = 0.3
# A impact past an edge passes it this much closer than a radius, or beside its own center line.
MARGIN = 1e-3


@dataclass(frozen=True)
class Aim:
    """A target in the world: a surface for one radius [m], turned at random."""

    target: Target
    radius: float
    shell: sp.Shell
    placement: pin.SE3

    @cached_property
    def corners(self) -> Array:
        """Corners of its triangles (m, 3, 3) in the world [m]."""
        vertices, elements = self.target.mesh
        return np.asarray(
            (self.radius * vertices @ self.placement.rotation.T + self.placement.translation)[
                elements
            ]
        )

    def point(self, place: Array) -> Array:
        """Return the world's point of a place in radii in the target's frame."""
        return np.asarray(self.placement.act(self.radius * place))


@dataclass(frozen=True)
class ImpactTest:
    """A sphere that flies straight from `start` [m] with `velocity` [m/s] and touches.

    `approach` [m] to the first touch; `dt` [s] of the steppers with a fixed step; `grazes`: it
    passes an edge at 0.999 r.
    """

    aim: Aim
    start: Array
    velocity: Array
    approach: float
    dt: float
    mass: float
    law: sp.ImpactLaw | sp.HuntCrossleyLaw
    friction: object
    turn: Array | None
    grazes: bool
    bounces: int

    @property
    def speed(self) -> float:
        return float(np.linalg.norm(self.velocity))

    @property
    def duration(self) -> float:
        """There and back, and three steps at least [s]."""
        r = self.aim.radius
        return max(3 * self.dt, (self.approach + (4 + 8 * self.bounces) * r) / self.speed)

    def scene(self) -> sp.Scene:
        """Build the scene: a free or a sliding sphere, and a target that stands still."""
        make, r = (models.block if self.turn is None else models.ball), self.aim.radius
        more = {"radius": r, "placement": self.aim.placement, "name": "impact"}
        model = make(0.0, self.mass, r)
        return models.on_shell(model, self.aim.shell, self.law, self.friction, **more)

    def state(self) -> tuple[Array, Array]:
        """Return q and v at the start."""
        if self.turn is None:
            return self.start, self.velocity
        turn = pin.Quaternion(self.turn).matrix()
        v = np.concatenate([turn.T @ self.velocity, np.zeros(3)])
        return np.concatenate([self.start, self.turn]), v


def draw(rng: np.random.Generator, groups: int, each: int) -> list[ImpactTest]:
    """Return `groups` times `each` impacts; a group shares target and radius."""
    targets = all_targets()
    impacts = []
    for k in range(groups):
        aim = _aim(rng, targets[k % len(targets)])
        impacts += [_impact(rng, aim) for _ in range(each)]
    return impacts


def _aim(rng: np.random.Generator, target: Target) -> Aim:
    radius = 10 ** rng.uniform(-4, np.log10(0.05))
    vertices, elements = target.mesh
    side = "outside" if target.closed and not target.interior and rng.random() < 0.5 else "both"
    shell = sp.Shell(radius * vertices, elements, side=side, name=target.name)
    turn = meshes.random_rotation(int(rng.integers(2**31))) if rng.random() < 0.8 else np.eye(3)
    return Aim(target, radius, shell, pin.SE3(turn, radius * rng.uniform(-5, 5, 3)))


def _unit(rng: np.random.Generator) -> Array:
    u = rng.normal(size=3)
    return np.asarray(u / np.linalg.norm(u))


def _impact(rng: np.random.Generator, aim: Aim) -> ImpactTest:
    r = aim.radius
    speed, dt = 10 ** rng.uniform(0, 3), 10 ** rng.uniform(-4, -2)
    inside = aim.target.interior is not None and rng.random() < 0.3
    grazes = False
    if inside:
        dt = min(dt, r / speed)
        start, along = aim.point(aim.target.interior(rng)), _unit(rng)
        approach = sweep(start, along, r, aim.corners)
    else:
        near, along, grazes = _line(rng, aim)
        far = near - 1e3 * r * along
        touch = sweep(far, along, r, aim.corners)
        approach = r * rng.uniform(0.05, 4)
        if rng.random() < 0.5:
            approach = max(approach, rng.uniform(0.3, 2.5) * speed * dt)
        start = far + (touch - approach) * along
    assert np.isfinite(approach), "a impact that touches nothing"
    mass = rng.uniform(1000, 8000) * 4 / 3 * np.pi * r**3
    law = _law(rng, mass, speed, r)
    q = rng.normal(size=4)
    return ImpactTest(
        aim=aim,
        start=start,
        velocity=speed * along,
        approach=approach,
        dt=dt,
        mass=mass,
        law=law,
        friction=_friction(rng, law, speed, r),
        turn=None if rng.random() < 0.5 else q / np.linalg.norm(q),
        grazes=grazes,
        bounces=3 if inside else 0,
    )


def _line(rng: np.random.Generator, aim: Aim) -> tuple[Array, Array, bool]:
    """Return a point and the direction of a path that touches, and whether it only grazes."""
    vertices, elements = aim.target.mesh
    along = aim.placement.rotation @ _unit(rng)
    kind = rng.random()
    # A bent border lies beside the flat one: there only the nearer impacts are sure to touch.
    curved = aim.target.curved
    if kind < 0.7:
        corners = vertices[elements[rng.integers(len(elements))]]
        at = aim.point(rng.dirichlet(np.ones(3)) @ corners)
        off = np.cross(along, _unit(rng))
        off *= rng.uniform(0, 0.8 if curved else 0.95) * aim.radius / np.linalg.norm(off)
        return at + off, along, False
    sides = borders(elements)
    a, b = vertices[sides[rng.integers(len(sides))]]
    at = aim.point(a + rng.uniform(0.1, 0.9) * (b - a))
    off = np.cross(along, aim.placement.rotation @ (b - a))
    off *= rng.choice([-1, 1]) * aim.radius / np.linalg.norm(off)
    if curved or kind < 0.85:
        return at + MARGIN * off, along, False
    at = at + (1 - MARGIN) * off
    far = at - 1e3 * aim.radius * along
    only = np.isinf(sweep(far, along, (1 - 1.5 * MARGIN) * aim.radius, aim.corners))
    return at, along, bool(only)


def _law(rng, mass, speed, r):
    e = float(rng.choice([1.0, 1.5, 2.2]))
    depth = STOPPED_AT * r
    k = 0.5 * (e + 1) * mass * speed**2 / depth ** (e + 1)
    kind = rng.integers(3)
    if kind == 2:
        return sp.HuntCrossleyLaw(k, e, rng.uniform(0.1, 1.0) / speed)
    damping = rng.uniform(0.1, 1.0) * mass * speed / depth if kind else 0.0
    return sp.ImpactLaw(k, e, damping, 0.2 * depth)


def _friction(rng: np.random.Generator, law: sp.ImpactLaw, speed: float, r: float) -> object:
    kind = rng.integers(3)
    if kind == 0:
        return None
    mu = rng.uniform(0.1, 0.8)
    if kind == 1:
        return sp.CoulombFriction(mu, 0.8 * mu, 0.01 * speed, 0.1 * speed)
    stiffness = law.normal_stiffness(STOPPED_AT * r)
    return sp.BristleFriction(mu, 0.8 * mu, stiffness, v_stribeck=0.01 * speed)
