"""What the checks of robots found: verdicts, and the file they are written to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from sphshell_pin.base.texts import json_text
from sphshell_pin.study.robot_check.checks import CHECKS, Sizes
from sphshell_pin.testing.finding import Finding

PASS, FAILED, NOT_CHECKED = "pass", "failed", "not checked"


@dataclass(frozen=True)
class RobotReport:
    """One robot's findings.

    `frame` carries the sphere of `radius` [m]; `nq`, `nv` of the model that was checked; `findings`
    the worst of each check by its key in CHECKS; `notes` on what was done differently; `reason` why
    the robot was not checked, or None.
    """

    name: str
    frame: str = ""
    radius: float = math.nan
    nq: int = 0
    nv: int = 0
    findings: dict[str, Finding] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    reason: str | None = None

    def met(self, key: str) -> bool:
        """Whether the check `key` was passed."""
        return self.findings[key].error <= CHECKS[key].tolerance

    @property
    def verdict(self) -> str:
        """`pass`, `failed` or `not checked`."""
        if self.reason is not None:
            return NOT_CHECKED
        return PASS if all(self.met(key) for key in self.findings) else FAILED

    @property
    def remarks(self) -> list[str]:
        """Sentences on what failed, what was not checked, and what was done differently."""
        failed = [
            f"{key} failed: {self.findings[key].where} "
            f"({error_text(self.findings[key].error)}, allowed {CHECKS[key].tolerance:g})"
            for key in self.findings
            if not self.met(key)
        ]
        return [*failed, *([self.reason] if self.reason else []), *self.notes]

    def require(self) -> RobotReport:
        """Return this report; raise AssertionError with all remarks unless it passed."""
        if self.verdict != PASS:
            raise AssertionError(f"robot '{self.name}': {self.verdict}: {'; '.join(self.remarks)}")
        return self


def error_text(error: float) -> str:
    """Return an error as the tables show it."""
    return "0" if error == 0.0 else f"{error:.0e}" if math.isfinite(error) else "no figure"


def remarks(reports: Sequence[RobotReport]) -> list[str]:
    """Return all remarks as sentences, robots with the same remark together."""
    of: dict[str, list[str]] = {}
    for one in reports:
        for sentence in one.remarks:
            of.setdefault(sentence, []).append(one.name)
    return [f"{', '.join(names)}: {sentence}." for sentence, names in of.items()]


def as_json(reports: Sequence[RobotReport], command: str, seed: int, sizes: Sizes) -> str:
    """Return all figures as JSON; what is no finite number is null. `command` writes them."""
    robots: list[dict[str, object]] = []
    for one in reports:
        checks = {
            key: {"error": found.error, "met": one.met(key), "where": found.where}
            for key, found in one.findings.items()
        }
        figures = {name: getattr(one, name) for name in ("name", "nq", "nv", "verdict", "reason")}
        others = {"frame": one.frame or None, "radius": one.radius, "notes": one.notes}
        robots.append(figures | others | {"checks": checks})
    data = {
        "command": command,
        "seed": seed,
        "sizes": vars(sizes),
        "checks": {key: {"title": key} | vars(check) for key, check in CHECKS.items()},
        "robots": robots,
    }
    return json_text(data)
