"""What is kept of a scenario with its results: its robots, surfaces and tables, as they were used.

So a finished run can be shown on any machine, and no file is read but that of the results. What is
kept may have been changed since: indices are checked, nothing is executed.
"""

import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.parameters import Component
from sphshell_pin.base.regular_file import read_bytes
from sphshell_pin.dynamics.result.result_parts import Kept
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.robots.kept_robot import load_kept, meshes_of, text_of
from sphshell_pin.robots.plain_mesh import FORMATS, plain_mesh
from sphshell_pin.scenario.format.bodies import origin
from sphshell_pin.scenario.format.schema import (
    ContactSection,
    RobotSection,
    Scenario,
    SourceSection,
)
from sphshell_pin.shell.kept_shell import arrays_of, shell_of
from sphshell_pin.shell.shell import Shell

MOST_FILES = 256e6
"""Meshes and tables of a run that are kept [bytes]; of what is beyond it, only the hash."""


class _Part(BaseModel):
    model_config = ConfigDict(strict=True)


class _Robot(_Part):
    """A robot of a file; `meshes` are the SHA-256 of its meshes, "" of one that was missing."""

    file: str
    text: str
    q0: list[float]
    meshes: dict[str, str]


class _Surface(_Part):
    side: str
    crease_angle: float
    rounding: float
    finds_faces: bool
    face_names: list[str]


class _Contents(_Part):
    """`robots` as the scenario has them, None of a shipped one; `tables` of laws as `meshes`."""

    robots: list[_Robot | None]
    surfaces: dict[str, _Surface]
    tables: dict[str, str]


@dataclass(frozen=True)
class Restored:
    """A scenario whose files are at hand: what `build_scenario` takes."""

    scenario: Scenario
    robots: Mapping[tuple[object, ...], LoadedRobot]
    surfaces: Mapping[str, Shell]


def keep(
    scenario: Scenario, folder: Path, robots: Sequence[LoadedRobot], shells: Mapping[str, Shell]
) -> Kept:
    """Return what is kept of a scenario in `folder`, built with `robots` and `shells`.

    Robots and surfaces that need no file are built again from the settings. A mesh is kept as
    `plain_mesh` writes it, up to MOST_FILES in total.
    """
    arrays: dict[str, NDArray[np.generic]] = {}
    room = MOST_FILES

    def kept(path: Path | None, suffix: str = "") -> str:
        nonlocal room
        try:
            content = b"" if path is None else read_bytes(path)
        except OSError:  # gone since the scenario was built
            return ""
        if suffix:
            content = plain_mesh(suffix, content) or b""
        digest = hashlib.sha256(content).hexdigest()
        if content and _file(digest) not in arrays and len(content) <= room:
            room -= len(content)
            arrays[_file(digest)] = np.frombuffer(content, np.uint8)
        return digest if content else ""

    held: list[_Robot | None] = []
    for section, robot in zip(scenario.robot, robots, strict=True):
        description = robot.description if section.path is not None else None
        if description is None:
            held.append(None)
            continue
        meshes = {
            name: kept(path, Path(name).suffix.lower() or "none")
            for name, path in meshes_of(description).items()
        }
        file = str(description.file.absolute() if description.is_mjcf else section.path)
        text, q0 = text_of(description), robot.q0.tolist()
        held.append(_Robot(file=file, text=text, q0=q0, meshes=meshes))
    surfaces = {}
    for one in scenario.shell:
        if one.file is not None:
            shell = shells[one.name]
            arrays |= {f"shell.{one.name}.{k}": array for k, array in arrays_of(shell).items()}
            about = {name: getattr(shell, name) for name in _Surface.model_fields}
            surfaces[one.name] = _Surface(**about | {"face_names": list(shell.face_names)})
    with_laws: list[ContactSection | SourceSection] = [*scenario.contact, *scenario.source]
    laws = [law for one in with_laws for law in (one.law, one.friction)]
    named = [name for law in laws for name in law.files if not name.endswith(".py")]  # no code
    tables = {name: kept(folder / name) for name in named}
    contents = _Contents(robots=held, surfaces=surfaces, tables=tables)
    return Kept(contents.model_dump(mode="json"), arrays)


def restore(scenario: Scenario, kept: Kept) -> Restored:
    """Return `scenario` with what is kept of it.

    Raises
    ------
    SphshellError
        Something of it is not kept, or not as `keep` gives it.
    """
    try:
        contents = _Contents.model_validate(kept.contents)
    except ValidationError as error:
        where = ".".join(map(str, error.errors(include_url=False)[0]["loc"]))
        raise SphshellError(f"what is kept of its scene has a wrong part, '{where}'") from None
    if len(contents.robots) != len(scenario.robot):
        raise SphshellError(f"it has {len(contents.robots)} robots, not {len(scenario.robot)}")
    robots = {
        origin(section): _robot(section, one, kept)
        for section, one in zip(scenario.robot, contents.robots, strict=True)
        if section.path is not None
    }
    surfaces = {}
    for one in scenario.shell:
        if one.file is None:
            continue
        if one.name not in contents.surfaces:
            raise SphshellError(f"it does not hold the surface '{one.name}'")
        about = dict(contents.surfaces[one.name])
        about["face_names"] = tuple(about["face_names"])
        begin = f"shell.{one.name}."
        arrays = {k.removeprefix(begin): v for k, v in kept.arrays.items() if k.startswith(begin)}
        surfaces[one.name] = shell_of(arrays, name=one.name, **about)
    tables = {name: _place(kept, digest, ".csv") for name, digest in contents.tables.items()}
    sections = {
        table: [
            one.model_copy(
                update={kind: _at_hand(getattr(one, kind), tables) for kind in ("law", "friction")}
            )
            for one in getattr(scenario, table)
        ]
        for table in ("contact", "source")
    }
    return Restored(scenario.model_copy(update=sections), robots, surfaces)


def _at_hand(stated: Component, places: Mapping[str, Path | None]) -> Component:
    """Return a law that names files at hand."""
    changed = {}
    for one in fields(stated):
        name = getattr(stated, one.name)
        if isinstance(name, str) and name in stated.files:
            if places.get(name) is None:
                raise SphshellError(f"it does not hold the file '{name}' of a law")
            changed[one.name] = str(places[name])
    return replace(stated, **changed) if changed else stated


def _robot(section: RobotSection, one: _Robot | None, kept: Kept) -> LoadedRobot:
    if one is None:
        raise SphshellError(f"it does not hold the robot '{section.path}'")
    places = {}
    for name, digest in one.meshes.items():
        suffix = Path(name).suffix.lower()
        place = _place(kept, digest, suffix) if suffix in FORMATS else None
        if place is not None:
            places[name] = place
    called = Path(section.path or "").name.partition(".")[0]
    return load_kept(
        one.text,
        one.file,
        places,
        one.q0,
        free_flyer=section.floats,
        mimic=section.mimic,
        name=called,
    )


def _file(digest: str) -> str:
    return f"file.{digest}"


def _place(kept: Kept, digest: str, suffix: str) -> Path | None:
    """Return a file with what is kept under `digest`, None if nothing is."""
    array = kept.arrays.get(_file(digest))
    if array is None or array.dtype != np.uint8:
        return None
    content = array.tobytes()
    if suffix in FORMATS:  # written anew, also from older results
        content = plain_mesh(suffix, content) or b""
    if not content:
        return None
    # Named by what it holds: files of all results of a process stand in one folder, which stays
    # until it ends, as meshes are read when drawn.
    folder = Path(_holder(os.getpid()).name)
    place = folder / (hashlib.sha256(content).hexdigest() + suffix)
    if not place.exists():
        with atomic_file(place) as stream:
            stream.write(content)
    return place


@cache
def _holder(process: int) -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="sphshell-pin-")
