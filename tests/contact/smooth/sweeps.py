"""Sweeps of a sphere of radius one over every kind of joint, and what must not jump along them."""

from functools import partial
from itertools import pairwise

import numpy as np

from tests.contact.helpers import energy, force_sum
from tests.contact.walks import borders, steepest
from tests.oracle.pieces import potential_and_force

DEPTHS = (0.04, 0.004, 0.0004)
# Two centres this far apart are on two sides of a border of regions.
WIDTH = 1e-11
# A jump is a change by more than this share of the force.
LIMIT = 1e-6
UP = np.array([0.0, 0.0, 1.0])


def query(shell, center):
    return shell.contacts(center, 1.0, method="smooth")


def segment(start, end, nodes: int):
    """Centres (nodes, 3) along a straight line."""
    return start + np.linspace(0, 1, nodes)[:, None] * (np.asarray(end) - start)


def about(axis, center, angles):
    """`center` turned about an axis through the origin by `angles`: (n, 3)."""
    along = center @ axis * axis
    east = center - along
    return along + np.outer(np.cos(angles), east) + np.outer(np.sin(angles), np.cross(axis, east))


def sweep(shell, path):
    """Pairs of centres WIDTH apart where the force may jump: wherever the features change, and,
    lest it jump where they do not, in the step of the path over which it changes most."""
    find = partial(query, shell)
    pairs = [pair for ends in pairwise(path) for pair in borders(find, *ends, WIDTH)]

    def force(center):
        return force_sum(query(shell, center))

    k = np.linalg.norm(np.diff([force(c) for c in path], axis=0), axis=1).argmax()
    return [*pairs, steepest(force, path[k], path[k + 1], WIDTH)[:2]]


def changes(shell, pairs, depth: float):
    """Change of the force, and of the potential, within each pair: (n, 2), of their sizes."""
    found = []
    for pair in pairs:
        before, after = (query(shell, center) for center in pair)
        forces = force_sum(before), force_sum(after)
        energies = energy(before), energy(after)
        size = max(*(np.linalg.norm(f) for f in forces), depth**1.5)
        jump = np.linalg.norm(forces[1] - forces[0]) / size
        found.append((jump, abs(energies[1] - energies[0]) / max(*energies, depth**2.5)))
    return np.array(found)


def assert_continuous(shell, paths, depth: float, least: int = 1, limit: float = LIMIT):
    """Neither the force nor the potential jumps along any of the paths."""
    worst, seen = (0.0, None), 0
    for path in paths:
        pairs = sweep(shell, path)
        seen += len(pairs) - 1
        found = zip(changes(shell, pairs, depth), pairs, strict=True)
        for (force, potential), (before, _) in found:
            worst = max(worst, (float(max(force, potential)), before.tolist()), key=lambda w: w[0])
    assert seen >= least
    assert worst[0] <= limit, worst


def assert_as_defined(shell, places, depth: float) -> None:
    """Force and potential are those of the pieces of surface inside the sphere."""
    for center in places:
        found = query(shell, center)
        exact, force = potential_and_force(shell.vertices, shell.triangles, center, 1.0)
        assert abs(energy(found) - exact) <= 1e-6 * max(exact, depth**2.5), center.tolist()
        size = max(np.linalg.norm(force), depth**1.5)
        assert np.linalg.norm(force_sum(found) - force) <= LIMIT * size, center.tolist()
