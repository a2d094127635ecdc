"""The largest magnitude of a displacement on a step of a contact. SI units."""

from ..kernels import kernel_without_refcount

SECANTS = 4
"""Secant steps to an extreme: its value then errs by less than rounding."""


@kernel_without_refcount
def hermite_peak(best: float, x0: float, v0: float, x1: float, v1: float, step: float) -> float:
    """Largest abs(x) over a step, x as the cubic through both ends with their velocities."""
    best = max(best, abs(x0), abs(x1))
    if v0 * v1 >= 0.0:
        return best
    rise = x1 - x0
    quadratic = 3.0 * rise - step * (2.0 * v0 + v1)
    cubic = step * (v0 + v1) - 2.0 * rise
    low, high, slope_low, slope_high = 0.0, 1.0, step * v0, step * v1
    for _ in range(SECANTS):
        part = low - slope_low * (high - low) / (slope_high - slope_low)
        slope = step * v0 + part * (2.0 * quadratic + part * 3.0 * cubic)
        best = max(best, abs(x0 + part * (step * v0 + part * (quadratic + part * cubic))))
        if slope * slope_low > 0.0:
            low, slope_low = part, slope
        else:
            high, slope_high = part, slope
    return best
