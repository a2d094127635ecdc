"""Gaussian noise that never repeats, computed on demand for an analogue output."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from ..instruments import Samples
from ..recording import SegmentLabel
from .periodic_noise import BandNoise
from .steps import Segment, Step, Stream

CREST_FACTOR = 4.5
"""Ratio of half the amplitude setting (the peak) to the rms value. About seven Gaussian values in a million
exceed 4.5 standard deviations; they are clipped, with no visible effect on the spectrum.
"""
CHUNK = 4096
"""Number of random values per seed: few make any sample quick to reach, many make drawing faster."""
TRANSITION_WIDTH = 0.5
"""Transition width of the filter divided by the band's lower edge; the band edges are the -6 dB points."""
HAMMING_WIDTH = 3.3
"""Number of taps times transition width divided by sample rate, for a Hamming-windowed filter (Oppenheim and
Schafer, Discrete-Time Signal Processing, 3rd ed., table 7.2).
"""
PREVIEW_S = 10.0
"""Duration of the preview if the noise is longer [s]."""


@dataclass(frozen=True)
class GaussianBand:
    """A stationary Gaussian signal in a band; the seed determines every sample."""

    band_start_hz: float
    band_stop_hz: float
    seed: int

    @property
    def crest_factor(self) -> float:
        """Peak value of the noise divided by its rms value."""
        return CREST_FACTOR

    def samples(self, first: int, count: int, sample_rate_hz: float) -> Samples:
        """Return samples ``first`` to ``first + count - 1``, from -1 to 1, independent of earlier calls."""
        from scipy.signal import oaconvolve  # noqa: PLC0415 - takes 0.5 s; `vibench stop` must not wait

        taps = _taps(self.band_start_hz, self.band_stop_hz, sample_rate_hz)
        # The white noise starts one filter length before the first sample, so that the signal is stationary
        # from its first sample on.
        white = self._white(first, count + len(taps) - 1)
        shaped = np.asarray(oaconvolve(white, taps, mode="valid"))
        return np.clip(shaped / CREST_FACTOR, -1.0, 1.0)

    def _white(self, first: int, count: int) -> Samples:
        chunks = range(first // CHUNK, (first + count - 1) // CHUNK + 1)
        numbers = np.concatenate([self._chunk(chunk) for chunk in chunks])
        start = first - chunks[0] * CHUNK
        return numbers[start : start + count]

    def _chunk(self, number: int) -> Samples:
        key = np.random.SeedSequence(self.seed, spawn_key=(number,))
        return np.random.Generator(np.random.PCG64(key)).standard_normal(CHUNK)


@lru_cache(maxsize=8)
def _taps(band_start_hz: float, band_stop_hz: float, sample_rate_hz: float) -> Samples:
    half = int(np.ceil(HAMMING_WIDTH * sample_rate_hz / (TRANSITION_WIDTH * band_start_hz) / 2))
    band = [band_start_hz, band_stop_hz]
    from scipy.signal import firwin  # noqa: PLC0415 - as above

    taps = firwin(2 * half + 1, band, pass_zero=False, fs=sample_rate_hz, window="hamming")
    # The filter multiplies the variance by the sum of the squared taps: normalise this sum to 1.
    return np.asarray(taps / np.sqrt(np.sum(taps**2)))


class StreamedNoise(BandNoise):
    """Band-limited Gaussian noise of any length, on an analogue output.

    The rms value is half the setting divided by the crest factor of 4.5. The band edges are -6 dB points.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.NOISE,)
    kind: Literal["streamed_noise"] = "streamed_noise"
    settle_s: NonNegativeFloat = 3.0
    """Waiting time before the recording, for the transient to die out [s]."""
    duration_s: PositiveFloat
    """Time for which the noise is recorded after settling [s]."""
    seed: int = Field(default=1, ge=0)
    """Seed; the same seed gives the same noise on any machine with the same version of numpy."""

    @property
    def source(self) -> GaussianBand:
        """The noise signal that the plan describes."""
        return GaussianBand(self.band_start_hz, self.band_stop_hz, self.seed)

    @property
    def playing_s(self) -> float:
        """Duration of settling and recording [s]."""
        return self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """Yield the only step: the whole noise."""
        band = {"band_start_hz": self.band_start_hz, "band_stop_hz": self.band_stop_hz}
        yield Step(Stream(self.source), self.settle_s, self.duration_s, Segment(SegmentLabel.NOISE, band))

    def shown_steps(self) -> Iterator[Step]:
        """Yield the first ``PREVIEW_S`` seconds of the noise."""
        for step in self.steps():
            yield Step(step.play, 0.0, min(self.duration_s, PREVIEW_S), step.segment)
