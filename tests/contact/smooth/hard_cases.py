"""What the tests of hard cases share; `python -m tests.contact.smooth.hard_cases` lists them.

Each docstring is a row "case; what happens". The sphere has radius one unless said otherwise.
"""

import inspect
from importlib import import_module

import numpy as np
import pytest

from benchmarks.measured import Measured, write
from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests.contact.helpers import directions, energy, force_sum
from tests.contact.smooth.surfaces import jittered_grid
from tests.contact.smooth.test_real_surfaces import faults
from tests.contact.walks import jump

UP = np.array([0.0, 0.0, 1.0])


DEPTH = 0.04


def fails(why: str):
    """Mark of a test that the present code fails."""
    return pytest.mark.xfail(strict=True, raises=AssertionError, reason=why)


def find(shell: Shell, center, radius: float = 1.0):
    """Contacts, after a look at what holds of any."""
    found = shell.contacts(center, radius, method="smooth")
    assert not faults(found, np.asarray(center), radius)
    return found


def push(shell: Shell, center, radius: float = 1.0) -> Array:
    """Force in units of that at DEPTH r."""
    return force_sum(find(shell, center, radius)) / (DEPTH * radius) ** 1.5


def stored(shell: Shell, center, depth: float, radius: float = 1.0) -> float:
    """Potential in units of that of one contact of `depth`."""
    return energy(find(shell, center, radius)) / (depth**2.5 / 2.5)


def assert_no_jump(shell: Shell, center, radius: float = 1.0, force: float = 1e-5) -> None:
    """1e-9 r further the potential is the same, and so is the force."""
    rng, here = np.random.default_rng(0), find(shell, center, radius)
    size = here.depth.max() ** 1.5
    for _ in range(20):
        move = 1e-9 * radius * directions(rng)
        there = find(shell, center + move, radius)
        assert jump(here, there, move) <= 1e-6
        change = np.linalg.norm(force_sum(there) - force_sum(here))
        assert change <= force * size


def graph(height, slopes, half: float, cells: int):
    """Vertices, elements and normals of z = height(x, y) over a square."""
    x, y, elements = jittered_grid((-half, half), (-half, half), cells, cells, 1)
    along_x, along_y = slopes(x, y)
    normals = np.stack([-along_x, -along_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.stack([x, y, height(x, y)], axis=1), elements, normals


FILES = ("rounds", "sheets", "meshes")


def table() -> list[tuple[str, str, str]]:
    """Case, what is right, and whether it holds, of all tests of hard cases."""
    rows = []
    for name in FILES:
        module = import_module(f"tests.contact.smooth.test_hard_{name}")
        found = [f for key, f in inspect.getmembers(module, inspect.isfunction) if "test_" in key]
        mine = [f for f in found if f.__module__ == module.__name__ and f.__name__[:5] == "test_"]
        for test in sorted(mine, key=lambda f: f.__code__.co_firstlineno):
            case, happens = (inspect.getdoc(test) or "").rstrip(".").split("; ")
            rows.append((case, happens, state(test)))
    return rows


def state(test) -> str:
    """Return "held", or why a test or one of its parameters is expected to fail."""
    marks = list(getattr(test, "pytestmark", ()))
    marks += [m for one in marks if one.name == "parametrize" for p in one.args[1]
              for m in getattr(p, "marks", ())]  # fmt: skip
    return next((f"open: {m.kwargs['reason']}" for m in marks if m.name == "xfail"), "held")


if __name__ == "__main__":
    rows = table()
    print("\n".join(f"| {' | '.join(row)} |" for row in rows))
    text = "Spheres of radius r. Each row is a test; an open one is expected to fail, and says why."
    head = "case", "what is right", ""
    cases = Measured("Contacts of curved elements", text, table=[head, *rows])
    print(write("contact_cases", "python -m tests.contact.smooth.hard_cases", [cases]))
