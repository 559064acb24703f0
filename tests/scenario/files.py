"""Small scenario files for the tests, and runs of them without pictures."""

from pathlib import Path
from unittest.mock import patch

import numpy as np

from sphshell_pin.scenario import judge
from sphshell_pin.scenario.running.run import simulate
from tests.models import pose_of
from tests.texts import text_of

DROP = text_of("scenarios/drop.toml")

FINGER = text_of("scenarios/finger.toml")


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
