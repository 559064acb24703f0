"""One browser for all tests, and runs without pictures."""

import shutil

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


@pytest.fixture
def no_pictures():
    """Runs draw nothing."""
    with without_pictures():
        yield


@pytest.hookimpl(tryfirst=True)  # marks are looked at next
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow; build the C++ library first and open browsers last.

    Beside compilers pages stand still.
    """
    slow = set(LIST.read_text("utf-8").split())

    def is_of_the_library(item: pytest.Item) -> bool:
        return item.path.name == "test_cpp.py"

    def place(item: pytest.Item) -> int:
        return 0 if is_of_the_library(item) else 2 if item.get_closest_marker("browser") else 1

    items.sort(key=place)
    for item in items:
        if function_of(item.nodeid) in slow or is_of_the_library(item):
            item.add_marker(pytest.mark.slow)
