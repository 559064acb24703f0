"""What several tests of scenarios use."""

import pytest

from sphshell_pin.scenario.drafting.new import new_scenario


@pytest.fixture
def draft(tmp_path):
    """Drafts a scenario into a.toml in the folder of the test, over an earlier one."""

    def made(*arguments, **options):
        return new_scenario(*arguments, out=tmp_path / "a.toml", force=True, **options)

    return made
