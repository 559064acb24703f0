"""Ear clipping of a flat polygon by trying every ear again after every cut."""

import numpy as np

FLAT, TIE, LAST, BLOCKED = 2e-12, 1e-9, 1e-6, -1.0


def clip_ears(points, corners, tolerance):
    """Return triangles (n - 2, 3), numbers of corners, and whether a proper ear was always left.

    points : (p, 2) [m], counter-clockwise; corners : (n,) vertices. The ear of the best shape goes
    first; among equals that of the lowest x, y. An ear is empty but for the vertices it has itself.
    """
    place = points[corners]
    left = list(range(len(corners)))
    score = np.array([_score(place, corners, left, i, tolerance)[0] for i in left])
    triangles, proper, start = [], True, 0
    while len(left) > 3:
        at = left.index(start)
        best = start
        for i in left[at + 1 :] + left[:at]:
            higher = score[i] > score[best] + TIE
            equal = not higher and score[i] >= score[best] - TIE
            if higher or (equal and tuple(place[i]) < tuple(place[best])):
                best = i
        if score[best] <= FLAT:
            proper = False
            shapes = [_score(place, corners, left, i, tolerance)[1] for i in left]
            best = left[int(np.argmax(shapes))]
        at = left.index(best)
        before, after = left[at - 1], left[(at + 1) % len(left)]
        triangles.append(sorted((before, best, after)))
        left.remove(best)
        for i in left:
            if score[i] < 0.0 or i in (before, after):
                score[i] = _score(place, corners, left, i, tolerance)[0]
        start = before
    triangles.append(left)
    a, b, c = place[left]
    return triangles, proper and _shape(a, b, c) > FLAT


def _cross(a, b, p):
    return (b[0] - a[0]) * (p[..., 1] - a[1]) - (b[1] - a[1]) * (p[..., 0] - a[0])


def _shape(a, b, c):
    longest = max(((p - q) ** 2).sum() for p, q in ((a, b), (b, c), (c, a)))
    return _cross(a, b, c) / longest if longest > 0.0 else 0.0


def _score(place, corners, left, i, tolerance):
    """Score of the ear at corner i and its shape."""
    at = left.index(i)
    h, j = left[at - 1], left[(at + 1) % len(left)]
    a, b, c = place[[h, i, j]]
    shape = _shape(a, b, c)
    if shape <= FLAT:
        return BLOCKED, shape
    others = np.array(left)
    others = others[~np.isin(corners[others], corners[[h, i, j]])]
    p = place[others]
    slack = 1e-14 * max(((u - v) ** 2).sum() for u, v in ((a, b), (b, c), (c, a)))
    if np.any(
        (_cross(a, b, p) >= -slack) & (_cross(b, c, p) >= -slack) & (_cross(c, a, p) >= -slack)
    ):
        return BLOCKED, shape
    beyond, along, base = -_cross(c, a, p), (p - a) @ (c - a), ((c - a) ** 2).sum()
    near = (beyond >= 0.0) & (beyond <= tolerance * np.sqrt(base)) & (along > 0.0) & (along < base)
    return (LAST * shape if near.any() else shape), shape
