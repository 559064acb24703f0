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
    shell, rng = shell_of(MESHES[name]), np.random.default_rng(0)
    centers = rng.uniform(-0.6, 0.6, (1500, 3)) * ([1, 1, 0.2] if name != "icosphere" else 1)
    radii = rng.uniform(0.01, 0.12, len(centers))
    single = [shell.contacts(*one, method).depth for one in zip(centers, radii, strict=True)]
    assert 0 < np.count_nonzero([*map(len, single)]) < len(centers)
    for threads in (1, 2, 3, 7, None):
        depth, count = shell.contacts_batch(centers, radii, method=method, threads=threads)
        assert count.tolist() == [*map(len, single)]
        assert depth.tolist() == [one.max(initial=0.0) for one in single]
