"""What `new` writes for many robots, parts and places: each works, or is refused for a reason.

Run it with `make new-study FOLDER=...`, or `python -m benchmarks.new_study FOLDER`. Every scenario
that is written is read again, run, judged by its own expectations, and looked at by a way of its
own: the corners of the links' meshes against the closed parts.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.cases.measured import Measured, write
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build, judge
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.trial import whole_posture
from sphshell_pin.scenario.format.bodies import to_se3
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.running.run import simulate

ROOT = Path(__file__).parents[1]
DATA = ROOT / "tests" / "data" / "corpus"
PROBE = ROOT / "tests" / "data" / "robots" / "arm_with_probe.urdf"

ROBOTS: dict[str, tuple[str, dict[str, object]]] = {
    "three_link_finger": ("three_link_finger", {}),
    "arm_with_probe": (str(PROBE), {}),
    "panda": ("panda", {}),
    "ur5": ("ur5", {}),
    "ur10": ("ur10", {}),
    "xarm7": ("xarm7", {"frame": "link_eef", "radius": 0.012, "offset": (0.0, 0.0, 0.02)}),
    "z1": ("z1", {"frame": "gripperMover", "radius": 0.012, "offset": (0.1, 0.0, 0.0)}),
    "kinova": ("kinova", {"frame": "j2s6s200_end_effector", "radius": 0.02}),
    "finger_edu": ("finger_edu", {}),
    "allegro_right_hand": ("allegro_right_hand", {}),
    "talos_arm": (
        "talos_arm",
        {"frame": "gripper_left_base_link", "radius": 0.015, "offset": (0.0, 0.0, -0.16)},
    ),
    "ball": ("ball", {}),
    "a1": ("a1", {}),
    "solo12": ("solo12", {"radius": 0.016}),
}
"""What `new` is asked: the robot, and the options that it cannot do without."""

PLACES = ("below", "above", "+x", "-x", "+y")
SUFFIXES = (".step", ".stp", ".iges", ".igs", ".brep", ".stl", ".obj", ".shl", ".ply", ".off")
UNITS = {".stl": "mm", ".obj": "mm", ".brep": "mm", ".ply": "mm", ".off": "mm"}
MOST_FILES = 8
# Of a vertex of a link's mesh behind the surface [m], and of what belongs to the sphere [radii].
_DEEP, _AT_TIP = 1e-5, 1.5


@dataclass(frozen=True)
class Case:
    """One question to `new`, and what came of it."""

    robot: str
    part: str
    place: str
    refused: str = ""
    """Why, in the words of `new`; "" where a scenario was written."""
    failed: str = ""
    """What a written scenario misses in its own run; "" where it works."""
    seconds: float = 0.0


def find_parts(folder: Path) -> list[Path]:
    """Return the parts of `folder`: CAD files first, MOST_FILES at most."""
    files = [one for one in sorted(folder.iterdir()) if one.suffix.lower() in SUFFIXES]
    return sorted(files, key=lambda one: SUFFIXES.index(one.suffix.lower()) > 4)[:MOST_FILES]


def read_once(file: Path, folder: Path) -> Path:
    """Write the surface of a file as .shl, so that CAD files are not read in each case again."""
    shell = sp.Shell.from_file(file, unit=UNITS.get(file.suffix.lower()))
    path = folder / f"{file.stem}_{file.suffix[1:].lower()}.shl"
    shell.to_file(path)
    return path


def ask(robot: str, part: Path, place: str) -> Case:
    """Ask `new` for one scenario, and run what it writes."""
    name, options = ROBOTS[robot]
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / "made.toml"
        asked = options if place == "-" else {**options, "place": place}
        try:
            new_scenario(name, part, out=path, **asked)  # type: ignore[arg-type]
        except SphshellError as error:
            if path.exists():
                return Case(robot, part.stem, place, failed=f"refused and written: {error}")
            return Case(robot, part.stem, place, str(error), "", time.perf_counter() - began)
        seconds = time.perf_counter() - began
        built = build(path)
        return Case(robot, part.stem, place, "", failure(built), seconds)


def _asked(question: tuple[str, Path, str]) -> Case:
    return ask(*question)


def failure(built: Built) -> str:
    """Run a scenario as `run` does; say what it misses, "" if nothing."""
    result, stopped = simulate(built)
    if stopped is not None:
        return str(stopped)
    for one in judge(built, result):
        if not one.met:
            return f"{one.figure} is {one.measured:.4g}, not {one.expected}"
    rows = np.unique(np.linspace(0, len(result.t) - 1, 12).astype(int))
    for q in result.q[rows]:
        link = link_inside(built, q)
        if link:
            return f"link {link} is in the part"
    return ""


def link_inside(built: Built, q: np.ndarray) -> str:
    """Return the name of a link with a corner inside the closed part; "" if there is none."""
    (shell,) = built.shells.values()
    if not shell.is_closed or shell.side != "outside":
        return ""
    assembly, section = built.assembly, built.scenario.shell[0]
    model, geometry = assembly.model, assembly.loaded[0].collision_model
    data, at = model.createData(), pin.GeometryData(geometry)
    pin.updateGeometryPlacements(model, data, geometry, at, whole_posture(built, q))
    pin.updateFramePlacements(model, data)
    spheres = []
    for contact in built.scenario.contact:
        if (sphere := contact.sphere) is not None:
            pose = data.oMf[model.getFrameId(sphere.frame)]
            spheres.append((pose.act(np.array(sphere.offset)), sphere.radius))
    part = to_se3(section.placement)
    for one, pose in zip(geometry.geometryObjects, at.oMg, strict=True):
        if not isinstance(one.geometry, coal.BVHModelBase):
            continue
        corners = np.asarray(one.geometry.vertices()) @ pose.rotation.T + pose.translation
        for center, radius in spheres:
            corners = corners[np.linalg.norm(corners - center, axis=1) > _AT_TIP * radius]
        if not len(corners):
            continue
        local = (corners - part.translation) @ part.rotation
        near = ((local > shell.box[0]) & (local < shell.box[1])).all(axis=1)
        if (
            near.any()
            and (shell.closest_points(local[near], method="facets").distances < -_DEEP).any()
        ):
            return str(one.name)
    return ""


def cases_of(robots: Sequence[str], parts: Sequence[Path]) -> list[tuple[str, Path, str]]:
    """Return all questions; a robot that floats has one place, which is none."""
    floating = ("ball", "a1", "solo12", "iris")
    return [
        (robot, part, place)
        for robot in robots
        for part in parts
        for place in (("-",) if robot in floating else PLACES)
    ]


def main() -> int:
    """Ask, run, print a table; with --write put it into the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=DATA)
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--files", nargs="*", help="names without a suffix; default: the first 8")
    parser.add_argument("--write", action="store_true", help="write docs/measured/new_study.json")
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        parts = [read_once(one, Path(folder)) for one in find_parts(asked.folder)]
        parts = [
            one for one in parts if not asked.files or one.stem.rpartition("_")[0] in asked.files
        ]
        questions = cases_of(asked.robots, parts)
        with multiprocessing.get_context("spawn").Pool(asked.processes) as pool:
            cases = []
            for case in pool.imap(_asked, questions):
                cases.append(case)
                said = f"refused: {case.refused}" if case.refused else case.failed or "works"
                where = f"{case.robot}  {case.part}  {case.place}  {case.seconds:.1f} s"
                print(f"{where}  {said}", flush=True)
    found = sections(cases)
    print(found[0].text, *(" | ".join(row) for one in found for row in one.table), sep="\n")
    if asked.write:
        print(f"wrote {write('new_study', 'python -m benchmarks.new_study FOLDER --write', found)}")
    return 1 if any(case.failed for case in cases) else 0


def sections(cases: Sequence[Case]) -> list[Measured]:
    """Return what the site shows: the places that work by robot and part, and why others do not."""
    robots = list(dict.fromkeys(case.robot for case in cases))
    parts = list(dict.fromkeys(case.part for case in cases))
    written = [case for case in cases if not case.refused]
    works = sum(not case.failed for case in written)
    text = (
        f"{len(cases)} cases: {len(written)} written, of which {works} work in their own run; "
        f"{len(cases) - len(written)} refused."
    )
    rows = [["robot", *parts]]
    for robot in robots:
        cells = []
        for part in parts:
            here = [case for case in cases if (case.robot, case.part) == (robot, part)]
            works = sum(not case.refused and not case.failed for case in here)
            cells.append(f"{works} of {len(here)}")
        rows.append([robot, *cells])
    reasons = Counter(reason(case.refused) for case in cases if case.refused)
    counts = [[text, str(count)] for text, count in reasons.most_common()]
    return [
        Measured(text=text, table=rows),
        Measured("New scenarios refused", table=[["because", "cases"], *counts]),
    ]


def reason(text: str) -> str:
    """Return the kind of a refusal."""
    for word, kind in (
        ("would be in the part", "a link would be in the part wherever it was tried"),
        ("is in the part", "a link comes into the part in each run that was tried"),
        ("cannot move", "the joints cannot move the tip that way"),
        ("is not held", "the force is not held"),
        ("never touches", "the sphere does not come to the surface"),
        ("is not carried", "the weight is not carried"),
        ("less than the sphere's radius", "the part is smaller than the sphere"),
        ("effort limits", "the joints are too weak"),
        ("too small", "the part is too small to stand on"),
    ):
        if word in text:
            return kind
    return text


if __name__ == "__main__":
    sys.exit(main())
