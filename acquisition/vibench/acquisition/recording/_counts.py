"""Counts of a block: the converter's own, or made of volts where it gives volts only."""

from collections.abc import Sequence

import numpy as np

from ..errors import RecordingError
from ..instruments import Counts, Samples
from ._header import ChannelHeader
from ._layout import COUNT_DTYPE, LARGEST_COUNT

COUNT_TOLERANCE = 0.01
"""How far volts may lie from a whole count. Rounding of float64 is 1e-8 of a count at 24 bits;
a wrong step or offset shows up as a spread over the whole count."""


class CountScale:
    """The steps of all channels, ready to turn blocks into counts."""

    def __init__(self, channels: Sequence[ChannelHeader]) -> None:
        self._roles = [channel.role for channel in channels]
        self._step_v = np.array([[channel.step_v] for channel in channels])
        self._zero_v = np.array([[channel.volts_at_zero_count] for channel in channels])
        self._has_converter_step = np.array([channel.volts_per_count is not None for channel in channels])

    def counts(self, volts: Samples) -> Counts:
        """Turn a block into counts, shape (channels, samples); exact where the converter's step is known.

        Raises RecordingError when the volts are no multiples of the step, or outside what an int32 holds (NaN
        included).
        """
        scaled = (np.asarray(volts, dtype=np.float64) - self._zero_v) / self._step_v
        rounded = np.rint(scaled)
        self._require_range(rounded)
        self._require_whole_counts(np.abs(scaled - rounded))
        return np.ascontiguousarray(rounded.astype(COUNT_DTYPE))

    def _require_range(self, rounded: Samples) -> None:
        inside = np.abs(rounded) <= LARGEST_COUNT
        if not inside.all():
            row, column = np.argwhere(~inside)[0]
            raise RecordingError(
                f"{self._roles[row]!r} reads {rounded[row, column] * self._step_v[row, 0]:g} V, which is"
                f" {rounded[row, column]:g} steps of {self._step_v[row, 0]:g} V; at most 2^31 - 1 fit."
                " The block was not recorded; correct volts_per_count or range_v of the channel."
            )

    def _require_whole_counts(self, distance: Samples) -> None:
        worst = np.where(self._has_converter_step, distance.max(axis=1, initial=0.0), 0.0)
        if (worst > COUNT_TOLERANCE).any():
            row = int(worst.argmax())
            raise RecordingError(
                f"The volts of {self._roles[row]!r} lie up to {worst[row]:.2f} counts beside the converter's"
                f" steps of {self._step_v[row, 0]:g} V. The block was not recorded, because counts would not"
                " give the same volts back; correct volts_per_count and volts_at_zero_count, or give None"
                " to keep the volts to 2^-30 of the range."
            )
