"""A scene follows a slow sphere from call to call; what it finds is what a fresh query finds."""

import numpy as np
import pytest

from tests.contact.helpers import directions
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.test_sweeps_edges import edged
from tests.models import ball, free_q, linear_law, on_shell


def rows(contacts, point, normal):
    """Contacts as rows, in an order that does not depend on how they were found."""
    table = np.column_stack([contacts.depth, point, normal, contacts.element, contacts.feature])
    return table[np.lexsort(table.T)]


def slow_paths(shell):
    """Centres (n, 3) that move along and across the surface, in and out of touch."""
    rng, t = np.random.default_rng(4), np.arange(120)[:, None]
    for place in shell.vertices[rng.choice(len(shell.vertices), 12)]:
        (normal, along), pace = directions(rng, 2), rng.choice([1e-5, 1e-3, 5e-3])
        yield place + 0.97 * normal + pace * t * along + 0.03 * np.sin(0.1 * t) * normal


@pytest.mark.parametrize("name", ["torus inside", "wavy above", "can", "sheet"])
def test_scene_finds_what_the_shell_finds(name: str) -> None:
    shell = shell_of(name, 0.3) if name in SURFACES else edged(name)
    scene = on_shell(ball(gravity=0.0), shell, linear_law(1000.0), radius=1.0, method="smooth")
    found = 0
    for path in slow_paths(shell):
        for center in path:
            followed = scene.contacts(free_q(center), np.zeros(6))
            fresh = shell.contacts(center, 1.0, method="smooth")
            a = rows(followed, followed.point_world, followed.normal_world)
            b = rows(fresh, fresh.point, fresh.normal)
            assert np.array_equal(a, b), center
            found += len(fresh)
    assert found > 100
