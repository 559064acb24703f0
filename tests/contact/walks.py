"""Walks of a sphere over a surface: where its elastic potential jumps."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sphshell_pin import Shell

# Two centres this share of the radius apart are on two sides of a border of regions.
WIDTH = 1e-12


def narrowed(look, start, end, width: float, goes_left):
    """Two centres `width` apart between two others, and what `look` says of them, by halving:
    goes_left(first, here, last) tells in which half to look on, by what it says of the ends and of
    the middle."""
    first, last = look(start), look(end)
    while np.linalg.norm(end - start) > width:
        middle = (start + end) / 2
        if (middle == start).all() or (middle == end).all():
            break
        here = look(middle)
        if goes_left(first, here, last):
            end, last = middle, here
        else:
            start, first = middle, here
    return start, end, first, last


def steepest(look, start, end, width: float):
    """The same where vectors change most."""

    def goes_left(first, here, last):
        return np.linalg.norm(here - first) > np.linalg.norm(last - here)

    return narrowed(look, start, end, width, goes_left)


@dataclass
class State:
    """What a sphere meets: its potential (law depth^1.5), the sizes of the forces, and the terms
    by element, feature and weight."""

    energy: float
    size: float
    label: list[tuple[int, int, float]]
    point: np.ndarray


def state(shell: Shell, method: str, center: np.ndarray, radius: float) -> State:
    found = shell.contacts(center, radius, method).terms
    share, weight = found.depth / radius, found.weight
    columns = (found.element, found.feature, weight)
    label = sorted(zip(*(column.tolist() for column in columns), strict=True))
    energy = float(weight @ share**2.5) / 2.5
    return State(energy, float(np.abs(weight) @ share**1.5), label, found.point)


def jumps(shell, method, path, radius=1.0, limit=1e-9):
    """Places where the potential jumps by more than `limit` of itself, with the share by which it
    does, and the states on both sides."""
    found = []

    def look(center):
        return state(shell, method, center, radius)

    for first, end in pairwise(path):
        start, here, last = first, look(first), look(end)
        for _ in range(60):  # every border between the two
            if here.label == last.label:
                break
            low, high, before, after = narrowed(
                look, start, end, WIDTH * radius, lambda a, b, _: b.label != a.label
            )
            allowed = max(before.size, after.size) * np.linalg.norm(high - low) / radius
            lost = abs(after.energy - before.energy) - allowed
            if lost > limit * max(before.energy, after.energy):
                found.append((low, lost / max(before.energy, after.energy), before, after))
            start, here = high, after
    return found


def paths(shell, count, steps, radius=1.0, step=0.02, seed=0):
    """Centres (steps, 3) along straight lines: by turns along the surface at some depth, and across
    it in any direction."""
    rng = np.random.default_rng(seed)
    corners = shell.vertices[shell.triangles]
    for k in range(count):
        t = rng.integers(len(corners))
        normal = shell.triangle_normals[t] * rng.choice([-1, 1])
        over = rng.dirichlet([1, 1, 1]) @ corners[t] + rng.uniform(0.3, 1) * radius * normal
        along = rng.normal(size=3)
        if k % 2 == 0:
            along -= along @ normal * normal
        along *= radius * step / np.linalg.norm(along)
        yield over + (np.arange(steps) - steps / 2)[:, None] * along
