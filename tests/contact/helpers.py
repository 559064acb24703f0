"""What the contact tests share: probe positions, and comparison of contact sets."""

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell

OFFSETS = (0.0, 1e-12, -1e-12, 1e-4, -1e-4, 1.0)


def heights(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Smallest height (t,) of each triangle [m]."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.asarray(doubled / longest)


def positions(vertices, elements, radius, count, seed, heights=(0.0, 0.3, 0.9)):
    """Sphere centres: `count` near random places of the surface, `count` on borders of regions.

    A border position stands over a point of an element's side (or over a corner), at a height (one
    of `heights` times the radius) along the element's normal, moved by one of OFFSETS in the
    element's plane away from that side.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        a, b, c = vertices[rng.choice(elements)[:3]]
        weight = rng.dirichlet([1.0, 1.0, 1.0])
        direction = rng.normal(size=3)
        direction *= rng.uniform(0.0, 1.1 * radius) / np.linalg.norm(direction)
        yield weight @ np.stack([a, b, c]) + direction
    for k in range(count):
        corners = vertices[np.roll(rng.choice(elements)[:3], rng.integers(3))]
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal) * rng.choice([-1.0, 1.0])
        away = np.cross(b - a, np.cross(b - a, c - a))
        away /= np.linalg.norm(away)
        t = rng.choice([0.0, 0.5, 1.0, rng.uniform()])
        height = rng.choice(heights) * radius
        yield a + t * (b - a) + OFFSETS[k % len(OFFSETS)] * away + height * normal


def directions(rng: np.random.Generator, count: int | None = None) -> NDArray[np.float64]:
    """Random unit vectors (count, 3), or one (3,)."""
    out = rng.normal(size=3 if count is None else (count, 3))
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


def difference(a, b, radius: float) -> float:  # type: ignore[no-untyped-def]
    """Largest difference of two sets matched by nearest point; inf if counts differ.

    A normal is known to rounding / distance only: its difference is weighed by distance / radius.
    Where the centre lies on the surface (distance below 1e-9 radius) it is not known at all.
    """
    if len(a) != len(b):
        return float("inf")
    free = list(range(len(b)))
    worst = 0.0
    for k in range(len(a)):
        nearest = min(free, key=lambda i: float(np.linalg.norm(b.point[i] - a.point[k])))
        free.remove(nearest)
        distance = 1.0 - a.depth[k] / radius
        weight = distance if distance > 1e-9 else 0.0
        apart = np.abs(b.point[nearest] - a.point[k]).max()
        turned = np.abs(b.normal[nearest] - a.normal[k]).max() * weight
        worst = max(worst, float(apart), float(turned), float(abs(b.depth[nearest] - a.depth[k])))
    return worst


def force_sum(contacts, exponent: float = 1.5) -> NDArray[np.float64]:  # type: ignore[no-untyped-def]
    """Sum of weight depth^exponent normal over the minima and saddles (stiffness one)."""
    terms = contacts.terms
    push = terms.weight * terms.depth**exponent
    return np.asarray((push[:, None] * terms.normal).sum(axis=0))


def energy(contacts, exponent: float = 1.5) -> float:  # type: ignore[no-untyped-def]
    """Elastic potential of that force: a saddle counts off."""
    terms = contacts.terms
    return float((terms.weight * terms.depth ** (exponent + 1)).sum() / (exponent + 1))


def shell_of(mesh: tuple[NDArray[np.float64], NDArray[np.int32]], **options: object) -> Shell:
    """Shell from a builder's mesh."""
    return Shell(mesh[0], mesh[1], **options)  # type: ignore[arg-type]
