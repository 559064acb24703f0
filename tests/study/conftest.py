"""What several tests of studies use."""

import pytest

from tests.export.conftest import finger, table  # noqa: F401


@pytest.fixture
def bounce(tmp_path):
    """The file of a scenario whose ball bounces, for fits."""
    from tests.study.fitted_sets import SCENARIO

    path = tmp_path / "bounce.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    """The file of a scenario whose ball settles on a plate, for sweeps."""
    from tests.study.resting import write

    return write(tmp_path_factory.mktemp("sweep"))
