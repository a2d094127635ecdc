"""All resonances of a transmission fitted together: the skirts of the others are modes too, no background."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..signals import Reals
from ._mode import LARGEST_DAMPING, SMALLEST_RELATIVE_SD, WELL_FITTED, Resonance
from ._results import FrequencyResponse

_BACKGROUND_TERMS = 3
"""Of modes outside of the band, and of what the channels' phases err: 1, i w and w^2, with real factors."""
_FINE_POINTS = 401
_STEP = 1e-6


@dataclass(frozen=True)
class _Lines:
    """What is fitted; arrays of shape (lines,)."""

    frequency_hz: Reals
    weighted: Reals
    """Real and imaginary parts over their standard deviation, shape (2 lines,)."""
    spread: Reals


def jointly_fitted(band: FrequencyResponse, found: Sequence[Resonance]) -> tuple[Resonance, ...]:
    """Fit all modes of a band at once, from the single fits; those stand where the modes do not explain it.

    H = sum of (a_k + i w b_k) / (w_k^2 - w^2 + 2 i zeta_k w_k w) + c0 + i w c1 + w^2 c2, all factors real:
    exact for a linear specimen with any damping. The poles are found by variable projection (Golub and
    Pereyra 1973). With impacts, or lines coarser than a mode, the misfit is above its stated scatter, and
    nothing is gained.
    """
    if not found:
        return ()
    lines = _lines(band)
    unknowns = 4 * len(found) + _BACKGROUND_TERMS
    if lines.weighted.size < 2 * unknowns:
        return tuple(found)
    start = np.log([[each.frequency_hz, each.damping_ratio] for each in found]).ravel()

    def misfit(poles: Reals) -> Reals:
        basis = _basis(lines, poles)
        factors = np.linalg.lstsq(basis, lines.weighted, rcond=None)[0]
        return np.asarray(lines.weighted - basis @ factors)

    reach = np.tile([0.02, 1.0], len(found))
    top = np.tile([np.inf, np.log(LARGEST_DAMPING)], len(found))
    result = scipy.optimize.least_squares(
        misfit,
        start,
        bounds=(start - reach, np.minimum(start + reach, np.maximum(top, start + 1e-6))),
        x_scale=reach / 20,
        xtol=1e-12,
        ftol=1e-12,
    )
    chi_square = 2 * float(result.cost) / (lines.weighted.size - unknowns)
    jacobian = np.asarray(result.jac, dtype=np.float64)
    curvature = jacobian.T @ jacobian
    if not result.success or chi_square > WELL_FITTED or np.linalg.cond(curvature) > 1e14:
        return tuple(found)
    widened = max(1.0, chi_square)
    sd = np.sqrt(np.diag(np.linalg.inv(curvature)) * widened)
    basis = _basis(lines, result.x)
    factors: Reals = np.linalg.lstsq(basis, lines.weighted, rcond=None)[0].astype(np.float64)
    # How the lines follow poles and factors together, and with what covariance.
    follows = np.hstack((_moved(lambda poles: _basis(lines, poles) @ factors, result.x), basis))
    covariance: Reals = np.asarray(widened * np.linalg.pinv(follows.T @ follows), dtype=np.float64)
    pairs = zip(found, result.x.reshape(-1, 2), sd.reshape(-1, 2), strict=True)
    return tuple(
        _updated(
            each, pole, spread, chi_square, _peak(each, result.x, factors, covariance), lines.spread.size
        )
        for each, pole, spread in pairs
    )


def _lines(band: FrequencyResponse) -> _Lines:
    spread = np.maximum(band.relative_sd_magnitude, SMALLEST_RELATIVE_SD) * band.magnitude
    usable = np.isfinite(spread) & np.isfinite(band.value) & (spread > 0) & band.is_significant
    value, spread = band.value[usable], spread[usable]
    return _Lines(
        band.frequency_hz[usable], np.concatenate([value.real / spread, value.imag / spread]), spread
    )


def _shapes(frequency_hz: Reals, poles: Reals) -> Reals:
    """Modes and background over frequency, complex, shape (lines, unknown factors); scaled to order one."""
    columns = []
    middle_hz = float(np.mean(frequency_hz))
    for log_frequency, log_damping in poles.reshape(-1, 2):
        ratio, damping = frequency_hz / np.exp(log_frequency), np.exp(log_damping)
        mode = 2 * damping / (1 - ratio**2 + 2j * damping * ratio)
        columns += [mode, 1j * ratio * mode]
    scaled = frequency_hz / middle_hz
    columns += [np.ones_like(frequency_hz), 1j * scaled, scaled**2]
    return np.stack(columns, axis=1)


def _basis(lines: _Lines, poles: Reals) -> Reals:
    shapes = _shapes(lines.frequency_hz, poles) / lines.spread[:, None]
    return np.concatenate([shapes.real, shapes.imag])


def _moved(shape: Callable[[Reals], Reals], poles: Reals) -> Reals:
    """Give how a shape follows each pole, by central differences."""
    steps = _STEP * np.eye(poles.size)
    return np.stack([(shape(poles + step) - shape(poles - step)) / (2 * _STEP) for step in steps], axis=-1)


def _peak(found: Resonance, poles: Reals, factors: Reals, covariance: Reals) -> tuple[float, float, float]:
    """Where the fitted magnitude is largest near a mode, how large it is, and its standard deviation."""
    width = max(found.half_power_bandwidth_hz, abs(found.peak_frequency_hz - found.frequency_hz))
    fine_hz: Reals = np.linspace(
        found.peak_frequency_hz - width, found.peak_frequency_hz + width, _FINE_POINTS, dtype=np.float64
    )
    curve = np.abs(_shapes(fine_hz, poles) @ factors)
    top = int(np.argmax(curve))
    top_hz, value = fine_hz[top : top + 1], _shapes(fine_hz[top : top + 1], poles) @ factors
    follows = np.hstack(
        (_moved(lambda moved: _shapes(top_hz, moved) @ factors, poles), _shapes(top_hz, poles))
    )
    along = np.real(np.conj(value / np.abs(value))[:, None] * follows)[0]
    return float(fine_hz[top]), float(curve[top]), float(np.sqrt(along @ covariance @ along))


def _updated(
    found: Resonance,
    pole: Reals,
    sd: Reals,
    chi_square: float,
    peak: tuple[float, float, float],
    lines: int,
) -> Resonance:
    frequency_hz, damping = np.exp(pole).tolist()
    return replace(
        found,
        frequency_hz=frequency_hz,
        sd_frequency_hz=float(frequency_hz * sd[0]),
        damping_ratio=damping,
        sd_damping_ratio=float(damping * sd[1]),
        reduced_chi_square=chi_square,
        lines_used=lines,
        peak_frequency_hz=peak[0],
        peak_magnitude=peak[1],
        sd_peak_magnitude=peak[2],
    )
