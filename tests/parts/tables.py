"""The verdicts as tables: rows of texts, the headings first."""

from collections.abc import Sequence

import numpy as np

from tests.parts.judge import MARGIN, Verdict

FILE_COLUMNS = (
    "file",
    "parts",
    "worse than flat",
    "mean error over flat's",
    "largest over flat's",
    "planes off",
    "force on them, curved",
    "flat",
    "touches lost, curved / flat",
    "health not ok (of the worse)",
    "recognized",
    "ms per 1000 triangles",
)
Rows = list[Sequence[str]]


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows as Markdown."""
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def by_file(verdicts: list[Verdict]) -> Rows:
    """One row for each kind of file."""
    return [FILE_COLUMNS, *([name, *summary(own)] for name, own in groups(verdicts))]


def groups(verdicts: list[Verdict]) -> list[tuple[str, list[Verdict]]]:
    """Return the kinds of files, and the verdicts of each."""
    names = dict.fromkeys(verdict.file for verdict in verdicts)
    return [(name, [v for v in verdicts if v.file == name]) for name in names]


def summary(verdicts: list[Verdict]) -> list[str]:
    """Cells of the columns after the first."""
    kept = [verdict for verdict in verdicts if not verdict.spoiled]
    if not kept:
        return ["0", *["-"] * (len(FILE_COLUMNS) - 2)]
    worse = [verdict for verdict in kept if verdict.worse]
    ratio = np.exp(np.mean([np.log(verdict.ratio) for verdict in kept]))
    planes = [verdict for verdict in kept if verdict.touches]
    seconds, triangles = sum(v.seconds for v in kept), sum(v.triangles for v in kept)
    not_ok = sum(not verdict.ok for verdict in kept)
    return [
        str(len(kept))
        + (f" ({len(verdicts) - len(kept)} spoiled)" if len(kept) < len(verdicts) else ""),
        str(len(worse)),
        f"{ratio:.3f}",
        f"{max(largest_ratio(verdict) for verdict in kept):.3g}",
        f"{sum(v.off_plane > 0 for v in planes)} of {len(planes)}",
        forces(planes, "smooth"),
        forces(planes, "facets"),
        f"{sum(v.lost['smooth'] for v in kept)} / {sum(v.lost['facets'] for v in kept)}"
        f" of {sum(v.touches for v in kept)}",
        f"{not_ok} ({sum(not verdict.ok for verdict in worse)})",
        f"{np.mean([v.recognized for v in kept]):.2f}",
        f"{1e6 * seconds / triangles:.1f}",
    ]


def forces(verdicts: list[Verdict], method: str) -> str:
    if not verdicts:
        return "-"
    low = min(verdict.forces[method][0] for verdict in verdicts)
    return f"{low:.3f} to {max(verdict.forces[method][1] for verdict in verdicts):.4g}"


def largest_ratio(verdict: Verdict) -> float:
    """Largest error, curved over flat; flat ones below the margin count as that."""
    return verdict.largest["smooth"] / max(verdict.largest["facets"], MARGIN)


def line(verdict: Verdict) -> str:
    """Return one line for one file."""
    v = verdict
    remark = "spoiled" if v.spoiled else "WORSE" if v.worse else ""
    force = f"planes {forces([v], 'smooth')}, {v.lost['smooth']} lost" if v.touches else ""
    return (
        f"{v.number:4d} {v.family:18s} {v.file:18s} {v.triangles:6d} largest "
        f"{v.largest['smooth']:.1e} flat {v.largest['facets']:.1e} mean {v.mean['smooth']:.1e} "
        f"flat {v.mean['facets']:.1e} {force} recognized {v.recognized:.2f} "
        f"{'' if v.ok else 'not ok'} {remark}"
    ).rstrip()
