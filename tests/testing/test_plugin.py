"""The pytest plugin, in suites of its own: it checks what it should, and is not there otherwise."""

import re
from pathlib import Path

import pytest

# Here, as suites in this process forget what they load, and NumPy is loaded once per process.
import sphshell_pin.study.robot_check  # noqa: F401
from tests.texts import text_of

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
    suite.makepyfile(text_of("suites/robots.py"))
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
    suite.makepyfile(text_of("suites/scenes.py"))
    suite.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=3)


def test_broken_scenes_fail(suite: pytest.Pytester) -> None:
    suite.makepyfile(text_of("suites/broken.py"))
    result = suite.runpytest_inprocess(*PLUGIN)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*'ball': failed: derivatives failed*"])


def test_a_suite_that_uses_none_of_it_imports_none_of_it(suite: pytest.Pytester) -> None:
    suite.makepyfile(text_of("suites/light.py"))
    # In a process of its own: this one has it all.
    suite.runpytest_subprocess(*PLUGIN, "-p", "no:cacheprovider").assert_outcomes(passed=1)


def test_the_suite_of_the_page(suite: pytest.Pytester) -> None:
    page = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
    block = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[-1]
    suite.makepyfile(test_contact=block)
    result = suite.runpytest_inprocess(*PLUGIN, "--sphshell-robot=turntable", "test_contact.py")
    result.assert_outcomes(passed=2)


def test_a_parametrisation_of_ones_own_goes_first(suite: pytest.Pytester) -> None:
    suite.makepyfile(text_of("suites/own_parameters.py"))
    suite.runpytest_inprocess(*PLUGIN, "--sphshell-robot", "a1").assert_outcomes(passed=2)
