"""Resonances of a transmission: frequency, damping and quality factor, each with its uncertainty."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from ..errors import InvalidRequest
from ..signals import Complexes, Reals, standard_uncertainty
from .modal_fit import (
    LARGEST_DAMPING,
    SMALLEST_RELATIVE_SD,
    Background,
    Lines,
    ModalFit,
    Resonance,
    modal_fit,
)
from .results import FrequencyResponse

_REACH_BANDWIDTHS = 2.0
"""Largest distance from a peak [half-power bandwidths] at which its fit uses spectral lines."""
_LEAST_LINES = 8
"""Minimum number of lines for a fit: 8 complex values determine a pole (2) and up to 10 linear parameters."""
_LEAST_RISE = 3.0
"""Minimum height of a peak above the valley beside it, in standard deviations of the difference."""
_MOST_MODES = 3
"""Maximum number of modes fitted to one peak."""
_APART = (0.5, 1.5)
"""Initial spacing of neighbouring poles, in half widths."""
_LEAST_GAIN = 25.0
"""Minimum reduction of chi square that justifies another mode (four parameters). By chance, the reduction
exceeds 19 once in a thousand cases."""
_REACH_DAMPING = 4.0
"""Largest change of ln(damping ratio) from its start value in a fit."""
_USUAL_HZ = 300.0
"""Reference frequency that scales the background."""
_LARGEST_SD_UNRESOLVED = 0.1
"""Largest relative uncertainty of an unresolved peak (line or damping); less certain peaks may be ripples."""
_BACKGROUND_DEGREES = (1, 2, 3)
"""Degrees of the background polynomial, tried in turn; near broad peaks, a straight line is not enough."""
_LARGEST_RELATIVE_SD_DAMPING = 1 / _LEAST_RISE
"""Relative uncertainty of damping above which a peak counts as noise, not as a resonance."""


def resonances(
    frequency_response: FrequencyResponse, *, low_hz: float, high_hz: float
) -> tuple[Resonance, ...]:
    """Find and fit the resonances of a transmission in a band, sorted by frequency.

    Each significant peak is fitted with H(w) = R / (w0^2 - w^2 + 2 i zeta w0 w) + b0 + b1 (w - w0) + ...,
    weighted by the standard deviations. This is one mode on a polynomial of degree 1 to 3, which describes
    neighbouring modes; R, b0 and b1 are complex. The pole is found by variable projection (Golub & Pereyra
    1973, SIAM J. Numer. Anal. 10, 413-432). Peaks that noise explains are left out. Then all modes are fitted
    together. The joint fit is used if it explains the whole band, because a polynomial describes neighbouring
    modes only approximately.

    Raises InvalidRequest when fewer than eight lines lie in the band.
    """
    band = frequency_response.between(low_hz, high_hz)
    if band.frequency_hz.size < _LEAST_LINES:
        raise InvalidRequest(
            f"{band.frequency_hz.size} lines lie between {low_hz:g} and {high_hz:g} Hz; a fit needs at least "
            f"{_LEAST_LINES}"
        )
    found: list[tuple[Resonance, ...]] = []
    if band.steady_relative_sd is not None:
        band = replace(band, relative_sd_magnitude=band.steady_relative_sd)
    # The matrices are small, and several threads of linear algebra would wait for each other in busy loops.
    with threadpool_limits(limits=1, user_api="blas"):
        for line, width in _significant_peaks(band):
            together = _refit(band, width, _fit_peak(band, line, width, 1))
            found.append(tuple(each for each in together if low_hz <= each.frequency_hz <= high_hz))
        return _fit_jointly(band, _distinct(found))


def scattered_resonances(
    found: Sequence[Resonance], without: Sequence[Sequence[Resonance]]
) -> tuple[Resonance, ...]:
    """Widen the uncertainties of resonances by Tukey's jackknife over realisations.

    With collisions, each realisation shifts all lines about a resonance together, so a fit of independent
    lines is overconfident (Miller 1974, Biometrika 61, 1-15). A resonance is dropped if fewer than two
    subsets show it.

    Parameters
    ----------
    found
        Resonances from all realisations.
    without
        Resonances of each subset; each subset leaves out one realisation.
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
                    sd_frequency_hz=_largest_change(each, rest, "frequency_hz", len(without)),
                    sd_damping_ratio=_largest_change(each, rest, "damping_ratio", len(without)),
                    sd_peak_magnitude=_largest_change(each, rest, "peak_magnitude", len(without)),
                )
            )
    return tuple(widened)


def _largest_change(found: Resonance, rest: Sequence[Resonance], name: str, realisations: int) -> float:
    """Return the largest of three standard deviations: of the fit, between realisations, between fits.

    Joint and single fits differ more than realisations do, so the jackknife compares only fits over similar
    numbers of lines.
    """
    alike = [each for each in rest if 0.5 < each.lines_used / found.lines_used < 2.0]
    values, moved = (
        np.array([getattr(each, name) for each in some]) for some in (rest, alike if len(alike) > 2 else rest)
    )
    jackknife = (realisations - 1) * np.sqrt(moved.size / realisations) * standard_uncertainty(moved)
    choice = np.std(np.append(values, getattr(found, name)), ddof=1)
    return float(max(getattr(found, f"sd_{name}"), jackknife, choice))


def _significant_peaks(band: FrequencyResponse) -> list[tuple[int, int]]:
    """Return the line number and the half-power half width [lines] of each significant peak."""
    spread = np.maximum(np.nan_to_num(band.relative_sd_magnitude, posinf=1e9), SMALLEST_RELATIVE_SD)
    size = _smooth(np.nan_to_num(np.log(np.maximum(band.magnitude, 1e-300)), nan=-700.0), spread)
    significant = band.is_significant & (np.nan_to_num(band.coherence) > band.coherence_significance)
    # At a peak, ln(magnitude) must rise by more than noise explains.
    lines, about = scipy.signal.find_peaks(size, prominence=0.0)
    result = []
    for line, rise in zip(lines, about["prominences"], strict=True):
        width = _half_power_lines(size, int(line))
        # Of the peaks as wide as the band, keep only the largest: all would be fitted to the same lines.
        is_wide = 2 * width >= size.size - 1 and line != np.argmax(size)
        if significant[line] and rise > _LEAST_RISE * np.sqrt(2) * spread[line] and not is_wide:
            result.append((int(line), width))
    return result


def _smooth(size: Reals, spread: Reals) -> Reals:
    """Average ln(magnitude) over up to 9 lines to reduce its scatter to about 2 %; small scatter remains."""
    lines = min(int((np.median(spread) / 0.02) ** 2) // 2 * 2 + 1, 9)
    if lines <= 1:
        return size
    padded = np.pad(size, lines // 2, mode="edge")
    return np.convolve(padded, np.full(lines, 1 / lines), mode="valid")


def _half_power_lines(size: Reals, line: int) -> int:
    """Return the number of spectral lines from the peak to the nearer -3 dB point."""
    level = size[line] - 0.5 * np.log(2)
    below = np.flatnonzero(size < level)
    return int(np.min(np.abs(below - line))) if below.size else size.size // 2


def _fit_peak(band: FrequencyResponse, line: int, half_width: int, most: int) -> tuple[Resonance, ...]:
    """Fit the spectral lines about a peak with the fewest modes that explain them, at most ``most``."""
    reach = max(int(np.ceil(2 * _REACH_BANDWIDTHS * half_width)), _LEAST_LINES // 2)
    chosen = np.zeros(band.frequency_hz.size, dtype=np.bool_)
    chosen[max(0, line - reach) : line + reach + 1] = True
    lines = Lines(band, chosen)
    if lines.value.size < _LEAST_LINES:
        return ()
    centre_hz = float(band.frequency_hz[line])
    spacing_hz = float(np.median(np.diff(lines.frequency_hz)))
    damping = float(np.clip(max(half_width, 0.5) * spacing_hz / centre_hz, 2e-6, 0.9 * LARGEST_DAMPING))
    span = (lines.frequency_hz[-1] - lines.frequency_hz[0]) / centre_hz
    first: tuple[Resonance, ...] = ()
    start = np.array([[np.log(centre_hz), np.log(damping)]])
    for modes in range(1, most + 1):
        for degree in _BACKGROUND_DEGREES if modes == 1 else _BACKGROUND_DEGREES[1:2]:
            for split in _split_poles(start, modes):
                reaches = np.tile([span, _REACH_DAMPING], modes)
                fit = modal_fit(band, lines, split, reaches, _powers(centre_hz, degree))
                determined_modes = () if fit is None else _determined_modes(fit, lines)
                if fit is not None and determined_modes and fit.explains:
                    return determined_modes
                first = determined_modes if modes == 1 and determined_modes else first
        if not first:
            return ()
        start = _poles(first)
    return first


def _powers(centre_hz: float, degree: int) -> Background:
    """Return a polynomial background with complex factors."""

    def shapes(frequency_hz: Reals) -> Complexes:
        off = frequency_hz / centre_hz - 1
        return np.stack([factor * off**power for power in range(degree + 1) for factor in (1, 1j)], axis=1)

    return shapes


def _split_poles(poles: Reals, modes: int) -> Iterator[Reals]:
    """Yield starting values that split one pole into several narrower ones, at several spacings."""
    ((log_frequency, log_damping),) = poles
    if modes == 1:
        yield poles.ravel()
        return
    sides = np.linspace(-1, 1, modes)
    for apart in _APART:
        off = apart * float(np.exp(log_damping)) * sides
        yield np.stack((log_frequency + off, np.full(modes, log_damping - np.log(modes) / 2)), axis=1).ravel()


def _is_determined(found: Resonance, lines: Lines) -> bool:
    """Return whether a mode is determined: in the band, with known damping, and not a ripple of noise."""
    natural_hz, damping = found.frequency_hz, found.damping_ratio
    first_hz, last_hz = lines.frequency_hz[[0, -1]]
    if damping > 0.99 * LARGEST_DAMPING or not first_hz <= natural_hz <= last_hz:
        return False
    relative_sd = found.sd_damping_ratio / found.overlap / damping
    if relative_sd > _LARGEST_RELATIVE_SD_DAMPING:
        return False
    if found.half_power_bandwidth_hz < lines.narrowest_hz:
        return False
    known = min(lines.relative_sd(natural_hz), relative_sd)
    return found.is_resolved or known <= _LARGEST_SD_UNRESOLVED


def _refit(band: FrequencyResponse, half_width: int, first: tuple[Resonance, ...]) -> tuple[Resonance, ...]:
    """Fit a peak again over its fitted bandwidth, since the first width came from single noisy lines."""
    if not first:
        return ()
    (one,) = first
    line = int(np.argmin(np.abs(band.frequency_hz - one.frequency_hz)))
    spacing_hz = float(np.median(np.diff(band.frequency_hz)))
    found = round(0.5 * one.half_power_bandwidth_hz / spacing_hz)
    return _fit_peak(band, line, found if one.is_explained else max(found, half_width), _MOST_MODES) or first


def _fit_jointly(band: FrequencyResponse, found: list[Resonance]) -> tuple[Resonance, ...]:
    """Fit all modes of a band together from the single fits; return the single fits if the joint fit fails.

    H = sum of (a_k + i w b_k) / (w_k^2 - w^2 + 2 i zeta_k w_k w) + c0 + i w c1 + w^2 c2, all factors real:
    exact for a linear specimen with any damping. If these modes do not explain the band, the mode with the
    largest residual is split in two. With impacts, no set of modes explains the band.
    """
    if not found:
        return ()
    lines = Lines(band, band.is_significant)
    starts, best, last = [_poles(found)], tuple(found), np.inf
    for _ in range(_MOST_MODES):
        if 2 * lines.value.size < 2 * (4 * len(starts[0]) + 3):
            break
        fit = _best(band, lines, starts)
        if fit is None or fit.chi_square * fit.freedom > last - _LEAST_GAIN:
            break
        modes = _determined_modes(fit, lines)
        best = modes if fit.explains and modes else best
        if best is modes and max(each.reduced_chi_square for each in modes) <= fit.chi_square:
            break
        last, poles = fit.chi_square * fit.freedom, _poles(fit.resonances)
        worst = int(np.argmax([each.reduced_chi_square for each in fit.resonances]))
        rest = np.delete(poles, worst, axis=0)
        # A pole that was fitted to two modes may lie far from both modes, so also split its start value.
        split = (_split_poles(each[worst : worst + 1], 2) for each in (poles, starts[0]))
        starts = [np.vstack((rest, two.reshape(2, 2))) for two in chain.from_iterable(split)]
    return best


def _best(band: FrequencyResponse, lines: Lines, starts: Sequence[Reals]) -> ModalFit | None:
    """Fit all modes from each start and return the best fit."""
    fits = (
        modal_fit(band, lines, np.ravel(each), np.tile([0.02, 1.0], len(each)), _background)
        for each in starts
    )
    return min((fit for fit in fits if fit is not None), key=lambda fit: fit.chi_square, default=None)


def _determined_modes(fit: ModalFit, lines: Lines) -> tuple[Resonance, ...]:
    """Return the modes that the lines of a fit determine, sorted by frequency."""
    determined_modes = (each for each in fit.resonances if _is_determined(each, lines))
    return tuple(sorted(determined_modes, key=lambda one: one.frequency_hz))


def _poles(found: Sequence[Resonance]) -> Reals:
    """Return the logarithms of natural frequency and damping ratio, shape (modes, 2)."""
    return np.log([[each.frequency_hz, each.damping_ratio] for each in found])


def _background(frequency_hz: Reals) -> Complexes:
    """Return the background of modes outside the band and of phase errors: 1, i w and w^2."""
    scaled = frequency_hz / _USUAL_HZ
    return np.stack([np.ones_like(frequency_hz), 1j * scaled, scaled**2], axis=1)


def _distinct(found: list[tuple[Resonance, ...]]) -> list[Resonance]:
    """Keep one fit of each pole, because ripples of one resonance give the same pole."""
    kept: list[Resonance] = []

    def rank(fit: tuple[Resonance, ...]) -> tuple[bool, float]:
        """Rank fits that explain their lines first, then by relative uncertainty of damping."""
        return min((not each.is_explained, each.sd_damping_ratio / each.damping_ratio) for each in fit)

    for together in sorted(filter(None, found), key=rank):
        known = tuple(kept)
        for each in together:
            half = 0.5 * each.half_power_bandwidth_hz
            if all(
                abs(each.frequency_hz - other.frequency_hz) > max(half, 0.5 * other.half_power_bandwidth_hz)
                for other in known
            ):
                kept.append(each)
    return sorted(kept, key=lambda one: one.frequency_hz)
