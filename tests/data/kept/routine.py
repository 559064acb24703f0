"""Routines of a user."""

from pathlib import Path

Path(__file__).with_name("executed").touch()


def find(pose_i, pose_j):
    return [], [], []


def torque(t, q, v, contacts):
    return [0.0] * len(v)


def figure(result, scene):
    return 1.0
