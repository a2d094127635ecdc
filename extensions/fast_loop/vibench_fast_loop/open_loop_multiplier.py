"""Whether a motion that feedback holds would be stable without it: told by small changes of what is played.

Near a motion of period T the specimen obeys a linear equation with coefficients of that period, driven by
what the base does besides its sine. Controller, amplifier, shaker and the specimen's push on the table act on
the specimen through the base alone. The base is measured: with it as the input, the fit is one of the open
loop, and its multipliers are those under a base that moves as prescribed, whatever law held the motion and
however little is known of it. D. A. W. Barton, Mech. Syst. Signal Process. 84 (2017) 54, fits a periodic
autoregression with inputs for the same purpose.

Small deviations are slow beside the drive where a multiplier lies near 1, so that complex envelopes tell
them: z of m0 at the drive's frequency, b1 and b3 of the base at one and three times that. What is fast (the
upper modes, the third harmonic of m0) follows them, and is expanded in derivatives of the input:

    dz/dt = A z + B0 b1 + B1 db1/dt + B2 d2b1/dt2 + C0 b3 + C1 db3/dt,

each letter a real 2 x 2 matrix on real and imaginary part, since springs that change twice a period couple a
deviation to its conjugate. Multipliers: exp(T eig A). Both harmonics must be changed independently of each
other: the specimen pushes the table at three times the frequency as well, and b3 would else follow from z.

Noise of the sensors in z and b biases least squares towards stability. What is played goes through its
changes twice, the second time with the other sign, and each repeat is the instrument of the other
(T. Soderstrom, Automatica 43 (2007) 939): their noises are independent, and what is even in the changes,
curvature of the branch above all, has opposite signs and drops out as well.

Not seen: growth that changes sign from period to period (a multiplier near -1), and, in motions without the
symmetry of two equal stops, the second harmonic of the base.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from vibench.sim.specimen.state import Table, Vector

Complexes = NDArray[np.complex128]
_HALF = 4
"""Half the length of the window of an envelope [periods]."""
_EACH = 4
"""Envelopes a period."""
_INPUTS = {1: 2, 3: 1}
"""Harmonics of the base, and the highest derivative that is taken of each."""
_BLOCK = 8
"""Periods after which what is left over counts as independent."""
_MODEL = 0.01
"""What the expansion leaves out, as a standard error: bias of noiseless motions (docs/decisions/0069)."""
_QUANTILE = 2.1
"""Quantile of Student's distribution at 95 % with the twenty degrees of freedom of as many blocks."""


@dataclass(frozen=True, eq=False)
class PerturbedMotion:
    """Base and m0 while what is played is changed a little."""

    base: Vector
    """Acceleration, in any unit, shape (samples,)."""
    m0: Vector
    """Velocity, in any unit, shape (samples,)."""
    period: float
    """Period of the drive [samples]."""
    first: int
    """Sample at which the changes begin to be gone through; before it lies the end of their second half."""
    periods: int
    """That they take; then they are gone through once more with the other sign."""


@dataclass(frozen=True)
class OpenLoopMultiplier:
    """The largest multiplier over a period of a motion under a base that moves as prescribed."""

    size: float
    error: float
    """Standard uncertainty."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Interval of 95 %."""
        return self.size - _QUANTILE * self.error, self.size + _QUANTILE * self.error


def open_loop_multiplier(motion: PerturbedMotion) -> OpenLoopMultiplier:
    """Fit the equation of slow deviations to a perturbed motion, and give its largest multiplier.

    Parameters
    ----------
    motion
        At least some thirty periods of changes, each a few periods long.

    Returns
    -------
    An error that is not finite where the changes tell nothing.
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
    signs: Table = np.repeat([1.0, -1.0], rows // 2)[:, None]
    left, right = (signs * _detrend(each) for each in (left, right))
    scale: Vector = np.maximum(left.std(axis=0), np.finfo(np.float64).tiny)
    left /= scale
    other = np.roll(left, rows // 2, axis=0)
    gains = np.asarray(np.linalg.lstsq(other.T @ left, other.T, rcond=None)[0], dtype=np.float64)
    found = gains @ right
    return _largest(found, gains, left, right, scale)


def envelope_deviation(signal: Vector, period: float) -> float:
    """Return the rms deviation of a signal's fundamental from its mean and drift, over that mean.

    Parameters
    ----------
    signal
        At least some twenty periods, shape (samples,).
    period
        Of the drive [samples].
    """
    half = round(_HALF * period)
    turn = np.exp(-2j * np.pi * np.arange(len(signal)) / period)
    seen = _envelope(signal, turn, period, 0)[half:-half]
    deviation = np.hypot(*_detrend(_parts([seen])).T)
    return float(np.sqrt(np.mean(deviation**2)) / abs(seen.mean()))


def _largest(found: Table, gains: Table, left: Table, right: Table, scale: Vector) -> OpenLoopMultiplier:
    """Give the largest multiplier, and its error by what is left over in blocks of periods (delta method)."""
    values, vectors = np.linalg.eig(found[:2].T / scale[:2])
    most = int(np.argmax(values.real))
    mirror = np.linalg.pinv(vectors)[most]
    rest = (right - left @ found) @ mirror
    told = (rest * (gains[:2].T @ (vectors[:, most] / scale[:2]))).real
    length = _BLOCK * _EACH
    sums = np.convolve(told, np.ones(length), mode="valid")
    count, free = len(told) / _EACH, len(told) / _EACH - left.shape[1] - 2
    spread = float(np.sqrt(np.mean(sums**2) * len(told) / length * count / max(free, 1.0)))
    size = float(np.exp(values[most].real))
    return OpenLoopMultiplier(size, float(np.hypot(size * spread, _MODEL)))


def _turn(motion: PerturbedMotion) -> Complexes:
    """Give the carrier at the drive's frequency as the base shows it: clocks differ by parts in a million."""
    turn = np.exp(-2j * np.pi * np.arange(len(motion.base)) / motion.period)
    inside = slice(motion.first, motion.first + round(2 * motion.periods * motion.period))
    phase = np.unwrap(np.angle(_envelope(motion.base, turn, motion.period, 0)[inside]))
    slope = np.polyfit(np.arange(len(phase)), phase, 1)[0]
    return np.asarray(turn * np.exp(-1j * slope * np.arange(len(turn))))


def _envelope(signal: Vector, turn: Complexes, period: float, order: int) -> Complexes:
    """Return a derivative of an envelope, per period, under a window cos^4 of several periods."""
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


def _parts(columns: list[Complexes]) -> Table:
    return np.column_stack([part for each in columns for part in (each.real, each.imag)])


def _detrend(table: Table) -> Table:
    """Take mean and drift out."""
    line = np.column_stack([np.ones(len(table)), np.linspace(-1, 1, len(table))])
    return np.asarray(table - line @ np.linalg.lstsq(line, table, rcond=None)[0])
