"""Steps of the generator: an excitation lists them, and a run plays them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from typing import ClassVar, TypeAlias

import numpy as np

from ..instruments import Samples, Sweep
from ..recording import SegmentLabel

CREST_FACTOR = 4.5
"""Ratio of the peak (half the amplitude setting) to the rms value. About seven Gaussian values in a million
exceed 4.5 standard deviations; these values are clipped, with no visible effect on the spectrum.
"""
CHUNK = 4096
"""Number of random values per seed: small for quick access to any sample, large for fast generation."""
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
        # White noise starts one filter length before the first sample: the signal is then stationary from its
        # first sample.
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
    # The filter multiplies the variance by the sum of its squared taps, so scale this sum to 1.
    return np.asarray(taps / np.sqrt(np.sum(taps**2)))


@dataclass(frozen=True)
class Tone:
    """A sine at one frequency."""

    frequency_hz: float
    level: float = 1.0
    """Level as a fraction of the amplitude setting: above 0, and at most 1 except in a lead-in."""


@dataclass(frozen=True)
class LoopTone(Tone):
    """A sine played by a real-time controller, whose control law holds the motion."""


@dataclass(frozen=True, eq=False)
class Waveform:
    """One period that repeats, as in a generator's memory; each value is held until the next value."""

    values: Samples
    """Values from -1 to 1; the full range is the amplitude setting. The peak may be below 1: the realisations
    of a noise have equal rms values, and only the realisation with the highest peak reaches 1."""
    repetition_hz: float


@dataclass(frozen=True, eq=False)
class Stream:
    """A signal that does not repeat, for an analogue output: the full range is the amplitude setting."""

    source: GaussianBand


Play: TypeAlias = Tone | Waveform | Stream | Sweep


def full_level(play: Play | None) -> float:
    """Return the level that a signal reaches after its ramp, as a fraction of the amplitude setting."""
    return play.level if isinstance(play, Tone) else 1.0


@dataclass(frozen=True)
class Segment:
    """A named range of samples of the recording, for the analysis."""

    label: SegmentLabel
    numbers: Mapping[str, int | float | str] = field(default_factory=dict)
    """Values for the analysis: ``realisation``, ``repetition_hz``, ``frequency_hz``, ``start_hz`` ..."""


@dataclass(frozen=True)
class Step:
    """One signal to play: first the motion settles, then it is recorded.

    Consecutive steps with equal segments and no settling time are recorded as one segment.
    """

    play: Play
    settle_s: float
    record_s: float
    segment: Segment

    @property
    def duration_s(self) -> float:
        """Total time for settling and recording [s]."""
        return self.settle_s + self.record_s


class Direction(StrEnum):
    """Order of the steps. An impacting specimen may respond differently to rising and falling values."""

    UP = "up"
    DOWN = "down"
    UP_THEN_DOWN = "up_then_down"
    DOWN_THEN_UP = "down_then_up"

    def passes(self, rising: tuple[float, ...]) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each pass: ``"up"`` or ``"down"``, and the values in the order played.
        ``rising`` lists the values in ascending order.
        """
        up = (Direction.UP.value, rising)
        down = (Direction.DOWN.value, rising[::-1])
        match self:
            case Direction.UP:
                yield up
            case Direction.DOWN:
                yield down
            case Direction.UP_THEN_DOWN:
                yield from (up, down)
            case Direction.DOWN_THEN_UP:
                yield from (down, up)


class Approach(StrEnum):
    """Initial state at each frequency, which selects one of several possible motions."""

    REST = "from rest"
    UP = "swept upwards"
    """The motion starts from the final state and phase of the motion at the next lower frequency."""
    DOWN = "swept downwards"


@dataclass(frozen=True)
class HeldAcceleration:
    """Feedback holds the fundamental of the base motion, with any drive voltage up to the allowed maximum."""

    amplitude_m_per_s2: float
    """Peak acceleration of the base's fundamental [m/s2]."""
    basis: ClassVar[str] = "the level that feedback holds"


@dataclass(frozen=True)
class RelativeSetting:
    """A sine at a fixed amplitude setting; the base motion results from the shaker's response."""

    share: float
    """Amplitude setting as a fraction of the plan's ``amplitude_vpp``."""
    basis: ClassVar[str] = "the rig's linear model"


@dataclass(frozen=True)
class RmsSetting:
    """Noise at the plan's amplitude setting; a sine of the same rms value represents the noise."""

    basis: ClassVar[str] = "a sine of the same rms base displacement"


LevelAtBase: TypeAlias = HeldAcceleration | RelativeSetting | RmsSetting
