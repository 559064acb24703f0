"""What the checks of robots found: verdicts, and the page and the file they are written to."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from sphshell_pin.atomic import atomic_file
from sphshell_pin.errors import ResultError
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
            f"{CHECKS[key].title} failed: {self.findings[key].where} "
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


def as_markdown(reports: Sequence[RobotReport], command: str) -> str:
    """Return a page with the table of all robots; `command` is what writes it."""
    passed = sum(one.verdict == PASS for one in reports)
    lines = [
        "# Every robot",
        "",
        f"{passed} of {len(reports)} robots pass; written by `{command}`. A sphere is attached to "
        "the frame listed, a curved shell of 800 elements is put under it at random legal "
        "postures, "
        "and each check compares the result with computations independent of the compiled core "
        "([testing](testing.md)). Figures are the worst over all postures.",
        "",
        "| check | what is compared | allowed |",
        "|---|---|---|",
        *(f"| {one.title} | {one.compares} | {one.tolerance:g} |" for one in CHECKS.values()),
        "",
        f"| robot | frame | nq/nv | {' | '.join(one.title for one in CHECKS.values())} | verdict |",
        f"|---|---|---{'|---' * len(CHECKS)}|---|",
    ]
    for one in reports:
        figures = [
            error_text(one.findings[key].error) if key in one.findings else "" for key in CHECKS
        ]
        size = f"{one.nq}/{one.nv}" if one.nv else ""
        frame = f"`{one.frame}`" if one.frame else ""
        lines.append(f"| {one.name} | {frame} | {size} | {' | '.join(figures)} | {one.verdict} |")
    lines += ["", "## Remarks", ""]
    lines += [f"- {sentence}" for sentence in remarks(reports)] or ["None."]
    return "\n".join(lines) + "\n"


def remarks(reports: Sequence[RobotReport]) -> list[str]:
    """Return all remarks as sentences, robots with the same remark together."""
    of: dict[str, list[str]] = {}
    for one in reports:
        for sentence in one.remarks:
            of.setdefault(sentence, []).append(one.name)
    return [f"{', '.join(names)}: {sentence}." for sentence, names in of.items()]


def as_json(reports: Sequence[RobotReport], seed: int, sizes: Sizes) -> str:
    """Return all figures as JSON; what is no finite number is null."""
    data: dict[str, Any] = {
        "seed": seed,
        "sizes": vars(sizes),
        "checks": {key: vars(check) for key, check in CHECKS.items()},
        "robots": [
            {
                "name": one.name,
                "frame": one.frame or None,
                "radius": _number(one.radius),
                "nq": one.nq,
                "nv": one.nv,
                "verdict": one.verdict,
                "reason": one.reason,
                "notes": list(one.notes),
                "checks": {
                    key: {
                        "error": _number(finding.error),
                        "met": one.met(key),
                        "where": finding.where,
                    }
                    for key, finding in one.findings.items()
                },
            }
            for one in reports
        ],
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def write(path: str | PathLike[str], text: str) -> Path:
    """Write a text file, whole or not at all; ResultError if that cannot be done."""
    try:
        with atomic_file(path) as stream:
            stream.write(text.encode())
    except OSError as error:
        raise ResultError(path, f"cannot be written: {error.strerror}") from error
    return Path(path)


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
