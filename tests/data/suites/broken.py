"""A check that must fail."""

from sphshell_pin import Scene
from sphshell_pin.study.robot_check import QUICK


def test_wrong_robot_check(robot_check, monkeypatch):
    right = Scene.contact_derivatives
    monkeypatch.setattr(
        Scene, "contact_derivatives", lambda s, q, v=None: [-m for m in right(s, q, v)]
    )
    robot_check("ball", sizes=QUICK)
