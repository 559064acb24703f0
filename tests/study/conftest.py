"""What several tests of studies use."""

import pytest


@pytest.fixture
def bounce(tmp_path):
    """The file of a scenario whose ball bounces, for fits."""
    from tests.study.fitted_sets import SCENARIO

    path = tmp_path / "bounce.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path
