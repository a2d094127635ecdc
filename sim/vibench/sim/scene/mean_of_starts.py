"""Mean responses over several nearly equal starts (initial states), and error of the mean. SI units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..specimen.specimen import Floats
from .followed_run import FollowedRun
from .repetition import Repetition
from .scatter import COVERED
from .shares import student_quantile, wilson_share
from .stated_error import ROUNDING

ALIKE = 1e-2
"""Largest relative difference between responses of the same motion if some runs are still settling."""
OTHER_DIFFERS = 1.0
"""Assumed relative deviation of the response of a motion that no start has reached, such as chaos."""
FEWEST_STARTS = 16
PADDING = 8.0
"""Number of starts at which counting the smallest and largest response twice doubles the squared error."""
TINY = 1e-300
MOST_FREEDOM = 200
"""Degrees of freedom above which Student's t hardly changes."""


@dataclass(eq=False)
class Start:
    """One of several nearly equal starts, with the responses in its windows."""

    run: FollowedRun
    windows: list[Floats]
    """Responses in each window, shape (4,); a periodic motion needs only one window."""
    repeats: Repetition | None
    """Period of a nearly periodic motion, all windows of which are alike; None for other motions."""
    impacts: int
    """Number of impacts in the start's first response window."""

    def mean(self, windows: int) -> Floats:
        """Return the mean of the four responses over the first ``windows`` windows, shape (4,)."""
        return self.windows[0] if windows == 1 else np.asarray(np.mean(self.windows[:windows], axis=0))


def mean_error(seen: Sequence[Floats], others: int | None) -> Floats:
    """Return the relative error of the mean responses over starts, shape (4,).

    The error is the larger of two estimates. The first is Student's 95 % interval with the smallest and the
    largest value counted twice (Agresti and Coull, Am. Stat. 52 (1998) 119), which allows for a rare motion.
    The second applies if most starts reached one repeating motion and ``others`` starts did not. It assumes
    that the share of other motions is at the upper end of Wilson's interval. Motions that some starts reached
    differ by at most the range of the responses; motions that no start reached may differ more.
    """
    responses = np.array(seen)
    padded = np.vstack([responses, responses.min(axis=0), responses.max(axis=0)])
    mean, count = responses.mean(axis=0), len(seen)
    times = student_quantile(min(count - 1, MOST_FREEDOM), COVERED) / math.sqrt(count)
    rare: Floats | float = 0.0
    if others is not None:
        share = wilson_share(others, count)
        seen_differ = (share.high - share.share) * np.ptp(responses, axis=0) / mean
        rare = np.maximum(seen_differ, _unseen(count))
    return np.asarray(np.maximum(times * padded.std(axis=0, ddof=1) / mean, rare) + ROUNDING)


def error_of(starts: Sequence[Start]) -> Floats:
    """Return the relative error of the mean over all starts and their common windows, shape (4,)."""
    windows = windows_of(starts)
    return mean_error([each.mean(windows) for each in starts], others_of(starts))


def windows_of(starts: Sequence[Start]) -> int:
    """Return the number of windows that all non-periodic starts have; 1 if all are periodic."""
    return min((len(each.windows) for each in starts if each.repeats is None), default=1)


def others_of(starts: Sequence[Start]) -> int | None:
    """Return how many starts missed the repeating motion of most starts; None without such a motion."""
    settled = np.array([each.windows[0] for each in starts if each.repeats is not None])
    if 2 * len(settled) < len(starts) or len(settled) == 0:
        return None
    middle = np.median(settled, axis=0)
    alike = int(np.sum(np.all(np.abs(settled - middle) <= ALIKE * middle, axis=1)))
    return len(starts) - alike if 2 * alike >= len(starts) else None


def next_size(
    starts: Sequence[Start], error: float | None, lead: float, most: float = 2.0
) -> tuple[int, int]:
    """Return the next numbers of starts and of windows per start, which need the least simulated time.
    More windows save the time ``lead`` before a start's first window (in window lengths). More starts reduce
    the part of the variance that differs between starts, and the weight of the smallest and largest start.
    The variance is reduced at most by a factor of ``most`` at once, because its value is uncertain.
    """
    count, windows = len(starts), windows_of(starts)
    if count < FEWEST_STARTS:
        return FEWEST_STARTS, windows
    factor = most if error is None else min(most, time_factor(starts, error))
    within = _share_within(starts)

    def size(more: int) -> tuple[int, int]:
        wanted = factor * (1.0 - within + within * windows / more) * count**2 / (count + PADDING)
        # Solve n^2 / (n + PADDING) = wanted for n.
        return max(count, math.ceil(0.5 * (wanted + math.sqrt(wanted * (wanted + 4.0 * PADDING))))), more

    sizes = [size(more) for more in range(windows, 2 * windows + 1 if within > 0.0 else windows + 1)]
    best = min(sizes, key=lambda each: each[0] * (lead + each[1]))
    return best if best > (count, windows) else (count + 2, windows)


def _share_within(starts: Sequence[Start]) -> float:
    """Return the share of a start's variance due to scatter between its windows; 1 if not yet known.

    Motions that repeat differ only between starts.
    """
    windows = windows_of(starts)
    if any(each.repeats is not None for each in starts):
        return 0.0
    if windows == 1:
        return 1.0
    worst = int(np.argmax(error_of(starts)))
    values = np.array([each.windows[:windows] for each in starts])[:, :, worst]
    between = float(values.mean(axis=1).var(ddof=1))
    return min(1.0, float(values.var(axis=1, ddof=1).mean()) / windows / max(between, TINY))


def time_factor(starts: Sequence[Start], error: float) -> float:
    """Return the factor by which the simulated time must grow to reach the target error."""
    worst = float(error_of(starts).max())
    # The share of unreached motions falls like 1 / starts; other errors fall like 1 / sqrt(starts).
    is_unseen = others_of(starts) is not None and worst <= 1.01 * _unseen(len(starts))
    return 1.05 * math.pow(worst / max(error, ROUNDING), 1.0 if is_unseen else 2.0)


def _unseen(count: int) -> float:
    """Return the relative error due to motions that none of ``count`` starts reached."""
    return wilson_share(0, count).high * OTHER_DIFFERS
