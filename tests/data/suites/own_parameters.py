"""Robots of its own."""

import pytest


@pytest.mark.parametrize("sphshell_robot, times", [("ball", 1), ("turntable", 2)])  # noqa: PT006
def test_own(sphshell_robot, times):
    assert sphshell_robot in ("ball", "turntable")
