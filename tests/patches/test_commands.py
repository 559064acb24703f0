"""Patches and taxels from scenario files and results folders."""

import numpy as np

import sphshell_pin as sp
from tests.command import call, succeed
from tests.scenario.files import DROP, write


def test_a_scenario_writes_patches_and_taxels(tmp_path):
    text = DROP.replace(
        "[run]", 'friction = { type = "coulomb", mu_static = 0.3 }\n[run]\nrecord = ["patch"]'
    ).replace("[robot]", "[robot]\nspeed = { root_joint = [0.2, 0, 0, 0, 0, 0] }")
    out = tmp_path / "out"
    succeed("run", write(tmp_path, text), "--out", out)
    result = sp.Result.load(out / "run.npz")
    assert len(result.patches) == len(result.contacts) > 0
    assert "pressure of patches" in (out / "recording.html").read_text(encoding="utf-8")

    succeed("taxels", out, "--contact", "ball-plate", "--axis", 0, 0, -1, "--shape", 4, 6)
    with np.load(out / "taxels.npz") as file:
        assert file["forces"].shape == (len(result.t), 4, 6)
        pressed = np.bincount(result.contacts.row, result.contacts.normal_force, len(result.t))
        felt = file["forces"].sum(axis=(1, 2)) + file["outside"]
        np.testing.assert_allclose(felt, pressed, rtol=1e-12, atol=1e-300)
        # A loaded result finds the scene of its scenario.
        grid = sp.TaxelGrid("ball-plate", (4, 6), axis=(0, 0, -1))
        np.testing.assert_array_equal(grid.images(result).forces, file["forces"])
    assert (out / "taxels.png").is_file()


def test_a_run_without_patches_has_no_taxels(tmp_path, no_pictures):
    out = tmp_path / "out"
    succeed("run", write(tmp_path), "--out", out, "--no-recording")
    told = call("taxels", out, "--contact", "ball-plate")
    assert told.exit_code == 2
    assert "has no patches" in told.stderr
