"""B-spline surfaces at many places at once."""

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.shell.cad.options import Occ


class SplineSurface:
    """Points and derivatives of a B-spline surface that is not periodic.

    low, high : (2,) parameters of the face, whose ends take the derivatives inside
    """

    def __init__(self, surface: Occ, low: Array, high: Array) -> None:
        count = surface.NbUPoles(), surface.NbVPoles()
        places = [(i, j) for i in range(1, count[0] + 1) for j in range(1, count[1] + 1)]
        poles = np.array([surface.Pole(*place).Coord() for place in places])
        self._rational = bool(surface.IsURational() or surface.IsVRational())
        if self._rational:
            weights = np.array([surface.Weight(*place) for place in places])[:, None]
            poles = np.hstack([weights * poles, weights])
        self._poles = poles.reshape(*count, -1)
        u, v = (np.array(list(one)) for one in (surface.UKnotSequence(), surface.VKnotSequence()))
        self._bases = (
            _Basis(u, surface.UDegree(), float(low[0]), float(high[0])),
            _Basis(v, surface.VDegree(), float(low[1]), float(high[1])),
        )

    def derivatives(self, uv: Array) -> tuple[Array, Array, Array]:
        """Points and derivatives by u and by v at parameters uv (n, 2), (n, 3) each."""
        (rows, u, along_u), (columns, v, along_v) = (
            basis.at(one) for basis, one in zip(self._bases, uv.T, strict=True)
        )
        net = self._poles[rows[:, :, None], columns[:, None, :]]
        across, slopes = (np.einsum("ni,nijx->njx", one, net) for one in (u, along_u))
        pairs = ((v, across), (v, slopes), (along_v, across))
        point, by_u, by_v = (np.einsum("nj,njx->nx", *pair) for pair in pairs)
        if self._rational:
            weight, slope_u, slope_v = point[:, 3:], by_u[:, 3:], by_v[:, 3:]
            point = point[:, :3] / weight
            by_u = (by_u[:, :3] - slope_u * point) / weight
            by_v = (by_v[:, :3] - slope_v * point) / weight
        return point, by_u, by_v


class _Basis:
    """The basis functions of one parameter, between its values `low` and `high`."""

    def __init__(self, knots: Array, degree: int, low: float, high: float) -> None:
        self._knots, self._degree = knots, degree
        most = len(knots) - degree - 2
        self._first = int(np.clip(np.searchsorted(knots, low, "right") - 1, degree, most))
        self._last = int(np.clip(np.searchsorted(knots, high) - 1, self._first, most))

    def at(self, places: Array) -> tuple[Longs, Array, Array]:
        """Numbers, values and derivatives (n, degree + 1) of those that are not zero."""
        knots, degree = self._knots, self._degree
        span = np.searchsorted(knots, places, "right") - 1
        span = np.clip(span, self._first, self._last)
        values, none = [np.ones(len(places))], np.zeros(len(places))
        shares: list[Array] = []
        # Cox and de Boor's recursion, as in Piegl and Tiller, The NURBS Book (1997), A2.2.
        for order in range(1, degree + 1):
            ends = [(knots[span + 1 - order + k], knots[span + 1 + k]) for k in range(order)]
            shares = [one / (b - a) for one, (a, b) in zip(values, ends, strict=True)]
            rising = [(places - a) * one for one, (a, _) in zip(shares, ends, strict=True)]
            falling = [(b - places) * one for one, (_, b) in zip(shares, ends, strict=True)]
            values = [down + up for down, up in zip([*falling, none], [none, *rising], strict=True)]
        slopes = [a - b for a, b in zip([none, *shares], [*shares, none], strict=True)]
        numbers = span[:, None] + np.arange(-degree, 1)
        return numbers, np.stack(values, axis=1), degree * np.stack(slopes, axis=1)
