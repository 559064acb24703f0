"""Walks of a sphere over a surface: where its elastic potential jumps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sphshell_pin import Shell

NUMBERS = {"facets": 0, "smooth": 2}
# Two centres this share of the radius apart are on two sides of a border of regions.
WIDTH = 1e-12


@dataclass
class State:
    """What a sphere meets: its potential (law depth^1.5), the sizes of the forces, and the terms
    by element, feature and weight."""

    energy: float
    size: float
    label: list[tuple[int, int, float]]
    point: np.ndarray


def state(shell: Shell, method: str, center: np.ndarray, radius: float) -> State:
    shown, terms = shell.core_for(method).contacts(center, radius, NUMBERS[method])
    point, _, depth, element, feature, weight, _ = shown if terms is None else terms
    share = depth / radius
    label = sorted(zip(element.tolist(), feature.tolist(), weight.tolist(), strict=True))
    energy = float(weight @ share**2.5) / 2.5
    return State(energy, float(np.abs(weight) @ share**1.5), label, point)


def jumps(shell, method, path, radius=1.0, limit=1e-9):
    """Places where the potential jumps by more than `limit` of itself, with the share by which it
    does, and the states on both sides."""
    found = []
    for first, end in pairwise(path):
        last = state(shell, method, end, radius)
        start, here = first, state(shell, method, first, radius)
        for _ in range(60):  # every border between the two
            if here.label == last.label:
                break
            low, high, before, after = start, end, here, last
            while np.linalg.norm(high - low) > WIDTH * radius:
                middle = (low + high) / 2
                if (middle == low).all() or (middle == high).all():
                    break
                between = state(shell, method, middle, radius)
                if between.label == here.label:
                    low, before = middle, between
                else:
                    high, after = middle, between
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
