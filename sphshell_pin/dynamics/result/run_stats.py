"""What a run took, and what its contacts did over all steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from sphshell_pin.base.summary import Fact, Summarized

# Kinds of events in the order of the compiled core; from "stop" on, of joints.
EventKind = Literal[
    "touch",
    "lift_off",
    "deep",
    "through",
    "beyond_hertz",
    "stop",
    "stop_left",
    "effort_limit",
    "effort_limit_left",
    "speed_limit",
    "speed_limit_left",
]


@dataclass(frozen=True)
class PairFigures:
    """Figures of one contact pair over all steps of a run, recorded or not.

    `contact_time` [s] spent in touch; `impulse` [N s] of the normal force; `peak_force` [N] the
    largest sum of the pair's normal forces, at `peak_force_time` [s]; `max_depth` [m], at
    `max_depth_time` [s]; `touches` how often it came into touch; `mean_force` [N] the impulse over
    the contact time, 0 without contact. Adaptive and Implicit find peaks between the ends of their
    steps, on the dense output; peaks of fixed steps are the largest at the ends of steps.
    """

    # What has another type in a file is refused.
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
class JointFigures:
    """Figures of one joint that has stops or limits, over all steps of a run, recorded or not.

    `stop_time` [s] beyond the range; `stops` how often it came to an end of it; `stop_impulse` of
    the stops' force [N m s or N s], `peak_stop_force` [N m or N] and `max_stop_depth` [rad or m]
    the largest; `cut_time` [s] with the controller's torque cut to the effort limit, since
    `first_cut` [s]; `peak_speed` [rad/s or m/s], beyond its limit first at `first_too_fast` [s].
    Times are None where that never happened.
    """

    __pydantic_config__: ClassVar[Mapping[str, bool]] = {"strict": True}

    stop_time: float = 0.0
    stops: int = 0
    stop_impulse: float = 0.0
    peak_stop_force: float = 0.0
    max_stop_depth: float = 0.0
    cut_time: float = 0.0
    first_cut: float | None = None
    peak_speed: float = 0.0
    first_too_fast: float | None = None

    @classmethod
    def from_core(
        cls, stops: Sequence[Mapping[str, float]], limits: Sequence[Mapping[str, float]]
    ) -> JointFigures:
        """Build from what the core adds up at the stops of a joint, and of its velocities."""

        def first(name: str) -> float | None:
            return min((one[name] for one in limits if one[name] >= 0), default=None)

        return cls(
            stop_time=sum(one["contact_time"] for one in stops),
            stops=int(sum(one["touches"] for one in stops)),
            stop_impulse=sum(one["impulse"] for one in stops),
            peak_stop_force=max((one["peak_force"] for one in stops), default=0.0),
            max_stop_depth=max((one["max_depth"] for one in stops), default=0.0),
            cut_time=max((one["cut_time"] for one in limits), default=0.0),
            first_cut=first("first_cut"),
            peak_speed=max((one["peak_speed"] for one in limits), default=0.0),
            first_too_fast=first("first_too_fast"),
        )


@dataclass(frozen=True, repr=False)
class RunStats(Summarized):
    """Cost and figures of a run; zeros for the rows of a run that goes on.

    `steps` accepted, `rejected` for their error or a sphere's motion, `event_steps` made to end at
    an event and made again, as they missed it; `evaluations` of forces and forward dynamics in all
    of these; `event_queries` of the contacts alone, to locate events within a step; `duration` [s]
    simulated in `wall_time` [s], their ratio `real_time_factor`; `dt` [s] the fixed or the mean
    step; `integrator` the name of its class; `pairs` the figures by the pairs' names, `joints`
    those of joints with stops or limits.
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
    joints: dict[str, JointFigures] = field(default_factory=dict)

    def _facts(self) -> list[Fact]:
        return [
            Fact("simulated", self.duration, "s"),
            Fact("steps", self.steps),
            Fact("wall time", self.wall_time, "s"),
        ]
