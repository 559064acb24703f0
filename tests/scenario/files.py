"""Small scenario files for the tests, and runs of them without pictures."""

from pathlib import Path
from unittest.mock import patch

import numpy as np

from sphshell_pin.scenario import judge
from sphshell_pin.scenario.running.run import simulate
from tests.models import pose_of

DROP = """
title = "a ball falls on a box"

[robot]
name = "ball"
start = { root_joint = [0.01, 0.02, 0.0125, 0, 0, 0, 1] }

[[shell]]
name = "plate"
primitive = { type = "box", size = [0.2, 0.2, 0.02] }
placement = { xyz = [0, 0, -0.01] }

[[contact]]
name = "ball-plate"
sphere = { frame = "ball", radius = 0.012 }
shell = "plate"
law = { type = "impact", stiffness = 1e6, exponent = 1.5, damping = 20.0 }

[run]
duration = 0.05
dt = 1e-4
"""

FINGER = """
title = "a finger bends over a plate"

[robot]
name = "three_link_finger"
start = { knuckle = 0.3, middle_joint = 0.6, distal_joint = 0.5 }

[[shell]]
name = "plate"
primitive = { type = "box", size = [0.4, 0.4, 0.02] }
placement = { xyz = [0.0, 0.0, -0.3] }

[[contact]]
name = "tip-plate"
sphere = { frame = "tip", radius = 0.01 }
shell = "plate"
law = { type = "impact", stiffness = 1e6, exponent = 1.5, damping = 20.0 }

[controller]
type = "joint-pd"
kp = 0.05
kd = 0.004
q_ref = { knuckle = 0.6 }

[[sensor]]
name = "wrist"
type = "force-torque"
frame = "tip"
rate = 300
delay = 2e-3

[run]
duration = 0.1
dt = 2e-4
record_dt = 5e-3
record = ["torque"]
"""


def write(folder: Path, text: str = DROP, name: str = "drop.toml") -> Path:
    """Write a scenario file and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def run_well(built):
    """Run a scenario; it comes to its end, and to all figures that it expects."""
    result, stopped = simulate(built)
    assert stopped is None
    assert [one.figure for one in judge(built, result) if not one.met] == []
    return result


def center_of(built, q):
    """Return the center (3,) [m] of the only pair's sphere at q (nq,), in its shell's frame."""
    (pair,) = built.scene.pairs
    pose = pose_of(built.scene.model, q, pair.side_i.sphere.frame)
    return pair.side_j.placement.actInv(pose.act(np.array(pair.side_i.sphere.offset)))


def without_pictures():
    """Return a context in which runs draw nothing: that takes longer than all the rest of them."""
    return patch("sphshell_pin.plot.save_figures", lambda *_, **__: [])
