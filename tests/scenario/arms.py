"""A scenario with an arm of two hinges and a controller, for tests of what moves it."""

import shutil
from pathlib import Path

from tests.texts import DATA

SCENARIO = """
title = "an arm"

[robot]
urdf = "arm.urdf"
start = {{ shoulder = 0.4, elbow = 0.5 }}

{controller}

[run]
duration = 1.0
dt = 1e-3
integrator = "semi-implicit-euler"
"""
PD = '[controller]\ntype = "joint-pd"\nkp = 60.0\nkd = 8.0\n'


def write_arm(folder: Path, controller: str = PD) -> Path:
    """Write the scenario with its URDF and return its path."""
    shutil.copy(DATA / "robots" / "two_hinges.urdf", folder / "arm.urdf")
    path = folder / "arm.toml"
    path.write_text(SCENARIO.format(controller=controller), encoding="utf-8")
    return path
