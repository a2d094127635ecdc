"""After how many drive periods a motion repeats itself, as far as its noise lets one see."""

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Reals
from ..tables import Labelled

LONGEST_PERIOD = 32
_TABLE = 2
"""Dimensions of points: periods and coordinates."""
STEADY = 2e-3
"""A motion that repeats to this part of its size is steady: no drive is steadier."""
_NOISE_MARGIN = 1.5
"""Measured scatter over the expected one, up to which noise explains it."""
_REPEATED = 0.25
"""Part of the points' variance that a period above one may leave: any period leaves less than all."""
_BLOCKS = 10
_DRIFT = 5.0
"""Standard errors of a slope that a settled record reaches once in 250 (four figures, eight free blocks)."""

_STEADY_SCATTER = 0.9
"""Scatter of one half of a record over that of the other, above which it does not decay."""


@dataclass(frozen=True, eq=False)
class Points(Labelled):
    """Motion once a drive period, with what it is to be judged by; coordinates over their sizes."""

    value: Reals
    """Displacement and velocity over the size of the orbit, shape (periods, 2)."""
    noise: Reals
    """Standard deviation of the noise on each coordinate, in the same measure, shape (2,)."""

    def __post_init__(self) -> None:
        """Raise InvalidRequest for other shapes, or noise that is none; UnusableData for lost points."""
        points, noise = np.shape(self.value), np.shape(self.noise)
        if len(points) != _TABLE or noise != points[1:]:
            raise InvalidRequest(
                f"points of shape {points} with noise of shape {noise} were given; points are of shape "
                "(periods, 2), their noise of shape (2,)"
            )
        if not np.all((np.asarray(self.noise) >= 0.0) & np.isfinite(self.noise)):
            raise InvalidRequest(f"a noise of {self.noise} is none; give standard deviations, zero or more")
        if not np.all(np.isfinite(self.value)):
            raise UnusableData("points hold values that are not finite; give a stretch in which none is lost")

    @property
    def spread(self) -> float:
        """Root mean square distance from the mean point; 1 is the size of the orbit."""
        return float(np.sqrt(np.mean(np.var(self.value, axis=0))))

    @property
    def noise_level(self) -> float:
        """Root mean square of the noise."""
        return float(np.sqrt(np.mean(self.noise**2)))


def shortest_period(points: Points, longest: int = LONGEST_PERIOD) -> int | None:
    """Find the fewest drive periods after which all points repeat within noise; None if they do not.

    The points of each phase of the period are compared over the whole record: what changes slowly differs
    little from one period to the next. A scatter of 0.2 % of the orbit is granted to the drive, and to a
    period above one no more than half of the points' own, beyond their noise.
    """
    by_noise = (_NOISE_MARGIN * points.noise) ** 2
    allowed = by_noise + STEADY**2
    count = len(points.value)
    for period in range(1, min(longest, count // 4) + 1):
        whole = np.full((-(-count // period) * period, _TABLE), np.nan)
        whole[:count] = points.value
        scatter = np.nanvar(whole.reshape(-1, period, _TABLE), axis=0, ddof=1)
        if np.all(np.mean(scatter, axis=0) <= allowed):
            return period
        allowed = np.minimum(allowed, by_noise + _REPEATED * np.var(points.value, axis=0))
    return None


def drift(points: Points) -> float:
    """Say by how many standard errors mean or scatter grow or shrink over a record.

    The slope through the figures of tenths of the record, over its standard error; a steadiness of 0.2 % of
    the orbit is granted to the drive.
    """
    blocks = np.array_split(points.value, _BLOCKS)
    place = np.linspace(-0.5, 0.5, _BLOCKS)
    worst = 0.0
    for figure in (
        np.array([block.mean(axis=0) for block in blocks]),
        np.array([block.std(axis=0) for block in blocks]),
    ):
        slope = place @ figure / (place @ place)
        left = figure - figure.mean(axis=0) - np.outer(place, slope)
        variance = np.sum(left**2, axis=0) / (_BLOCKS - 2) + STEADY**2 / _BLOCKS
        worst = max(worst, float(np.max(np.abs(slope) / np.sqrt(variance / (place @ place)))))
    return worst


def slow_share(points: Points) -> float:
    """Return the part of the points' variance that the means of tenths of the record show."""
    means = np.array([block.mean(axis=0) for block in np.array_split(points.value, _BLOCKS)])
    whole = float(np.sum(np.var(points.value, axis=0)))
    return float(np.sum(np.var(means, axis=0))) / whole if whole > 0.0 else 0.0


def is_settled(points: Points) -> bool:
    """Whether mean and scatter stay what they are over the record."""
    return drift(points) <= _DRIFT


def scatter_drifts(points: Points) -> bool:
    """Whether the scatter about the mean point changes by a tenth, even below a drive's steadiness."""
    sizes = [Points(half, points.noise).spread for half in np.array_split(points.value, 2)]
    relative = Points(points.value / points.spread, points.noise)
    return min(sizes) < _STEADY_SCATTER * max(sizes) and not is_settled(relative)
