"""Small scenario files for the tests, and runs of them without pictures."""

import re
from pathlib import Path
from unittest.mock import patch

import numpy as np

from sphshell_pin.scenario import judge
from sphshell_pin.scenario.running.run import simulate
from tests import urdf
from tests.models import pose_of
from tests.texts import text_of

DROP, FINGER, EGG, HAND, TIP_AT, TWO_BALLS = (
    text_of(f"scenarios/{name}.toml")
    for name in ("drop", "finger", "egg", "hand", "tip_at", "two_balls")
)
SENSORS = DROP + text_of("scenarios/sensors.toml")


def write(folder: Path, text: str = DROP, name: str = "drop.toml") -> Path:
    """Write a scenario file and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def run_well(built):
    """Run a scenario; it comes to its end, and to all figures that it expects."""
    result, stopped = simulate(built)
    assert stopped is None
    missed = [one for one in judge(built, result) if not one.met]
    assert [(one.figure, one.measured, one.expected) for one in missed] == []
    return result


def center_of(built, q):
    """Return the center (3,) [m] of the only pair's sphere at q (nq,), in its shell's frame."""
    (pair,) = built.scene.pairs
    pose = pose_of(built.scene.model, q, pair.side_i.sphere.frame)
    return pair.side_j.placement.actInv(pose.act(np.array(pair.side_i.sphere.offset)))


def without_pictures():
    """Return a context in which runs draw nothing: that takes longer than all the rest of them."""
    return patch("sphshell_pin.plot.save_figures", lambda *_, **__: [])


AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def arm_urdf(folder: Path, axes: str = "zyyzyz") -> Path:
    """Write an arm of links of 0.2 m that stands straight up at zero; return its URDF file."""
    parts = [urdf.link("base")]
    for k, axis in enumerate(axes):
        mass, ends = 2.0 / (k + 1), (f"link_{k - 1}" if k else "base", f"link_{k}")
        inertial = urdf.inertial(mass, mass / 250).replace("<mass", '<origin xyz="0 0 0.1"/><mass')
        inertial = re.sub('izz="[^"]*', f'izz="{mass / 900}', inertial)
        at = "0 0 0.2" if k else "0 0 0"
        joint = urdf.joint(f"joint_{k}", "revolute", *ends, at=at, axis=AXES[axis])
        limit = 'lower="-2.8" upper="2.8" effort="60" velocity="3"'
        parts += [urdf.link(ends[1], inertial), re.sub("lower=.*(?=/></joint>)", limit, joint)]
    return urdf.write(folder / "arm.urdf", *parts)
