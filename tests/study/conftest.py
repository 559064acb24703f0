"""What several tests of studies use."""

import pytest

from sphshell_pin.benchmarks.fitting import SCENARIO


@pytest.fixture
def bounce(tmp_path):
    path = tmp_path / "bounce.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path
