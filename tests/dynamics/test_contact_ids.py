"""A contact keeps its number over elements and smooth edges, and no other gets it."""

import numpy as np
import pytest

import sphshell_pin as sp
from tests import meshes, models

RADIUS = 0.01


def ball(shell: sp.Shell, start, velocity=None, duration=0.5):
    """Run of a ball without rotation, from `start` (3,)."""
    law = sp.ImpactLaw(1e4, exponent=1.0, damping=2.0)
    scene = models.on_shell(models.block(9.81, 0.05, RADIUS), shell, law, radius=RADIUS)
    run = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4))
    return run.run(start, np.zeros(3) if velocity is None else velocity, duration)


def test_one_number_over_many_elements() -> None:
    vertices, elements = meshes.icosphere(4)
    bowl = sp.Shell(0.04 * vertices, elements, side="inside")
    turn = np.radians(40)
    start = 0.03003 * np.array([np.sin(turn), 0.002, -np.cos(turn)])
    log = ball(bowl, start).contacts
    assert len(np.unique(log.element)) > 10
    ids, counts = np.unique(log.contact_id[log.t > 0.01], return_counts=True)
    assert len(ids) == 1
    assert counts[0] > 4000


@pytest.mark.parametrize("cells", [1, 4])
def test_two_walls_two_numbers(cells: int) -> None:
    vertices, triangles = meshes.v_groove(np.radians(40), size=0.2, cells=cells)
    height = (RADIUS - 3.2e-5) / np.cos(np.radians(40))
    result = ball(sp.Shell(vertices, triangles), [1e-6, -0.05, height], velocity=[0, 0.1, 0])
    log = result.contacts
    left = log.normal_world[:, 0] > 0
    assert len(np.unique(log.contact_id[left & (log.t > 0.05)])) == 1
    assert len(np.unique(log.contact_id[~left & (log.t > 0.05)])) == 1
    assert not set(log.contact_id[left]) & set(log.contact_id[~left])
