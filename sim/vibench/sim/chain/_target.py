"""Responses of a chain, with a target relative error or in a requested computing time. SI units."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..engine.run import Accuracy, Outcome, time_limit
from ..scene.prediction import TargetReport
from ..scene.refinement import LONGEST_S, OUT_OF_REACH_S, uncertainty_of_time
from ..specimen.drive import Harmonic
from ..specimen.specimen import Complex, Floats
from ._chain import Chain
from ._response import ChainResponse, chain_response

WINDOW_S, FEWEST_WINDOWS = 0.25, 32
"""Approximate length of a response window [s], and smallest number of windows."""
FEWEST_PAIRS, STUDENT = 8, 2.365
"""Smallest number of pairs of windows for an error estimate, and Student's t (95 %) for this number."""
TOLERANCE_PART = 0.1
"""Largest part of the target error that may come from the integration."""
FIRST_S, FIRST_SHARE = 0.1, 0.75
"""Limit of the first period's computing time: in seconds or, if longer, as a share of the time limit. The
limit leaves time for a second period, which callers compute."""
HOPELESS, STEADILY = 10.0, 0.5
"""Ratio of expected time to default limit above which the run ends early. Ratio of the error with all windows
to the error with half of them, above which the error is assumed to fall only like 1 / sqrt(time)."""


class TargetedResponse(NamedTuple):
    """Mean response over the second half of the run, with errors."""

    response: ChainResponse
    errors: Floats
    """Relative errors (95 %) of the transmissibility of every cell, shape (cells,)."""
    followed_s: float
    """Total simulated time of all response windows [s]."""
    target: TargetReport
    """Requested and reached error (of the worst cell) and computing time."""


def chain_response_to(
    chain: Chain, drive: Harmonic, error: float | None, time_s: float | None
) -> TargetedResponse:
    """Extend the run until the second half of its windows gives the target error; return the response.

    Without a time limit, the run ends early if more than ten minutes would be needed.

    Raises ValueError when the computation of one drive period takes longer than ``time_s``.

    Parameters
    ----------
    chain, drive
        As in `chain_response`; the chain starts from rest.
    error
        Target relative error of every cell's transmissibility; None for the smallest error within ``time_s``.
    time_s
        Limit of the computing time [s]; None means 60 s.
    """
    began_s, limit_s = time.monotonic(), LONGEST_S if time_s is None else time_s
    wanted = 0.0 if error is None else error
    end_s = began_s + max(FIRST_S, FIRST_SHARE * limit_s)
    levels = (level for level in Accuracy if level.promise <= TOLERANCE_PART * wanted)
    accuracy = next(levels, Accuracy.REFERENCE)
    most = max(1, math.floor(WINDOW_S * drive.frequency_hz))
    seen: list[ChainResponse] = []

    def follows(periods: int) -> bool:
        """Continue the run for ``periods``; return whether it succeeded before ``end_s``."""
        length_s, state = periods / drive.frequency_hz, seen[-1].final_state if seen else None
        try:
            with time_limit(end_s):
                seen.append(chain_response(chain, drive, accuracy, length_s, length_s, state))
        except TimeoutError:
            return False
        return seen[-1].outcome is Outcome.REACHED_END

    # A whole window may take longer than the time limit, so start with one drive period.
    periods, goes_on = 1, follows(1)
    if not seen:
        raise ValueError(
            f"A time of {limit_s:g} s is not allowed for this chain: one drive period of "
            f"{1.0 / drive.frequency_hz:g} s takes longer to compute; give more time."
        )
    end_s = began_s + limit_s
    while goes_on and periods < most:
        periods = min(2 * periods, most)
        goes_on = follows(periods)
    before, used = len(seen) - 1, seen[-1:]
    errors = _errors(used) + accuracy.promise
    while goes_on and not (error is not None and np.all(errors <= error)):
        goes_on = follows(most)
        count = len(seen) - before
        if not goes_on or (count >= FEWEST_WINDOWS and not count & (count - 1)):
            used, last = seen[before + count // 2 :], float(errors.max())
            errors = _errors(used) + accuracy.promise
            worst = float(errors.max())
            if time_s is None and worst > max(wanted, STEADILY * last):
                needed_s = (worst / max(wanted, accuracy.promise)) ** 2 * (time.monotonic() - began_s)
                goes_on = goes_on and needed_s < HOPELESS * limit_s
    response = replace(
        used[-1],
        window_s=sum(each.window_s for each in used),
        lines_m=np.mean([each.lines_m for each in used], axis=0),
        largest_m=np.max([each.largest_m for each in used], axis=0),
        impacts=np.sum([each.impacts for each in used], axis=0),
    )
    report = _report(errors, accuracy, (error, time_s), time.monotonic() - began_s, len(used))
    return TargetedResponse(response, errors, sum(each.duration_s for each in seen), report)


def _report(
    errors: Floats, accuracy: Accuracy, asked: tuple[float | None, float | None], taken_s: float, windows: int
) -> TargetReport:
    """Report the largest error and the time needed for the requested error; errors fall as 1 / sqrt(time)."""
    worst, (wanted, _) = float(errors.max()), asked
    error = worst if math.isfinite(worst) else None
    is_met = error is not None and (wanted is None or worst <= wanted)
    needed, is_reachable = None, wanted is None or wanted > accuracy.promise
    if wanted is not None and error is not None and is_reachable and not is_met:
        about_s = taken_s * ((worst - accuracy.promise) / (wanted - accuracy.promise)) ** 2
        off = uncertainty_of_time(windows)
        needed = about_s, (1.0 - off) * about_s, (1.0 + off) * about_s
        is_reachable = needed[1] <= OUT_OF_REACH_S
    return TargetReport(*asked, error, taken_s, 1, windows, is_met, needed, is_reachable)


def _errors(windows: Sequence[ChainResponse]) -> Floats:
    return error_of_lines(np.array([each.lines_m[:, 0] for each in windows]))


def error_of_lines(lines: Complex) -> Floats:
    """Return the relative error of the mean amplitude of spectral lines of shape (windows, cells).

    It is the larger of Student's interval from pairs of windows and the difference between the two halves.
    """
    count = len(lines) // 2
    if count < FEWEST_PAIRS:
        return np.full(lines.shape[1], math.inf)
    pairs = 0.5 * (lines[-2 * count :: 2] + lines[-2 * count + 1 :: 2])
    scatter = STUDENT * pairs.std(axis=0, ddof=1) / math.sqrt(count)
    apart = np.abs(lines[:count].mean(axis=0) - lines[count:].mean(axis=0))
    return np.asarray(np.maximum(scatter, apart) / np.abs(lines.mean(axis=0)))
