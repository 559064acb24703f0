#!/usr/bin/env python3
"""The newest minor versions of pin and coal on PyPI, and how the project is moved to them.

    python .ci/newest_pinocchio.py            # print them, if they are newer than the project's
    python .ci/newest_pinocchio.py --write    # write them into every file that states them

Needs nothing but Python. The core is compiled against one minor version of both: their C++ headers
are part of it.
"""

import argparse
import json
import re
import sys
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# The files that state versions, and what stands before and after them there.
PLACES = {
    "pyproject.toml": r'(?P<before>"{dist}(?:\[build\])?==)[0-9.]+(?P<after>\.\*")',
    "pixi.toml": r'(?P<before>^{conda} = ")[0-9.]+(?P<after>\.\*")',
    "packaging/conda/recipe.yaml": r'(?P<before>^  {conda}: ")[0-9.]+(?P<after>")',
}
NAMES = {"pin": "pinocchio", "coal": "coal"}  # on PyPI, on conda-forge


def stated(dist: str) -> str:
    """Return the minor version that pyproject.toml states."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (version,) = set(re.findall(rf'"{dist}(?:\[build\])?==([0-9.]+)\.\*"', text))
    return version


def newest(dist: str) -> str:
    """Ask PyPI for the newest final release."""
    with urllib.request.urlopen(f"https://pypi.org/pypi/{dist}/json", timeout=60) as answer:
        version: str = json.load(answer)["info"]["version"]
    return ".".join(version.split(".")[:2])


def write(versions: dict[str, str]) -> None:
    """Write `versions`, by their names on PyPI, into every file that states them."""
    for name, pattern in PLACES.items():
        file = ROOT / name
        text = file.read_text(encoding="utf-8")
        for dist, version in versions.items():
            place = pattern.format(dist=dist, conda=NAMES[dist])
            text, places = re.subn(
                place, rf"\g<before>{version}\g<after>", text, flags=re.MULTILINE
            )
            if not places:
                raise SystemExit(f"error: {name} states no version of {dist}")
        file.write_text(text, encoding="utf-8")


def main() -> int:
    """Print the newer versions as one line, or nothing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="move the project to them")
    options = parser.parse_args()
    versions = {dist: newest(dist) for dist in NAMES}
    if any(versions[dist] != stated(dist) for dist in NAMES):
        if options.write:
            write(versions)
        print(" ".join(f"{dist} {version}" for dist, version in versions.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
