"""Patches and taxels from scenario files and results folders."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ResultError
from tests.command import succeed
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

    # A loaded result finds the scene of its scenario.
    images = sp.TaxelGrid("ball-plate", (4, 6), axis=(0, 0, -1)).images(result)
    assert images.forces.shape == (len(result.t), 4, 6)
    pressed = np.bincount(result.contacts.row, result.contacts.normal_force, len(result.t))
    felt = images.forces.sum(axis=(1, 2)) + images.outside
    np.testing.assert_allclose(felt, pressed, rtol=1e-12, atol=1e-300)


def test_a_run_without_patches_has_no_taxels(tmp_path):
    out = tmp_path / "out"
    succeed("run", write(tmp_path), "--out", out, "--no-recording")
    with pytest.raises(ResultError, match="has no patches"):
        sp.TaxelGrid("ball-plate", (4, 6)).images(sp.Result.load(out / "run.npz"))
