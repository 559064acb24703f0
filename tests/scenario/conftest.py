"""What several tests of scenarios use."""

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.scenario.drafting.new import new_scenario
from tests.scenario.files import arm_urdf


@pytest.fixture
def draft(tmp_path):
    """Drafts a scenario into a.toml in the folder of the test, over an earlier one."""

    def made(*arguments, **options):
        return new_scenario(*arguments, out=tmp_path / "a.toml", force=True, **options)

    return made


@pytest.fixture(scope="session")
def arm(tmp_path_factory):
    """The URDF file of an arm that stands straight up."""
    return arm_urdf(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="session")
def plate(tmp_path_factory):
    """The file of a plate that lies above the origin of its coordinates."""
    path = tmp_path_factory.mktemp("plate") / "plate.shl"
    box = sp.Shell.from_geometry(coal.Box(0.3, 0.24, 0.04))
    box.transformed(pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.02]))).to_file(path)
    return path
