"""What the press of fingertip_on_blade is judged by: the force after the touch."""

from __future__ import annotations

SETTLED = 0.3  # [s]: by then the bounce of the first touch has ended


def _forces(result):
    force = result.row_columns()["pairs.tip-blade.normal_force [N]"]
    return force[result.t >= SETTLED]


def least_force(result, scene):
    """Return the least normal force after the touch [N]."""
    return float(_forces(result).min())


def greatest_force(result, scene):
    """Return the greatest normal force after the touch [N]."""
    return float(_forces(result).max())
