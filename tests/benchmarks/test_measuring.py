"""Workers, choices of settings, tables and files."""

import math
import os

import pytest

from benchmarks import processes
from benchmarks.peers import measuring, section, workers
from benchmarks.peers.measuring import Ratio, Row, as_good_as, best_of, compared


def row(engine, period, energy, cost, **more):
    errors = {"period": period, "energy": energy}
    return Row(
        "bowl", engine, params={"dt": 1e-3}, errors=errors, unit="CPU s / s", cost=cost, **more
    )


def test_the_best_of_a_peer_is_met_by_the_cheapest_of_ours_that_is_as_good():
    peers = [row("mujoco", 1e-3, 1e-2, 0.1), row("mujoco", 5e-4, 3e-3, 2.0)]
    peers.append(row("mujoco", 5.2e-4, 3.1e-3, 0.5))  # as good within a tenth, and cheaper
    ours = [row("ours", 1e-4, 4e-3, 0.001), row("ours", 4e-4, 2e-3, 0.02)]
    ours.append(row("ours", 1e-6, 1e-6, 0.05))
    assert best_of(peers) is peers[2]
    assert not as_good_as(ours[0], peers[2])
    assert compared(peers + ours, "bowl", "mujoco") == (peers[2], ours[1])
    assert compared(peers + ours[:1], "bowl", "mujoco") is None
    assert compared(ours, "bowl", "mujoco") is None


def test_a_setting_that_does_not_press_is_not_compared():
    def press(engine, pressed, cost):
        return Row("press", engine, errors={"pressed [mm]": pressed}, cost=cost)

    rows = [press("drake", -0.1, 1.0), press("drake", 0.4, 9.0), press("ours", 0.4, 2.0)]
    assert compared(rows, "press", "drake") == (rows[1], rows[2])


def test_rows_come_from_a_process_of_its_own():
    told = []
    rows, ratios = measuring.measure(["ours"], ["plate"], quick=True, say=told.append)
    assert ratios == []
    assert len(told) >= 2
    assert not rows[0].note
    assert rows[0].errors["depth"] < 1e-10
    assert rows[0].low <= rows[0].cost <= rows[0].high


def test_a_lost_process_is_reported_and_starts_anew():
    worker = workers.Worker("ours")
    try:
        with pytest.raises(workers.NoAnswer, match="took longer than 0 s"):
            worker.run("plate", {"integrator": "Adaptive"}, 0, timeout=0.0)
        assert worker.facts("plate")["param_sets"]
        with pytest.raises(workers.NoAnswer, match="AttributeError"):
            worker.run("plate", {"integrator": "None"}, 0, timeout=60.0)
        with pytest.raises(processes.ProcessLost, match="crashed"):
            worker._process.call(60.0, os._exit, 3)
        assert worker.facts("plate")["version"].startswith("sphshell_pin")
    finally:
        worker.close()


def test_the_page_has_every_scene_and_ratio():
    rows = [row("mujoco", 1e-3, math.nan, math.nan, note="diverged"), row("ours", 1e-6, 1e-5, 0.01)]
    ratios = [Ratio("swing", rows[0], rows[1], 100.0, 90.0, 110.0)]
    _, ratio, scene, _ = section.site_sections(rows, ratios)
    assert list(ratio.table[1])[:5] == ["swing", "MuJoCo", "100", "90", "110"]
    assert scene.title == "Ball swings in a bowl without friction, triangles of 0.3 radii"
    assert list(scene.table[1]) == ["MuJoCo", "dt 0.001", "0.001", *4 * "-", "diverged"]
