"""What is done with each damaged file: it is read, and a little is done with what came of it."""

import contextlib
import functools
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.base.tables import csv_text
from sphshell_pin.cli.export import with_scene
from sphshell_pin.errors import SphshellError
from sphshell_pin.export.mcap import write_mcap
from sphshell_pin.export.tables import write_tables
from sphshell_pin.patches import TaxelGrid
from sphshell_pin.plot.compare import plot_compare
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.replay import Replay
from sphshell_pin.study.compare import compare, measured, tables_of
from sphshell_pin.study.fit import fit
from sphshell_pin.study.robot_check.models import load_subject
from sphshell_pin.view.recording import render_recording
from tests.fuzz.folders import results_corpus, unpacked
from tests.fuzz.tables import prepare
from tests.scenario.files import write


def read_mesh(path: Path) -> None:
    shell = sp.Shell.from_file(path, unit=None if path.suffix == ".shl" else "m")
    low, high = shell.box
    for center in (shell.vertices[0], 0.5 * (np.asarray(low) + np.asarray(high))):
        for method in ("smooth", "facets"):
            shell.contacts(center, 0.2 * shell.size, method)


def read_result(path: Path) -> None:
    result = sp.Result.load(path)
    result.contact_columns()
    if (by := result.sensitivities) is not None:
        assert by.q.shape == (*result.v.shape, len(by.parameters))
    assert result.energy.exchanged >= 0.0 or np.isnan(result.energy.exchanged)
    Replay(result)
    result.contacts.at_row(0)


def read_scenario(path: Path) -> None:
    built = build(path)
    built.scene.contacts(built.q0, built.v0)


def read_scenario_in(home: Path) -> None:
    read_scenario(home / "law.toml")


def read_robot(path: Path) -> None:
    # Without its meshes the robot may be read where it is refused with them.
    with contextlib.suppress(SphshellError):
        _use(load_subject(path).robot)
    _use(robots.load_file(path))


def _use(robot: robots.LoadedRobot) -> None:
    scene = sp.Scene(robot.model, joints=sp.JointComponents.from_model(robot.model))
    pin.forwardKinematics(scene.model, scene.model.createData(), robot.q0)
    robots.end_spheres(robot)


def in_folder(read: Callable[[Path], None]) -> Callable[[Path], None]:
    """Return what unpacks an archive, and reads the folder with `read`."""
    return functools.partial(_unpack_and_read, read)


def _unpack_and_read(read: Callable[[Path], None], path: Path) -> None:
    # Always another folder: what one package.xml states is kept by its path.
    with tempfile.TemporaryDirectory(dir=path.parent) as place:
        with zipfile.ZipFile(path) as archive:
            archive.extractall(place)
        prepare(Path(place))
        read(Path(place))


def read_robot_in(home: Path) -> None:
    """Read the robot of a folder, with its poses."""
    srdf = home / "robot.srdf"
    more = {"srdf": srdf, "pose": "closed"} if srdf.exists() else {}
    _use(robots.load_file(next(home.glob("robot.[!s]*"), home / "robot.urdf"), [home], **more))


def read_measured(path: Path) -> None:
    """Fit a parameter of a short run to measured data."""
    scenario = write(path.parent, name="short.toml")
    fit(scenario, path, ["contact.ball-plate.law.damping"], changes={"run.duration": "4e-3"})


def read_run(home: Path) -> None:
    """Look at the results in a folder in one of the ways that there are, or two."""
    run, number = home / "run.npz", 0
    with contextlib.suppress(OSError):
        number = zlib.crc32(read_bytes(run, 1e7))
    fault = None
    for way in (LOOKS[0], LOOKS[number % len(LOOKS)]):
        try:
            way(home)
        except SphshellError as error:
            fault = error
    if fault is not None:
        raise fault


look_in = in_folder(read_run)


def _replay(home: Path) -> None:
    replay = Replay(home / "run.npz")
    for row in range(len(replay.result.t)):
        replay.result.contacts.at_row(row)


def _taxels(home: Path) -> None:
    replay = Replay(home / "run.npz")
    TaxelGrid("ball-plate", (8, 8)).images(replay.result, replay.scene).save(home / "taxels.npz")


def _recording(home: Path) -> None:
    replay = Replay(home / "run.npz")
    page = render_recording(replay.result, replay.scene, replay.visual_model, title=replay.title)
    assert page.startswith("<!")


def _compare(home: Path) -> None:
    (home / "whole.npz").write_bytes(unpacked(results_corpus()[0])["run.npz"])
    runs = [measured(name, *with_scene(home / name)) for name in ("run.npz", "whole.npz")]
    for pair in (runs, runs[::-1]):
        differences = compare(pair)
        for table in tables_of(differences).values():
            csv_text(table)
        plot_compare(pair, differences)


def _save(home: Path) -> None:
    """What was read can be saved, and read again."""
    sp.Result.load(sp.Result.load(home / "run.npz").save(home / "again.npz"))


def _export(to: str) -> Callable[[Path], None]:
    def export(home: Path) -> None:
        write_tables(home / to, *with_scene(home), format=to)

    return export


def _mcap(home: Path) -> None:
    replay = Replay(home / "run.npz")
    write_mcap(home / "run.mcap", replay.result, replay.scene)


def _plot(kind: str) -> Callable[[Path], None]:
    return lambda home: sp.Result.load(home / "run.npz").plot(kind)


LOOKS = (
    *(_replay, _mcap, _export("csv"), _export("parquet"), _compare, _recording, _taxels),
    *(_save, *map(_plot, ("overview", "force", "energy", "sensors", "map"))),
)
"""Everything that shows or exports the results in a folder."""
