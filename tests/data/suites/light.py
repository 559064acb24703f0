"""A suite that uses nothing of the plugin."""

import sys


def test_nothing_heavy():
    heavy = {"numpy", "pinocchio", "coal", "sphshell_pin", "pydantic", "rich"}
    assert not heavy & set(sys.modules)
