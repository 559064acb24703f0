"""Files that an MJCF includes or attaches, put into it."""

import os
import xml.etree.ElementTree as ET
from pathlib import Path

from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, check_size, parsed

MOST_FILES = 1000
"""Files that an MJCF may include or attach, one as often as it is named."""

MOST_INCLUDED = 64e6
"""What they may have in all [B]."""


def include(root: ET.Element, open_files: list[Path], sizes: list[int] | None = None) -> None:
    """Put the content of included files in the place of <include>, attached models into <model>.

    `sizes` are those of the files so far [B]. The limits hold in total: of small files that include
    others twice, the whole doubles each time.
    """
    sizes = [] if sizes is None else sizes
    _include(root, open_files, sizes)
    for one in root.iterfind("asset/model"):
        path = open_files[-1].parent / one.get("file", "")
        if not os.path.isfile(path):
            raise ValueError(f"it attaches {one.get('file')}, which is not there")
        files = [*open_files, path.resolve()]
        model = _read(path, files, sizes)
        include(model, files, sizes)
        compiler = {key: value for part in model.iter("compiler") for key, value in part.items()}
        folder = path.absolute().parent / compiler.get("meshdir", compiler.get("assetdir", ""))
        for mesh in model.iterfind("asset/mesh[@file]"):
            mesh.set("name", mesh.get("name", Path(mesh.attrib["file"]).stem))
            mesh.set("file", str(folder / mesh.attrib["file"]))
        one[:] = [model]


def _include(element: ET.Element, files: list[Path], sizes: list[int], deep: int = 1) -> None:
    if deep > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    for k in range(len(element) - 1, -1, -1):
        one = element[k]
        if one.tag != "include":
            _include(one, files, sizes, deep + 1)
            continue
        stated = one.get("file", "")
        places = [files[0].parent / stated, files[-1].parent / stated]
        found = next((place for place in places if os.path.isfile(place)), None)
        if found is None:
            raise ValueError(f"it includes {stated}, which is not there")
        if found.resolve() in files:
            raise ValueError(f"it includes {stated}, which includes itself")
        inner = [*files, found.resolve()]
        root = _read(found, inner, sizes)
        _include(root, inner, sizes, deep)
        element[k : k + 1] = list(root)


def _read(path: Path, files: list[Path], sizes: list[int]) -> ET.Element:
    """Return the root of one more file; `files` are open, it is the last of them."""
    text = read_bytes(path, MOST_INCLUDED)
    sizes.append(len(text))
    if len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
        raise ValueError(
            f"it includes more than {MOST_FILES} files or {MOST_INCLUDED * 1e-6:g} MB in all, "
            "repeats counted: write each part once"
        )
    if len(files) > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    check_size(text)
    return parsed(text)
