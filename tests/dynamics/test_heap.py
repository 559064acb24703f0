"""A step allocates nothing: heap calls do not grow with the number of steps."""

import os
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

from tests.programs import python
from tests.texts import DATA

PROBE = """
import ctypes
import numpy as np
import sphshell_pin as sp
from tests.models import ARM_Q, FRICTION, LAW, arm, on_plate, plate
heap = ctypes.CDLL(None).heap_calls
heap.restype = ctypes.c_long
scene = on_plate(arm(), LAW, FRICTION, shell=plate(2.0, 5000))
for _, controller, integrator in [{cases}]:
    sim = sp.Simulation(scene, integrator)
    counts, steps = [], []
    for duration in (0.02, 0.1, 1.1):
        before = heap()
        result = sim.run(ARM_Q, np.zeros(3), duration, controller, record_dt=duration)
        counts.append(heap() - before)
        steps.append(result.stats.steps)
    print(*counts, steps[2] - steps[1], result.stats.pairs["ball-plate"].contact_time)
"""

CONTROLLERS = {
    "none": "None",
    "gravity": "sp.GravityCompensation()",
    "pd": "sp.JointPD(np.full(3, 60.0), np.full(3, 3.0), ARM_Q + [0.2, 0.3, 0.2])",
    "impedance": (
        "sp.CartesianImpedance('ball', np.array([[0.25, 0.08, 0.04], [0.2, 0.15, 0.04]]),"
        " stiffness=200.0, damping=20.0, joint_damping=0.5)"
    ),
}


@pytest.fixture(scope="module")
def counter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        pytest.skip("counting heap calls needs Linux and a C compiler called cc")
    source, library = DATA / "heap_counter.c", tmp_path_factory.mktemp("heap") / "counter.so"
    build = [compiler, "-O2", "-shared", "-fPIC", "-fno-builtin", source, "-o", library]
    subprocess.run(build, check=True, capture_output=True)
    return library


# The integrator, and how many steps more a second more takes at least.
INTEGRATORS = {
    "SemiImplicitEuler(1e-4)": 9999,
    "RungeKutta4(1e-4)": 9999,
    "LinearlyImplicitEuler(1e-4)": 9999,
    "Adaptive(1e-8)": 300,
    "Implicit(1e-8)": 300,
}


CASES = list(product(CONTROLLERS, INTEGRATORS))
SOME = [both for both in CASES if both[0] == "impedance" or both[1] == "Implicit(1e-8)"]


@pytest.mark.parametrize("cases", [SOME, pytest.param(CASES, marks=pytest.mark.study)], ids=len)
def test_steps_do_not_touch_the_heap(counter: Path, cases: list[tuple[str, str]]) -> None:
    """A second more may cost a handful of calls (events grow), never one a step."""
    rows = ", ".join(f"({name!r}, {CONTROLLERS[name]}, sp.{one})" for name, one in cases)
    with_counter = {**os.environ, "LD_PRELOAD": str(counter)}
    done = python(PROBE.format(cases=rows), cwd=DATA.parents[1], env=with_counter)
    assert done.returncode == 0, done.stderr
    for case, line in zip(cases, done.stdout.splitlines(), strict=True):
        first, short, long, steps, contact_time = line.split()
        assert int(first) > 0, "the counter counted nothing"
        # An arm that gravity compensation holds still is one long step where the error decides.
        gravity = case[0] == "gravity"
        assert int(steps) >= (1 if gravity else INTEGRATORS[case[1]]), case
        assert int(long) - int(short) <= 100, (case, line)
        assert gravity or float(contact_time) > 0.0, case
