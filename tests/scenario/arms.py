"""A scenario with an arm of two hinges and a controller, for tests of what moves it."""

import shutil
from pathlib import Path

from tests.scenario.files import write
from tests.texts import DATA, text_of

PD = '[controller]\ntype = "joint-pd"\nkp = 60.0\nkd = 8.0\n'


def write_arm(folder: Path, controller: str = PD) -> Path:
    """Write the scenario with its URDF and return its path."""
    shutil.copy(DATA / "robots" / "two_hinges.urdf", folder / "arm.urdf")
    text = text_of("scenarios/two_hinges.toml").replace("# CONTROLLER", controller)
    return write(folder, text, "arm.toml")
