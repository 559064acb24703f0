"""What a run took, and what its contacts did over all steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from sphshell_pin.deprecation import FormerDict


@dataclass(frozen=True)
class PairFigures(FormerDict):
    """Figures of one contact pair over all steps of a run, recorded or not.

    `contact_time` [s] spent in touch; `impulse` [N s] of the normal force; `peak_force` [N] the
    largest sum of the pair's normal forces, at `peak_force_time` [s]; `max_depth` [m], at
    `max_depth_time` [s]; `touches` how often it came into touch; `mean_force` [N] the impulse over
    the contact time, 0 without contact.
    """

    # Of files: what has another type is refused.
    __pydantic_config__: ClassVar[Mapping[str, bool]] = {"strict": True}

    contact_time: float
    impulse: float
    peak_force: float
    peak_force_time: float
    max_depth: float
    max_depth_time: float
    touches: int
    mean_force: float

    @classmethod
    def from_core(cls, sums: Mapping[str, float]) -> PairFigures:
        """Build from what the core adds up over a run."""
        time = sums["contact_time"]
        mean = sums["impulse"] / time if time else 0.0
        return cls(**sums, mean_force=mean)  # type: ignore[arg-type]  # touches is an int


@dataclass(frozen=True)
class RunStats(FormerDict):
    """Cost and figures of a run; zeros for the rows of a run that goes on.

    `steps` accepted, `rejected` for their error or a sphere's motion, `event_steps` made to end at
    an event and made again, as they missed it; `evaluations` of forces and forward dynamics in all
    of these; `event_queries` of the contacts alone, to locate events within a step; `duration` [s]
    simulated in `wall_time` [s], their ratio `real_time_factor`; `dt` [s] the fixed or the mean
    step; `integrator` the name of its class; `pairs` the figures by the pairs' names.
    """

    __pydantic_config__: ClassVar[Mapping[str, bool]] = {"strict": True}

    steps: int = 0
    wall_time: float = 0.0
    real_time_factor: float = 0.0
    duration: float = 0.0
    rejected: int = 0
    evaluations: int = 0
    event_steps: int = 0
    event_queries: int = 0
    dt: float = 0.0
    integrator: str = ""
    pairs: dict[str, PairFigures] = field(default_factory=dict)
