"""One browser for all tests, and runs without pictures."""

import shutil

import pytest

from tests.scenario.files import without_pictures

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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Build the C++ library first and open browsers last: beside compilers pages stand still."""

    def place(item: pytest.Item) -> int:
        if item.path.name == "test_cpp.py":
            return 0
        return 2 if item.get_closest_marker("browser") else 1

    items.sort(key=place)
