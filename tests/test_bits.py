"""Which bits depend on the processor.

glibc chooses at run time between functions with and without fused multiply-add, NumPy and its BLAS
between instruction sets. A process that is told to leave those out gets what an older x86-64
processor would give it. Promised: contacts, and laws that need no transcendental function, are the
same on all of them; whole runs are the same wherever glibc's choice is. Nothing is promised for
runs where it is not: Pinocchio takes sin and cos from glibc.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from tests.texts import DATA

ROOT = DATA.parents[1]
NO_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4"}
OLDER = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX,-AVX2,-AVX512F,-AVX512VL,-SSE4_2,-SSE4_1",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR AVX2 FMA3 AVX512F AVX512_SKX",
    "OPENBLAS_CORETYPE": "Prescott",
}


def digest(columns: Iterable[Any]) -> str:
    """Hash arrays or numbers."""
    return hashlib.sha256(b"".join(np.asarray(one).tobytes() for one in columns)).hexdigest()


def contacts() -> str:
    """Hash contacts of all methods and distances, with shells made anew."""
    import sphshell_pin as sp
    from tests import meshes

    rng = np.random.default_rng(1)
    shells = [sp.Shell.from_file(DATA / "corpus" / "bladex_upper.stl", unit="m")]
    for vertices, elements in (meshes.icosphere(2, 0.4), meshes.dome(6), meshes.crumpled(5)):
        # NumPy made them, with last bits of its own: away with those.
        shells.append(sp.Shell(np.float32(vertices).astype(np.float64), elements))
    columns: list[Any] = []
    for shell in shells:
        points = shell.box[0] + rng.random((60, 3)) * (shell.box[1] - shell.box[0])
        near = shell.closest_points(points)
        columns += [near.points, near.distances]
        for method in ("facets", "smooth", "elements"):
            for point in points:
                found = shell.contacts(point, 0.05 * shell.size, method=method)
                columns += [found.point, found.normal, found.depth, found.weight, found.element]
    assert sum(len(one) for one in columns) > 1000
    return digest(columns)


def laws() -> str:
    """Hash forces, energies and coefficients."""
    import sphshell_pin as sp

    depths = 0.01 * np.random.default_rng(2).random(500)
    made = [sp.ImpactLaw(1e5, e, 100.0) for e in (1.0, 1.5, 2.0)] + [sp.HuntCrossleyLaw(1e6)]
    columns = [f(d) for law in made for f in (law.normal_force, law.energy) for d in depths]
    return digest([*columns, *map(sp.CoulombFriction(0.5, 0.3, 0.001, 0.005).coefficient, depths)])


def runs() -> str:
    """Hash the motion of shipped scenarios."""
    from sphshell_pin.scenario import build
    from sphshell_pin.scenario.running.run import simulate

    columns = []
    for name in ("sphere_on_shell", "fingertip_on_blade", "ball_on_turntable"):
        result, _ = simulate(build(name, {"run.duration": "0.1"}))
        columns += [result.q, result.v, result.contacts.depth, result.energy.total]
    return digest(columns)


def bits(environment: dict[str, str]) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.test_bits"]
    env = {k: v for k, v in os.environ.items() if k not in OLDER} | environment
    return subprocess.Popen(command, env=env, cwd=ROOT, stdout=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def hashes() -> list[dict[str, str]]:
    """Those of a process as it is, without fused multiply-add, and with the oldest instructions."""
    if platform.machine() != "x86_64" or platform.libc_ver()[0] != "glibc":
        pytest.skip("only glibc on x86-64 can be told which instructions to leave out")
    processes = [bits(environment) for environment in ({}, NO_FMA, OLDER)]
    return [json.loads(process.communicate(timeout=120)[0]) for process in processes]


@pytest.mark.parametrize("what", ["contacts", "laws"])
def test_contacts_and_laws_have_the_same_bits_on_every_processor(hashes, what):
    assert len({one[what] for one in hashes}) == 1


def test_runs_have_the_same_bits_without_fused_multiply_add(hashes: list[dict[str, str]]) -> None:
    _, without, older = hashes
    assert without["runs"] == older["runs"]


if __name__ == "__main__":
    print(json.dumps({"contacts": contacts(), "laws": laws(), "runs": runs()}))
