"""Motion and impacts without a contact law, with the contact force as an unknown.

Two relations hold for any law: z follows from m0's motion through a stable first-order filter, and the sum of
m1 y'' and m2 z'' contains no contact force. A Kalman smoother combines both, with a white force held over
each sample. In flight the force is zero. Windows around the peaks of the force are found first. Elsewhere the
force is then set to zero (switched variance, Rogers and Friis, arXiv 2303.03858). With a force in flight, the
double integral of the second relation would drift.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..signals.arrays import Flags, Reals, runs_of
from ._filtering import FilterPredictions, FilterState, MotionModel, RtsTrack, run_filter, smooth
from ._prepared_motion import PreparedMotion
from ._tracking_model import STATES

_PEAK_BAND_HZ = 4500.0
"""Bandwidth in which peaks of the force are sought: a compromise between short collisions and noise."""
_WINDOW_S = 6e-5
"""Half width of a window around a peak of the contact force [s]."""
_PEAK_OVER_MEDIAN = 6.0
_LEAST_PEAK = 0.1
"""Smallest peak of the force at an impact, relative to the first guess of the force."""
CLOSED_SHARE = 3e-4
"""Standard deviation of the force between impacts, relative to the first guess of the force."""
_LEAST_GUESS_N = 1e-3
_SURPRISE = 25.0
"""Squared normalised innovation that shows an overlooked impact."""
_MEDIAN_OF_SQUARE = 0.455
"""Median of the square of a standard normal variable."""
_RERUNS = 3
_START_UP_S = 4e-3
"""Start-up time of the filter, in which innovations are ignored [s]."""
_START_SD = (1e-4, 0.3, 1.0, 0.5)
"""Initial standard deviations of displacements, velocities, base velocity W and acceleration error B."""


@dataclass(frozen=True, eq=False)
class LatentMotion:
    """A part of a motion smoothed without a contact law."""

    run: FilterPredictions
    smoothed: RtsTrack
    is_open: Flags
    """Flags of samples with a possible contact force."""
    is_dropout: Flags
    """Flags of samples in or near drop-outs, which may hide a contact."""
    force_variance: Reals
    misfit: float
    """Mean squared normalised innovation without its largest 0.1 %; 1 for a good fit."""


def latent_motion(
    model: MotionModel, motion: PreparedMotion, first: int, count: int, closed_share: float = CLOSED_SHARE
) -> LatentMotion:
    """Smooth ``count`` samples after sample ``first`` without a contact law.

    A larger ``closed_share`` allows more force between impacts, which tolerates wrong specimen parameters.
    """
    free = model.without_stops
    # Guess the size of the force: m1 times three times the rms acceleration of m0.
    velocity = motion.velocity[first : first + count + 1].astype(np.float64)
    smooth_v = gaussian_filter1d(velocity, motion.sample_rate_hz / (2 * np.pi * _PEAK_BAND_HZ))
    rms = float(np.std(np.diff(smooth_v))) * motion.sample_rate_hz
    guess_n = max(model.specimen.masses[1] * 3.0 * rms, _LEAST_GUESS_N)
    variance = np.full(count, guess_n**2)
    run, smoothed = _filter_and_smooth(free, motion, first, variance)
    # During a drop-out, m1 may have struck a stop unseen.
    is_dropout = _widen_marks(motion.is_dropout[first + 1 : first + count + 1], motion.sample_rate_hz)
    windows = _peaks(smoothed.forces[:, 0], guess_n, motion.sample_rate_hz) | is_dropout
    closed = (closed_share * guess_n) ** 2
    variance = np.where(windows, (6.0 * guess_n) ** 2, closed)
    for _ in range(_RERUNS):
        run, smoothed = _filter_and_smooth(free, motion, first, variance)
        windows, surprised = _with_surprises(windows, run, motion.sample_rate_hz)
        following = _learnt(windows, smoothed.forces, guess_n, closed)
        settled = not surprised and np.allclose(following, variance, rtol=0.5)
        if settled:
            break
        variance = following
    squared = run.nis[_start_up(motion.sample_rate_hz, count) :]
    squared = np.sort(squared[~np.isnan(squared)])
    misfit = float(np.mean(squared[: int(0.999 * squared.size) or 1])) if squared.size else np.inf
    return LatentMotion(run, smoothed, windows, is_dropout, variance, misfit)


def latent_start(first: int) -> FilterState:
    """Return an unknown initial state at sample ``first``: zero with a wide covariance."""
    place, rate, base, error = _START_SD
    return FilterState(first, np.zeros(STATES), np.diag([place**2] * 3 + [rate**2] * 3 + [base**2, error**2]))


def _filter_and_smooth(
    model: MotionModel, motion: PreparedMotion, first: int, variance: Reals
) -> tuple[FilterPredictions, RtsTrack]:
    run = run_filter(model, motion, latent_start(first), variance.size, force_variance=variance)
    return run, smooth(model, run, variance)


def _widen_marks(marks: Flags, sample_rate_hz: float) -> Flags:
    width = 2 * max(1, round(_WINDOW_S * sample_rate_hz)) + 1
    return np.asarray(np.convolve(marks, np.ones(width), "same") > 0.5)


def _peaks(force: Reals, guess_n: float, sample_rate_hz: float) -> Flags:
    size = np.abs(gaussian_filter1d(force, sample_rate_hz / (2.0 * np.pi * _PEAK_BAND_HZ)))
    threshold = max(_PEAK_OVER_MEDIAN * float(np.median(size)), _LEAST_PEAK * guess_n)
    marks = np.zeros(size.size, dtype=np.bool_)
    inner = size[1:-1]
    marks[1:-1] = (inner > threshold) & (inner >= size[:-2]) & (inner > size[2:])
    return _widen_marks(marks, sample_rate_hz)


def _start_up(sample_rate_hz: float, count: int) -> int:
    return min(round(_START_UP_S * sample_rate_hz), count // 4)


def _with_surprises(windows: Flags, run: FilterPredictions, sample_rate_hz: float) -> tuple[Flags, bool]:
    """Add a window just before every innovation that shows an overlooked impact."""
    squared = run.nis
    # Wrong parameters raise innovations everywhere; only outliers are impacts.
    usual = max(1.0, float(np.nanmedian(squared)) / _MEDIAN_OF_SQUARE)
    surprise = squared > _SURPRISE * usual
    surprise[: _start_up(sample_rate_hz, surprise.size)] = False
    onsets = surprise & ~np.concatenate(([False], surprise[:-1]))
    earlier = np.concatenate((onsets[1:], [False]))
    added = _widen_marks(earlier, sample_rate_hz) & ~windows
    return np.asarray(windows | added), bool(added.any())


def _learnt(windows: Flags, forces: Reals, guess_n: float, closed: float) -> Reals:
    """Return the force variance: mean square force of each window, as in expectation maximisation."""
    begins, ends = runs_of(windows).T
    squares = np.concatenate(([0.0], np.cumsum(forces[:, 0] ** 2 + forces[:, 1])))
    found = np.maximum((squares[ends] - squares[begins]) / (ends - begins), guess_n**2)
    variance = np.full(windows.size, closed)
    variance[windows] = np.repeat(found, ends - begins)
    return variance
