"""Drive, base and response as they come, the response's drop-outs bridged across the ends of what came."""

import numpy as np

from ..instruments import Samples
from ..recording import bridged, found_dropouts, undecided_from

_REMEMBERED_S = 0.1
"""Of what was handed on: a drop-out is told, and bridged, by the motion before it."""


class BridgedRows:
    """Hands samples on, but for what may be the beginning of a drop-out: that waits for the next ones."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate_hz = sample_rate_hz
        self._rows = np.empty((3, 0))
        self._first = 0
        self._next = 0
        """Sample that is handed on next."""

    def take(self, first_sample: int, rows: Samples) -> tuple[int, Samples]:
        """Take the next samples, shape (3, samples) with the response last; give those handed on."""
        if first_sample != self._first + self._rows.shape[1]:
            self._rows, self._first, self._next = self._rows[:, :0], first_sample, first_sample
        self._rows = np.concatenate([self._rows, rows], axis=1)
        response = self._rows[-1]
        dropouts = found_dropouts(response, self._rate_hz)
        self._rows[-1] = bridged(response, dropouts)
        begin, stop = self._next - self._first, undecided_from(response, self._rate_hz, dropouts)
        stop = max(begin, stop)
        handed_on = self._rows[:, begin:stop].copy()
        surplus = min(begin, max(0, stop - round(_REMEMBERED_S * self._rate_hz)))
        first = self._next
        self._next += stop - begin
        self._rows, self._first = self._rows[:, surplus:], self._first + surplus
        return first, handed_on

    def skip(self) -> None:
        """Leave out what waits: it belongs to what was played before."""
        self._next = self._first + self._rows.shape[1]
