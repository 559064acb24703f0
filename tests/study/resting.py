"""A fast scenario for sweeps: a ball settles on a plate, where its depth has a closed form."""

from pathlib import Path

RADIUS = 0.012
GRAVITY = 9.81

SCENARIO = f"""
title = "a ball settles on a plate"

[robot]
name = "ball"
start = {{ root_joint = [0.01, 0.02, {RADIUS}, 0, 0, 0, 1] }}

[[shell]]
name = "plate"
primitive = {{ type = "half-space", extent = 1.0 }}

[[contact]]
name = "ball-plate"
sphere = {{ frame = "ball", radius = {RADIUS} }}
shell = "plate"

[contact.law]
type = "impact"
stiffness = 1e4
exponent = 1.5
damping = 5.0
full_damping_depth = 1e-9

[run]
duration = 1.0
integrator = "implicit"
record_dt = 0.1

[figures]
depth = "figures.py:depth"

[expect]
"figures.depth" = {{ max = 1e-4 }}
"""

FIGURES = """
import os
import signal


def depth(result, scene):
    return result.contacts.depth[-1]


def deadly(result, scene):
    if scene.pairs[0].law.stiffness == 2e4:
        os.kill(os.getpid(), signal.SIGKILL)
    return 1.0


def breaks(result, scene):
    return 1.0 / (scene.pairs[0].law.stiffness - 2e4)


calls = []


def count(result, scene):
    calls.append(1)
    return len(calls)
"""


def write(folder: Path, figure: str | None = None) -> Path:
    """Write the scenario into `folder`, with one more figure of FIGURES; return its path."""
    text = SCENARIO
    if figure is not None:
        text = text.replace("[figures]", f'[figures]\n{figure} = "figures.py:{figure}"')
    folder.mkdir(exist_ok=True)
    (folder / "figures.py").write_text(FIGURES, encoding="utf-8")
    path = folder / "resting.toml"
    path.write_text(text, encoding="utf-8")
    return path
