"""Values of a band-limited signal between its samples, to nine digits."""

from math import ceil

import numpy as np
import scipy
from scipy.special import i0

from vibench.sim.engine.run import native_engine

from ..errors import InvalidRequest
from .arrays import Reals

REACH = 32
"""Number of samples on each side used for one interpolated value."""
TRUSTED_BAND = 0.4
"""Fraction of the sample rate up to which the interpolation is accurate to about 1e-9."""

_KAISER_BETA = 19.9
"""Parameter of the Kaiser window for 64 taps and a transition from 0.4 to 0.6 of the sample rate: 189 dB."""
_PHASES = 512
"""Number of tabulated fractions of a sample interval; cubic interpolation in this table errs by 1e-10."""


def _weights_of_phases() -> Reals:
    """Return the windowed sinc at every tap, for fractions from one step below 0 to one step above 1."""
    fraction = np.arange(-1, _PHASES + 2, dtype=np.float64) / _PHASES
    distance = fraction[:, np.newaxis] - np.arange(1 - REACH, REACH + 1)
    shape = np.sqrt(np.maximum(1 - (distance / REACH) ** 2, 0.0))
    window = np.where(np.abs(distance) <= REACH, i0(_KAISER_BETA * shape) / i0(_KAISER_BETA), 0.0)
    # The computed sine of a multiple of pi is not exactly zero, so set the values at samples exactly.
    sinc = np.where(distance == np.rint(distance), distance == 0.0, np.sinc(distance))
    return np.asarray(sinc * window)


_WEIGHTS = _weights_of_phases()


def interpolate(samples: Reals, positions: Reals) -> Reals:
    """Evaluate a signal at fractional sample positions by a Kaiser-windowed sinc.

    Returns an array of shape (m,) or (channels, m), exact to about 1e-9 of the signal up to `TRUSTED_BAND`
    of the sample rate.

    Parameters
    ----------
    samples
        Shape (n,) or (channels, n). The signal is assumed zero outside, so values within `REACH` of an end
        are wrong unless the signal is zero there.
    positions
        Positions to evaluate, in samples from the first one, shape (m,).
    """
    channels = np.ascontiguousarray(np.atleast_2d(samples), dtype=np.float64)
    values = np.empty((len(channels), positions.size))
    engine = native_engine()
    work = engine.new(
        "Interpolation",
        samples=channels,
        channels=len(channels),
        table=_WEIGHTS,
        positions=np.ascontiguousarray(positions, dtype=np.float64),
        values=values,
    )
    engine.call("interpolate", work)
    return values.reshape(*samples.shape[:-1], positions.size)


_CLOSE = 0.125
"""Spacing of the interpolated values around a maximum, in samples; the parabola's error is at most 1e-6."""


def sizes_with_maxima(samples: Reals) -> Reals:
    """Return |value| of every sample, or of an interpolated maximum next to the sample, shape (n,).

    At 16 samples per period, the largest sample may be 2 % below the maximum.

    Parameters
    ----------
    samples
        Band-limited signal, shape (n,); maxima within `REACH` of its ends are not interpolated.
    """
    size = np.abs(samples)
    middle = size[REACH:-REACH]
    top = REACH + np.flatnonzero(
        (middle >= size[REACH - 1 : -REACH - 1]) & (middle >= size[REACH + 1 : size.size - REACH + 1])
    )
    # With less than four samples per period, neighbours of a maximum may have the opposite sign.
    at, _ = _vertices(*(np.sign(samples[top]) * samples[top + each] for each in (-1, 0, 1)))
    near = np.concatenate([top + at + each for each in (-_CLOSE, 0.0, _CLOSE)])
    _, largest = _vertices(*np.abs(interpolate(samples, near)).reshape(3, -1))
    size[top] = np.maximum(size[top], largest)
    return size


def _vertices(before: Reals, middle: Reals, after: Reals) -> tuple[Reals, Reals]:
    """Return the maxima of parabolas through three points: positions (0 is the middle point) and values."""
    slope, bend = (after - before) / 2, before + after - 2 * middle
    at = np.clip(-slope / np.minimum(bend, -np.finfo(np.float64).tiny), -1.0, 1.0)
    return at, middle + at * slope / 2


_TOGETHER = 8
_STOP_DB = 100.0
"""Attenuation of aliases [dB], below the noise of a 24-bit converter."""
TRUSTED_FRACTION = 0.4
"""Fraction of the decimated rate up to which the gain is 1 within 1e-5."""


class Decimator:
    """Low-pass filter that keeps every n-th sample; output sample k is at the time of input sample k n."""

    def __init__(self, channels: int, factor: int) -> None:
        if factor < 1:
            raise InvalidRequest(f"a decimation factor of {factor} was requested; give 1 or more")
        self._factor = factor
        taps = _taps(factor)
        self._half = (taps.size - 1) // 2
        # The engine sums eight products at a time; padding gets zero weight.
        self._taps = np.concatenate([np.zeros(-taps.size % _TOGETHER), taps])
        # Half of the filter's taps need later samples. Before the first sample, assume zeros.
        self._pending = np.zeros((channels, self._taps.size - 1 - self._half if factor > 1 else 0))
        self._received = 0
        self._given = 0

    def add(self, block: Reals) -> Reals:
        """Add samples (channels, n); return the output samples that are now complete, shape (channels, m)."""
        self._received += block.shape[1]
        if self._factor == 1:
            return block
        return self._filter(np.concatenate((self._pending, block), axis=1))

    def finish(self) -> Reals:
        """Return the last output samples; after the end, the input is assumed to be zero."""
        if self._factor == 1:
            return self._pending
        zeros = np.zeros((self._pending.shape[0], self._half))
        data = self._filter(np.concatenate((self._pending, zeros), axis=1))
        left = -(-self._received // self._factor) - (self._given - data.shape[1])
        return data[:, : max(left, 0)]

    def _filter(self, data: Reals) -> Reals:
        count = (data.shape[1] - self._taps.size) // self._factor + 1
        if count <= 0:
            self._pending = data
            return data[:, :0]
        engine, result = native_engine(), np.empty((data.shape[0], count))
        # The first output sample has the time of the first input sample.
        first = {"ratio": self._factor, "origin": -self._factor}
        for means, samples in zip(data, result, strict=True):
            fields = {"table": self._taps, "reach": self._taps.size, "means": means, "samples": samples}
            engine.call("decimate", engine.new("Decimation", **first, **fields))
        self._pending = data[:, count * self._factor :].copy()
        self._given += count
        return result


def _taps(factor: int) -> Reals:
    """Return a Kaiser low-pass (edge at 0.4 to 0.6 of the new rate); factor divides half its length."""
    if factor == 1:
        return np.ones(1)
    width = 2 * (1 - 2 * TRUSTED_FRACTION) / factor
    count, beta = scipy.signal.kaiserord(_STOP_DB, width)
    half = ceil(count / 2 / factor) * factor
    return np.asarray(scipy.signal.firwin(2 * half + 1, 1 / factor, window=("kaiser", beta)))


def decimation_factor(sample_rate_hz: float, least_rate_hz: float) -> int:
    """Return the largest decimation factor whose new rate is at least ``least_rate_hz``."""
    return max(1, int(sample_rate_hz / least_rate_hz))
