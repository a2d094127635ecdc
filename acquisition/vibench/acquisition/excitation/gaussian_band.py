"""Band-limited Gaussian noise that never repeats, computed on demand."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..instruments import Samples

CREST_FACTOR = 4.5
"""Ratio of half the amplitude setting (the peak) to the rms value. About seven Gaussian values in a million
exceed 4.5 standard deviations; they are clipped, with no visible effect on the spectrum.
"""
CHUNK = 4096
"""Number of random values per seed: few for quick access to any sample, many for fast generation."""
TRANSITION_WIDTH = 0.5
"""Transition width of the filter divided by the band's lower edge; the band edges are the -6 dB points."""
HAMMING_WIDTH = 3.3
"""Number of taps times transition width divided by sample rate, for a Hamming-windowed filter (Oppenheim and
Schafer, Discrete-Time Signal Processing, 3rd ed., table 7.2).
"""


@dataclass(frozen=True)
class GaussianBand:
    """A stationary Gaussian signal in a band; the seed determines every sample."""

    band_start_hz: float
    band_stop_hz: float
    seed: int

    def samples(self, first: int, count: int, sample_rate_hz: float) -> Samples:
        """Return ``count`` samples starting at ``first``, within -1 to 1 and independent of earlier calls."""
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
