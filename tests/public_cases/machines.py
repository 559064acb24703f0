"""Reports about files of robots and assemblies: masses, joints that mimic, parts used twice."""

import sphshell_pin as sp
from sphshell_pin import robots
from tests import urdf
from tests.public_cases import case
from tests.public_cases.shapes import INERTIAL, elements_read, folder


def chain(links: list[str], joints: list[tuple[str, str]]) -> robots.LoadedRobot:
    """Load a URDF of links with what is in them, and joints of a type with what they mimic."""
    parts = [urdf.link(f"l{k}", inside) for k, inside in enumerate(links)]
    parts += [
        urdf.joint(f"j{k}", kind, f"l{k}", f"l{k + 1}", mimic)
        for k, (kind, mimic) in enumerate(joints)
    ]
    with folder() as home:
        file = urdf.write(home / "chain.urdf", *parts)
        return robots.load_file(file, mimic=True, density=2700.0)


@case
def continuous_joints_that_mimic() -> float:
    mimic = '<mimic joint="j0" multiplier="-0.5"/>'
    return chain([INERTIAL] * 3, [("continuous", ""), ("continuous", mimic)]).model.nv


@case
def gripper_that_mimics() -> float:
    rules = [f'<mimic joint="j0" multiplier="{ratio}"/>' for ratio in (1, -1, 1, -1, 1)]
    return chain([INERTIAL] * 7, [("revolute", rule) for rule in ("", *rules)]).model.nv


@case
def links_without_masses() -> float:
    shape = urdf.shape("collision", '<box size="0.1 0.2 0.3"/>')
    return float(chain([INERTIAL, shape], [("revolute", "")]).model.inertias[1].mass)


@case
def part_used_twice() -> float:
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    from sphshell_pin.shell.cad.model import compound
    from tests.joints.solids import write_step
    from tests.parts import occ

    part, move = occ.box((0, 0, 0), (1, 2, 3)), gp_Trsf()
    move.SetTranslation(gp_Vec(10.0, 0.0, 0.0))
    both = compound([part, part.Moved(TopLoc_Location(move))])
    with folder() as home:
        return sp.Shell.from_file(write_step(both, home / "twice.step")).health.volume / 6e-9


@case
def bytes_after_an_stl() -> float:
    return elements_read(b"part", b"\0" * 17)
