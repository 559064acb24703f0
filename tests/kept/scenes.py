"""A scenario of which every part is a file, code or both: its results must not need any of them."""

import shutil
from pathlib import Path

from sphshell_pin.robots.plain_mesh import FORMATS
from sphshell_pin.scenario import run_scenario, shipped_scenarios
from tests.fuzz.strangers import mesh_corpus
from tests.scenario.files import without_pictures
from tests.texts import text_of

DATA = Path(__file__).parents[1] / "data"

SCENARIO = text_of("kept/scenario.toml")

CAD = text_of("kept/with_cad.toml")

HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'


def write(home: Path) -> Path:
    """Write the scenario and all its files into `home`; return its path."""
    shutil.copytree(DATA / "xacro" / "finger_description", home / "arm" / "finger_description")
    (home / "arm" / "arm.urdf.xacro").write_text(text_of("kept/arm.urdf.xacro"))
    (home / "arm" / "arm.srdf").write_text(text_of("kept/arm.srdf"))
    # Meshes that name other files, in every format that is kept.
    for suffix in FORMATS:
        drawn = mesh_corpus(suffix)[0].replace(b"/dev/zero", b"named")
        (home / "arm" / f"drawn{suffix}").write_bytes(drawn)
    with (home / "arm" / "drawn.obj").open("ab") as file:
        file.write(b"\rmtllib named\nmtllib named\nusemtl a\n")
    (home / "arm" / "named").write_text("newmtl a\nmap_Kd named\n")
    shutil.copy(DATA / "mjcf" / "meshes.xml", home)
    shutil.copytree(DATA / "mjcf" / "assets", home / "assets")
    shutil.copy(shipped_scenarios()["polished_valve"].parent / "surfaces" / "valve_body.step", home)
    plate = "v 0.2 -0.1 0\nv 0.4 -0.1 0\nv 0.4 0.1 0\nv 0.2 0.1 0\nf 1 2 3 4\n"
    (home / "plate.obj").write_text(plate)
    (home / "law.csv").write_text("depth,force\n0,0\n1e-3,10\n")
    shutil.copy(DATA / "kept" / "routine.py", home)
    (home / "all.toml").write_text(SCENARIO + CAD)
    return home / "all.toml"


def run(home: Path) -> Path:
    """Run it; return the folder of its results. What it read is worse than gone afterwards."""
    out = home / "results"
    with without_pictures():
        run_scenario(write(home), out, recording=False)
    (home / "arm" / "arm.urdf.xacro").write_text(f"{HEAD}<link name='a${{1 / 0}}'/></robot>")
    (home / "executed").unlink()
    return out
