"""A finished run is played again: from its file, in the scene that it came from."""

import dataclasses
import json

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ResultError
from sphshell_pin.scenario import build, run_built
from sphshell_pin.scenario.running.replay import Replay
from tests import models
from tests.scenario.files import DROP, without_pictures, write

pytestmark = pytest.mark.usefixtures("no_pictures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scenario and the results of a changed run of it."""
    home = tmp_path_factory.mktemp("drop")
    changes = {"contact.ball-plate.sphere.radius": "0.011", "run.record_dt": "1e-3"}
    with without_pictures():
        run_built(build(write(home), changes), home / "out", recording=False)
    return home


@pytest.fixture
def replay(folder):
    return Replay(folder / "out" / "run.npz")


def test_a_shipped_scenario_is_found_by_its_name(tmp_path):
    built = build("sphere_on_shell", {"run.duration": "0.01"})
    report = run_built(built, tmp_path, recording=False)
    assert report.result.origin.scenario == "sphere_on_shell"
    assert Replay(tmp_path / "run.npz").visual_model is not None
    lost = dataclasses.replace(report.result.origin, keep=None)
    with pytest.raises(ResultError, match=r"without its robots .* its scene can be given"):
        Replay(dataclasses.replace(report.result, origin=lost))


def test_a_file_of_an_older_version_loads(folder, tmp_path):
    with np.load(folder / "out" / "run.npz") as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]))
    del header["origin"]
    np.savez(tmp_path / "old.npz", **(arrays | {"header": np.array(json.dumps(header))}))
    assert sp.Result.load(tmp_path / "old.npz").origin is None
    with pytest.raises(ResultError, match=r"old.npz: does not say .* its scene can be given"):
        Replay(tmp_path / "old.npz")


def test_a_scene_of_another_robot_or_other_contacts_is_refused(folder, tmp_path):
    result = sp.Result.load(folder / "out" / "run.npz")
    with pytest.raises(ResultError, match=r"had nq = 7, nv = 6, that .* has nq"):
        result.view(build("fingertip_on_blade").scene)
    other = write(tmp_path, DROP.replace("ball-plate", "ball-table"))
    with pytest.raises(ResultError, match="were ball-plate, the scene has ball-table"):
        result.view(build(other).scene)


def test_a_scene_of_ones_own_is_played_where_it_ran():
    scene = models.on_plate(models.slider(), sp.ImpactLaw(1e5, 1.5, 10.0, 1e-3), radius=0.1)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(np.array([0.12]), duration=0.1)
    replay = Replay(result)
    assert replay.scene is scene
    with pytest.raises(ResultError, match="does not say"):
        Replay(dataclasses.replace(result, scene=None))


def test_elements_that_the_surface_does_not_have_are_refused(folder):
    result = sp.Result.load(folder / "out" / "run.npz")
    log = dataclasses.replace(result.contacts, element=result.contacts.element + 1000)
    with pytest.raises(ResultError, match=r"touched element 10\d\d, but its shell has 6 elements"):
        Replay(dataclasses.replace(result, contacts=log))
