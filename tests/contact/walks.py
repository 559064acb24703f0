"""Walks of a sphere over a surface: where its contacts change, and where its potential jumps."""

from functools import partial
from itertools import pairwise

import numpy as np

from sphshell_pin import Shell
from tests.contact.helpers import energy, force_sum

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


def label(contacts) -> list[tuple[int, int, float]]:
    """What the contacts are with: a change of it is the passing of some border."""
    terms = contacts.terms
    columns = (column.tolist() for column in (terms.element, terms.feature, terms.weight))
    return sorted(zip(*columns, strict=True))


def borders(find, start, end, width: float) -> list[list[np.ndarray]]:
    """All places between two centres where what `find` finds changes: pairs `width` apart."""
    found = []
    while len(found) < 60:
        *pair, first, last = narrowed(
            lambda center: label(find(center)), start, end, width, lambda a, b, _: a != b
        )
        if first == last:
            break
        found.append(pair)
        start = pair[1]
    return found


def change(before, after, move) -> tuple[float, float, float]:
    """Potential that the forces do not account for, potential, and largest force times move."""
    v0, v1, f0, f1 = energy(before), energy(after), force_sum(before), force_sum(after)
    size = max(sum(c.terms.depth**1.5) for c in (before, after))
    return abs(v1 - v0 + (f0 + f1) @ move / 2), max(v0, v1), size * float(np.linalg.norm(move))


def jump(before, after, move) -> float:
    """Jump of the potential between two centres that are near each other, as a share of it."""
    lost, potential, most = change(before, after, move)
    return max(lost - most, 0.0) / potential if potential > 0 else 0.0


def jumps(shell, method, path, radius=1.0, limit=1e-9) -> list[tuple[list[float], float]]:
    """Places where the potential of depth^1.5 jumps by more than `limit` of itself, and the share
    by which it does."""
    found, find = [], partial(shell.contacts, radius=radius, method=method)
    for ends in pairwise(path):
        for low, high in borders(find, *ends, WIDTH * radius):
            share = jump(find(low), find(high), high - low)
            if share > limit:
                found.append((low.tolist(), share))
    return found


def paths(shell: Shell, count: int, steps: int, radius: float = 1.0, step=0.02, seed=0):
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
