"""Lets Griffe read this project's docstrings, whose entries say in one line what a name means.

NumPy's convention takes what follows the colon for a type. Here types stand in the annotations, and
`name : meaning` says shape, unit and meaning.
"""

import re
from typing import Any

import griffe

LISTS = {"Parameters", "Attributes", "Returns", "Yields"}
SECTION = re.compile(r"^([A-Z][A-Za-z ]+)\n-{3,}$", re.MULTILINE)
ENTRY = re.compile(r"^(\*{0,2}\w[\w., ()*]*?) : (.+)$")
SHAPE = re.compile(r" (\([^)]*\))")
# Two entries on one line: "vertices : (n, 3) [m]; elements : (m, 4)".
NEXT = re.compile(r"; (?=\w+ : )")


def spell_out(text: str) -> str:
    """Return `text` with each `name : meaning` as a name and an indented meaning below it."""
    found = list(SECTION.finditer(text))
    ends = [one.start() for one in found] + [len(text)]
    parts = [text[: ends[0]]]
    for one, end in zip(found, ends[1:], strict=True):
        body = text[one.end() : end]
        parts += [one[0], _entries(body) if one[1] in LISTS else body]
    return "".join(parts)


def _entries(body: str) -> str:
    lines: list[str] = []
    for line in body.split("\n"):
        for piece in NEXT.split(line):
            entry = ENTRY.match(piece)
            if entry is None:
                lines.append(piece)
                continue
            # "q (n, nq), v (n, nv) : ..." has the shapes beside the names.
            shapes = ", ".join(SHAPE.findall(entry[1]))
            lines += [
                SHAPE.sub("", entry[1]),
                f"    {shapes} {entry[2]}" if shapes else f"    {entry[2]}",
            ]
    return "\n".join(lines)


class Sections(griffe.Extension):
    """Spells out the docstring of every object of the package."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Replace the text of the docstring before it is parsed."""
        if obj.docstring is not None:
            obj.docstring.value = spell_out(obj.docstring.value)
