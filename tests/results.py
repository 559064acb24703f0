"""What tests compare of two results."""

from dataclasses import fields

import numpy as np

import sphshell_pin as sp


def assert_same_bits(one: sp.Result, other: sp.Result) -> None:
    """Rows, contacts, energies, events and figures are the same."""
    for name in ("t", "q", "v"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name)
    for part in ("contacts", "energy"):
        first, second = getattr(one, part), getattr(other, part)
        for field in fields(first):
            a, b = (getattr(it, field.name) for it in (first, second))
            np.testing.assert_array_equal(a, b, f"{part}.{field.name}")
    assert one.pairs == other.pairs
    assert one.events == other.events
    assert one.stats.pairs == other.stats.pairs
    assert one.stats.joints == other.stats.joints
    assert one.stats.steps == other.stats.steps


def damaged(file, name, change):
    """Change an array of a file of results, or take it out where `change` returns None."""
    with np.load(file) as whole:
        arrays = dict(whole)
    changed = change(arrays.pop(name))
    if changed is not None:
        arrays[name] = np.asarray(changed)
    np.savez(file, **arrays)
    return file
