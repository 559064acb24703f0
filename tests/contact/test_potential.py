"""Is the elastic energy a potential? The work of the force along closed paths, for every law.

Paths are triangles that graze a surface: over elements, creases, joints between faces, seams and
corners. The integrals are adaptive, as the force has kinks where contacts come and go.
"""

import itertools
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import sphshell_pin as sp
from tests.contact.test_function_law import FORCE
from tests.models import block, on_shell

pytestmark = pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
FOLDER = Path(__file__).parents[2] / "scenarios" / "surfaces"
STIFFENS = FORCE(lambda depth, _rate, _numbers: 1e6 * depth * (1 + 1e3 * depth))

LAWS = {
    "impact": lambda r: sp.ImpactLaw(1e6, 1.5),
    "hunt-crossley": lambda r: sp.HuntCrossleyLaw(1e6, 1.3, 0.0),
    "hertz": lambda r: sp.HertzLaw(2e7, 0.4),
    "table": lambda r: sp.TableLaw([0.0, 0.01 * r, 0.03 * r, r], [0.0, 1.0, 5.0, 400.0]),
    "function": lambda r: sp.FunctionLaw(STIFFENS),
    "foundation": lambda r: sp.FoundationLaw(1e6, 0.1 * r),
}
# Unit of the file, and radius of the ball [m].
SURFACES = {
    "valve_body.step": ("mm", 1e-3),
    "blade.step": ("mm", 2e-3),
    "bladex_upper.stl": ("mm", 3e-3),
    "bottle.obj": ("m", 5e-3),
    "seat.obj": ("m", 5e-3),
    "bowl.shl": ("mm", 5e-3),
}
# How a shell is looked at: its faces, curved elements alone, flat elements. The method "facets" has
# no potential but for a FoundationLaw: at concave joints it switches contacts.
KINDS = {"faces": {}, "curved": {"faces": False}, "flat": {"faces": False, "crease_angle": 0.0}}


@cache
def shell_of(name: str, kind: str) -> sp.Shell:
    more = {"scale": "ignore"} if name.endswith(".shl") else {}
    if kind == "faces":
        return sp.Shell.from_file(FOLDER / name, unit=SURFACES[name][0], **more)
    whole = shell_of(name, "faces")
    return sp.Shell(whole.vertices, whole.elements, side=whole.side, **KINDS[kind])


def triangle(shell: sp.Shell, radius: float, rng: np.random.Generator) -> np.ndarray:
    """Corners of a path of a ball's center, about 0.02 radii deep at its first corner."""
    corners = shell.vertices[shell.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    t = rng.choice(len(areas), p=areas / areas.sum())
    normal = normals[t] / areas[t] * (rng.choice([-1, 1]) if shell.side == "both" else 1)
    start = rng.dirichlet(np.ones(3)) @ corners[t] + 0.98 * radius * normal
    east = np.cross(normal, rng.normal(size=3))
    east /= np.linalg.norm(east)
    north, length = np.cross(normal, east), rng.uniform(0.2, 1.0) * radius
    lifts = 0.006 * radius * rng.normal(size=2)
    far = start + 0.7 * length * (east + north) + lifts[1] * normal
    return np.array([start, start + length * east + lifts[0] * normal, far])


def work_around(work: Callable[[np.ndarray, np.ndarray], float], corners: np.ndarray) -> float:
    """The sum over the sides of the integrals of work(place, side) over 0 <= u <= 1."""
    total = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        # In eight parts, so that a contact of a moment is not overlooked.
        for one in itertools.pairwise(np.linspace(0, 1, 9)):
            side = partial(lambda a, way, u: work(a + u * way, way), a, b - a)
            total += quad(side, *one, limit=100, epsabs=1e-12, epsrel=1e-7)[0]
    return total


def worst_loop(shell: sp.Shell, radius: float, law, loops: int, method: str | None = None) -> float:
    """The largest work around a loop, over largest force times 0.02 radii."""
    scene = on_shell(block(0.0, 0.05, radius), shell, law, radius=radius, method=method)
    rng, still, worst, found = np.random.default_rng(7), np.zeros(3), 0.0, 0
    while found < loops:
        corners = triangle(shell, radius, rng)
        ends = zip(corners, np.roll(corners, -1, 0), strict=True)
        sides = [a + u * (b - a) for a, b in ends for u in np.linspace(0, 1, 6)]
        deep = [shell.contacts(x, radius).depth.max(initial=0.0) for x in sides]
        # Beyond that the laws are out of their range.
        if not 0 < max(deep) < 0.2 * radius:
            continue
        found += 1
        largest = max(np.linalg.norm(scene.external_forces(x, still)[1].linear) for x in sides)

        def work(x: np.ndarray, side: np.ndarray) -> float:
            return scene.external_forces(x, still)[1].linear @ side

        worst = max(worst, abs(work_around(work, corners)) / (largest * 0.02 * radius))
    return worst


@pytest.mark.parametrize(
    ("loops", "bound"), [(1, 1e-6), pytest.param(30, 1e-3, marks=pytest.mark.study)]
)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", SURFACES)
def test_no_work_is_done_around_a_loop(name, kind, law, loops, bound) -> None:
    radius = SURFACES[name][1]
    assert worst_loop(shell_of(name, kind), radius, LAWS[law](radius), loops) < bound


@pytest.mark.parametrize("name", SURFACES)
def test_no_work_is_done_by_a_foundation_on_facets(name: str) -> None:
    radius = SURFACES[name][1]
    law = LAWS["foundation"](radius)
    assert worst_loop(shell_of(name, "faces"), radius, law, 1, "facets") < 1e-6
