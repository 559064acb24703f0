"""Runs that several tests export."""

import pytest

from tests.export.runs import finger_run, turntable_run


@pytest.fixture(scope="session")
def finger():
    return finger_run()


@pytest.fixture(scope="session")
def table():
    return turntable_run()
