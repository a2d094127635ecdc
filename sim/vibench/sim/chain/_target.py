"""Responses of a chain to a requested error or within a requested time. SI units."""

import math
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..specimen.accuracy import Accuracy
from ..specimen.drive import Harmonic
from ..specimen.outcome import Outcome
from ..specimen.state import Complex, Floats
from ._chain import Chain
from ._response import ChainResponse, chain_response

WINDOW_S, FEWEST_WINDOWS = 0.25, 32
"""Length of the windows that are compared, about, and their least number [s]."""
FEWEST_PAIRS, STUDENT = 8, 2.365
"""Pairs of windows without which nothing is said, and Student's quantile for it: 19 cases of 20."""
TOLERANCE_PART = 0.1
"""Part of a requested error that the accuracy of contacts may use."""
LONGEST_S = 60.0
"""Time after which an answer is refined no further, where none was requested [s]."""


class TargetedResponse(NamedTuple):
    """Responses in the later half of the windows."""

    response: ChainResponse
    errors: Floats
    """Relative errors of the transmission of every cell, for 19 cases of 20, shape (cells,)."""
    followed_s: float
    """Length of all windows."""


def chain_response_to(
    chain: Chain, drive: Harmonic, error: float | None, time_s: float | None
) -> TargetedResponse:
    """Observe windows until their later half determines the lines to the requested error.

    Parameters
    ----------
    chain, drive
        As in `chain_response`, from rest.
    error
        Relative, of the transmission of every cell; as small as the time allows when None.
    time_s
        From the call to the answer; a minute when None [s].

    """
    began_s, limit_s = time.monotonic(), LONGEST_S if time_s is None else time_s
    wanted = 0.0 if error is None else error
    levels = (level for level in Accuracy if level.promise <= TOLERANCE_PART * wanted)
    accuracy = next(levels, Accuracy.REFERENCE)
    window_s = max(1, math.floor(WINDOW_S * drive.frequency_hz)) / drive.frequency_hz
    windows: list[ChainResponse] = []
    while True:
        state = windows[-1].final_state if windows else None
        windows.append(chain_response(chain, drive, accuracy, window_s, window_s, state))
        is_over = time.monotonic() - began_s > limit_s or windows[-1].outcome is not Outcome.REACHED_END
        count = len(windows)
        if not is_over and (count < FEWEST_WINDOWS or count & (count - 1)):
            continue
        used = windows[count // 2 :]
        lines = np.array([each.lines_m for each in used])
        errors = error_of_lines(lines[:, :, 0]) + accuracy.promise
        if is_over or (error is not None and np.all(errors <= error)):
            break
    response = replace(
        windows[-1],
        window_s=len(used) * window_s,
        lines_m=lines.mean(axis=0),
        largest_m=np.max([each.largest_m for each in used], axis=0),
        impacts=np.sum([each.impacts for each in used], axis=0),
    )
    return TargetedResponse(response, errors, count * window_s)


def error_of_lines(lines: Complex) -> Floats:
    """Return the relative error of the amplitude of the mean of lines of shape (windows, cells).

    Scatter of neighbouring pairs, by Student's interval; while a chain settles, the halves are apart.
    """
    count = len(lines) // 2
    if count < FEWEST_PAIRS:
        return np.full(lines.shape[1], math.inf)
    pairs = 0.5 * (lines[-2 * count :: 2] + lines[-2 * count + 1 :: 2])
    scatter = STUDENT * pairs.std(axis=0, ddof=1) / math.sqrt(count)
    apart = np.abs(lines[:count].mean(axis=0) - lines[count:].mean(axis=0))
    return np.asarray(np.maximum(scatter, apart) / np.abs(lines.mean(axis=0)))
