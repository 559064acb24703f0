"""What `new` writes for many robots and parts: each pair works at the first try, or is refused.

Run it with `make new-study FOLDER=...`, or `python -m tests.new_study FOLDER...`. Every
scenario that is written is read again, run, judged by its own expectations, and looked at by a way
of its own: the corners of the links' meshes against the closed parts, the side that is touched, the
start's distance from singular postures and the part's height.
"""

import argparse
import multiprocessing
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from benchmarks.measured import Measured, write
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario import build, judge
from sphshell_pin.scenario.drafting.new import new_scenario
from sphshell_pin.scenario.drafting.trial import whole_posture
from sphshell_pin.scenario.format.bodies import to_se3
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.scenario.running.run import simulate
from tests import texts

DATA = texts.DATA / "corpus"
SHIPPED = (
    *("panda", "ur3", "ur5", "ur10", "xarm7", "z1", "kinova", "so100", "so101", "talos_arm"),
    *("finger_edu", "three_link_finger", "allegro_right_hand", "asr_twodof", "ball", "a1", "go2"),
    "solo12",
)
ROBOTS = {name: name for name in SHIPPED} | {
    file.partition("/")[2].partition(".")[0]: str(texts.DATA / file)
    for file in ("robots/arm_with_probe.urdf", "robots/arm_offset.urdf", "robots/gantry.urdf.xacro")
}
ROBOTS["hand_xacro"] = str(texts.DATA / "xacro" / "hand.urdf.xacro")
"""What `new` is asked."""

PLACES = ("-", "below", "above", "+x", "-x", "+y")
"""Values of --place; "-": none."""
SUFFIXES = (".step", ".stp", ".iges", ".igs", ".brep", ".stl", ".obj", ".shl", ".ply", ".off")
UNITS = {".stl": "mm", ".obj": "mm", ".brep": "mm", ".ply": "mm", ".off": "mm"}
# Of files that their authors made in another one.
UNITS |= {"trimesh_featuretype.STL": "in", "bottle.obj": "m", "seat.obj": "m"}
MOST_FILES = 12
# The least motion that the joints of an arm at the start give its tip, as a part of the largest.
_SINGULAR = 0.02
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
    slides: bool | None = None
    """Whether the tip follows a path; None of what falls or stands."""
    raised: float = 0.0
    """The part's underside above the ground [m]."""

    @property
    def word(self) -> str:
        """What came of it, in a word."""
        if self.refused or self.failed:
            return "refused" if self.refused else "fails"
        return {True: "slides", False: "presses", None: "works"}[self.slides]


def find_parts(folder: Path, names: Sequence[str] | None = None) -> list[Path]:
    """Return the parts of `folder`, CAD first: those called `names`, or MOST_FILES at most."""
    files = [one for one in sorted(folder.iterdir()) if one.suffix.lower() in SUFFIXES]
    if names:
        return [one for one in files if one.stem in names]
    return sorted(files, key=lambda one: SUFFIXES.index(one.suffix.lower()) > 4)[:MOST_FILES]


def read_once(file: Path, folder: Path) -> Path:
    """Write the surface of a file as .shl, so that CAD files are not read in each case again."""
    shell = sp.Shell.from_file(file, unit=UNITS.get(file.name, UNITS.get(file.suffix.lower())))
    path = folder / f"{file.stem}_{file.suffix[1:].lower()}.shl"
    shell.to_file(path)
    return path


def ask(robot: str, part: Path, place: str) -> Case:
    """Ask `new` for one scenario, and run what it writes."""
    began = time.perf_counter()
    case = Case(robot, part.stem, place)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / "made.toml"
        asked = {} if place == "-" else {"place": place}
        try:
            new_scenario(ROBOTS[robot], part, out=path, **asked)
        except SphshellError as error:
            if path.exists():
                return replace(case, failed=f"refused and written: {error}")
            return replace(case, refused=str(error), seconds=time.perf_counter() - began)
        seconds = time.perf_counter() - began
        built = build(path)
        control = built.scenario.controller
        slides = len(control.path) > 1 if isinstance(control, sp.CartesianImpedance) else None
        (shell,), at = built.shells.values(), to_se3(built.scenario.shell[0].placement)
        raised = float((shell.vertices @ at.rotation[2]).min() + at.translation[2])
        failed = failure(built) or ("" if slides is None else wrong_start(built))
        return replace(case, failed=failed, seconds=seconds, slides=slides, raised=raised)


def wrong_start(built: Built) -> str:
    """Return what is wrong with the posture and the side that is touched; "" if nothing."""
    scene, (pair,) = built.scene, built.scene.pairs
    reach = Reach(scene.model, pair.side_i.sphere.frame, pair.side_i.sphere.offset)
    center = pair.side_j.placement.actInv(reach.center(built.q0))
    jacobian = reach.jacobian(built.q0)
    if scene.model.nv > 2:
        values = np.linalg.svd(jacobian[:3], compute_uv=False)
        rank = min(3, scene.model.nv, int(np.linalg.matrix_rank(jacobian[:3], tol=1e-9)))
        if values[rank - 1] < _SINGULAR * values[0]:
            return "the start is near a singular posture"
    shell = pair.side_j.shell
    if not shell.is_closed:
        return ""
    outside = float(shell.closest_points(center[None], method="facets").distances[0])
    return "the tip starts inside the part" if outside < 0 and shell.side != "inside" else ""


def failure(built: Built) -> str:
    """Run a scenario as `run` does; say what it misses, "" if nothing."""
    result, stopped = simulate(built)
    if stopped is not None:
        return str(stopped)
    missed = [one for one in judge(built, result) if not one.met]
    if missed:
        return f"{missed[0].figure} is {missed[0].measured:.4g}, not {missed[0].expected}"
    rows = np.unique(np.linspace(0, len(result.t) - 1, 12).astype(int))
    inside = next(filter(None, (link_inside(built, q) for q in result.q[rows])), "")
    return f"link {inside} is in the part" if inside else ""


def link_inside(built: Built, q: np.ndarray) -> str:
    """Return the name of a link with a corner inside the closed part; "" if there is none."""
    (shell,) = built.shells.values()
    if not shell.is_closed or shell.side != "outside":
        return ""
    assembly, section = built.assembly, built.scenario.shell[0]
    model, geometry = assembly.model, assembly.loaded[0].collision_model
    data, at = model.createData(), pin.GeometryData(geometry)
    pin.updateGeometryPlacements(model, data, geometry, at, whole_posture(built, q, model))
    pin.updateFramePlacements(model, data)
    spheres = []
    for contact in built.scenario.contact:
        if (sphere := contact.sphere) is not None:
            pose = data.oMf[find_frame(model, sphere.frame)]
            spheres.append((pose.act(np.array(sphere.offset)), sphere.radius))
    part = to_se3(section.placement)
    for one, pose in zip(geometry.geometryObjects, at.oMg, strict=True):
        if not isinstance(one.geometry, coal.BVHModelBase):
            continue
        corners = np.asarray(one.geometry.vertices()) @ pose.rotation.T + pose.translation
        for center, radius in spheres:
            corners = corners[np.linalg.norm(corners - center, axis=1) > _AT_TIP * radius]
        local = (corners - part.translation) @ part.rotation
        near = local[((local > shell.box[0]) & (local < shell.box[1])).all(axis=1)]
        if (shell.closest_points(near, method="facets").distances < -_DEEP).any():
            return str(one.name)
    return ""


def main() -> int:
    """Ask, run, print a table; with --write put it into the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="*", default=[DATA])
    parser.add_argument("--robots", nargs="*", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--files", nargs="*", help="names without a suffix; default: the first 12")
    parser.add_argument("--places", nargs="*", default=["-"], choices=list(PLACES))
    parser.add_argument("--write", action="store_true", help="write docs/measured/new_study.json")
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = [one for some in asked.folders for one in find_parts(some, asked.files)]
        parts = [read_once(one, Path(folder)) for one in files]
        questions = [(r, p, place) for r in asked.robots for p in parts for place in asked.places]
        context, cases = multiprocessing.get_context("spawn"), []
        with ProcessPoolExecutor(asked.processes, context) as pool:
            for case in pool.map(ask, *zip(*questions, strict=True)):
                cases.append(case)
                said = f"refused: {case.refused}" if case.refused else case.failed or case.word
                print(case.robot, case.part, case.place, f"{case.seconds:.1f} s", said, flush=True)
    found = sections(cases)
    print(found[0].text, *(" | ".join(row) for one in found for row in one.table), sep="\n")
    if asked.write:
        command = f"python -m tests.new_study {' '.join(sys.argv[1:])}"
        print(f"wrote {write('new_study', command, found)}")
    return 1 if any(case.failed for case in cases) else 0


def sections(cases: Sequence[Case]) -> list[Measured]:
    """Return what the site shows: what came of each robot and part, and why some are refused."""
    robots = list(dict.fromkeys(case.robot for case in cases))
    parts = list(dict.fromkeys(case.part for case in cases))
    count = Counter(case.word for case in cases)
    arms = [case for case in cases if case.word in ("slides", "presses")]
    times = [case.seconds for case in cases]
    floor = sum(abs(case.raised) < 1e-3 for case in arms)
    written = len(cases) - count["refused"]
    text = f"{len(cases)} cases: {written} written, of which {count['fails']} "
    text += f"fail; {count['refused']} refused. Of {len(arms)} that press, {count['slides']} slide "
    text += f"and in {floor} the part is on the floor. Seconds for an answer: median "
    text += f"{np.median(times):.1f}, most {max(times):.1f}."
    words: dict[tuple[str, str], Counter[str]] = {}
    for case in cases:
        words.setdefault((case.robot, case.part), Counter())[case.word] += 1
    rows = [["robot", *parts]]
    for robot in robots:
        found = [words.get((robot, part), Counter()).items() for part in parts]
        rows.append([robot, *(", ".join(f"{w} {n}" if n > 1 else w for w, n in f) for f in found)])
    reasons = Counter(reason(case.refused) for case in cases if case.refused)
    counts = [[text, str(count)] for text, count in reasons.most_common()]
    refused = [["because", "cases"], *counts]
    return [Measured(text=text, table=rows), Measured("New scenarios refused", table=refused)]


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
