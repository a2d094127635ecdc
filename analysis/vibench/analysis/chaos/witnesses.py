"""Tests for chaos in a recorded motion: divergence of neighbours, the 0-1 test, and surrogates."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.spatial import cKDTree
from scipy.special import ndtri

from ..errors import InvalidRequest, NotEnoughData
from ..signals import Flags, Integers, Reals

_MOST_TRIED = 64
"""A quarter of the largest number of nearest points searched for a neighbour that is distant in time."""


def delay_vectors(series: Reals, delays: int) -> Reals:
    """Return delay vectors of a series.

    Returns an array of shape (n - delays + 1, delays * channels), oldest value first.

    Parameters
    ----------
    series
        Shape (n,) or (n, channels).
    delays
        Number of successive values per point.
    """
    columns = series.reshape(series.shape[0], -1)
    if delays < 1:
        raise InvalidRequest(f"an embedding of {delays} delays is not allowed; give one delay or more")
    points = columns.shape[0] - delays + 1
    if points < 2:
        raise NotEnoughData(
            f"{columns.shape[0]} values are too few for an embedding of {delays} delays; measure longer"
        )
    return np.hstack([columns[first : first + points] for first in range(delays)])


def nearest_neighbours(points: Reals, apart: int, last: int, floor: float = 0.0) -> tuple[Integers, Integers]:
    """Find, for each point, the nearest point that is distant in time.

    Returns the indices of the points that have such a neighbour, and the indices of these neighbours.

    Parameters
    ----------
    points
        Shape (n, dimensions).
    apart
        Theiler's window: points less than this many steps apart in time are not neighbours, since they belong
        to one stretch of the orbit (Theiler, Phys. Rev. A 34 (1986) 2427).
    last
        Only points before this index are used, so that both points of a pair have successors.
    floor
        Neighbours closer than this are skipped, because noise dominates their distance.
    """
    tree = cKDTree(points[:last])
    wanted = np.arange(last)
    found = np.full(last, -1, dtype=np.int64)
    tried = 4
    while wanted.size and tried <= min(4 * _MOST_TRIED, 4 * last):
        # For a list of ranks, `query` returns a two-dimensional array, even for one neighbour.
        ranks = list(range(1, min(tried, last) + 1))
        reach, index = (np.asarray(each) for each in tree.query(points[wanted], k=ranks))
        allowed = (np.abs(index - wanted[:, np.newaxis]) >= apart) & (reach > floor)
        has = allowed.any(axis=1)
        first = np.argmax(allowed, axis=1)
        rows = np.flatnonzero(has)
        found[wanted[rows]] = index[rows, first[rows]]
        wanted = wanted[~has]
        tried *= 4
    point = np.flatnonzero(found >= 0)
    return point, found[point]


def neighbours_apart(points: Reals, apart: int, count: int) -> tuple[Integers, Flags]:
    """Find several neighbours of each point, at least ``apart`` steps away in time.

    Returns the indices of each point's nearest points, and flags that select at most ``count`` of these
    points as neighbours; shapes (n, tried).
    """
    tried = min(count + 2 * apart - 1, len(points))
    index = np.asarray(cKDTree(points).query(points, k=list(range(1, tried + 1)))[1])
    allowed = np.abs(index - np.arange(len(points))[:, np.newaxis]) >= apart
    return index, allowed & (np.cumsum(allowed, axis=1) <= count)


_SATURATION = 0.25
"""Distance of neighbours relative to typical distances; above it, the attractor's size limits the growth."""
_ABOVE_NOISE = 3.0
"""The line is fitted to steps at which the neighbours' distance is at least this multiple of the noise."""
_SHORTEST_FIT = 3
"""Minimum number of steps for fitting a line to the divergence."""
_BLOCKS = 10
FEWEST_PAIRS = 50


@dataclass(frozen=True, eq=False)
class Divergence:
    """Growth of the mean logarithmic distance between points that start close together."""

    first: int
    last: int
    """First and last step of the fitted line; equal if there were too few steps for a line."""
    exponent: float
    """Slope of the fitted line [1/step]; NaN if no line was fitted."""
    sd_exponent: float
    """Standard error of the slope, from the scatter of the slopes of ten parts of the record."""

    @property
    def is_resolved(self) -> bool:
        """Return whether a line could be fitted between noise and saturation."""
        return self.last - self.first >= _SHORTEST_FIT


def divergence(points: Reals, *, steps: int = 20, apart: int = 1, noise: float = 0.0) -> Divergence:
    """Return the divergence of neighbouring points over time.

    Rosenstein, Collins and De Luca, Physica D 65 (1993) 117. The fit starts where distances exceed the noise
    and ends before the size of the attractor limits them. If too few steps remain, the exponent is NaN.

    Raises NotEnoughData when fewer than 50 points have a neighbour.

    Parameters
    ----------
    points
        The motion, shape (n, dimensions), one point per step.
    steps
        Number of steps over which pairs of points are followed.
    apart
        Neighbours are at least this many steps apart in time.
    noise
        Standard deviation of the noise on one coordinate, in the coordinates' unit.
    """
    count, dimensions = points.shape
    last = count - steps
    floor = noise * np.sqrt(2 * dimensions)
    point, neighbour = nearest_neighbours(points, apart, max(last, 0), floor=floor)
    if point.size < FEWEST_PAIRS:
        raise NotEnoughData(
            f"{point.size} of {count} points have a neighbour that can be followed for {steps} steps, but "
            f"{FEWEST_PAIRS} such points are needed; measure longer"
        )
    logarithms = np.empty((steps + 1, point.size))
    for step in range(steps + 1):
        distance = np.linalg.norm(points[point + step] - points[neighbour + step], axis=1)
        logarithms[step] = np.log(np.maximum(distance, np.finfo(np.float64).tiny))
    mean = logarithms.mean(axis=1)
    # The mean logarithm of the distance between points half a record apart in time is the typical distance.
    half = count // 2
    distance = np.linalg.norm(points[half : 2 * half] - points[:half], axis=1)
    typical = float(np.mean(np.log(np.maximum(distance, np.finfo(np.float64).tiny))))
    first, final = _fit_range(mean, typical, floor, apart)
    return Divergence(first, final, *_slope(logarithms, first, final))


def _fit_range(mean: Reals, size: float, floor: float, apart: int) -> tuple[int, int]:
    top = size + np.log(_SATURATION)
    above = np.flatnonzero(mean > np.log(_ABOVE_NOISE * floor)) if floor > 0.0 else np.arange(mean.size)
    beyond = np.flatnonzero(mean > top)
    first = int(above[0]) if above.size else mean.size - 1
    # Leave out the first steps, in which the difference turns into the direction of growth.
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


_LOWEST, _HIGHEST = np.pi / 5, 4 * np.pi / 5
"""Range of c in the 0-1 test; other frequencies cause resonances (Gottwald and Melbourne, section 3.1)."""
_FREQUENCIES = 100
_CUT = 10
"""The mean square displacement is computed for lags up to the series length divided by this number."""
FEWEST = 200
OVERSAMPLED = 0.8
"""Correlation of successive values above which a series is sampled too finely for the 0-1 test."""


@dataclass(frozen=True)
class ZeroOne:
    """Result of the 0-1 test."""

    k: float
    """Median of the correlations K_c; near 0 for regular motion, near 1 for chaos *or noise*."""
    spread: float
    """Half the interquartile range of the correlations K_c."""
    neighbour_correlation: float
    """Correlation of each value of the series with the next value."""

    @property
    def is_oversampled(self) -> bool:
        """Return whether successive values are too strongly correlated for K to be valid."""
        return self.neighbour_correlation > OVERSAMPLED


def zero_one(series: Reals, *, seed: int = 0) -> ZeroOne:
    """Apply the 0-1 test to a series with one value per drive period.

    Gottwald and Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129, the correlation method with the oscillatory
    term removed (eqs. 3.1 to 3.6). The test mistakes noise for chaos, and oversampled chaos for regular
    motion, so it is never used alone.

    Raises NotEnoughData when the series is too short.

    Parameters
    ----------
    series
        Shape (n,), at least 200 values.
    seed
        Seed of the frequencies c.
    """
    count = series.size
    if count < FEWEST:
        raise NotEnoughData(f"the 0-1 test needs {FEWEST} values, but was given {count}; measure longer")
    centred = series - series.mean()
    power = float(np.mean(centred**2))
    if power == 0.0:
        return ZeroOne(0.0, 0.0, 0.0)
    neighbours = float(np.mean(centred[1:] * centred[:-1])) / power
    frequencies = np.random.default_rng(seed).uniform(_LOWEST, _HIGHEST, _FREQUENCIES)
    correlations = [_correlation(series, each) for each in frequencies]
    lower, middle, upper = np.quantile(correlations, (0.25, 0.5, 0.75))
    return ZeroOne(float(middle), float(0.5 * (upper - lower)), neighbours)


def _correlation(series: Reals, frequency: float) -> float:
    """Return K_c, the correlation of the mean square displacement with time."""
    count = series.size
    lags = np.arange(1, count // _CUT + 1)
    left = count - lags.size
    walk = np.cumsum(series * np.exp(1j * frequency * np.arange(1, count + 1)))
    walk -= walk.mean()
    # Mean of |later - earlier|^2 over all starts, from running sums and a correlation by FFT.
    squares = np.append(0.0, np.cumsum(np.abs(walk) ** 2))
    size = fft.next_fast_len(count)
    products = fft.ifft(fft.fft(walk, size) * np.conj(fft.fft(walk[:left], size)))[lags].real
    displacement = (squares[left] + squares[left + lags] - squares[lags] - 2 * products) / left
    oscillation = series.mean() ** 2 * (1 - np.cos(frequency * lags)) / (1 - np.cos(frequency))
    return float(np.corrcoef(lags, displacement - oscillation)[0, 1])


SURROGATES = 39
"""Number of surrogates; the probability that linear noise has the smallest statistic is 1/40 = 0.025."""
_DELAYS, _NEIGHBOURS = 4, 10
"""Number of values in a delay vector, and number of similar vectors that predict the next value."""
_MOST_VALUES = 1 << 18
"""Number of values in the surrogates that are made at once, to limit memory."""
_ITERATIONS = 200
_SETTLED = 1e-8
_LAGS = (1, 2, 3, 4)
_SPECTRUM_KEPT = 0.05
"""Largest relative error of the spectrum of a valid surrogate."""


@dataclass(frozen=True)
class SurrogateTest:
    """Test of a series against linear noise with the same spectrum and values."""

    statistic: float
    surrogates: tuple[float, ...]
    spectrum_error: float
    """Largest relative error of a surrogate's spectrum."""
    least_margin: float = 0.0
    """Minimum `margin` that rejects linear noise; a smaller margin may occur by chance."""

    @property
    def margin(self) -> float:
        """Distance of the statistic below the surrogates' mean, in standard deviations of the surrogates."""
        away = float(np.mean(self.surrogates)) - self.statistic
        return away / max(float(np.std(self.surrogates, ddof=1)), np.finfo(np.float64).tiny)

    @property
    def p(self) -> float:
        """Probability that linear noise gives as small a statistic as the series (one-sided rank test)."""
        smaller = sum(each <= self.statistic for each in self.surrogates)
        return (smaller + 1) / (len(self.surrogates) + 1)

    @property
    def is_valid(self) -> bool:
        """Return whether the surrogates have the spectrum of the series, as a valid test requires."""
        return self.spectrum_error <= _SPECTRUM_KEPT

    @property
    def rejects_linear_noise(self) -> bool:
        """Return whether the test is valid and rejects linear noise."""
        is_lowest = self.p <= 1 / (len(self.surrogates) + 1)
        return self.is_valid and is_lowest and self.margin >= self.least_margin


def surrogates(series: Reals, rng: np.random.Generator, count: int) -> tuple[Reals, Reals]:
    """Return surrogates: the values of the series in random orders that keep the spectrum of the series.

    Schreiber and Schmitz, Phys. Rev. Lett. 77 (1996) 635 (iterated amplitude-adjusted Fourier transform).
    Returns the surrogates, shape (count, n), and the relative errors of their spectra (root mean square).
    """
    values = np.sort(series)
    wanted = np.abs(fft.rfft(series - series.mean()))
    scale = float(np.sqrt(np.mean(wanted**2)))
    shuffled = np.array([rng.permutation(series) for _ in range(count)])
    errors, changing = np.full(count, np.inf), np.arange(count)
    for _ in range(_ITERATIONS):
        spectra = fft.rfft(shuffled[changing] - series.mean())
        sizes, before = np.abs(spectra), errors[changing]
        errors[changing] = np.sqrt(np.mean((sizes - wanted) ** 2, axis=1)) / scale
        is_changing = before - errors[changing] >= _SETTLED
        changing, spectra, sizes = changing[is_changing], spectra[is_changing], sizes[is_changing]
        if not changing.size:
            break
        turns = np.divide(spectra, sizes, out=np.ones_like(spectra), where=sizes > 0.0)
        places = np.argsort(fft.irfft(wanted * turns, series.size), axis=1)
        shuffled[changing[:, np.newaxis], places] = values
    return shuffled, errors


def prediction_error(series: Reals) -> float:
    """Return the relative error of predicting each value from the successors of similar delay vectors.

    Zeroth-order nonlinear prediction (Kantz and Schreiber, Nonlinear Time Series Analysis (2004), section
    4.2), mean over neighbours. The error is far below 1 for a deterministic series, near 1 otherwise. With
    one neighbour or fewer delays, more of the chaotic motions with impacts remained undecided.
    """
    pasts, next_values = delay_vectors(series, _DELAYS)[:-1], series[_DELAYS:]
    # Delay vectors that overlap in time are not neighbours.
    index, nearest = neighbours_apart(pasts, _DELAYS, _NEIGHBOURS)
    has = nearest.any(axis=1)
    foretold = np.sum(next_values[index[has]] * nearest[has], axis=1) / np.sum(nearest[has], axis=1)
    miss = next_values[has] - foretold
    return float(np.sqrt(np.mean(miss**2)) / np.std(series))


def time_symmetry(series: Reals) -> float:
    """Return the negative rms, over lags of 1 to 4, of the skewness of a series' increments.

    Linear noise is symmetric in time, also after a static nonlinearity; dissipative chaos rarely is
    (Schreiber and Schmitz, Physica D 142 (2000) 346, section 5).
    """
    rises = [series[lag:] - series[:-lag] for lag in _LAGS]
    skewness = [np.mean(each**3) / np.mean(each**2) ** 1.5 for each in rises]
    return -float(np.sqrt(np.mean(np.square(skewness))))


def surrogate_test(
    series: Reals, statistic: Callable[[Reals], float] = prediction_error, *, seed: int = 0
) -> SurrogateTest:
    """Compare a statistic of a series with its values for surrogates; determinism makes the statistic small.

    Parameters
    ----------
    series
        Shape (n,), one value per drive period.
    statistic
        `prediction_error` or `time_symmetry`.
    seed
        Seed of the surrogates.
    """
    # Trim the series so that its ends match: a jump between the ends would look like noise in the spectrum.
    most = max(1, series.size // 10)
    heads = series[:most]
    tails = series[series.size - most :]
    slopes_head = series[1 : most + 1] - heads
    slopes_tail = np.diff(series[series.size - most - 1 :])
    gap = np.abs(heads[:, np.newaxis] - tails) + np.abs(slopes_head[:, np.newaxis] - slopes_tail)
    head, tail = np.unravel_index(int(np.argmin(gap)), gap.shape)
    matched = series[int(head) : series.size - most + int(tail) + 1]
    rng, together = np.random.default_rng(seed), max(1, _MOST_VALUES // matched.size)
    counts = [min(together, SURROGATES - first) for first in range(0, SURROGATES, together)]
    made, errors = zip(*(surrogates(matched, rng, count) for count in counts), strict=True)
    return SurrogateTest(
        statistic=statistic(matched),
        surrogates=tuple(statistic(each) for group in made for each in group),
        spectrum_error=float(np.max(np.concatenate(errors))),
    )


def normal_scores(series: Reals) -> Reals:
    """Replace values by normal scores of the same rank, which undoes a static monotone nonlinearity.

    Surrogates of the distorted values would match the spectrum only after iterations.
    """
    rank = np.argsort(np.argsort(series))
    return np.asarray(ndtri((rank + 0.5) / series.size))
