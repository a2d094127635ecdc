"""Bounds from overlapping, tapered segments have their stated coverage for every estimator."""

import numpy as np
import pytest

from vibench.analysis import Estimator, transmissibility

RATE = 1024.0
SEGMENT = 64
NOISE = 0.5
EVERY_THIRD = slice(3, -3, 3)
"""Hann lines three apart share no noise."""
SECOND_ORDER = 0.004
"""The logarithmic bounds are exact to second order in the error; this is what is left at ten averages."""


def coverage(estimator, overlap, averages, repeats, seed):
    """Coverage of magnitude and phase bounds for the true H = 1, and its standard error."""
    rng = np.random.default_rng(seed)
    held_magnitude = held_phase = trials = 0
    for _ in range(repeats):
        clean = rng.standard_normal(averages * SEGMENT)
        on_drive, on_response = NOISE * rng.standard_normal((2, clean.size))
        drive = clean if estimator is Estimator.H1 else clean + on_drive
        response = clean if estimator is Estimator.H2 else clean + on_response
        how = {
            Estimator.HV: {"noise_ratio": 1.0},
            Estimator.DRIVE: {"reference": clean},
        }.get(estimator, {})
        found = transmissibility(
            drive, response, RATE, segment_samples=SEGMENT, overlap=overlap, estimator=estimator, **how
        )
        low, high = found.magnitude_lower[EVERY_THIRD], found.magnitude_upper[EVERY_THIRD]
        held_magnitude += np.count_nonzero((low <= 1) & (high >= 1))
        held_phase += np.count_nonzero(
            (found.phase_lower_rad[EVERY_THIRD] <= 0) & (found.phase_upper_rad[EVERY_THIRD] >= 0)
        )
        trials += low.size
    return held_magnitude / trials, held_phase / trials, np.sqrt(0.95 * 0.05 / trials)


def require_coverage(estimator, overlap, averages, repeats):
    seed = [list(Estimator).index(estimator), round(100 * overlap), averages]
    magnitude, phase, own_error = coverage(estimator, overlap, averages, repeats, seed)
    assert magnitude == pytest.approx(0.95, abs=3 * own_error + SECOND_ORDER)
    assert phase == pytest.approx(0.95, abs=3 * own_error + SECOND_ORDER)


@pytest.mark.parametrize("estimator", list(Estimator))
@pytest.mark.parametrize("overlap", [0.0, 0.5, 0.75])
def test_bounds_from_hann_segments_contain_the_true_value_in_95_percent_of_cases(estimator, overlap):
    require_coverage(estimator, overlap, averages=12, repeats=150)
