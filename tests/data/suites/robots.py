"""Robots that are named on the command line are checked one by one."""

from sphshell_pin.study.robot_check import QUICK


def test_contact(sphshell_robot, robot_check):
    report = robot_check(sphshell_robot, sizes=QUICK)
    assert report.verdict == "pass"
    assert max(report.findings["forces"].error, 1e-300) < 1e-10
