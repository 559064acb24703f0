"""The example scripts run as they stand, and come to what the books say."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parent.parent / "docs" / "examples"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs an example in an empty folder; returns its names, and checks the files it leaves."""
    monkeypatch.chdir(tmp_path)

    def run_example(name, files):
        names = runpy.run_path(str(EXAMPLES / f"{name}.py"))
        assert {path.name for path in tmp_path.iterdir()} == set(files)
        for path in tmp_path.glob("*.png"):
            assert path.read_bytes().startswith(b"\x89PNG")
        return names

    return run_example


def test_every_example_is_tested():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {
        "01_ball_on_a_surface",
        "02_own_loop",
        "03_parameter_study",
        "04_taxels_on_a_crease",
        "05_circle_with_5_newtons",
        "06_fit_measured_rebounds",
    }


def test_a_ball_on_a_surface(run):
    names = run("01_ball_on_a_surface", ["overview.png", "contact_map.png", "ball.html"])
    result = names["result"]
    # The first flight ends where free fall says.
    assert result.contacts.t[0] == pytest.approx(
        np.sqrt(2 * _height(names) / 9.81), abs=2 * np.diff(result.t).max()
    )
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged


def _height(names):
    """How far the ball falls until it touches the bowl."""
    x, y, z = names["q0"][:3]
    gaps = np.linspace(0.0, z, 2001)
    depth, _ = names["bowl"].contacts_batch(
        np.column_stack((np.full(2001, x), np.full(2001, y), z - gaps)), np.full(2001, 0.012)
    )
    return float(gaps[np.argmax(depth > 0.0)])


def test_a_loop_of_ones_own(run):
    names = run("02_own_loop", ["own_loop.png"])
    assert names["difference"] < 1e-12
    assert names["force"][-1] > 1.0


def test_a_parameter_study(run):
    names = run("03_parameter_study", ["friction.png", "stiffness.png"])
    mu, mass, k = names["coefficients"], names["mass"], names["stiffnesses"]
    np.testing.assert_allclose(names["times"], 2.0 / (7.0 * mu * 9.81), rtol=0.01)
    np.testing.assert_allclose(names["speeds"], 5.0 / 7.0, rtol=1e-3)
    peaks = [one.peak_force for one in names["study"]]
    np.testing.assert_allclose(peaks, np.sqrt(k * mass), rtol=0.03)
    durations = [one.contact_time for one in names["study"]]
    np.testing.assert_allclose(durations, np.pi * np.sqrt(mass / k), rtol=0.03)


def test_taxels_on_a_crease(run):
    names = run("04_taxels_on_a_crease", ["taxels.npz", "taxels.png"])
    force = names["pressed"].max()
    assert np.abs(names["felt"] - names["pressed"]).max() < 1e-12 * force
    assert np.abs(names["images"].outside).max() < 1e-12 * force
    assert len(names["two"]) > 10


def test_a_circle_with_5_newtons(run):
    pytest.importorskip("crocoddyl")
    names = run("05_circle_with_5_newtons", ["circle.png"])
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


def test_a_fit_of_measured_rebounds(run):
    files = ["alumina.urdf", "rebound.toml", "rebound.fitted.toml", "fit.png"]
    found = run("06_fit_measured_rebounds", files)["found"]
    friction, young = found.parameters
    assert found.determined
    # The coefficient that the authors found from the same impacts, the modulus of handbooks.
    assert friction.low < 0.092 < friction.high
    assert young.low < 70e9 < young.high
    assert len(found.series) == 20
