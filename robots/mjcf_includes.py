"""Files that an MJCF includes, put in their places."""

import os
import xml.etree.ElementTree as ET
from pathlib import Path

from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, check_size, parsed

MOST_FILES = 1000
"""Files that an MJCF may include, one as often as it is named."""

MOST_INCLUDED = 64e6
"""What they may have in all [B]."""


def include(
    element: ET.Element, open_files: list[Path], sizes: list[int] | None = None, deep: int = 1
) -> None:
    """Put the content of included files in the place of <include>; `sizes` are theirs so far [B].

    The limits hold in total: of small files that include others twice, the whole doubles each time.
    """
    sizes = [] if sizes is None else sizes
    if deep > DEEPEST or len(open_files) > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    for k in range(len(element) - 1, -1, -1):
        one = element[k]
        if one.tag != "include":
            include(one, open_files, sizes, deep + 1)
            continue
        stated = one.get("file", "")
        places = [open_files[0].parent / stated, open_files[-1].parent / stated]
        found = next((place for place in places if os.path.isfile(place)), None)
        if found is None:
            raise ValueError(f"it includes {stated}, which is not there")
        if found.resolve() in open_files:
            raise ValueError(f"it includes {stated}, which includes itself")
        text = read_bytes(found, MOST_INCLUDED)
        sizes.append(len(text))
        if len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
            raise ValueError(
                f"it includes more than {MOST_FILES} files or {MOST_INCLUDED * 1e-6:g} MB in all, "
                "repeats counted: write each part once"
            )
        check_size(text)
        root = parsed(text)
        include(root, [*open_files, found.resolve()], sizes, deep)
        element[k : k + 1] = list(root)
