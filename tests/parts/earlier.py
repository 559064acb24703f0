"""Two runs of the study over the same parts: what has become better, and what worse."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from tests.parts.judge import FACTOR, FLOOR, MARGIN, Verdict
from tests.parts.tables import table

COLUMNS = (
    "file",
    "parts",
    "worse than flat, then",
    "now",
    "newly worse",
    "mean error over then's",
    "largest error grew in",
)


def against(path: Path, verdicts: Iterable[Verdict]) -> str:
    """Compare with the figures that --json has written to `path`."""
    then = {(row["number"], row["file"]): row for row in json.loads(path.read_text("utf-8"))}
    pairs = [(v, then[v.number, v.file]) for v in verdicts if (v.number, v.file) in then]
    pairs = [(v, row) for v, row in pairs if not v.spoiled]
    rows = []
    for kind in dict.fromkeys(v.file for v, _ in pairs):
        own = [(v, row) for v, row in pairs if v.file == kind]
        new = [v.number for v, row in own if v.worse and not _worse(row)]
        grown = [v.number for v, row in own if _grew(v, row)]
        ratio = [max(v.mean["smooth"], FLOOR) / max(row["mean"]["smooth"], FLOOR) for v, row in own]
        rows.append(
            [
                kind,
                str(len(own)),
                str(sum(_worse(row) for _, row in own)),
                str(sum(v.worse for v, _ in own)),
                " ".join(map(str, new)) or "-",
                f"{np.exp(np.mean(np.log(ratio))):.3f}",
                " ".join(map(str, grown)) or "-",
            ]
        )
    return table([COLUMNS, *rows])


def _worse(row: dict[str, Any]) -> bool:
    return bool(row["largest"]["smooth"] > FACTOR * row["largest"]["facets"] + MARGIN)


def _grew(verdict: Verdict, row: dict[str, Any]) -> bool:
    """Whether the largest curved error has grown, measured as it is against the flat one."""
    return verdict.largest["smooth"] > FACTOR * row["largest"]["smooth"] + MARGIN
