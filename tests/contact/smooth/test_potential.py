"""The normal force has a potential, and there is one contact however near a border is."""

from functools import partial

import numpy as np
import pytest

from tests.contact.helpers import energy, force_sum
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.sweeps import query
from tests.contact.walks import borders, label

CURVED = ("bowl", "dome", "torus inside", "wavy above", "wavy below")


def crossings(name: str, h: float, depth: float, count: int, width: float, seed: int = 0):
    """`count` pairs of centres `width` apart on two sides of an element's border."""
    shell = shell_of(name, h)
    rng = np.random.default_rng(1000 + seed)
    centers, normals = SURFACES[name].probes(4 * count, depth, seed)
    found = []
    for center, normal in zip(centers, normals, strict=True):
        along = np.cross(normal, rng.normal(size=3))
        end = center + 0.5 * h * along / np.linalg.norm(along)
        found += borders(partial(query, shell), center, end, width)[:1]
        if len(found) == count:
            break
    assert len(found) > count // 2
    return found


def gradient_error(shell, center, step: float) -> float | None:
    """Relative difference of the force and the energy's central differences; None where another
    feature takes over within the step."""
    here = query(shell, center)
    force, slope = force_sum(here), np.zeros(3)
    for k, move in enumerate(step * np.eye(3)):
        ahead, behind = query(shell, center + move), query(shell, center - move)
        if label(ahead) != label(here) or label(behind) != label(here):
            return None
        slope[k] = (energy(ahead) - energy(behind)) / (2 * step)
    return float(np.linalg.norm(force + slope) / np.linalg.norm(force))


@pytest.mark.parametrize("h", [0.6, 0.3])
@pytest.mark.parametrize("name", CURVED)
def test_force_is_minus_the_gradient(name: str, h: float) -> None:
    shell = shell_of(name, h)
    rng = np.random.default_rng(5)
    places = list(SURFACES[name].probes(150, 0.04, seed=5)[0])
    for start, end in crossings(name, h, 0.04, 50, 1e-10, seed=6):
        along = (end - start) / np.linalg.norm(end - start)
        places += [start + s * rng.uniform(0.02, 1) * 1e-3 * h * along for s in (-1.0, 1.0)]
    errors = [gradient_error(shell, place, 2e-6) for place in places]
    known = [e for e in errors if e is not None]
    assert len(known) > 0.9 * len(errors)
    assert max(known) <= 1e-7
