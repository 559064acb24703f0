"""The examples run as notebooks, and come to what the books say.

Each is made a notebook and executed; what it comes to is checked in its own kernel, by the function
`check_NAME` of this module.
"""

import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tests.programs import module_of
from tests.studies import mostly_studies
from tests.texts import text_of

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "docs" / "examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.py"))
TOLD = tomllib.loads(text_of("examples.toml"))
LONG = [f"0{k}_" for k in (3, 5, 6, 9)]


@pytest.fixture(scope="module")
def notebooks():
    """docs/site/notebooks.py, which is no part of a package."""
    for package in ("nbclient", "ipykernel"):
        pytest.importorskip(package)
    return module_of(ROOT / "docs/site/notebooks.py")


@pytest.mark.parametrize("name", mostly_studies(NAMES, lambda name: name[:3] not in LONG))
def test_an_example_comes_to_what_it_should(notebooks, name, tmp_path):
    pytest.importorskip(TOLD[name].get("needs", "numpy"))
    notebook = notebooks.notebook_of(EXAMPLES / f"{name}.py")
    check = f"check_{name[3:]}"
    cell = f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n"
    cell += f"from tests.test_examples import {check}\n{check}(globals())"
    notebook.cells.append(type(notebook.cells[-1])(notebook.cells[-1], source=cell, id="check"))
    done = notebooks.execute(notebook, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(TOLD[name]["files"])
    for path in tmp_path.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
    outputs = [output for one in done.cells for output in one.get("outputs", [])]
    assert [one.get("text") for one in outputs if one.get("name") == "stderr"] == []
    assert any("image/png" in one.get("data", {}) for one in outputs)
    texts = [one.get("data", {}).get("text/plain", "") for one in outputs]
    assert " at 0x" not in " ".join(texts)
    for title in TOLD[name].get("shows", []):
        assert any(text.startswith(f"<{title}") for text in texts), title
    done.cells.pop()
    text, files = notebooks.page_of(done, name)
    assert text.startswith("# ")
    assert all(stem in text for stem in files)
    assert "srcdoc" not in text  # a recording is a file of its own


def test_every_example_is_tested():
    assert set(TOLD) == set(NAMES)


def check_link_of_spheres(names):
    """No sphere reaches beyond the mesh, and they fill it."""
    shell, centers, radii = names["shell"], names["centers"], names["radii"]
    distances = shell.closest_points(centers, method="facets").distances
    assert (radii <= -distances + 1e-12).all()
    assert len(radii) == 32
    assert names["farthest"] < 0.012
    assert len(names["scene"].pairs) == 32


def check_ball_on_a_surface(names):
    """The first flight ends where free fall says."""
    result, (x, y, z) = names["result"], names["q0"][:3]
    gaps = np.linspace(0.0, z, 2001)
    centers = np.column_stack((np.full(2001, x), np.full(2001, y), z - gaps))
    depth, _ = names["bowl"].contacts_batch(centers, np.full(2001, 0.012))
    falls = np.sqrt(2 * gaps[np.argmax(depth > 0.0)] / 9.81)
    assert result.contacts.t[0] == pytest.approx(falls, abs=2 * np.diff(result.t).max())
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged


def check_own_loop(names):
    assert names["difference"] < 1e-12
    assert names["force"][-1] > 1.0


def check_parameter_study(names):
    mu, mass, k = names["coefficients"], names["mass"], names["stiffnesses"]
    np.testing.assert_allclose(names["times"], 2.0 / (7.0 * mu * 9.81), rtol=0.01)
    np.testing.assert_allclose(names["speeds"], 5.0 / 7.0, rtol=1e-3)
    peaks = [one.peak_force for one in names["study"]]
    np.testing.assert_allclose(peaks, np.sqrt(k * mass), rtol=0.03)
    durations = [one.contact_time for one in names["study"]]
    np.testing.assert_allclose(durations, np.pi * np.sqrt(mass / k), rtol=0.03)


def check_taxels_on_a_crease(names):
    force = names["pressed"].max()
    assert np.abs(names["felt"] - names["pressed"]).max() < 1e-12 * force
    assert np.abs(names["images"].outside).max() < 1e-12 * force
    assert len(names["two"]) > 10


def check_circle_with_5_newtons(names):
    assert names["converged"]
    planned, model = names["planned"][:, : names["model"].nq], names["model"]
    replays = names["replays"]
    # The optimizer's steps are those of the simulation.
    np.testing.assert_allclose(replays["runge-kutta-4"].q, planned, rtol=0, atol=1e-11)
    for kind, result in replays.items():
        assert len(result.contacts.t) == len(result.t), kind
        assert np.abs(names["forces"][kind] - 5.0).max() < 0.05, kind
    data, hand = model.createData(), names["hand"]
    for q, center in zip(replays["adaptive"].q, names["centers"], strict=True):
        pin.framesForwardKinematics(model, data, q)
        assert np.linalg.norm(data.oMf[hand].translation - center) < 1e-3


def check_fit_measured_rebounds(names):
    found = names["found"]
    friction, young = found.parameters
    assert found.determined
    # The coefficient that the authors found from the same impacts, the modulus of handbooks.
    assert friction.low < 0.092 < friction.high
    assert young.low < 70e9 < young.high
    assert len(found.series) == 20


def check_peg_in_mujoco(names):
    assert names["measured"] == pytest.approx(names["along"], rel=1e-3)
    # The hull pushes the peg out of the bore; in the shell it slides through.
    assert names["hull"][1][-1] > names["radius"] * 0.9
    assert names["round_bore"][1].min() < -names["depth"]


def check_gripper_with_loops(names):
    assert max(names["gaps"]) < 1e-8
    assert names["forces"][-1] == pytest.approx(names["expected"], rel=1e-3)
    # The part is held: it does not creep.
    assert np.ptp(names["heights"][3900:]) < 1e-7


def check_wear_of_a_polished_part(names):
    assert names["mean"] == pytest.approx(1e-12 * 8.0 / 2.0246e-3, rel=0.04)
    assert (names["depth"][names["raster"]] > 0.5 * names["mean"]).all()
