"""The largest magnitude of a displacement on a stretch. SI units."""

from ..kernels import (
    Vector,
    kernel_without_refcount,
)
from ._detection import polynomial_at

SECANTS = 4
"""Secant steps to an extreme: its value then errs by less than rounding."""


@kernel_without_refcount
def series_peak(best: float, series: Vector, low: float, high: float) -> float:
    """Largest magnitude of a polynomial on [low, high], which holds at most one extreme."""
    value_low, slope_low = polynomial_at(series, low)
    value_high, slope_high = polynomial_at(series, high)
    best = max(best, abs(value_low), abs(value_high))
    if slope_low * slope_high >= 0.0:
        return best
    for _ in range(SECANTS):
        tau = low - slope_low * (high - low) / (slope_high - slope_low)
        value, slope = polynomial_at(series, tau)
        best = max(best, abs(value))
        if slope * slope_low > 0.0:
            low, slope_low = tau, slope
        else:
            high, slope_high = tau, slope
        if slope_low == slope_high:
            return best
    return best
