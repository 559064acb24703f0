"""Where the meshes and the packages of a robot's description are: ROS names without ROS."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from urllib.parse import unquote

from sphshell_pin.base.regular_file import MOST_TEXT, StrPath, read_bytes

# Folders one within another below one of ROS_PACKAGE_PATH; a workspace has three.
_DEEPEST = 5
# Folders that are looked at below one, and above a package, in search of another package.
_MOST_FOLDERS, _ABOVE = 5000, 3


# A robot has a name, files of macros have none.
NAMED_ROBOT = re.compile(rb"<robot\b[^>]*\bname\s*=|<mujoco\b")


@dataclass(frozen=True)
class Folders:
    """The folders that are searched for the packages and the relative names of `file`.

    In this order: those given, the folder of the file and those above it, ROS_PACKAGE_PATH,
    AMENT_PREFIX_PATH (its share folders), and all of the workspace of the file.
    """

    file: Path
    given: tuple[Path, ...] = ()
    kept: Mapping[str, Path] | None = None
    """Meshes of a description that is no file any more by name, the only files to read."""

    @classmethod
    def of(cls, file: Path, given: Iterable[StrPath] = ()) -> Folders:
        """Return those of `file`, with the folders `given` first."""
        return cls(file, tuple(Path(one).absolute() for one in given))

    def packages(self, name: str) -> Iterator[Path]:
        """Yield the folders that may be the package called `name`, the likeliest first."""
        home = self.file.resolve().parent
        for folder in (*self.given, home):
            yield from _beside(folder, name)
        for above in (home, *home.parents):
            if _is_package(above, name):
                yield above
        for folder in _listed("ROS_PACKAGE_PATH"):
            yield from _beside(folder, name)
        for folder in _listed("AMENT_PREFIX_PATH"):
            yield from _beside(folder / "share", name)
        for folder in (*_listed("ROS_PACKAGE_PATH"), *self.given, *workspaces(home)):
            yield from _below(folder, name)

    def package(self, name: str) -> Path | None:
        """Return the folder of the package called `name`, or None."""
        return next((folder for folder in self.packages(name) if folder.is_dir()), None)

    def find(self, uri: str) -> Path | None:
        """Return the file that a description calls `uri`, or None: package://, file://, a path."""
        if self.kept is not None:
            return self.kept.get(uri)
        uri = uri.replace("\\", "/")  # of Windows
        scheme, colon, rest = uri.partition("://")
        if colon and scheme in ("package", "model"):
            name, _, inner = rest.partition("/")
            places: Iterable[Path] = (folder / inner for folder in self.packages(name))
        elif colon and scheme == "file":
            places = [Path(unquote(rest))]
        else:
            roots = (self.file.parent, *self.given)
            places = (folder / uri for folder in roots)  # of an absolute path, itself
        parts = Path(unquote(rest or uri)).parts
        tried = list[Path]()
        for place in chain(places, self._moved(parts)):
            if os.path.isfile(place):
                return place
            tried.append(place)
        # Where no folder is called as its own is, all files may have been put into one.
        whole = any(os.path.isdir(place.parent) for place in tried)
        return self._sorted_anew(scheme, parts) if whole else self._alone(parts[-1])

    def _sorted_anew(self, scheme: str, parts: Sequence[str]) -> Path | None:
        """Return the only file of a package whose path has all of `parts`, and folders between.

        Newer versions of a package put its meshes into more folders than older ones.
        """
        k = parts.index("share") + 1 if "share" in parts[:-2] else 0
        package = self.package(parts[k]) if k or scheme == "package" else None
        files = () if package is None else package.rglob(parts[-1])
        found = [one for one in files if _has_all(one.parts, parts[k + 1 :])]
        return found[0] if len(found) == 1 else None

    def _moved(self, parts: Sequence[str]) -> Iterator[Path]:
        """Yield where a file of a renamed package, or of another machine's folders, may be."""
        if "share" in parts[:-2]:  # where ROS installs packages
            k = parts.index("share") + 1
            yield from (folder.joinpath(*parts[k + 1 :]) for folder in self.packages(parts[k]))
        for k in range(1, len(parts) - 1):
            yield from (folder.joinpath(*parts[k:]) for folder in self._near())

    def moved(self, path: str) -> Path | None:
        """Return the file that an absolute path means that no file has, or None."""
        place = Path(path.replace("\\", "/"))
        return next(
            (one for one in (place, *self._moved(place.parts)) if os.path.isfile(one)), None
        )

    def holding(self, inner: str) -> Path | None:
        """Return a folder near the robot's that has the file `inner`, in folders of its own."""
        near = self._near() if "/" in inner else ()
        return next((one for one in near if os.path.isfile(one / inner)), None)

    def _alone(self, name: str) -> Path | None:
        """Return the file of that name in a folder near the robot's, if it is the only one."""
        near = self._near()
        places = {one / name for folder in near for one in (folder, *folder.glob("*"))}
        alike = [place for place in places if os.path.isfile(place)]
        return alike[0] if len(alike) == 1 and alike[0].parent in near else None

    def _near(self) -> tuple[Path, ...]:
        home = self.file.resolve().parent
        return (home, *home.parents[:2])

    def beside(self, name: str) -> Path:
        """Return the path that an MJCF calls `name`; nothing is there if it may not be read."""
        place = self.file.absolute().parent / name
        if self.kept is None:
            return place
        return self.kept.get(str(place), Path(os.devnull) / place.name)

    def searched(self) -> str:
        """Say where has been searched."""
        home = Path(os.path.abspath(self.file)).parent
        searched = [os.path.abspath(one) for one in (*self.given, home, workspaces(home)[-1])]
        searched += [
            f"${name} ({os.environ[name]})"
            for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
            if os.environ.get(name)
        ]
        return ", ".join(dict.fromkeys(searched))


def _has_all(parts: Sequence[str], wanted: Sequence[str]) -> bool:
    """Whether `wanted` are among `parts`, in that order."""
    rest = iter(parts)
    return all(one in rest for one in wanted)


def _listed(variable: str) -> list[Path]:
    return [Path(one) for one in os.environ.get(variable, "").split(os.pathsep) if one]


def _beside(folder: Path, name: str) -> Iterator[Path]:
    yield folder / name
    if _is_package(folder, name):
        yield folder


def _is_package(folder: Path, name: str) -> bool:
    return folder.name == name or _stated_name(folder / "package.xml") == name


@cache
def _stated_name(package_xml: Path) -> str | None:
    """Return the name that a package.xml states."""
    try:
        return (ET.fromstring(read_bytes(package_xml, MOST_TEXT)).findtext("name") or "").strip()
    except (OSError, ET.ParseError, ValueError, LookupError):  # the last: an unknown encoding
        return None


def workspaces(folder: Path) -> list[Path]:
    """Return the folders that hold packages beside that of `folder`, or `folder` itself.

    They end with the clone (its .git) or the `src` above the package, else with the folder of the
    package; of two packages of a name the nearer one counts.
    """
    above = (folder, *folder.parents)
    packages = [one for one in above if (one / "package.xml").is_file()]
    if not packages:
        return [folder]
    roots = list(packages[-1].parents)[:_ABOVE]
    if (packages[-1] / ".git").exists():
        roots.insert(0, packages[-1])
    ends = [k for k, one in enumerate(roots) if one.name == "src" or (one / ".git").exists()]
    return roots[: ends[-1] + 1] if ends else [packages[-1].parent]


def including(file: Path) -> Path | None:
    """Return a robot's file of the workspace that includes `file`, be it through others."""
    root, texts = workspaces(file.resolve().parent)[-1], dict[Path, bytes]()
    for place, _, names in itertools.islice(os.walk(root), _MOST_FOLDERS):
        for one in (Path(place, name) for name in names if name.endswith((".xacro", ".xml"))):
            with contextlib.suppress(OSError, ValueError):
                texts[one] = read_bytes(one, MOST_TEXT)
    wanted, seen = [file.name], set[Path]()
    for name in wanted:
        stated = re.compile(
            rb'(?:file(?:name)?=["\'])(?:[^"\']*/)?' + re.escape(name.encode()) + b"[\"']"
        )
        for one in sorted(set(texts) - seen, key=lambda one: (len(one.name), one)):
            if stated.search(texts[one]):
                if NAMED_ROBOT.search(texts[one]) and "macro" not in one.name:
                    return one
                seen.add(one)
                wanted.append(one.name)
    return None


def stated_source(folder: Path, name: str) -> str:
    """Return where a file of the workspace says that the package `name` is to be had, or ""."""
    stated = re.compile(
        rf"^\s*(?:\S+/)?{re.escape(name)}:\s*\n(?:.*\n)??\s*url:\s*(\S+)", re.MULTILINE
    )
    for one in itertools.islice(workspaces(folder)[-1].rglob("*.repos"), _MOST_FOLDERS):
        with contextlib.suppress(OSError, ValueError):
            found = stated.search(read_bytes(one, MOST_TEXT).decode(errors="replace"))
            if found is not None:
                return f"; {one.name} says that it is in {found[1]}"
    return ""


def _below(root: Path, name: str) -> Iterator[Path]:
    """Yield the packages of that name anywhere below `root`, as rospack finds them."""
    for count, (place, folders, files) in enumerate(os.walk(root)):
        here = Path(place)
        if count > _MOST_FOLDERS:
            return
        if "package.xml" in files:
            folders.clear()  # a package has no other in it
            if _is_package(here, name):
                yield here
        elif len(here.relative_to(root).parts) >= _DEEPEST:
            folders.clear()
        else:
            folders[:] = sorted(one for one in folders if not one.startswith("."))
