"""One browser for all tests, runs without pictures, the same random numbers in any order."""

import os
import shutil
import signal

import pinocchio as pin
import pytest

from tests.scenario.files import without_pictures
from tests.slow import LIST, function_of

# Software rendering, on machines that have no graphics card.
FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--host-resolver-rules=MAP evil.example 127.0.0.1",  # a name that was made to lead here
]

# Tests compute anew what a cache would keep; those of the caches have folders of their own.
os.environ["SPHSHELL_PIN_CACHE"] = ""


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        pytest.skip("no Chromium on this machine")
    with playwright.sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=program, args=FLAGS)
        yield running
        running.close()


@pytest.fixture(autouse=True)
def same_random_numbers():
    """Pinocchio draws the same ones in each test, whatever ran before."""
    pin.seed(0)


@pytest.fixture
def no_pictures():
    """Runs draw nothing."""
    with without_pictures():
        yield


@pytest.fixture
def keyboard():
    """Let SIGINT interrupt, as on a terminal; a shell's background jobs ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.hookimpl(tryfirst=True)  # marks are looked at next
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow; open browsers first, then build what uses the C++ library."""
    slow = set(LIST.read_text("utf-8").split())

    def is_of_the_library(item: pytest.Item) -> bool:
        return item.path.name == "test_cpp.py"

    def place(item: pytest.Item) -> int:
        return 0 if in_browser(item) else 1 if is_of_the_library(item) else 2

    items.sort(key=place)
    for item in items:
        if function_of(item.nodeid) in slow or is_of_the_library(item):
            item.add_marker(pytest.mark.slow)


def in_browser(item: pytest.Item) -> bool:
    return item.get_closest_marker("browser") is not None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let browsers go first.

    A page's picture is drawn by threads that yield to whatever computes: beside two busy processes
    of their own priority it takes 2 s instead of 17 ms. Tests in browsers are the first of the
    first process, and what the others do has the lowest priority.
    """
    if "PYTEST_XDIST_WORKER" in os.environ and not in_browser(item):
        os.nice(19)  # no lower than 19, however often
