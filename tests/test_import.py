"""Importing the package brings in what every user needs, and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

HEAVY = (
    "meshcat",
    "matplotlib",
    "trimesh",
    "pydantic",
    "typer",
    "rich",
    "pandas",
    "tornado",
    "zmq",
    "OCP",
)


@pytest.fixture(scope="module")
def loaded() -> set[str]:
    program = "import json, sys, sphshell_pin; print(json.dumps(list(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    return set(json.loads(done.stdout))


@pytest.mark.parametrize("module", HEAVY)
def test_heavy_module_is_not_loaded(loaded: set[str], module: str) -> None:
    assert not [name for name in loaded if name.split(".")[0] == module]


def test_what_is_needed_is_loaded(loaded: set[str]) -> None:
    assert {"numpy", "pinocchio", "coal", "sphshell_pin._core"} <= loaded


def test_public_names_exist() -> None:
    import sphshell_pin

    missing = [name for name in sphshell_pin.__all__ if not hasattr(sphshell_pin, name)]
    assert not missing
    contract = """Shell Sphere ImpactLaw HuntCrossleyLaw CoulombFriction contact_wrench Scene
        Simulation SemiImplicitEuler RungeKutta4 Result GravityCompensation JointPD
        CartesianImpedance"""
    assert set(contract.split()) <= set(sphshell_pin.__all__)
