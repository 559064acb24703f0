"""Fast spheres at thin sheets.

Ten thousand spheres of 0.1 to 50 mm fly at 1 to 1000 m/s at thin sheets, meshes and bodies; the
steps are 0.1 to 10 ms, so that a step may be 1e5 radii long. The law can stop the sphere at
0.3 r. Whether a center went through is decided from the recorded rows and the triangles alone.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.shell.curvature import curved_mesh
from tests.hard_cases.aims import STOPPED_AT, ImpactTest, draw
from tests.hard_cases.targets import all_targets, crossings, sweep, winding
from tests.hard_cases.verdict import Verdict, Verdicts, at_most, case
from tests.rolling import velocities

FIXED = ("SemiImplicitEuler", "RungeKutta4", "LinearlyImplicitEuler")
# Energy that may be gained: this share, and with explicit fixed steps besides a (step / depth)^b,
# as the sphere flies into the sheet for up to a step before a force acts on it. Of 1620 impacts the
# worst gains 0.6 of it. A step longer than r / 4 is cut.
GAIN = 1e-3
STEP_GAIN = {"SemiImplicitEuler": (2.0, 1), "RungeKutta4": (0.5, 2)}
LONGEST = 0.25


def steppers(dt: float) -> dict[str, Any]:
    """Return all integrators; those of a fixed step with `dt` [s]."""
    known: dict[str, Any] = {name: getattr(sp, name)(dt) for name in FIXED}
    return known | {"Adaptive": sp.Adaptive(), "Implicit": sp.Implicit()}


def allowed_gain(impact: ImpactTest, integrator: Any) -> float:
    """Return the share of its energy that a impact may gain."""
    step = min(impact.speed * impact.dt / impact.aim.radius, LONGEST) / STOPPED_AT
    share, order = STEP_GAIN.get(type(integrator).__name__, (0.0, 1))
    return GAIN + share * step**order


@dataclass
class Tally:
    """What became of the impacts of one integrator: numbers of impacts; gain over what is allowed,
    depth in radii.
    """

    passed: list[int] = field(default_factory=list)
    lost: list[int] = field(default_factory=list)
    missed_grazes: list[int] = field(default_factory=list)
    broken: list[int] = field(default_factory=list)
    undecided: list[int] = field(default_factory=list)
    gain: list[float] = field(default_factory=list)
    depth: list[float] = field(default_factory=list)


def positions(result: sp.Result) -> tuple[Array, Array]:
    """Return centers and velocities in the world (n, 3) of a result's rows."""
    if result.q.shape[1] == 3:
        return result.q, result.v
    return result.q[:, :3], velocities(result)


def path(impact: ImpactTest, result: sp.Result) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the legs (n, 3), (n, 3) of the center's way, and which are bridges.

    Legs are the ways between rows, joined up to r / 4. Where rows are farther apart and the
    velocity changed between them, the way is straight up to the first touch from the one, and
    from the last touch, backwards from the other; a bridge joins the two.
    """
    at, v = positions(result)
    r, corners = impact.aim.radius, impact.aim.corners
    step = np.linalg.norm(np.diff(at, axis=0), axis=1)
    mark = np.floor(np.concatenate([[0.0], np.cumsum(step)]) / (r / 4))
    kept = np.ones(len(at), dtype=bool)
    kept[1:-1] = (mark[1:-1] != mark[:-2]) | (mark[2:] != mark[1:-1])
    at, v, t = at[kept], v[kept], result.t[kept]
    starts, ends = at[:-1].copy(), at[1:].copy()
    turned = np.linalg.norm(np.diff(v, axis=0), axis=1) > 1e-9 * impact.speed
    bridge = (np.linalg.norm(ends - starts, axis=1) > r / 2) & turned
    free = []
    for k in np.nonzero(bridge)[0]:
        flown = t[k + 1] - t[k]
        starts[k] += min(_until_touch(impact, at[k], v[k]), flown) * v[k]
        ends[k] -= min(_until_touch(impact, at[k + 1], -v[k + 1]), flown) * v[k + 1]
        free += [(at[k], starts[k]), (ends[k], at[k + 1])]
    if free:
        more = np.array(free)
        starts, ends = np.concatenate([starts, more[:, 0]]), np.concatenate([ends, more[:, 1]])
        bridge = np.concatenate([bridge, np.zeros(len(free), dtype=bool)])
    near, starts, ends = _clip(starts, ends, corners, r)
    return starts, ends, bridge[near]


def _until_touch(impact: ImpactTest, at: Array, v: Array) -> float:
    """Return the time [s] until a sphere that flies on touches; 0 if it never does."""
    speed = float(np.linalg.norm(v))
    if not speed > 0:
        return 0.0
    way = sweep(at, v / speed, impact.aim.radius, impact.aim.corners)
    return way / speed if np.isfinite(way) else 0.0


def _should_touch(impact: ImpactTest, scene: sp.Scene, at: Array, v: Array) -> bool:
    """Whether a sphere that flies straight on from `at` meets the target on its way."""
    if not 0 < _until_touch(impact, at, v) < impact.duration:
        return False
    pair = scene.pairs[0]
    if not any(one.is_smooth for one in pair.shells):
        return True
    # Curved elements stand off the flat ones, and may do so on the far side of them.
    points, triangles, _ = curved_mesh(pair.side_j.shell, 8)
    corners = np.array([pair.placement_j.act(p) for p in points])[triangles]
    speed = float(np.linalg.norm(v))
    return sweep(at, v / speed, 0.999 * impact.aim.radius, corners) < speed * impact.duration


def _clip(starts, ends, corners, r):
    """Cut legs to a ball round the target: far ends would cost digits."""
    middle = corners.reshape(-1, 3).mean(axis=0)
    reach = np.linalg.norm(corners - middle, axis=2).max() + 2 * r
    along = ends - starts
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    nearest = -((starts - middle) * along).sum(axis=1) / square
    away = starts + nearest[:, None] * along - middle
    half = np.sqrt(np.maximum(reach**2 - (away**2).sum(axis=1), 0) / square)
    near = half > 0
    low, high = (np.clip(nearest + s * half, 0, 1)[near, None] for s in (-1, 1))
    return near, starts[near] + low * along[near], starts[near] + high * along[near]


def fly(number: int, impact: ImpactTest, integrator: Any, tally: Tally) -> None:
    """Run one impact and judge it."""
    q, v = impact.state()
    scene = impact.scene()
    try:
        result = sp.Simulation(scene, integrator).run(q, v, impact.duration)
    except SphshellError:
        tally.broken.append(number)
        return
    if not (np.isfinite(result.q).all() and np.isfinite(result.v).all()):
        tally.broken.append(number)
        return
    touched = any(event.kind == "touch" for event in result.events)
    at, flown = positions(result)
    if not touched and _should_touch(impact, scene, at[0], flown[0]):
        (tally.missed_grazes if impact.grazes else tally.lost).append(number)
    starts, ends, bridge = path(impact, result)
    through = crossings(starts, ends, impact.aim.corners)
    # A long bridge spans several touches: nothing is known of the way between them.
    vague = bridge & (np.linalg.norm(ends - starts, axis=1) > 3 * impact.aim.radius)
    centers = np.concatenate([ends[bridge], positions(result)[0][-1:]])
    if (through & ~vague).any() or _changed_side(impact, centers):
        tally.passed.append(number)
    elif through.any():
        tally.undecided.append(number)
    energy = result.energy
    gain = (energy.kinetic[-1] + energy.elastic[-1]) / energy.kinetic[0] - 1
    tally.gain.append(max(gain, 0.0) / allowed_gain(impact, integrator))
    tally.depth.append(result.stats.pairs["impact"].max_depth / impact.aim.radius)


def _changed_side(impact: ImpactTest, centers: Array) -> bool:
    if not impact.aim.target.closed:
        return False
    before = winding(impact.start[None], impact.aim.corners)
    return bool((winding(centers, impact.aim.corners) != before).any())


def judge(impacts: list[ImpactTest], name: str) -> Verdicts:
    """Fly all impacts with the integrator called `name`."""
    tally = Tally()
    for number, impact in enumerate(impacts):
        fly(number, impact, steppers(impact.dt)[name], tally)
    tried = f"{name}, {len(impacts)} impacts"

    def count(law: str, numbers: list[int], bound: float = 0) -> Verdict:
        if numbers:
            first = impacts[numbers[0]].aim.target.name
            law += f" (first: impact {numbers[0]}, {first})"
        return at_most("fast spheres", tried, law, len(numbers), bound)

    worst = [max(figures, default=np.nan) for figures in (tally.gain, tally.depth)]
    grazes = sum(impact.grazes for impact in impacts)
    yield count("none passes", tally.passed)
    yield count("none flies by untouched", tally.lost)
    # A fixed step may be longer than the way on which a sphere at 0.999 r of an edge touches.
    yield count(
        f"none of {grazes} at 0.999 r of an edge flies by",
        tally.missed_grazes,
        grazes if name in FIXED else 0,
    )
    yield count("every run ends, and finite", tally.broken)
    yield count("ways that the rows do not tell", tally.undecided, 0.01 * len(impacts))
    yield at_most("fast spheres", tried, "energy gained, of what is allowed", worst[0], 1.0)
    yield at_most("fast spheres", tried, "depth, of the radius", worst[1], 0.5)


@case("lines through the targets, to judge by")
def lines() -> Verdicts:
    """The judge must see a center that flies through."""
    rng = np.random.default_rng(1)
    seen = count = 0
    for target in all_targets():
        vertices, elements = target.mesh
        corners = vertices[elements]
        chosen = corners[rng.integers(len(corners), size=200)]
        points = np.einsum("nk,nki->ni", rng.dirichlet(np.ones(3), 200), chosen)
        along = rng.normal(size=(200, 3))
        seen += int(crossings(points - along, points + along, corners).sum())
        count += 200
    yield at_most("lines", f"{count} lines", "none is overlooked", count - seen, 0)


@case("10 000 fast spheres", slow=True)
def many() -> Verdicts:
    """Fly every impact once: the integrators take turns."""
    impacts = draw(np.random.default_rng(1), groups=1120, each=9)
    names = list(steppers(1.0))
    for k, name in enumerate(names):
        yield from judge(impacts[k :: len(names)], name)
