"""URDF files that would cost the process its stack or its memory are refused before."""

import pytest

from sphshell_pin import robots
from sphshell_pin.study.robot_check.models import load_subject
from tests import urdf


def joint(number, parent, kind="fixed"):
    """A link and the joint that moves it."""
    own = urdf.link(f"l{number}", urdf.inertial())
    return own + urdf.joint(f"j{number}", kind, f"l{parent}", f"l{number}")


def robot(inside):
    return urdf.robot(urdf.link("l0"), inside)


def chain(links, first=1):
    """Links, each on the one before."""
    return "".join(joint(k, k - 1) for k in range(first, links))


ENTITIES = "".join(f"<!ENTITY e{k} '{f'&e{k - 1};' * 10 if k else 'x' * 99}'>" for k in range(9))
ATTRIBUTES = " ".join(f"a{k}=''" for k in range(201))
TWO_PARENTS = chain(4900).replace("</joint>", '<parent link="l0"/></joint>')

REFUSED = {
    "chain of 1002 links": chain(1002),
    "has 5001 links": "".join(joint(k, 0) for k in range(1, 5001)),
    "316 degrees of freedom need 2.02 GB": chain(317).replace('"fixed"', '"revolute"'),
    "nested more than 100 deep": "<a>" * 100_000 + "</a>" * 100_000,
    "element 'a' has more than 200 attributes": f"<a {ATTRIBUTES}/>",
    # urdfdom reads the first of both: a chain that the last ones hide.
    "'j1' has 2 <parent> elements": TWO_PARENTS,
    # A loop; pinocchio says that a body is missing.
    "not a URDF": chain(3) + joint(3, 2).replace('"l3"', '"l1"', 2),
}
TEXTS = {reason: robot(inside) for reason, inside in REFUSED.items()} | {
    "declares an entity, 'e0'": f"<!DOCTYPE r [{ENTITIES}]>{robot('&e8;')}",
    "not well-formed XML": robot("")[:-1],
    "it is empty": " ",
}


@pytest.mark.parametrize("reason", TEXTS)
@pytest.mark.parametrize("load", [robots.load_file, load_subject])
def test_what_is_too_large_is_refused(tmp_path, reason, load):
    path = tmp_path / "r.urdf"
    path.write_text(TEXTS[reason])
    with pytest.raises(robots.RobotError, match=rf"r\.urdf: .*{reason}"):
        load(path)


def test_a_chain_as_long_as_may_be_is_read(tmp_path):
    path = urdf.write(tmp_path / "r.urdf", urdf.link("l0"), chain(1000))
    assert robots.load_file(path).model.nv == 0


def test_what_moves_nothing_is_mended(tmp_path):
    """Fixed joints of links that are missing, limits of -1, and boxes of size 0."""
    box = "<collision><geometry><box size='0 0 0.0'/></geometry></collision>"
    file = tmp_path / "arm.urdf"
    tool, ground = urdf.joint("t", "fixed", "l1", "tool"), urdf.joint("g", "fixed", "world", "l0")
    arm = joint(1, 0, "continuous").replace('effort="50"', 'effort="-1"')
    file.write_text(robot(arm.replace("</link>", f"{box}</link>") + tool + ground))
    with pytest.warns(robots.RobotWarning) as said:
        loaded = robots.load_file(file)
    text = " ".join(str(one.message) for one in said)
    assert "links that it does not have are frames: tool, world" in text
    assert "without the negative effort limits of the joints 'j1'" in text
    assert loaded.model.existFrame("tool")
    assert loaded.collision_model.ngeoms == 0
    file.write_text(robot(arm + "<link name='table'/>"))
    with pytest.warns(robots.RobotWarning, match="without links that no joint holds: table"):
        assert robots.load_file(file).model.nv == 1
    file.write_text(robot(arm + joint(3, 2, "continuous") + "<link name='l2'/>"))
    with pytest.raises(robots.RobotError, match="no joint moves or fixes the links 'l0', 'l2'"):
        robots.load_file(file)
    file.write_text(robot(arm + tool.replace("fixed", "revolute")))
    with pytest.raises(robots.RobotError, match="child 'tool', but there is no such link"):
        robots.load_file(file)
    file.write_text(robot(arm.replace(' effort="-1"', "")))
    assert robots.load_file(file).model.nv == 1
