"""Gaussian noise that never repeats, computed on demand for an analogue output."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from ..recording import SegmentLabel
from .gaussian_band import GaussianBand
from .periodic_noise import BandNoise
from .steps import Segment, Step, Stream

PREVIEW_S = 10.0
"""Duration of the preview if the noise is longer [s]."""


class StreamedNoise(BandNoise):
    """Band-limited Gaussian noise of any length, on an analogue output.

    The rms value is half the setting divided by the crest factor of 4.5. The band edges are -6 dB points.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.NOISE,)
    kind: Literal["streamed_noise"] = "streamed_noise"
    settle_s: NonNegativeFloat = 3.0
    """Waiting time before the recording, for the transient to die out [s]."""
    duration_s: PositiveFloat
    """Recording time of the noise, after settling [s]."""
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
