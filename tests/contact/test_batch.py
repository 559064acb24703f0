"""Many queries at once are the single ones, bit for bit, for any number of threads."""

import numpy as np
import pytest

from tests import meshes
from tests.contact.helpers import shell_of

MESHES = {
    "plate": meshes.random_plate(2000, seed=1),
    "crumpled": meshes.crumpled(20, seed=1, height=0.03),
    "icosphere": meshes.icosphere(3, radius=0.5),
}


@pytest.mark.parametrize("method", ["facets", "elements"])
@pytest.mark.parametrize("name", MESHES)
def test_equals_single_queries(name: str, method: str) -> None:
    shell = shell_of(MESHES[name])
    rng = np.random.default_rng(0)
    centers = rng.uniform(-0.6, 0.6, (1500, 3)) * ([1, 1, 0.2] if name != "icosphere" else 1)
    radii = rng.uniform(0.01, 0.12, len(centers))
    depth, count = shell.contacts_batch(centers, radii, method=method, threads=1)
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        contacts = shell.contacts(center, radius, method=method)
        assert count[k] == len(contacts)
        assert depth[k] == (contacts.depth.max() if len(contacts) else 0.0)
    assert 0 < np.count_nonzero(count) < len(count)
    for threads in (2, 3, 7, None):
        again = shell.contacts_batch(centers, radii, method=method, threads=threads)
        assert np.array_equal(depth, again[0])
        assert np.array_equal(count, again[1])
