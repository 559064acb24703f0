"""A fast scenario for sweeps: a ball settles on a plate, where its depth has a closed form."""

from pathlib import Path

from tests.texts import text_of

RADIUS = 0.012
GRAVITY = 9.81

SCENARIO = text_of("scenarios/resting.toml")

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
