"""The force by the potential, and its derivative by the sphere's position, against differences."""

from functools import partial

import numpy as np
import pytest

from sphshell_pin import ImpactLaw, Shell
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell.contact_set import Feature
from tests import meshes
from tests.contact.helpers import energy, force_sum
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.sweeps import query
from tests.contact.walks import borders, label

LAW = ImpactLaw(2.0, exponent=1.5)


def differences(shell: Shell, center, radius: float, method: str, step: float):
    """Central differences (3, 3) of the force, None where other features take over."""

    def look(move):
        found = shell.contacts(center + move, radius, method=method)
        return found.force(LAW), label(found)

    out, here = np.zeros((3, 3)), look(np.zeros(3))[1]
    for k in range(3):
        ahead, behind = look(step * np.eye(3)[k]), look(-step * np.eye(3)[k])
        if ahead[1] != here or behind[1] != here:
            return None
        out[:, k] = (ahead[0] - behind[0]) / (2 * step)
    return out


def assert_gradient(shell, centers, radius, method="smooth", step=1e-5):
    """All gradients are right; returns the features and weights that were met."""
    met = set()
    for center in centers:
        found = shell.contacts(center, radius, method=method, gradient=True)
        exact = differences(shell, np.asarray(center, dtype=float), radius, method, step)
        if len(found) == 0 or exact is None:
            continue
        gradient = found.force_gradient(LAW)
        assert np.abs(gradient - gradient.T).max() <= 1e-9 * np.abs(gradient).max()
        assert np.abs(gradient - exact).max() <= 2e-6 * np.abs(exact).max(), list(center)
        terms = found.terms
        met |= {(Feature(f), w) for f, w in zip(terms.feature, terms.weight, strict=True)}
    return met


@pytest.mark.parametrize("name", SURFACES)
def test_on_curved_surfaces(name: str) -> None:
    centers, _ = SURFACES[name].probes(60, 0.04, seed=3)
    assert assert_gradient(shell_of(name, 0.6), centers, 1.0) >= {(Feature.FACE, 1.0)}


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_round_a_cube(method: str) -> None:
    rng = np.random.default_rng(1)
    centers = rng.uniform(-1.3, 1.3, (400, 3))
    met = assert_gradient(Shell(*meshes.cube(2.0), side="outside"), centers, 0.4, method)
    assert {feature for feature, _ in met} == {Feature.FACE, Feature.EDGE, Feature.VERTEX}


def test_at_a_saddle() -> None:
    shell = Shell(*meshes.v_groove(np.radians(5), size=8.0, cells=2), crease_angle=0.01)
    x, y, z = np.random.default_rng(3).uniform([-0.1, -1, 0.94], [0.1, 1, 0.99], (60, 3)).T
    met = assert_gradient(shell, np.stack([x, y, z], axis=1), 1.0)
    assert (Feature.EDGE, -1.0) in met


def test_gradient_is_asked_for() -> None:
    shell = shell_of("dome", 0.6)
    with pytest.raises(InvalidParameter, match="gradient=True"):
        shell.contacts([0, 0, 4.9], 1.0).force_gradient(LAW)
    with pytest.raises(InvalidParameter, match="elements"):
        shell.contacts([0, 0, 4.9], 1.0, method="elements", gradient=True)


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
