"""What frequencies a long signal holds when: a picture of bounded size from a record of any length."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Reals
from ..signals.window import Window, taper
from ..tables import Labelled

MOST_COLUMNS = 600
"""A figure has no more pixels to show."""
_TAPER = Window.HANN


@dataclass(frozen=True, eq=False)
class Spectrogram(Labelled):
    """Root mean square amplitude of each frequency in each stretch of time."""

    OWN_UNITS: ClassVar = {"amplitude": "{unit}", "density": "({unit})2 Hz-1"}

    time_s: Reals
    """Middle of each column, from the first sample, shape (columns,)."""
    frequency_hz: Reals
    """Shape (rows,)."""
    amplitude: Reals
    """Peak amplitude of a sine that would give this power, shape (rows, columns)."""
    resolution_hz: float
    """Width of the window's main lobe at half power."""
    noise_bandwidth_hz: float
    """Width of a rectangle that lets as much noise through."""

    @property
    def density(self) -> Reals:
        """One-sided spectral density [unit²/Hz], shape (rows, columns)."""
        return np.asarray(0.5 * self.amplitude**2 / self.noise_bandwidth_hz)


class SpectrogramSums:
    """Takes a signal block by block; memory holds the picture and one segment, not the record.

    Parameters
    ----------
    sample_rate_hz
        Of the blocks.
    samples
        Of the whole record: decides how much time one column stands for.
    highest_hz
        Rows end here.
    segment_s
        Length of one Fourier transform; half of it overlaps the next.

    """

    def __init__(
        self, sample_rate_hz: float, samples: int, *, highest_hz: float, segment_s: float = 0.25
    ) -> None:
        self._length = round(segment_s * sample_rate_hz)
        if not (0 < highest_hz <= sample_rate_hz / 2 and self._length >= 2):
            raise InvalidRequest(
                f"rows up to {highest_hz:g} Hz by segments of {segment_s:g} s were asked for at "
                f"{sample_rate_hz:g} samples a second; give a frequency up to half of that, and two samples"
            )
        if samples < self._length:
            raise NotEnoughData(
                f"{samples} samples are less than one segment of {segment_s:g} s; use shorter segments"
            )
        self._hop = max(1, self._length // 2)
        segments = 1 + (samples - self._length) // self._hop
        self._columns = min(MOST_COLUMNS, segments)
        self._segments = segments
        self._window = taper(_TAPER, self._length)
        self._rate_hz = sample_rate_hz
        self._rows = int(highest_hz * self._length / sample_rate_hz) + 1
        self._power = np.zeros((self._rows, self._columns))
        self._count = np.zeros(self._columns)
        self._done = 0
        self._carry = np.empty(0)

    def add(self, block: Reals) -> None:
        """Take the next samples, shape (samples,)."""
        data = np.concatenate((self._carry, block))
        first = 0
        while first + self._length <= data.size and self._done < self._segments:
            column = self._done * self._columns // self._segments
            spectrum = np.fft.rfft(self._window * data[first : first + self._length])[: self._rows]
            self._power[:, column] += spectrum.real**2 + spectrum.imag**2
            self._count[column] += 1
            self._done += 1
            first += self._hop
        self._carry = data[first:].copy()

    def spectrogram(self) -> Spectrogram:
        """Give the picture of everything added."""
        filled = self._count > 0
        mean = self._power[:, filled] / self._count[filled]
        starts = np.arange(self._segments) * self._columns // self._segments
        middle = np.arange(self._segments) * self._hop + 0.5 * self._length
        time_s = np.bincount(starts, middle, self._columns)[filled] / np.bincount(starts)[filled]
        return Spectrogram(
            time_s=np.asarray(time_s / self._rate_hz),
            frequency_hz=np.arange(self._rows, dtype=np.float64) * (self._rate_hz / self._length),
            amplitude=2 * np.sqrt(mean) / self._window.sum(),
            resolution_hz=1.44 * self._rate_hz / self._length,
            noise_bandwidth_hz=float(self._rate_hz * np.sum(self._window**2) / np.sum(self._window) ** 2),
        )
