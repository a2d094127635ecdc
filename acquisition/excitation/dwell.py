"""One sine, held: for the long look at one frequency."""

from collections.abc import Iterator
from typing import Literal

from pydantic import NonNegativeFloat, PositiveFloat

from .plan import AbstractExcitation, FrequencyHz
from .preview import Preview, preview_of
from .steps import Segment, Step, Tone


class Dwell(AbstractExcitation):
    """A sine at one frequency, recorded after it has settled."""

    kind: Literal["dwell"] = "dwell"
    frequency_hz: FrequencyHz
    settle_s: NonNegativeFloat = 3.0
    """Wait until the transient has died out [s]."""
    duration_s: PositiveFloat
    """Time recorded after settling [s]."""

    @property
    def highest_frequency_hz(self) -> float:
        """The frequency itself [Hz]."""
        return self.frequency_hz

    @property
    def playing_s(self) -> float:
        """Settling and recording [s]."""
        return self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """One step."""
        segment = Segment("dwell", {"frequency_hz": self.frequency_hz})
        yield Step(Tone(self.frequency_hz), self.settle_s, self.duration_s, segment)

    def preview(self, sample_rate_hz: float) -> Preview:
        """Show the sine from the moment the wait begins."""
        return preview_of(
            self.steps(), self.amplitude_vpp, sample_rate_hz, self.highest_frequency_hz, self.playing_s
        )
