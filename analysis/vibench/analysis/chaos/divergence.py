"""How fast neighbouring points of a recorded motion part: the largest Lyapunov exponent from data."""

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


_SATURATION = 0.25
"""Distances beyond this part of the typical one feel the size of the attractor, not its stretching."""
_ABOVE_NOISE = 3.0
"""Distances below so many times the noise are made by it."""
_SHORTEST_FIT = 3
"""Steps a line needs to be a statement."""
_BLOCKS = 10
FEWEST_PAIRS = 50


@dataclass(frozen=True, eq=False)
class Divergence:
    """The mean logarithm of the distance of former neighbours, step by step."""

    logarithm: Reals
    """Mean ln(distance), shape (steps + 1,)."""
    size: float
    """ln of the typical distance of two points of the motion."""
    first: int
    last: int
    """Steps between which the line was fitted; last - first is 0 where there was no room for one."""
    exponent: float
    """Slope [1/step]; NaN where no line could be fitted."""
    sd_exponent: float
    """Scatter of the slope over tenths of the record."""
    pairs: int

    @property
    def is_resolved(self) -> bool:
        """Whether there was room for a line between noise and saturation."""
        return self.last - self.first >= _SHORTEST_FIT


def divergence(points: Reals, *, steps: int = 20, apart: int = 1, noise: float = 0.0) -> Divergence:
    """Follow neighbouring points until they part.

    Rosenstein, Collins and De Luca, Physica D 65 (1993) 117. The fit begins where distances stand above
    the noise and ends before they feel the size of the attractor; a slope fitted across either end is a
    property of the noise or of the size. Where nothing is left between, there is no exponent.

    Raises NotEnoughData when fewer than 50 points have a neighbour.

    Parameters
    ----------
    points
        The motion, shape (n, dimensions): one point a step.
    steps
        How long pairs are followed.
    apart
        Neighbours are at least so many steps apart in time.
    noise
        Standard deviation of the noise on one coordinate, in the coordinates' unit.

    """
    count, dimensions = points.shape
    last = count - steps
    floor = noise * np.sqrt(2 * dimensions)
    found = nearest_neighbours(points, apart, last, floor=floor) if last > 1 else None
    if found is None or found.point.size < FEWEST_PAIRS:
        have = 0 if found is None else found.point.size
        raise NotEnoughData(
            f"of {count} points {have} have a neighbour that can be followed for {steps} steps, and "
            f"{FEWEST_PAIRS} are needed; measure longer"
        )
    logarithms = np.empty((steps + 1, found.point.size))
    for step in range(steps + 1):
        distance = np.linalg.norm(points[found.point + step] - points[found.neighbour + step], axis=1)
        logarithms[step] = np.log(np.maximum(distance, np.finfo(np.float64).tiny))
    mean = logarithms.mean(axis=1)
    size = _typical(points)
    first, final = _fit_range(mean, size, floor, apart)
    return Divergence(mean, size, first, final, *_slope(logarithms, first, final), int(found.point.size))


def _typical(points: Reals) -> float:
    """Mean ln distance of points that have nothing to do with each other: half the record apart."""
    half = points.shape[0] // 2
    distance = np.linalg.norm(points[half : 2 * half] - points[:half], axis=1)
    return float(np.mean(np.log(np.maximum(distance, np.finfo(np.float64).tiny))))


def _fit_range(mean: Reals, size: float, floor: float, apart: int) -> tuple[int, int]:
    top = size + np.log(_SATURATION)
    above = np.flatnonzero(mean > np.log(_ABOVE_NOISE * floor)) if floor > 0.0 else np.arange(mean.size)
    beyond = np.flatnonzero(mean > top)
    first = int(above[0]) if above.size else mean.size - 1
    # Within its own memory a difference turns into the stretching direction: no part of the line.
    first = max(first, apart)
    last = int(beyond[0]) - 1 if beyond.size else mean.size - 1
    return (first, last) if last - first >= _SHORTEST_FIT else (first, first)


def _slope(logarithms: Reals, first: int, last: int) -> tuple[float, float]:
    if last == first:
        return float("nan"), float("nan")
    steps = np.arange(first, last + 1)
    parts = np.array_split(logarithms[first : last + 1], _BLOCKS, axis=1)
    slopes = [float(np.polyfit(steps, part.mean(axis=1), 1)[0]) for part in parts]
    whole = float(np.polyfit(steps, logarithms[first : last + 1].mean(axis=1), 1)[0])
    return whole, float(np.std(slopes, ddof=1)) / np.sqrt(_BLOCKS)
