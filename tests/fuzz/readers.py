"""What is done with each damaged file: it is read, and a little is done with what came of it."""

from __future__ import annotations

import warnings
import zlib
from pathlib import Path

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.replay import Replay
from sphshell_pin.study.robot_check.models import load_subject
from sphshell_pin.study.sweep.journal import Journal
from tests.fuzz.tables import HEAD, OUTCOMES


def read(path: Path) -> str:
    """Read the file, by its suffix, as a user would; return "read", or "refused" with an error.

    Whatever else is raised is a fault of the package.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _READERS.get(path.suffix, _read_mesh)(path)
    except SphshellError:
        return "refused"
    return "read"


def _read_mesh(path: Path) -> None:
    shell = sp.Shell.from_file(path, unit=None if path.suffix == ".shl" else "m")
    low, high = shell.box
    for center in (shell.vertices[0], 0.5 * (np.asarray(low) + np.asarray(high))):
        for method in ("smooth", "facets"):
            shell.contacts(center, 0.2 * shell.size, method)


def _read_result(path: Path) -> None:
    result = sp.Result.load(path)
    result.contact_columns()
    if (by := result.sensitivities) is not None:
        assert by.q.shape == (*result.v.shape, len(by.parameters))
    assert result.energy.exchanged >= 0.0 or np.isnan(result.energy.exchanged)
    replay = Replay(result)
    replay.advance(1e-2)
    # Figures take most of the time: a few files are enough.
    if zlib.crc32(path.read_bytes()) % 40 == 0:
        result.plot("map")
        result.plot("path")
        result.plot()


def _read_scenario(path: Path) -> None:
    built = build(path)
    built.scene.contacts(built.q0, built.v0)


def _read_journal(path: Path) -> None:
    journal = Journal(path, HEAD, len(OUTCOMES))
    try:
        for number, outcome in journal.outcomes.items():
            # Damage is noticed: what is read is what was written.
            assert repr(outcome) == repr(OUTCOMES[number]), outcome
    finally:
        journal.close()


def _read_robot(path: Path) -> None:
    fault = None
    for load in (load_subject, robots.load_file):
        try:
            loaded = load(str(path))
        except SphshellError as error:
            fault = error  # the other one has to refuse it, or read it, as well
            continue
        robot = getattr(loaded, "robot", loaded)
        scene = sp.Scene(robot.model, joints=sp.JointComponents.from_model(robot.model))
        pin.forwardKinematics(scene.model, scene.model.createData(), robot.q0)
        robots.end_spheres(robot)
    if fault is not None:
        raise fault


_READERS = {
    ".npz": _read_result,
    ".toml": _read_scenario,
    ".journal": _read_journal,
    ".urdf": _read_robot,
    ".xml": _read_robot,
}
