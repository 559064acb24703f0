"""A pytest plugin: contact scenes and whole robots for other people's test suites.

It stands beside sphshell_pin, not in it, so that a suite without these fixtures never imports
Pinocchio: everything else is imported when a fixture is first used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sphshell_pin.study.robot_check import RobotReport, Touch

_NO_ROBOT = "no robot is named: give --sphshell-robot NAME|URDF"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that names robots."""
    group = parser.getgroup("sphshell", "contact of spheres with surfaces (sphshell_pin)")
    group.addoption(
        "--sphshell-robot",
        action="append",
        default=[],
        metavar="NAME|URDF",
        dest="sphshell_robots",
        help="run tests that use the fixture sphshell_robot with this robot; may be given often",
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give each test that uses `sphshell_robot` every robot that was named; skip it if none was."""
    if "sphshell_robot" not in metafunc.fixturenames:
        return
    for mark in metafunc.definition.iter_markers("parametrize"):
        names = mark.args[0] if mark.args else mark.kwargs.get("argnames", "")
        listed = names.split(",") if isinstance(names, str) else names
        if "sphshell_robot" in {name.strip() for name in listed}:
            return
    robots: list[Any] = list(dict.fromkeys(metafunc.config.getoption("sphshell_robots")))
    if not robots:
        robots = [pytest.param(None, marks=pytest.mark.skip(reason=_NO_ROBOT))]
    metafunc.parametrize("sphshell_robot", robots, indirect=True, scope="session")


@pytest.fixture(scope="session")
def sphshell_robot(request: pytest.FixtureRequest) -> str:
    """Return each robot named by --sphshell-robot in turn, as it was named."""
    return str(request.param)


@pytest.fixture(scope="session")
def contact_scene_factory() -> Callable[..., Touch]:
    """Return `make(robot, ...)`: a scene of a robot's sphere in a curved patch, and its state.

    The arguments are those of sphshell_pin.study.robot_check.contact_scene.
    """
    from sphshell_pin.study.robot_check import contact_scene

    return contact_scene


@pytest.fixture(scope="session")
def robot_check() -> Callable[..., RobotReport]:
    """Return `check(robot, ...)`, which fails the test unless all checks of the robot pass.

    The arguments are those of sphshell_pin.study.robot_check.check_robot, whose report it returns.
    """
    from sphshell_pin.study.robot_check import check_robot

    def check(robot: str, **options: Any) -> RobotReport:
        return check_robot(robot, **options).require()

    return check
