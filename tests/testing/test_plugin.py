"""The pytest plugin, in suites of its own: it checks what it should, and is not there otherwise."""

import re
from pathlib import Path

import pytest

# Here, as suites in this process forget what they load, and NumPy is loaded once per process.
import sphshell_pin.study.robot_check  # noqa: F401

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]
PLUGIN = ("-p", "pytest_sphshell_pin")


@pytest.fixture
def suite(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A suite in a folder of its own, as a user has it: without other plugins found on the way."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return pytester


def test_robots_named_on_the_command_line_run_one_by_one(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        """
        from sphshell_pin.study.robot_check import QUICK

        def test_contact(sphshell_robot, robot_check):
            report = robot_check(sphshell_robot, sizes=QUICK)
            assert report.verdict == "pass"
            assert max(report.findings["forces"].error, 1e-300) < 1e-10
        """
    )
    urdf = ROOT / "robots" / "urdf" / "three_link_finger.urdf"
    # With a blank in place of = pytest takes a file for one of tests, and its folder for the root.
    named = [f"--sphshell-robot={one}" for one in ("ball", urdf, "ball")]
    result = suite.runpytest_inprocess(*PLUGIN, *named, "-v")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["*test_contact[[]ball]*", "*three_link_finger.urdf]*"])


def test_without_a_robot_such_tests_are_skipped_with_the_reason(suite: pytest.Pytester) -> None:
    suite.makepyfile("def test_contact(sphshell_robot): assert False")
    result = suite.runpytest_inprocess(*PLUGIN, "-rs")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["*give --sphshell-robot NAME|URDF*"])


def test_scenes_and_assertions(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        """
        from sphshell_pin.testing import assert_derivatives, assert_forces_balance

        def test_named(contact_scene_factory):
            touch = contact_scene_factory("three_link_finger", frame="tip", radius=0.01, seed=3)
            assert len(touch.scene.contacts(touch.q)) == 1
            assert_forces_balance(touch.scene, touch.q, touch.v)
            assert_derivatives(touch.scene, touch.q, touch.v)

        def test_gap(contact_scene_factory):
            touch = contact_scene_factory("ball", depth=-0.5)
            assert len(touch.scene.contacts(touch.q)) == 0
        """
    )
    suite.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)


def test_broken_scenes_fail(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        """
        from sphshell_pin import Scene
        from sphshell_pin.study.robot_check import QUICK

        def test_wrong_robot_check(robot_check, monkeypatch):
            right = Scene.contact_derivatives
            monkeypatch.setattr(
                Scene, "contact_derivatives", lambda s, q, v=None: [-m for m in right(s, q, v)]
            )
            robot_check("ball", sizes=QUICK)
        """
    )
    result = suite.runpytest_inprocess(*PLUGIN)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*'ball': failed: derivatives failed*"])


def test_a_suite_that_uses_none_of_it_imports_none_of_it(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        """
        import sys

        def test_nothing_heavy():
            heavy = {"numpy", "pinocchio", "coal", "sphshell_pin", "pydantic", "rich"}
            assert not heavy & set(sys.modules)
        """
    )
    # In a process of its own: this one has it all.
    suite.runpytest_subprocess(*PLUGIN, "-p", "no:cacheprovider").assert_outcomes(passed=1)


def test_the_suite_of_the_page(suite: pytest.Pytester) -> None:
    page = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
    block = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[-1]
    suite.makepyfile(test_contact=block)
    result = suite.runpytest_inprocess(*PLUGIN, "--sphshell-robot=turntable", "test_contact.py")
    result.assert_outcomes(passed=2)


def test_a_parametrisation_of_ones_own_goes_first(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        """
        import pytest

        @pytest.mark.parametrize("sphshell_robot, times", [("ball", 1), ("turntable", 2)])
        def test_own(sphshell_robot, times):
            assert sphshell_robot in ("ball", "turntable")
        """
    )
    suite.runpytest_inprocess(*PLUGIN, "--sphshell-robot", "a1").assert_outcomes(passed=2)
