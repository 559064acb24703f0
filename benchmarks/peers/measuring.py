"""Runs engines over scenes; the ratios of their costs to ours."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.peers.engine import Params
from benchmarks.peers.scenes import SCENES
from benchmarks.peers.workers import ENGINES, NoAnswer, Ran, Worker
from sphshell_pin.study.report.contents import number

OURS = "ours"
SWINGS = ("bowl", "bowl fine")
ENOUGH = 0.3  # [s]: runs are repeated up to five times as long as they take less than this together
LONGEST = 600.0  # [s] for a run of the comparison
BUILDING = 60.0  # [s] allowed for what comes before the stepping
Say = Callable[[str], object]


@dataclass(frozen=True)
class Row:
    """One setting of one engine in one scene, or why there is none (`note`).

    `cost` is the median of the runs, `low` and `high` their quartiles, in `unit`.
    """

    scene: str
    engine: str
    version: str = ""
    settings: dict[str, str] = field(default_factory=dict)
    params: Params = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    unit: str = ""
    cost: float = math.nan
    low: float = math.nan
    high: float = math.nan
    steps: int = 0
    note: str = ""


@dataclass(frozen=True)
class Ratio:
    """Cost of a peer / ours, measured in turns: median and quartiles of the rounds."""

    what: str
    peer: Row
    ours: Row
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Budget:
    """How long an engine may take for a scene [s], and how often costs are compared."""

    scene: float
    swing: float
    variants: int
    rounds: int

    def of(self, scene: str) -> float:
        """Return the seconds for a scene: settings beyond them are left out."""
        return self.swing if scene in SWINGS else self.scene


QUICK = Budget(scene=2.0, swing=10.0, variants=2, rounds=3)
FULL = Budget(scene=10.0, swing=60.0, variants=16, rounds=11)


def cost_of(unit: str, found: Ran) -> float:
    """Return the cost of a run in `unit`."""
    if unit == "us / step":
        return found["cpu"] / found["steps"] * 1e6
    return found["cpu"] / found["simulated"]


class Field:
    """The engines' processes, and what was learned from them."""

    def __init__(self, engines: Iterable[str], budget: Budget, say: Say) -> None:
        self.workers = {name: Worker(name) for name in engines}
        self.budget, self.say = budget, say

    def close(self) -> None:
        """End all processes."""
        for worker in self.workers.values():
            worker.close()

    def rows_of(self, engine: str, scene: str) -> list[Row]:
        """Run an engine over a scene, its settings one after another while the time lasts."""
        worker, budget = self.workers[engine], self.budget.of(scene)
        try:
            facts = worker.facts(scene)
        except NoAnswer as reason:
            return [Row(scene, engine, note=str(reason))]
        start, rows = time.monotonic(), []
        self.say(f"  {SCENES[scene]().title}: {facts['version']}")
        base = Row(scene, engine, facts["version"], facts["settings"])
        before = start
        for k, params in enumerate(facts["param_sets"]):
            now = time.monotonic()
            # Settings go from coarse to fine: the next one takes at least as long as the last.
            if k and now - start + (now - before) > budget:
                left = len(facts["param_sets"]) - k
                rows.append(Row(scene, engine, note=f"{left} more left out: {budget:g} s used"))
                break
            before = now
            row = self.row_of(base, params)
            self.say(line(row))
            rows.append(row)
            if row.note.startswith("took longer"):
                break
        return rows

    def row_of(self, base: Row, params: Params) -> Row:
        """Run one setting: all variants once, and again while that is short."""
        scene = SCENES[base.scene]()
        variants = range(min(len(scene.variants()), self.budget.variants))
        timeout = 3 * self.budget.of(base.scene) + BUILDING
        errors, costs, steps = [], [], 0
        start = time.monotonic()
        for turn in range(5):
            for variant in variants:
                try:
                    found = self.workers[base.engine].run(base.scene, params, variant, timeout)
                except NoAnswer as reason:
                    return replace(base, params=params, note=str(reason))
                costs.append(cost_of(scene.unit, found))
                if turn == 0:
                    errors.append(found["errors"])
                    steps = found["steps"]
            if time.monotonic() - start > ENOUGH:
                break
        low, median, high = np.percentile(costs, [25, 50, 75])
        joined = scene.joined(errors)
        return replace(
            base,
            params=params,
            errors=joined,
            unit=scene.unit,
            cost=float(median),
            low=float(low),
            high=float(high),
            steps=steps,
            note="" if all(map(math.isfinite, joined.values())) else "diverged",
        )

    def in_turns(self, what: str, peer: Row, ours: Row) -> Ratio:
        """Run two settings in turns; return the ratio of their costs. Raises NoAnswer."""
        ratios = []
        unit = SCENES[peer.scene]().unit
        for turn in range(self.budget.rounds):
            costs = []
            for row in (peer, ours):
                variant = turn % 2 if row.scene in SWINGS else 0
                found = self.workers[row.engine].run(row.scene, row.params, variant, LONGEST)
                costs.append(cost_of(unit, found))
            ratios.append(costs[0] / costs[1])
        low, median, high = np.percentile(ratios, [25, 50, 75])
        return Ratio(what, peer, ours, float(median), float(low), float(high))


def params_text(params: Params) -> str:
    """Return a setting in a few words."""
    return ", ".join(
        f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in params.items()
    )


def errors_text(errors: dict[str, float]) -> str:
    """Return errors as "period 2.0e-4, energy ..."."""
    return ", ".join(f"{name} {number(value)}" for name, value in errors.items())


def line(row: Row) -> str:
    """Return a row as one line of progress."""
    params, errors = params_text(row.params), errors_text(row.errors)
    cost = "" if row.note else f"{row.cost:.4g} {row.unit}"
    return f"  {row.scene:10s} {row.engine:9s} {params:60s} {errors}  {cost} {row.note}".rstrip()


def measure(
    engines: Iterable[str] = tuple(ENGINES),
    scenes: Iterable[str] = tuple(SCENES),
    quick: bool = False,
    say: Say = lambda text: None,
) -> tuple[list[Row], list[Ratio]]:
    """Run the engines (names of ENGINES) over the scenes (names of SCENES).

    Returns a row for every setting, and for every peer that can do it how many times more it costs
    than this package: a step of the Panda at its cheapest setting and our default; the swing in
    the bowl at the peer's best error. `say` is called with every row as one line. A peer that is
    not installed, cannot do a scene, crashes or takes too long has a row that says so.
    """
    scenes = list(scenes)
    names = [OURS, *(name for name in engines if name != OURS)]
    field_of = Field(names, QUICK if quick else FULL, say)
    try:
        rows = [row for scene in scenes for name in names for row in field_of.rows_of(name, scene)]
        ratios = []
        for name in names[1:]:
            for scene in scenes:
                pair = compared(rows, scene, name)
                if pair is None:
                    continue
                try:
                    ratios.append(field_of.in_turns(SCENES[scene]().title, *pair))
                except NoAnswer as reason:
                    say(f"  {scene} {name}: not compared, {reason}")
    finally:
        field_of.close()
    return rows, ratios


def compared(rows: list[Row], scene: str, peer: str) -> tuple[Row, Row] | None:
    """Return the settings to compare in the scene, the peer's and ours; None if there are none."""
    good = [row for row in rows if row.scene == scene and not row.note]
    theirs = [row for row in good if row.engine == peer]
    ours = [row for row in good if row.engine == OURS]
    if scene == "press":
        theirs = [row for row in theirs if row.errors["pressed [mm]"] > 0]
        # Ours is the default; the compiled robot has a row of its own.
        return (min(theirs, key=lambda row: row.cost), ours[0]) if theirs and ours else None
    if scene not in SWINGS or not theirs:
        return None
    best = best_of(theirs)
    as_good = [row for row in ours if as_good_as(row, best)]
    return (best, min(as_good, key=lambda row: row.cost)) if as_good else None


def as_good_as(row: Row, other: Row, slack: float = 1.0) -> bool:
    """Whether both errors are at most `slack` times those of the other."""
    return all(row.errors[name] <= slack * other.errors[name] for name in ("period", "energy"))


def best_of(rows: list[Row]) -> Row:
    """Return the setting of least error, the product of both; of equals (10 %) the cheapest."""
    best = min(rows, key=lambda row: row.errors["period"] * row.errors["energy"])
    return min((row for row in rows if as_good_as(row, best, 1.1)), key=lambda row: row.cost)
