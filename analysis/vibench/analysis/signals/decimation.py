"""Fewer samples of a long signal, block by block, without delay and without aliases."""

from math import ceil

import numpy as np
import scipy

from ..errors import InvalidRequest
from .arrays import Reals

_STOP_DB = 100.0
"""Aliases are this far down: below the noise of a 24-bit converter."""
TRUSTED_FRACTION = 0.4
"""Part of the decimated rate up to which the gain is 1 within 1e-5."""


class Decimator:
    """Low-passes channels and keeps every n-th sample; sample k of the result lies at sample k n."""

    def __init__(self, channels: int, factor: int) -> None:
        if factor < 1:
            raise InvalidRequest(f"a decimation factor of {factor} was asked for; allowed are 1 and more")
        self._factor = factor
        self._taps = _taps(factor)
        self._half = (self._taps.size - 1) // 2
        # The filter looks half its length ahead: zeros stand for the time before the record.
        self._pending = np.zeros((channels, self._half if factor > 1 else 0))
        self._received = 0
        self._given = 0

    def add(self, block: Reals) -> Reals:
        """Take samples of shape (channels, n) and give those that are complete, shape (channels, m)."""
        self._received += block.shape[1]
        if self._factor == 1:
            return block
        return self._filtered(np.concatenate((self._pending, block), axis=1))

    def finish(self) -> Reals:
        """Give the last samples, with zeros standing for the time after the record."""
        if self._factor == 1:
            return self._pending
        zeros = np.zeros((self._pending.shape[0], self._half))
        data = self._filtered(np.concatenate((self._pending, zeros), axis=1))
        left = -(-self._received // self._factor) - (self._given - data.shape[1])
        return data[:, : max(left, 0)]

    def _filtered(self, data: Reals) -> Reals:
        count = (data.shape[1] - self._taps.size) // self._factor + 1
        if count <= 0:
            self._pending = data
            return data[:, :0]
        whole = scipy.signal.upfirdn(
            self._taps, data[:, : (count - 1) * self._factor + self._taps.size], 1, self._factor
        )
        # upfirdn starts with the filter only partly over the data; outputs before that are no results.
        shift = self._taps.size - 1
        result = whole[:, shift // self._factor :][:, :count]
        self._pending = data[:, count * self._factor :].copy()
        self._given += count
        return np.asarray(result)


def _taps(factor: int) -> Reals:
    """Kaiser low-pass from 0.4 to 0.6 of the new rate, its half length a multiple of the factor."""
    if factor == 1:
        return np.ones(1)
    width = 2 * (1 - 2 * TRUSTED_FRACTION) / factor
    count, beta = scipy.signal.kaiserord(_STOP_DB, width)
    half = ceil(count / 2 / factor) * factor
    return np.asarray(scipy.signal.firwin(2 * half + 1, 1 / factor, window=("kaiser", beta)))


def decimation_factor(sample_rate_hz: float, least_rate_hz: float) -> int:
    """Largest factor that leaves at least the given rate."""
    return max(1, int(sample_rate_hz / least_rate_hz))
