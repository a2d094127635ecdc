"""Resonances of a transmission: frequency, damping and quality factor, with their uncertainties."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from ..errors import InvalidRequest
from ..signals import Complexes, Reals, standard_uncertainty
from ._joint_fit import jointly_fitted
from ._mode import LARGEST_DAMPING, SMALLEST_RELATIVE_SD, WELL_FITTED, Resonance
from ._results import FrequencyResponse

_REACH_BANDWIDTHS = 2.0
"""The fit uses lines within so many half-power bandwidths of the peak."""
_LEAST_LINES = 8
"""Two pole and at most ten linear parameters need more reals than that: eight lines are sixteen."""
_LEAST_RISE = 3.0
"""A peak stands above the valley beside it by at least so many standard deviations of the difference."""
_RESOLVED_LINES = 4.0
"""Noise bandwidths that a half-power bandwidth must hold, else the window smears the peak by over 2 %."""
_LARGEST_SD_UNRESOLVED = 0.1
"""A peak too narrow for the lines is believed only where they are known to a tenth: else it is one of the
ripples on top of a broad hill."""
_BACKGROUND_DEGREES = (1, 2, 3)
"""Tried in turn: broad peaks see more of their neighbours than a straight line can follow."""
_LARGEST_RELATIVE_SD_DAMPING = 0.5
"""Past it the damping is not significantly above zero: a ripple of noisy lines, and no resonance."""


def resonances(
    frequency_response: FrequencyResponse, *, low_hz: float, high_hz: float
) -> tuple[Resonance, ...]:
    """Find and fit the resonances of a transmission in a band, in the order of frequency.

    Each significant peak is fitted, weighted by the stated spreads, with
    H(w) = R / (w0^2 - w^2 + 2 i zeta w0 w) + b0 + b1 (w - w0) + ..., complex R, b0, b1: one mode on what
    its neighbours leave there, a straight line or, where that does not do, up to a cubic. The pole is
    found by variable projection (Golub & Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432). A peak that
    noise explains is left out. Then all modes are fitted together, and that fit stands where it explains
    the whole band: no polynomial follows the skirt of a neighbour to the last digit of a fine measurement.

    Raises
    ------
    InvalidRequest
        When fewer than eight lines lie in the band.

    """
    band = frequency_response.between(low_hz, high_hz)
    if band.frequency_hz.size < _LEAST_LINES:
        raise InvalidRequest(
            f"{band.frequency_hz.size} lines lie between {low_hz:g} and {high_hz:g} Hz; a fit needs at least "
            f"{_LEAST_LINES}"
        )
    found = []
    if band.steady_relative_sd is not None:
        band = replace(band, relative_sd_magnitude=band.steady_relative_sd)
    for line, width in _significant_peaks(band):
        fit = _refitted(band, _fitted(band, line, width))
        if fit is not None and low_hz <= fit.frequency_hz <= high_hz:
            found.append(fit)
    return jointly_fitted(band, _distinct(found))


def scattered_resonances(
    found: Sequence[Resonance], without: Sequence[Sequence[Resonance]]
) -> tuple[Resonance, ...]:
    """Widen what resonances are known to by how they move when each realisation in turn is left out.

    Where masses collide, each realisation moves all lines about a resonance together, and a fit that takes
    lines as independent knows too much: Tukey's jackknife (Miller 1974, Biometrika 61, 1-15) does not. A
    resonance that is there with one realisation only is none.

    Parameters
    ----------
    found
        From all realisations.
    without
        The same without each of them.

    """
    widened = []
    for each in found:
        half = each.half_power_bandwidth_hz
        rest = [
            min(others, key=lambda other: abs(other.frequency_hz - each.frequency_hz))
            for others in without
            if any(abs(other.frequency_hz - each.frequency_hz) < half for other in others)
        ]
        if len(rest) > 1:
            widened.append(
                replace(
                    each,
                    sd_frequency_hz=_moved(each, rest, "frequency_hz", len(without)),
                    sd_damping_ratio=_moved(each, rest, "damping_ratio", len(without)),
                    sd_peak_magnitude=_moved(each, rest, "peak_magnitude", len(without)),
                )
            )
    return tuple(widened)


def _moved(found: Resonance, rest: Sequence[Resonance], name: str, realisations: int) -> float:
    """Give the largest of what the fit says, what realisations move, and what the choice of a fit moves.

    A fit of all modes together and one of this mode alone differ by more than a realisation moves either:
    only fits over about as many lines tell the latter, which the jackknife multiplies.
    """
    alike = [each for each in rest if 0.5 < each.lines_used / found.lines_used < 2.0]
    told, moved = (
        np.array([getattr(each, name) for each in some]) for some in (rest, alike if len(alike) > 2 else rest)
    )
    jackknife = (realisations - 1) * np.sqrt(moved.size / realisations) * standard_uncertainty(moved)
    choice = np.std(np.append(told, getattr(found, name)), ddof=1)
    return float(max(getattr(found, f"sd_{name}"), jackknife, choice))


def _significant_peaks(band: FrequencyResponse) -> list[tuple[int, int]]:
    """Lines of peaks, and their half-power widths in lines."""
    spread = np.maximum(np.nan_to_num(band.relative_sd_magnitude, posinf=1e9), SMALLEST_RELATIVE_SD)
    size = _smoothed(np.nan_to_num(np.log(np.maximum(band.magnitude, 1e-300)), nan=-700.0), spread)
    significant = band.is_significant & (np.nan_to_num(band.coherence) > band.coherence_significance)
    # A rise of ln(magnitude) by less than this is noise, whatever the line.
    lines, about = scipy.signal.find_peaks(size, prominence=0.0)
    result = []
    for line, rise in zip(lines, about["prominences"], strict=True):
        if significant[line] and rise > _LEAST_RISE * np.sqrt(2) * spread[line]:
            result.append((int(line), _half_power_lines(size, int(line))))
    return result


def _smoothed(size: Reals, spread: Reals) -> Reals:
    """Average over the few lines that bring typical noise below a hundredth; a noise-free curve stays."""
    lines = min(int((np.median(spread) / 0.02) ** 2) // 2 * 2 + 1, 9)
    if lines <= 1:
        return size
    padded = np.pad(size, lines // 2, mode="edge")
    return np.convolve(padded, np.full(lines, 1 / lines), mode="valid")


def _half_power_lines(size: Reals, line: int) -> int:
    """Lines from the peak to where the magnitude has fallen by 3 dB, the nearer side."""
    level = size[line] - 0.5 * np.log(2)
    below = np.flatnonzero(size < level)
    return int(np.min(np.abs(below - line))) if below.size else size.size // 2


def _fitted(band: FrequencyResponse, line: int, half_width: int) -> Resonance | None:
    reach = max(int(np.ceil(2 * _REACH_BANDWIDTHS * half_width)), _LEAST_LINES // 2)
    part = slice(max(0, line - reach), line + reach + 1)
    frequency_hz, value = band.frequency_hz[part], band.value[part]
    spread = np.maximum(band.relative_sd_magnitude[part], SMALLEST_RELATIVE_SD) * np.abs(value)
    usable = np.isfinite(spread) & np.isfinite(value) & (spread > 0)
    if np.count_nonzero(usable) < _LEAST_LINES:
        return None
    frequency_hz, value, spread = frequency_hz[usable], value[usable], spread[usable]
    centre_hz = float(band.frequency_hz[line])
    data = (frequency_hz, value, spread, centre_hz)
    found: Resonance | None = None
    for degree in _BACKGROUND_DEGREES:
        found = _fitted_on(band, data, half_width, degree) or found
        if found is None or found.reduced_chi_square < WELL_FITTED:
            break
    return found


def _fitted_on(
    band: FrequencyResponse, data: tuple[Reals, Complexes, Reals, float], half_width: int, degree: int
) -> Resonance | None:
    """Fit one mode on a background of one degree."""
    frequency_hz, value, spread, centre_hz = data
    spacing_hz = float(np.median(np.diff(frequency_hz)))
    start = np.array([0.0, np.log(max(half_width, 0.5) * spacing_hz / centre_hz)])
    span = (frequency_hz[-1] - frequency_hz[0]) / centre_hz

    def misfit(pole: Reals) -> Reals:
        natural_hz, damping = centre_hz * float(np.exp(pole[0])), float(np.exp(pole[1]))
        basis = _basis(frequency_hz, natural_hz, damping, degree) / spread[:, None]
        target = value / spread
        coefficients = np.linalg.lstsq(basis, target, rcond=None)[0]
        left = target - basis @ coefficients
        return np.concatenate((left.real, left.imag))

    bounds = ([-span, np.log(1e-6)], [span, np.log(LARGEST_DAMPING)])
    start = np.clip(start, np.asarray(bounds[0]) + 1e-9, np.asarray(bounds[1]) - 1e-9)
    result = scipy.optimize.least_squares(
        misfit, start, bounds=bounds, x_scale=[0.01, 1.0], xtol=1e-12, ftol=1e-12
    )
    jacobian = np.asarray(result.jac, dtype=np.float64)
    return _resonance(band, result.x, jacobian, result.fun, data, degree)


def _refitted(band: FrequencyResponse, first: Resonance | None) -> Resonance | None:
    """Fit once more over the bandwidth found: the first width was read off single, noisy lines."""
    if first is None:
        return None
    line = int(np.argmin(np.abs(band.frequency_hz - first.frequency_hz)))
    spacing_hz = float(np.median(np.diff(band.frequency_hz)))
    return _fitted(band, line, round(0.5 * first.half_power_bandwidth_hz / spacing_hz)) or first


def _basis(frequency_hz: Reals, natural_hz: float, damping: float, degree: int) -> Complexes:
    """One mode and the powers of a background, each scaled to order one; shape (lines, degree + 2)."""
    ratio = frequency_hz / natural_hz
    mode = 2 * damping / (1 - ratio**2 + 2j * damping * ratio)
    powers = [np.asarray((ratio - 1) ** power, dtype=np.complex128) for power in range(degree + 1)]
    return np.stack((mode, *powers), axis=1)


def _resonance(
    band: FrequencyResponse,
    pole: Reals,
    jacobian: Reals,
    left: Reals,
    data: tuple[Reals, Complexes, Reals, float],
    degree: int,
) -> Resonance | None:
    frequency_hz, value, spread, centre_hz = data
    natural_hz, damping = centre_hz * float(np.exp(pole[0])), float(np.exp(pole[1]))
    at_a_bound = damping > 0.99 * LARGEST_DAMPING or not frequency_hz[0] <= natural_hz <= frequency_hz[-1]
    curvature = jacobian.T @ jacobian
    if at_a_bound or np.linalg.cond(curvature) > 1e14:
        return None
    # Two reals of the pole, and two for every complex coefficient.
    freedom = max(1, left.size - 2 - 2 * (degree + 2))
    chi_square = float(left @ left) / freedom
    covariance = np.linalg.inv(curvature) * max(1.0, chi_square)
    sd_log_frequency, sd_log_damping = np.sqrt(np.diag(covariance))
    if sd_log_damping > _LARGEST_RELATIVE_SD_DAMPING:
        return None
    basis = _basis(frequency_hz, natural_hz, damping, degree)
    coefficients = np.linalg.lstsq(basis / spread[:, None], value / spread, rcond=None)[0]
    fine_hz = np.linspace(frequency_hz[0], frequency_hz[-1], 2001)
    curve = np.abs(_basis(fine_hz, natural_hz, damping, degree) @ coefficients)
    top = int(np.argmax(curve))
    # The peak's height follows the residue: it is known as well as the damping, and as the lines at it.
    near = int(np.argmin(np.abs(frequency_hz - fine_hz[top])))
    is_resolved = 2 * damping * natural_hz > _RESOLVED_LINES * band.resolution_hz
    if not is_resolved and spread[near] > _LARGEST_SD_UNRESOLVED * np.abs(value[near]):
        return None
    lines_within = max(1.0, 2 * damping * natural_hz / float(np.median(np.diff(frequency_hz))))
    sd_peak = spread[near] * np.sqrt(max(1.0, chi_square) / lines_within)
    return Resonance(
        frequency_hz=natural_hz,
        sd_frequency_hz=float(natural_hz * sd_log_frequency),
        damping_ratio=damping,
        sd_damping_ratio=float(damping * sd_log_damping),
        peak_frequency_hz=float(fine_hz[top]),
        peak_magnitude=float(curve[top]),
        sd_peak_magnitude=float(sd_peak),
        reduced_chi_square=chi_square,
        lines_used=frequency_hz.size,
        is_resolved=is_resolved,
    )


def _distinct(found: list[Resonance]) -> list[Resonance]:
    """Two ripples of one resonance give the same pole; keep the fit that knows it better."""
    kept: list[Resonance] = []
    for each in sorted(found, key=lambda one: one.sd_damping_ratio / one.damping_ratio):
        half = 0.5 * each.half_power_bandwidth_hz
        if all(
            abs(each.frequency_hz - other.frequency_hz) > max(half, 0.5 * other.half_power_bandwidth_hz)
            for other in kept
        ):
            kept.append(each)
    return sorted(kept, key=lambda one: one.frequency_hz)
