"""Sizes of the recordings: python -m benchmarks.recordings [SCENARIO or ROBOT ...]."""

import re
import sys
import tempfile
import time
from pathlib import Path

import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.scenario import build, shipped_scenarios
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.view import write_recording

MB = 1e6
Recorded = tuple[sp.Result, sp.Scene, pin.GeometryModel]
ROBOTS = ("go1", "a1", "ur5", "talos")


def scenario_case(name: str) -> Recorded:
    """Run a shipped scenario whole."""
    built = build(name)
    result, _ = simulate(built)
    return result, built.scene, built.visual_model


def robot_case(name: str) -> Recorded:
    """Let a robot of robots/ fall for half a second."""
    robot = robots.load(name)
    scene = sp.Scene(robot.model)
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-3)).run(robot.q0, duration=0.5)
    return result, scene, robot.visual_model


def mesh_files(visual_model: pin.GeometryModel) -> int:
    """Bytes of the mesh files that a visual model names, each once."""
    paths = {body.meshPath for body in visual_model.geometryObjects}
    return sum(Path(path).stat().st_size for path in paths if Path(path).is_file())


def main() -> None:
    """Print a row for each recording."""
    names = sys.argv[1:] or [*shipped_scenarios(), *ROBOTS]
    print(
        f"{'':24s}{'mesh files':>12s}{'page':>10s}{'viewer':>10s}{'scene':>10s}{'written in':>12s}"
    )
    for name in names:
        case = scenario_case if name in shipped_scenarios() else robot_case
        result, scene, visual_model = case(name)
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            path = write_recording(Path(folder) / "page.html", result, scene, visual_model)
            took = time.perf_counter() - start
            page = path.read_text(encoding="utf-8")
        parts = [len(re.findall(f'id="{part}">([^<]*)<', page)[0]) for part in ("viewer", "scene")]
        sizes = "".join(f"{size / MB:7.2f} MB" for size in (len(page), *parts))
        print(f"{name:24s}{mesh_files(visual_model) / MB:9.2f} MB{sizes}{took:10.2f} s")


if __name__ == "__main__":
    main()
