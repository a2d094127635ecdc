"""Stability of a held motion without feedback, estimated from small perturbations of the drive.

Near a motion of period T, the specimen obeys a linear equation with T-periodic coefficients, driven by the
deviations of the base from its sine. Controller, amplifier, shaker and the reaction of the specimen on the
table act on the specimen through the base alone. The measured base is the input, so the fit describes the
open loop: its multipliers are those under a prescribed base motion, for any law, known or not. D. A. W.
Barton, Mech. Syst. Signal Process. 84 (2017) 54, fits a periodic autoregression with inputs for the same
purpose.

If a multiplier is near 1, small deviations are slow compared with the drive, and complex envelopes describe
them: z of m0 at the drive frequency, b1 and b3 of the base at one and three times this frequency. Fast parts
(upper modes, third harmonic of m0) follow the envelopes, and are expanded in derivatives of the input:

dz/dt = A z + B0 b1 + B1 db1/dt + B2 d2b1/dt2 + C0 b3 + C1 db3/dt,

where capital letters are real 2 x 2 matrices for real and imaginary part, because springs that change twice a
period couple a deviation to its conjugate. Multipliers are exp(T eig A). Both harmonics must be perturbed
independently: the specimen also drives the table at three times the frequency, so b3 would follow from z.

Sensor noise in z and b biases least squares towards stability. Therefore the changes are played twice, the
second time with opposite sign, and each half is the instrumental variable of the other (T. Soderstrom,
Automatica 43 (2007) 939). Both have independent noise; even effects such as the branch's curvature cancel.

Not detected: growth with alternating sign (a multiplier near -1), and the second harmonic of the base in
motions without the symmetry of two equal stops.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from vibench.sim.specimen.specimen import Floats

Complexes = NDArray[np.complex128]
_HALF = 4
"""Half length of the window of an envelope [periods]."""
_EACH = 4
_INPUTS = {1: 2, 3: 1}
"""Highest derivative used as an input of the fit, keyed by harmonic of the base."""
_BLOCK = 8
"""Number of periods in a block; residuals of different blocks count as independent."""
_MODEL = 0.01
"""Standard error due to the truncated expansion, from the bias in noise-free motions (decision 0069)."""
_QUANTILE = 2.1
"""97.5 % quantile of Student's distribution for about twenty blocks, for a 95 % interval."""


@dataclass(frozen=True, eq=False)
class PerturbedMotion:
    """Samples of base and m0 during small changes of the drive."""

    base: Floats
    """Base acceleration in any unit, shape (samples,)."""
    m0: Floats
    """Velocity of m0 in any unit, shape (samples,)."""
    period: float
    """Period of the drive [samples]."""
    first: int
    """Index of the first sample with evaluated changes; the lead-in before plays the last of the changes."""
    periods: int
    """Number of periods with changes; the same changes with opposite sign follow."""


@dataclass(frozen=True)
class OpenLoopMultiplier:
    """Largest multiplier over a period, for a motion under a prescribed base motion."""

    size: float
    error: float

    @property
    def bounds(self) -> tuple[float, float]:
        """95 % confidence interval of the multiplier."""
        return self.size - _QUANTILE * self.error, self.size + _QUANTILE * self.error


def open_loop_multiplier(motion: PerturbedMotion) -> OpenLoopMultiplier:
    """Return the largest multiplier, from a fit of the equation of slow deviations to a perturbed motion.

    The motion needs at least about thirty periods of changes, each change several periods long. The error of
    the result is not finite if the changes are insufficient.
    """
    rows = 2 * motion.periods * _EACH
    steps = motion.period / _EACH
    at = np.rint(motion.first + np.arange(rows) * steps).astype(np.int64)
    turn = _turn(motion)
    known = [_envelope(motion.m0, turn, motion.period, 0)[at]]
    for harmonic, top in _INPUTS.items():
        wave = turn**harmonic
        known += [_envelope(motion.base, wave, motion.period, order)[at] for order in range(top + 1)]
    left = _parts(known)
    right = _parts([_envelope(motion.m0, turn, motion.period, 1)[at]])
    signs: Floats = np.repeat([1.0, -1.0], rows // 2)[:, None]
    left, right = (signs * _detrend(each) for each in (left, right))
    scale: Floats = np.maximum(left.std(axis=0), np.finfo(np.float64).tiny)
    left /= scale
    other = np.roll(left, rows // 2, axis=0)
    gains = np.asarray(np.linalg.lstsq(other.T @ left, other.T, rcond=None)[0], dtype=np.float64)
    found = gains @ right
    return _largest(found, gains, left, right, scale)


def envelope_deviation(signal: Floats, period: float) -> float:
    """Return the relative rms deviation of a signal's fundamental from its mean and drift.

    ``signal`` spans about twenty drive periods or more, shape (samples,); ``period`` is one period [samples].
    """
    half = round(_HALF * period)
    turn = np.exp(-2j * np.pi * np.arange(len(signal)) / period)
    seen = _envelope(signal, turn, period, 0)[half:-half]
    deviation = np.hypot(*_detrend(_parts([seen])).T)
    return float(np.sqrt(np.mean(deviation**2)) / abs(seen.mean()))


def _largest(found: Floats, gains: Floats, left: Floats, right: Floats, scale: Floats) -> OpenLoopMultiplier:
    """Return the largest multiplier, with an error from the residuals of blocks of periods (delta method)."""
    values, vectors = np.linalg.eig(found[:2].T / scale[:2])
    most = int(np.argmax(values.real))
    mirror = np.linalg.pinv(vectors)[most]
    rest = (right - left @ found) @ mirror
    residual = (rest * (gains[:2].T @ (vectors[:, most] / scale[:2]))).real
    length = _BLOCK * _EACH
    sums = np.convolve(residual, np.ones(length), mode="valid")
    count, free = len(residual) / _EACH, len(residual) / _EACH - left.shape[1] - 2
    spread = float(np.sqrt(np.mean(sums**2) * len(residual) / length * count / max(free, 1.0)))
    size = float(np.exp(values[most].real))
    return OpenLoopMultiplier(size, float(np.hypot(size * spread, _MODEL)))


def _turn(motion: PerturbedMotion) -> Complexes:
    """Return the carrier at the drive frequency; estimate it from the base, because the clocks differ."""
    turn = np.exp(-2j * np.pi * np.arange(len(motion.base)) / motion.period)
    inside = slice(motion.first, motion.first + round(2 * motion.periods * motion.period))
    phase = np.unwrap(np.angle(_envelope(motion.base, turn, motion.period, 0)[inside]))
    slope = np.polyfit(np.arange(len(phase)), phase, 1)[0]
    return np.asarray(turn * np.exp(-1j * slope * np.arange(len(turn))))


def _envelope(signal: Floats, turn: Complexes, period: float, order: int) -> Complexes:
    """Return a derivative of an envelope, per period, under a cos^4 window of several periods."""
    half = round(_HALF * period)
    place = np.arange(-half, half + 1) / half * np.pi / 2
    per_period = np.pi / 2 * period / half
    cos, sin = np.cos(place), np.sin(place)
    window = (
        cos**4,
        -4 * cos**3 * sin * per_period,
        (12 * cos**2 * sin**2 - 4 * cos**4) * per_period**2,
    )[order]
    return np.asarray(fftconvolve(signal * turn, window / np.sum(cos**4), mode="same"))


def _parts(columns: list[Complexes]) -> Floats:
    return np.column_stack([part for each in columns for part in (each.real, each.imag)])


def _detrend(table: Floats) -> Floats:
    line = np.column_stack([np.ones(len(table)), np.linspace(-1, 1, len(table))])
    return np.asarray(table - line @ np.linalg.lstsq(line, table, rcond=None)[0])
