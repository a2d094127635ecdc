"""Number of drive periods after which a motion repeats within its noise."""

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidRequest, UnusableData
from ..signals.arrays import Reals
from ..tables import Tabular

LONGEST_PERIOD = 32
_TABLE = 2
"""Number of dimensions of an array of Poincaré points, whose shape is (drive periods, coordinates)."""
STEADY = 2e-3
"""Largest scatter of the points of a steady motion, relative to the orbit; real drives fluctuate."""
_NOISE_MARGIN = 1.5
"""Largest ratio of measured to expected scatter of the points that noise explains."""
_REPEATED = 0.25
"""Largest variance of every n-th point, relative to the variance of all points, for a period n above one."""
_BLOCKS = 10
_DRIFT = 5.0
"""Largest drift [standard errors]; 1 of 250 settled records exceeds it (4 slopes, 8 degrees of freedom)."""

_STEADY_SCATTER = 0.9
"""Minimum ratio of the smaller to the larger scatter of the two halves of a settled record."""


@dataclass(frozen=True, eq=False)
class Points(Tabular):
    """Poincaré points of a motion, one per drive period, and their noise; both relative to the orbit."""

    value: Reals
    """Displacement and velocity, each divided by the size of the orbit, shape (periods, 2)."""
    noise: Reals
    """Standard deviation of the noise of each coordinate, divided by the size of the orbit, shape (2,)."""

    def __post_init__(self) -> None:
        """Raise InvalidRequest for wrong shapes or invalid noise, UnusableData for non-finite points."""
        points, noise = np.shape(self.value), np.shape(self.noise)
        if len(points) != _TABLE or noise != points[1:]:
            raise InvalidRequest(
                f"points of shape {points} with noise of shape {noise} were given; points must have the "
                "shape (periods, 2), and their noise the shape (2,)"
            )
        if not np.all((np.asarray(self.noise) >= 0.0) & np.isfinite(self.noise)):
            raise InvalidRequest(
                f"a noise of {self.noise} is not allowed; give standard deviations, zero or more"
            )
        if not np.all(np.isfinite(self.value)):
            raise UnusableData(
                "points contain values that are not finite; choose a part without lost samples"
            )

    @property
    def spread(self) -> float:
        """RMS distance of the points from their mean; 1 is the size of the orbit."""
        return float(np.sqrt(np.mean(np.var(self.value, axis=0))))

    @property
    def noise_level(self) -> float:
        """RMS noise of the points, relative to the size of the orbit."""
        return float(np.sqrt(np.mean(self.noise**2)))


def shortest_period(points: Points) -> int | None:
    """Return the smallest number of drive periods after which all points repeat within noise, or None.

    To test period n, every nth point is compared over the whole record, because slow changes are small from
    one period to the next. In addition to their noise, these points may scatter by 0.2 % of the orbit
    (unsteady drive). If n exceeds one, their scatter must also be below half of the total scatter.
    """
    by_noise = (_NOISE_MARGIN * points.noise) ** 2
    allowed = by_noise + STEADY**2
    count = len(points.value)
    for period in range(1, min(LONGEST_PERIOD, count // 4) + 1):
        whole = np.full((-(-count // period) * period, _TABLE), np.nan)
        whole[:count] = points.value
        scatter = np.nanvar(whole.reshape(-1, period, _TABLE), axis=0, ddof=1)
        if np.all(np.mean(scatter, axis=0) <= allowed):
            return period
        allowed = np.minimum(allowed, by_noise + _REPEATED * np.var(points.value, axis=0))
    return None


def drift(points: Points) -> float:
    """Return the largest trend of the points' mean or scatter over a record, in standard errors.

    A line is fitted to the values of ten equal parts of the record, and its slope is divided by its standard
    error. A scatter of 0.2 % of the orbit is tolerated as unsteadiness of the drive.
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
    """Return the variance of the means of ten parts of the record, relative to the variance of the points."""
    means = np.array([block.mean(axis=0) for block in np.array_split(points.value, _BLOCKS)])
    whole = float(np.sum(np.var(points.value, axis=0)))
    return float(np.sum(np.var(means, axis=0))) / whole if whole > 0.0 else 0.0


def is_settled(points: Points) -> bool:
    """Return whether mean and scatter of the points are constant over the record."""
    return drift(points) <= _DRIFT


def scatter_drifts(points: Points) -> bool:
    """Return whether the points' scatter changes by a tenth or more over the record, however small it is."""
    sizes = [Points(half, points.noise).spread for half in np.array_split(points.value, 2)]
    relative = Points(points.value / points.spread, points.noise)
    return min(sizes) < _STEADY_SCATTER * max(sizes) and not is_settled(relative)
