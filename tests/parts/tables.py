"""The verdicts as tables: rows of texts, the headings first."""

from collections.abc import Sequence

import numpy as np

from tests.parts.judge import MARGIN, Verdict

Rows = list[Sequence[str]]


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as Markdown."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def by_file(verdicts: list[Verdict]) -> Rows:
    """One row for each kind of file of which not all are spoiled."""
    kinds = dict.fromkeys(verdict.file for verdict in verdicts if not verdict.spoiled)
    cells = [summary(kind, [v for v in verdicts if v.file == kind]) for kind in kinds]
    return [tuple(cells[0]), *(tuple(row.values()) for row in cells)] if cells else []


def summary(file: str, verdicts: list[Verdict]) -> dict[str, str]:
    """Cells by their headings."""
    kept = [verdict for verdict in verdicts if not verdict.spoiled]
    spoiled = len(verdicts) - len(kept)
    worse = [verdict for verdict in kept if verdict.worse]
    planes = [verdict for verdict in kept if verdict.touches]
    lost = [sum(v.lost[method] for v in kept) for method in ("smooth", "facets")]
    not_ok = [sum(not verdict.ok for verdict in some) for some in (kept, worse)]
    ratio = np.exp(np.mean([np.log(verdict.ratio) for verdict in kept]))
    seconds, triangles = sum(v.seconds for v in kept), sum(v.triangles for v in kept)
    return {
        "file": file,
        "parts": str(len(kept)) + (f" ({spoiled} spoiled)" if spoiled else ""),
        "worse than flat": str(len(worse)),
        "mean error over flat's": f"{ratio:.3f}",
        "largest over flat's": f"{max(largest_ratio(verdict) for verdict in kept):.3g}",
        "planes off": f"{sum(v.off_plane > 0 for v in planes)} of {len(planes)}",
        "force on them, curved": forces(planes, "smooth"),
        "flat": forces(planes, "facets"),
        "touches lost, curved / flat": f"{lost[0]} / {lost[1]} of {sum(v.touches for v in kept)}",
        "health not ok (of the worse)": f"{not_ok[0]} ({not_ok[1]})",
        "recognized": f"{np.mean([v.recognized for v in kept]):.2f}",
        "ms per 1000 triangles": f"{1e6 * seconds / triangles:.1f}",
    }


def forces(verdicts: list[Verdict], method: str) -> str:
    if not verdicts:
        return "-"
    low = min(verdict.forces[method][0] for verdict in verdicts)
    return f"{low:.3f} to {max(verdict.forces[method][1] for verdict in verdicts):.4g}"


def largest_ratio(verdict: Verdict) -> float:
    """Largest error, curved over flat; flat ones below the margin count as that."""
    return verdict.largest["smooth"] / max(verdict.largest["facets"], MARGIN)
