"""The example of a circle with 5 N, and the same problem with Crocoddyl's own rigid contact.

    python -m venv rigid && rigid/bin/pip install crocoddyl==3.2.1 pin==4.0.0
    python -m benchmarks.circle --rigid rigid/bin/python

The wheels of Crocoddyl 3.2.1 misread frames of Pinocchio 4.1, so its own contact is solved by
another interpreter, and the torques are replayed here.
"""

import argparse
import os
import runpy
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.machine import machine
from sphshell_pin.study.report.timing import one_core

HERE = Path(__file__).parent
EXAMPLE = HERE.parent / "docs" / "examples" / "05_circle_with_5_newtons.py"
Names = dict[str, Any]


def with_euler(folder: Path) -> Names:
    """Run the example with semi-implicit Euler steps of 1 ms."""
    text = EXAMPLE.read_text(encoding="utf-8")
    for old, new in (
        ("sp.RungeKutta4(dt)", "sp.SemiImplicitEuler(dt)"),
        ("dt, duration = 2e-3", "dt, duration = 1e-3"),
    ):
        assert old in text
        text = text.replace(old, new)
    script = folder / "euler.py"
    script.write_text(text, encoding="utf-8")
    return runpy.run_path(str(script))


def run(names: Names) -> dict[str, Any]:
    """Solve from the first guess."""
    solver = type(names["solver"])(names["problem"])
    solver.th_stop = names["solver"].th_stop
    begun = time.process_time()
    solver.solve(names["guess"], names["weights"][:-1], 100)
    seconds = time.process_time() - begun
    return {
        "xs": np.array(solver.xs),
        "us": np.array(solver.us),
        "gains": np.array(solver.K),
        "iterations": solver.iter,
        "seconds": seconds,
    }


def solve_rigid(names: Names, python: str, folder: Path) -> dict[str, Any]:
    """Solve the same problem with Crocoddyl's contact, by the interpreter `python`."""
    rotation = names["world_from_blade"].rotation
    start = names["guess"][0][: names["model"].nq]
    np.savez(
        folder / "problem.npz",
        guess=names["guess"],
        weights=names["weights"][:-1],
        dt=names["dt"],
        force=names["force"],
        th_stop=names["solver"].th_stop,
        normals=names["touched"].normals @ rotation.T,
        centers=names["centers"],
        hand=names["placements"][0].rotation,
        mass=pin.crba(names["model"], names["data"], start),
        fingers=[0.012, 0.012],  # as the scenario has them
    )
    script, files = HERE / "circle_rigid.py", (folder / "problem.npz", folder / "solution.npz")
    subprocess.run([python, script, *files], check=True)
    return dict(np.load(files[1]))


def replay(names: Names, plan: dict[str, Any], feedback: bool) -> str:
    """Replay torques with small steps: the largest errors of force and place."""
    model, dt, nq = names["model"], names["dt"], names["model"].nq
    us: Array = plan["us"]

    def torques(t: float, q: Array, v: Array, contacts: object) -> Array:
        k = min(round(t / dt), len(us) - 1)
        if not feedback:
            return np.asarray(us[k])
        wanted = plan["xs"][k]
        off = np.concatenate((pin.difference(model, wanted[:nq], q), v - wanted[nq:]))
        return np.asarray(us[k] - plan["gains"][k] @ off)

    result = sp.Simulation(names["scene"], sp.Adaptive(1e-8)).run(
        plan["xs"][0, :nq], plan["xs"][0, nq:], names["duration"], torques, dt, record_dt=dt
    )
    force = np.bincount(result.contacts.row, result.contacts.normal_force, len(result.t))
    data, hand, off = names["data"], names["hand"], []
    for q, wanted in zip(result.q, names["centers"], strict=True):
        pin.framesForwardKinematics(model, data, q)
        off.append(np.linalg.norm(data.oMf[hand].translation - wanted))
    worst = 100 * np.abs(force - names["force"]).max() / names["force"]
    return f"{worst:.3g} % | {1e3 * max(off):.2g} mm"


def main() -> None:
    """Print the table of docs/optimal_control.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigid", metavar="PYTHON", help="an interpreter with pin 4.0.0")
    rigid = parser.parse_args().rigid
    rigid = rigid and str(Path(rigid).absolute())
    one_core()
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        names = runpy.run_path(str(EXAMPLE))
        euler = with_euler(Path(folder))
        rows = [
            ("this package", names, run(names)),
            ("this package, Euler, 1 ms", euler, run(euler)),
        ]
        if rigid:
            rows.append(("rigid", names, solve_rigid(names, rigid, Path(folder))))
        print("| contact | iterations | CPU time | force | place | force, gains | place, gains |")
        print("|---|---|---|---|---|---|---|")
        for title, used, plan in rows:
            print(
                f"| {title} | {plan['iterations']} | {plan['seconds']:.2f} s "
                f"| {replay(used, plan, False)} | {replay(used, plan, True)} |"
            )


if __name__ == "__main__":
    main()
