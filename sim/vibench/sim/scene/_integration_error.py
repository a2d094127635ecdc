"""How far the steps of contacts have moved the responses: measured against stricter steps. SI units.

A motion is followed twice from the state in which a run ended, as before and with a far smaller tolerance.
One that repeats is followed until both have forgotten where they began: their responses then differ by the
error itself. One that never repeats forgets nothing but itself; what counts is what each drive period adds.
"""

import numpy as np

from ..kernels import Floats
from ..model import Accuracy, Outcome
from ._followed_run import FollowedRun, Watch

STRICTER = 1e-2
"""Tolerance of the comparison over that of the run."""
STRICTEST = 1e-12
"""Smaller tolerances are rounding."""
FORGETTING = 4.0
"""Forgetting times that a motion which repeats is followed before it is compared."""
LOOKS = 8
"""Periods of it, or drive periods of a motion that does not repeat, that are compared."""


def error_of_repeating(run: FollowedRun, accuracy: Accuracy, period: int, forgetting_s: float) -> float:
    """Relative error of the responses of a motion that repeats, the largest of the four; NaN if lost."""
    cycle_s = period / run.drive.frequency_hz
    wait_s = cycle_s * np.ceil(FORGETTING * forgetting_s / cycle_s)
    found = []
    for tolerance in _tolerances(accuracy):
        twin = run.apart(tolerance)
        twin.follow(run.time_s + wait_s)
        found.append(_responses(twin, LOOKS * cycle_s))
    return float(np.max(np.abs(found[0] - found[1]) / np.abs(found[1])))


def error_per_period(run: FollowedRun, accuracy: Accuracy) -> float:
    """Relative error that a drive period adds to a motion's responses, the largest seen; NaN if lost."""
    loose, strict = _tolerances(accuracy)
    cycle_s = 1.0 / run.drive.frequency_hz
    on = run.apart(loose)
    seen, missed = [], []
    for _ in range(LOOKS):
        twin = on.apart(strict)
        seen.append(_responses(on, cycle_s))
        missed.append(np.abs(seen[-1] - _responses(twin, cycle_s)))
    return float(np.max(np.max(missed, axis=0) / np.max(np.abs(seen), axis=0)))


def _tolerances(accuracy: Accuracy) -> tuple[float, float]:
    return accuracy.tolerance, max(STRICTER * accuracy.tolerance, STRICTEST)


def _responses(run: FollowedRun, length_s: float) -> Floats:
    """Largest x and p and both lines over a stretch, shape (4,); NaN if the run was lost."""
    seen = run.follow(run.time_s + length_s, Watch.PEAKS_AND_LINES)
    if run.outcome is not Outcome.REACHED_END:
        return np.full(4, np.nan)
    scale = 2.0 / length_s
    return np.array([seen.peak_x_m, seen.peak_p_m, scale * abs(seen.area_x), scale * abs(seen.area_p)])
