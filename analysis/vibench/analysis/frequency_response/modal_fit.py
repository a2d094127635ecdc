"""Fit of modes to a transmission's spectral lines by variable projection, with decorrelated errors."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
import scipy

from ..signals import (
    Complexes,
    Flags,
    Integers,
    Reals,
    Window,
    chi_square_limit,
    chi_square_of,
    cosine_weights,
    hop_samples,
    taper,
)
from .results import FrequencyResponse

SMALLEST_RELATIVE_SD = 1e-6
"""Minimum relative standard deviation, so that weights stay finite for noise-free simulations."""
LARGEST_DAMPING = 0.5
RESOLVED_LINES = 4.0
"""Minimum half-power bandwidth of a resolved mode, in noise bandwidths of a spectral line."""
WELL_FITTED = 1.2
"""Reduced chi-square below which a higher degree of the background would only add uncertainty."""


@dataclass(frozen=True)
class Resonance:
    """One resonance, fitted together with all modes of a band or alone on a smooth background."""

    DOCUMENT: ClassVar = (
        "frequency_hz sd_frequency_hz damping_ratio sd_damping_ratio peak_frequency_hz peak_magnitude "
        "sd_peak_magnitude reduced_chi_square chi_square_limit remark is_resolved"
    )

    frequency_hz: float
    """Undamped natural frequency of the mode."""
    sd_frequency_hz: float
    damping_ratio: float
    sd_damping_ratio: float
    peak_frequency_hz: float
    """Frequency of the largest fitted magnitude."""
    peak_magnitude: float
    sd_peak_magnitude: float
    reduced_chi_square: float
    """Reduced chi-square of the lines about the mode; values above 1 increase standard deviations."""
    chi_square_limit: float
    """Reduced chi-square that one correct fit in a thousand exceeds."""
    lines_used: int
    is_resolved: bool
    """Whether the spectral resolution is fine enough for the mode's bandwidth."""
    overlap: float
    """Factor by which an overlapping mode increases the uncertainty of damping; 1 without overlap."""

    @property
    def is_explained(self) -> bool:
        """Whether the fitted modes describe the lines about this mode within the lines' scatter."""
        # Chi-square is NaN for a single hit, whose lines have no known scatter.
        return not self.reduced_chi_square > max(self.chi_square_limit, WELL_FITTED)

    @property
    def remark(self) -> str:
        """Warning if the fit does not match the spectral lines or if modes overlap; otherwise empty."""
        if self.is_explained and self.overlap > 1.0:
            return f"two modes overlap at {self.frequency_hz:.5g} Hz; the bounds include this overlap"
        if self.is_explained:
            return ""
        return (
            f"one mode does not describe the lines near {self.frequency_hz:.5g} Hz (reduced chi² = "
            f"{self.reduced_chi_square:.3g}; by chance at most {max(self.chi_square_limit, WELL_FITTED):.3g})"
        )

    @property
    def half_power_bandwidth_hz(self) -> float:
        """Half-power bandwidth: 2 x damping ratio x frequency."""
        return 2 * self.damping_ratio * self.frequency_hz


# The window of averaged segments smears modes and correlates the errors of neighbouring lines.
#
# Segments are w(t) r(t), w(t) x(t) and w(t) y(t) with y = h * x; r and x have the cross density G. The
# averaged estimate is (|W|^2 convolved with G H) / (|W|^2 convolved with G). Its error is R* V / (R* X). The
# residual V = Y - H X of a segment is sensor noise n windowed by w, plus cut-off ringing: dH/df times x
# windowed by w' / (2 pi i).

_PROXY_SAMPLES = 1024
"""Window length for computing correlations [samples]; the length does not change the result."""
_FAR_LINES = 12
"""Distance in spectral lines beyond which errors under cosine windows are uncorrelated."""
_NEAR = 0.05
"""Value of |q| below which a series for integrals of exp(q t) is more accurate than the closed form."""
_LEAST_NOISE = 0.02
"""Minimum share of sensor noise in a line's variance, since ringing alone may give a singular matrix."""


@dataclass(frozen=True)
class Leakage:
    """Effect of the window, overlap and length of segments on a transmission."""

    segment_s: float
    window: Window
    noise: Reals
    """Correlation of the sensor-noise errors of two lines at distance k, shape (far lines,)."""
    ringing: Reals
    """Covariance of the errors of two lines at distance k due to cut-off ringing, per |dH/df|^2 [Hz^2]."""

    def smeared_pole(self, frequency_hz: Reals, pole: complex, slope_per_hz: Reals | Complexes) -> Complexes:
        """Return the estimate of 1 / (i w - s) including leakage, with s = `pole` [rad/s].

        Where the base's density is flat, this is T I(z), with the segment length T and z = (s - i w) T. I(z)
        is the integral of r(t) exp(z t) from t = 0 to 1; r is the autocorrelation of the window. A relative
        slope g of the density [1/Hz] adds g i / (2 pi) (-1 - z I).
        """
        scaled = (pole - 2j * np.pi * frequency_hz) * self.segment_s
        # For all lines and window terms, exp(scaled) is the same: they differ by whole periods per segment.
        rest = complex(np.expm1(pole * self.segment_s))
        integral = np.zeros_like(scaled)
        for order, falling, level in zip(*_autocorrelation(self.window), strict=True):
            once, twice = _exponentials(scaled + 2j * np.pi * order, rest)
            integral += falling * twice + level * once
        return np.asarray(
            self.segment_s * integral - slope_per_hz * 1j / (2 * np.pi) * (1 + scaled * integral)
        )

    def ringing_sd(self, line: Integers, value: Complexes, spread: Reals) -> Complexes:
        """Return the sd of each line's real or imaginary part due to ringing, with the phase of dH/df.

        Parameters
        ----------
        line
            Line numbers in ascending order.
        value, spread
            Transmission at these lines, and upper limit of the sd of its real or imaginary part.
        """
        ringing = np.gradient(value) / np.gradient(line / self.segment_s) * np.sqrt(self.ringing[0])
        most, size = np.sqrt(1 - _LEAST_NOISE) * spread, np.abs(ringing)
        return np.asarray(ringing * np.divide(most, size, out=np.ones_like(size), where=size > most))

    def covariance(self, line: Integers, rung: Complexes, spread: Reals) -> Complexes:
        """Return the lower bands of the real (or imaginary) errors' covariance, shape (far lines, lines)."""
        noise = np.sqrt(spread**2 - np.abs(rung) ** 2)
        alike = self.ringing / (self.ringing[0] or 1.0)
        bands = np.zeros((_FAR_LINES, line.size), dtype=np.complex128)
        for off in range(min(_FAR_LINES, line.size)):
            here, there = slice(0, line.size - off), slice(off, None)
            apart = line[there] - line[here]
            near = apart < _FAR_LINES
            apart = np.where(near, apart, 0)
            noisy = self.noise[apart] * noise[here] * noise[there]
            bands[off, here] = near * (noisy + alike[apart] * rung[there] * np.conj(rung[here]))
        return bands


def leakage_of(found: FrequencyResponse) -> Leakage | None:
    """Return the leakage of a transmission; None for whole periods and for hits."""
    if found.resolution_hz == 0.0 or found.settings.decay_per_s is not None:
        return None
    how = found.settings
    window, segment_s = Window(how.window), how.segment_samples / how.sample_rate_hz
    noise, ringing = _line_correlations(window, how.overlap, found.segments_used)
    # Real and imaginary part each have half the mean's variance; w' is per second, the slope is per hertz.
    scale = 1 / (8 * np.pi**2 * found.n_eff * segment_s**2)
    return Leakage(segment_s, window, noise, scale * ringing)


@lru_cache(maxsize=16)
def _line_correlations(window: Window, overlap: float, segments: int) -> tuple[Reals, Reals]:
    """Return the correlations of errors at distance k [lines] due to sensor noise and due to ringing.

    Both are sums over j of (1 - |j| / K) conj(c_j(k)) d_j(k), for K segments with hop D. c_j is the Fourier
    transform of w(n) w(n + j D). For noise, d_j = c_j; for ringing, w' replaces w in d_j.
    """
    values = taper(window, _PROXY_SAMPLES)
    weights = cosine_weights(window)
    turns = 2 * np.pi * np.arange(_PROXY_SAMPLES) / _PROXY_SAMPLES
    slope = np.zeros(_PROXY_SAMPLES)
    for order, weight in enumerate(weights):
        slope -= 2 * np.pi * order * weight * np.sin(order * turns)
    hop = hop_samples(_PROXY_SAMPLES, overlap)
    noise, ringing = np.zeros(_FAR_LINES), np.zeros(_FAR_LINES)
    for lag in range(0, min(_PROXY_SAMPLES, segments * hop), hop):
        share = (1 if lag == 0 else 2) * (1 - lag / hop / segments)
        here, there = slice(0, _PROXY_SAMPLES - lag), slice(lag, None)
        reference = np.fft.fft(values[here] * values[there], _PROXY_SAMPLES)[:_FAR_LINES]
        rung = np.fft.fft(slope[here] * slope[there], _PROXY_SAMPLES)[:_FAR_LINES]
        noise += share * np.abs(reference) ** 2
        ringing += share * np.real(np.conj(reference) * rung)
    return noise / noise[0], ringing / noise[0]


@lru_cache(maxsize=8)
def _autocorrelation(window: Window) -> tuple[Reals, Reals, Complexes]:
    """Return b, f_b and g_b of the autocorrelation, sum over b of exp(2 pi i b t) (f_b (1 - t) + g_b).

    For w = sum of c_b exp(2 pi i b t): f_b = c_b^2, g_b = c_b sum over a != b of c_a / (pi i (a - b)).
    """
    half = np.array(cosine_weights(window))
    half[1:] /= 2
    weights = np.concatenate((half[:0:-1], half))
    order = np.arange(weights.size) - float(half.size - 1)
    apart = order - order[:, None]
    np.fill_diagonal(apart, np.inf)
    level = weights * np.sum(weights / apart, axis=1) / (1j * np.pi)
    energy = float(weights @ weights)
    return np.asarray(order, dtype=np.float64), weights**2 / energy, np.asarray(level / energy)


def _exponentials(exponent: Complexes, rest: complex) -> tuple[Complexes, Complexes]:
    """Return the integrals of exp(q t) and (1 - t) exp(q t) from 0 to 1; `rest` is exp(q) - 1."""
    near = np.abs(exponent) < _NEAR
    q = np.where(near, 1.0, exponent)
    once = rest / q
    twice = (once - 1) / q
    small = exponent[near]
    once[near] = 1 + small / 2 * (1 + small / 3 * (1 + small / 4 * (1 + small / 5)))
    twice[near] = 0.5 * (1 + small / 3 * (1 + small / 4 * (1 + small / 5 * (1 + small / 6))))
    return once, twice


Background = Callable[[Reals], Complexes]
"""Function of frequency [Hz] that returns background shapes, one per real factor: (lines, factors)."""
_FINE_POINTS = 401
_STEP = 1e-6
_WORST_CONDITION = 1e14
_MOST_STEPS = 40
"""Maximum number of iteration steps of a fit."""
_STEADY_AVERAGES = 49.0
"""Equivalent number of averages of a scatter that is smoothed over neighbouring spectral lines."""
_LEAST_LINES_ABOUT = 8
_OVERLAP = 1.5
"""If two modes are closer than this [half-power bandwidths], a third mode between them is considered."""
_EDGE = 1e-3
"""A fit that ends closer than this to a bound, relative to the search reach, has found no minimum."""


class Lines:
    """Weighted lines of a transmission with decorrelated errors.

    Parameters
    ----------
    band
        Transmission at the lines; its standard deviation gives the weights.
    chosen
        Flags of the lines to fit, shape (lines,).
    """

    def __init__(self, band: FrequencyResponse, chosen: Flags) -> None:
        spread = np.maximum(band.relative_sd_magnitude, SMALLEST_RELATIVE_SD) * band.magnitude
        usable = chosen & np.isfinite(spread) & np.isfinite(band.value) & (spread > 0)
        self.frequency_hz, self.value = band.frequency_hz[usable], band.value[usable]
        self._spread = spread[usable]
        self._leakage = leakage_of(band)
        # Under an exponential window, spectral lines show the response at a complex frequency.
        self._off_hz = -0.5j / np.pi * (band.settings.decay_per_s or 0.0)
        slope = band.drive_slope_per_hz
        self._slope_per_hz = np.zeros(self.value.size) if slope is None else slope[usable]
        # Smoothing the scatter over lines has the same effect as more averages.
        self._averages = band.n_eff if band.steady_relative_sd is None else max(band.n_eff, _STEADY_AVERAGES)
        self._root: Complexes | None = None
        self.ringing_share = np.zeros(self.value.size)
        """Share of cut-off ringing in each line's variance; 1 with a boxcar."""
        if self._leakage is not None and self.value.size:
            number = np.rint(self.frequency_hz * self._leakage.segment_s).astype(np.int64)
            rung = self._leakage.ringing_sd(number, self.value, self._spread)
            bands = self._leakage.covariance(number, rung, self._spread)
            self.ringing_share += 1.0 if self.narrowest_hz else np.abs(rung / self._spread) ** 2
            self._root = np.asarray(scipy.linalg.cholesky_banded(bands, lower=True))

    @property
    def narrowest_hz(self) -> float:
        """Smallest half-power bandwidth [Hz] at which a boxcar resolves damping; 0 for other windows."""
        leakage = self._leakage
        return 1 / leakage.segment_s if leakage is not None and leakage.ringing[0] == 0 else 0.0

    def independent(self, columns: Complexes) -> Reals:
        """Convert complex values of lines to uncorrelated real values of variance 1, shape (2 lines, ...)."""
        if self._root is None:
            shape = (-1,) + (1,) * (columns.ndim - 1)
            scaled = columns / self._spread.reshape(shape)
        else:
            scaled = scipy.linalg.solve_banded((len(self._root) - 1, 0), self._root, columns)
        return np.concatenate([scaled.real, scaled.imag])

    def relative_sd(self, frequency_hz: float) -> float:
        """Return the relative scatter of the spectral line nearest to a frequency."""
        line = int(np.argmin(np.abs(self.frequency_hz - frequency_hz)))
        return float(self._spread[line] / np.abs(self.value[line]))

    def squares(self, left: Reals) -> Reals:
        """Return chi square of each line, 2 degrees of freedom, from residuals of variance one."""
        real, imaginary = np.split(left, 2)
        return chi_square_of(real**2 + imaginary**2, self._averages)

    def modes(self, poles: Reals) -> Complexes:
        """Return the shapes of modes including leakage; see `mode_shapes`."""
        if self._leakage is None:
            return mode_shapes(np.asarray(self.frequency_hz + self._off_hz), poles)
        columns = []
        for log_frequency, log_damping in poles.reshape(-1, 2):
            natural, damping = 2 * np.pi * np.exp(log_frequency), np.exp(log_damping)
            pole = natural * complex(-damping, np.sqrt(1 - damping**2))
            both = [
                (each, self._leakage.smeared_pole(self.frequency_hz, each, self._slope_per_hz))
                for each in (pole, pole.conjugate())
            ]
            over = damping * natural / (1j * pole.imag)
            (first, one), (second, other) = both
            columns += [natural * over * (one - other), over * (first * one - second * other)]
        return np.reshape(columns, (-1, self.frequency_hz.size)).T


def mode_shapes(frequency_hz: Reals | Complexes, poles: Reals) -> Complexes:
    """Return two functions per mode for a fit with real factors, shape (lines, 2 modes), of size about one.

    2 zeta / (1 - r^2 + 2 i zeta r) and i r times this, with r = w / w0; `poles`: ln(w0 / 2 pi), ln(zeta).
    """
    columns = []
    for log_frequency, log_damping in poles.reshape(-1, 2):
        ratio, damping = frequency_hz / np.exp(log_frequency), np.exp(log_damping)
        mode = 2 * damping / (1 - ratio**2 + 2j * damping * ratio)
        columns += [mode, 1j * ratio * mode]
    return np.reshape(columns, (-1, frequency_hz.size)).T


@dataclass(frozen=True)
class ModalFit:
    """Modes fitted together on one background."""

    resonances: tuple[Resonance, ...]
    chi_square: float
    """Chi square per degree of freedom of all fitted spectral lines."""
    freedom: int

    @property
    def explains(self) -> bool:
        """Return whether the residuals, overall and about each mode, are within the scatter."""
        return self.chi_square < max(WELL_FITTED, chi_square_limit(self.freedom)) and all(
            each.is_explained for each in self.resonances
        )


class _Sums:
    """Linear fit of modes and a background to spectral lines, for given poles and with real factors."""

    def __init__(self, lines: Lines, background: Background) -> None:
        self._lines = lines
        self.target, self.behind = (
            lines.independent(each) for each in (lines.value, background(lines.frequency_hz))
        )

    def basis(self, poles: Reals) -> Reals:
        """Return the shapes of all modes and of the background."""
        return np.hstack((self._lines.independent(self._lines.modes(poles)), self.behind))

    def factors(self, poles: Reals) -> tuple[Reals, Reals, Reals]:
        """Return the least-squares factors, the residual, and an orthonormal basis of the shapes."""
        onto, size, turn = np.linalg.svd(self.basis(poles), full_matrices=False)
        kept = size > np.finfo(np.float64).eps * onto.shape[0] * size[0]
        onto, along = onto[:, kept], onto[:, kept].T @ self.target
        return turn[kept].T @ (along / size[kept]), self.target - onto @ along, onto

    def pole_rates(self, poles: Reals, factors: Reals) -> Reals:
        """Return the derivatives of the fitted sum with respect to each pole, at fixed factors."""
        return self._lines.independent(_rates(self._lines.modes, poles, factors))

    def misfit(self, poles: Reals) -> Reals:
        """Return the residual with the best factors for the given poles."""
        return self.factors(poles)[1]

    def misfit_rates(self, poles: Reals) -> Reals:
        """Return the derivatives of the residual with respect to each pole."""
        # The factors also depend on the poles, which does not change the gradient (Kaufman 1975, BIT 15, 49).
        factors, _, onto = self.factors(poles)
        rates = self.pole_rates(poles, factors)
        return np.asarray(onto @ (onto.T @ rates) - rates)


def modal_fit(
    band: FrequencyResponse, lines: Lines, start: Reals, reach: Reals, background: Background
) -> ModalFit | None:
    """Fit poles near starting values; None if the lines do not determine them.

    Variable projection (Golub & Pereyra 1973, SIAM J. Numer. Anal. 10, 413-432).

    Parameters
    ----------
    band
        Transmission of the lines.
    lines
        Lines to fit.
    start, reach
        Logarithms of natural frequency [Hz] and damping ratio of each mode, and their largest changes, shape
        (2 modes,).
    background
        Shapes to add to the modes.
    """
    sums = _Sums(lines, background)
    freedom = sums.target.size - 2 * start.size - sums.behind.shape[1]
    if freedom < 1:
        return None
    top = np.tile([np.inf, np.log(LARGEST_DAMPING)], start.size // 2)
    low, high = start - reach, np.minimum(start + reach, np.maximum(top, start + 1e-6))
    result = scipy.optimize.least_squares(
        sums.misfit,
        start,
        jac=sums.misfit_rates,
        bounds=(low, high),
        x_scale=reach / 20,
        xtol=1e-9,
        ftol=1e-9,
        max_nfev=_MOST_STEPS,
    )
    poles = np.asarray(result.x, dtype=np.float64)
    if not result.success or np.any(np.minimum(poles - low, high - poles) < _EDGE * reach):
        return None
    found, left, _ = sums.factors(poles)
    # Compute the joint Jacobian and covariance of the poles and factors.
    follows = np.hstack((sums.pole_rates(poles, found), sums.basis(poles)))
    curvature: Reals = np.asarray(np.real(follows.T @ follows), dtype=np.float64)
    # If the factor of a mode is exactly zero, its pole is undetermined.
    if not np.diag(curvature).all() or _condition(curvature) > _WORST_CONDITION:
        return None
    squares = lines.squares(left)
    chi_square = float(np.sum(squares)) / freedom
    alone = np.diag(np.linalg.inv(curvature))
    hidden = lines.modes(_poles_between(poles))
    # Two overlapping peaks may also be three modes with very different damping: allow for a third mode.
    columns = np.hstack((follows, lines.independent(hidden)))
    curvature = np.asarray(columns.T @ columns)
    if _condition(curvature) > _WORST_CONDITION:
        return None
    covariance = np.asarray(np.linalg.inv(curvature)[: alone.size, : alone.size])

    def curve(frequency_hz: Reals, poles: Reals) -> Complexes:
        return np.hstack((mode_shapes(frequency_hz, poles), background(frequency_hz)))

    def resonance(mode: int) -> Resonance:
        natural_hz, damping = np.exp(poles[2 * mode : 2 * mode + 2]).tolist()
        half_hz = damping * natural_hz
        away_hz = np.abs(lines.frequency_hz - natural_hz)
        nearest_hz = float(np.sort(away_hz)[min(_LEAST_LINES_ABOUT, away_hz.size) - 1])
        about = away_hz <= max(2 * half_hz, nearest_hz)
        share = freedom / left.size
        beside = 2 * float(np.count_nonzero(about)) * share
        nearby = float(np.sum(squares[about])) / beside
        # Errors due to ringing also correlate with conjugates of other errors, which at most doubles the
        # variance of a fitted value.
        # Motion that remains from an earlier hit shifts all lines together; the jackknife includes this.
        least = 1.0 if band.settings.decay_per_s is None else 0.0
        widened = max(least, chi_square, nearby) * (1 + float(np.mean(lines.ringing_share[about])))
        sd = np.sqrt(widened * np.diag(covariance)[2 * mode : 2 * mode + 2])
        ends_hz = lines.frequency_hz[[0, -1]]
        top_hz = np.array([natural_hz])
        # In the second pass, search only between the two neighbours of the highest point.
        for reach_hz in (2 * half_hz, 4 * half_hz / _FINE_POINTS):
            fine_hz = np.clip(np.linspace(top_hz[0] - reach_hz, top_hz[0] + reach_hz, _FINE_POINTS), *ends_hz)
            top_hz = fine_hz[[int(np.argmax(np.abs(curve(fine_hz, poles) @ found)))]]
        value = curve(top_hz, poles) @ found
        moved = _rates(lambda poles: mode_shapes(top_hz, poles), poles, found)
        changes = np.hstack((moved, curve(top_hz, poles)))
        along = np.real(np.conj(value / np.abs(value))[:, None] * changes)[0]
        return Resonance(
            frequency_hz=natural_hz,
            sd_frequency_hz=float(natural_hz * sd[0]),
            damping_ratio=damping,
            sd_damping_ratio=float(damping * sd[1]),
            peak_frequency_hz=float(top_hz[0]),
            peak_magnitude=float(np.abs(value[0])),
            sd_peak_magnitude=float(np.sqrt(widened * (along @ covariance @ along))),
            reduced_chi_square=nearby,
            chi_square_limit=chi_square_limit(max(round(beside), 1)),
            lines_used=lines.frequency_hz.size,
            is_resolved=2 * half_hz > RESOLVED_LINES * band.resolution_hz,
            overlap=float(np.sqrt(covariance[2 * mode + 1, 2 * mode + 1] / alone[2 * mode + 1])),
        )

    return ModalFit(tuple(resonance(mode) for mode in range(poles.size // 2)), chi_square, freedom)


def _poles_between(poles: Reals) -> Reals:
    """Return poles half way between pairs of overlapping modes; none within groups of three or more modes."""
    modes = poles.reshape(-1, 2)
    modes = modes[np.argsort(modes[:, 0])]
    mean_bandwidth = np.exp(modes[:-1, 1]) + np.exp(modes[1:, 1])
    overlaps = np.pad(np.diff(modes[:, 0]) < _OVERLAP * mean_bandwidth, 1)
    are_two = overlaps[1:-1] & ~overlaps[:-2] & ~overlaps[2:]
    return np.asarray((modes[:-1] + modes[1:])[are_two] / 2)


def _condition(curvature: Reals) -> float:
    """Return the condition number of a matrix scaled to a unit diagonal, so that units have no effect."""
    size = np.sqrt(np.diag(curvature))
    return float(np.linalg.cond(curvature / np.outer(size, size)))


def _rates(shapes: Callable[[Reals], Complexes], poles: Reals, factors: Reals) -> Complexes:
    """Return the derivatives of a sum of modes with respect to each pole, by central differences.

    A pole affects only the two shapes of its mode.
    """
    rates = []
    for each in range(poles.size):
        pair = slice(each // 2 * 2, each // 2 * 2 + 2)
        step = _STEP * np.eye(2)[each % 2]
        rates.append((shapes(poles[pair] + step) - shapes(poles[pair] - step)) @ factors[pair] / (2 * _STEP))
    return np.stack(rates, axis=-1)
