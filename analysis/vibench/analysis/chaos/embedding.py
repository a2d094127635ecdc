"""A motion as points in a space of delays, and the nearest neighbours of each point."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Flags, Integers, Reals

_MOST_TRIED = 64
"""Neighbours looked at before a point is given up: those in its own time window do not count."""


def embedded(series: Reals, delays: int) -> Reals:
    """Put each value beside those before it.

    Parameters
    ----------
    series
        Shape (n,) or (n, channels).
    delays
        How many successive values make one point.

    Returns
    -------
    Shape (n - delays + 1, delays * channels), oldest value first.

    """
    columns = series.reshape(series.shape[0], -1)
    if delays < 1:
        raise InvalidRequest(f"an embedding of {delays} delays is not allowed; give one or more")
    points = columns.shape[0] - delays + 1
    if points < 2:
        raise NotEnoughData(f"{columns.shape[0]} values do not make an embedding of {delays}; measure longer")
    return np.hstack([columns[first : first + points] for first in range(delays)])


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest other point of each point that has one."""

    point: Integers
    neighbour: Integers
    distance: Reals
    """Shape (pairs,)."""


def nearest_neighbours(points: Reals, apart: int, last: int, floor: float = 0.0) -> Neighbours:
    """Find the nearest point that is not near in time.

    Parameters
    ----------
    points
        Shape (n, dimensions).
    apart
        Theiler's window: points less than so many steps apart in time are no neighbours, since one
        is merely the other a little later (Theiler, Phys. Rev. A 34 (1986) 2427).
    last
        Only points before this index take part, so that both can be followed beyond it.
    floor
        Neighbours at this distance or nearer do not count: noise decides about them.

    """
    tree = cKDTree(points[:last])
    wanted = np.arange(last)
    found = np.full(last, -1, dtype=np.int64)
    distance = np.full(last, np.nan)
    tried = 4
    while wanted.size and tried <= min(4 * _MOST_TRIED, 4 * last):
        # A list of ranks keeps the answer two-dimensional, whatever its length.
        ranks = list(range(1, min(tried, last) + 1))
        reach, index = (np.asarray(each) for each in tree.query(points[wanted], k=ranks))
        allowed = (np.abs(index - wanted[:, np.newaxis]) >= apart) & (reach > floor)
        has = allowed.any(axis=1)
        first = np.argmax(allowed, axis=1)
        rows = np.flatnonzero(has)
        found[wanted[rows]] = index[rows, first[rows]]
        distance[wanted[rows]] = reach[rows, first[rows]]
        wanted = wanted[~has]
        tried *= 4
    point = np.flatnonzero(found >= 0)
    return Neighbours(point, found[point], distance[point])


def neighbours_apart(points: Reals, apart: int, count: int) -> tuple[Integers, Flags]:
    """Find several neighbours of each point that are ``apart`` steps from it in time or more.

    Returns
    -------
    The nearest points of each, and which of them are its neighbours, at most ``count``; shapes (n, tried).

    """
    tried = min(count + 2 * apart - 1, len(points))
    index = np.asarray(cKDTree(points).query(points, k=list(range(1, tried + 1)))[1])
    allowed = np.abs(index - np.arange(len(points))[:, np.newaxis]) >= apart
    return index, allowed & (np.cumsum(allowed, axis=1) <= count)
