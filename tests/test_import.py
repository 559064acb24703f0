"""Importing the package brings in what every user needs, and nothing else."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "sphshell_pin"

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


NO_REDIRECT = "import sys; sys.meta_path = [f for f in sys.meta_path if isinstance(f, type)]; "


def failing_import(folder: Path, core: str | None) -> str:
    """Import a copy of the package in `folder` whose core is the module `core`: the last line."""
    package = folder / "sphshell_pin"
    package.mkdir()
    for name in ("__init__", "_interrupts", "_versions", "errors"):
        shutil.copy(PACKAGE / f"{name}.py", package)
    if core is not None:
        (package / "_core.py").write_text(core, encoding="utf-8")
    program = NO_REDIRECT + "import sphshell_pin"  # without the finder of an editable install
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "direct cause" not in done.stderr
    assert "During handling" not in done.stderr
    return done.stderr.splitlines()[-1]


def test_a_core_that_cannot_be_loaded_names_what_it_was_built_for(tmp_path: Path) -> None:
    linker = "libboost_python311.so.1.2.3: cannot open shared object file: No such file"
    said = failing_import(tmp_path, f"raise ImportError({linker!r})")
    assert said.startswith(
        f"ImportError: the compiled core of sphshell_pin does not load: {linker}"
    )
    assert "built for coal==" in said
    installed = {name: version(name) for name in ("pin", "coal", "cmeel-boost")}
    for name, number in installed.items():
        assert f"{name} {number}" in said
    assert "reinstall sphshell-pin" in said


def test_a_core_of_other_versions_says_which(tmp_path: Path) -> None:
    said = failing_import(tmp_path, "pinocchio_version, coal_version = '3.9.1', '3.0.0'")
    assert "pinocchio 3.9.1" in said
    assert "reinstall sphshell-pin" in said


def test_a_checkout_that_is_not_built_says_so(tmp_path: Path) -> None:
    said = failing_import(tmp_path, None)
    assert said.startswith(f"ImportError: sphshell_pin is not built in {tmp_path}")
    assert "pip install -e ." in said
    assert "another folder" in said
    assert "circular" not in said
