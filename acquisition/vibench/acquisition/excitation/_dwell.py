"""One sine, held: for the long look at one frequency."""

from collections.abc import Iterator
from typing import Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat

from ..host import FrozenModel
from ..recording import SegmentLabel
from ._plan import AbstractExcitation, AmplitudeVpp, FrequencyHz
from ._preview import SignalPreview, signal_preview
from ._steps import Segment, Step, Tone

MOST_LEAD_INS = 1000
"""Tones that may be passed on the way to one dwell."""


class LeadIn(FrozenModel):
    """A tone that is passed on the way to a dwell."""

    frequency_hz: FrequencyHz
    amplitude_vpp: AmplitudeVpp


class Dwell(AbstractExcitation):
    """A sine at one frequency, recorded after it has settled.

    An impacting specimen may have several motions at one frequency, and which of them it takes depends
    on where it comes from. ``lead_in`` brings it there along a path: tone after tone, without a break
    in phase, recorded as a segment of its own that no result is taken from.
    """

    kind: Literal["dwell"] = "dwell"
    frequency_hz: FrequencyHz
    settle_s: NonNegativeFloat = 3.0
    """Wait until the transient has died out [s]."""
    duration_s: PositiveFloat
    """Time recorded after settling [s]."""
    lead_in: tuple[LeadIn, ...] = Field(default=(), max_length=MOST_LEAD_INS)
    """Tones passed before, in the order of time; none to begin at the dwell itself."""
    lead_s: PositiveFloat = 0.5
    """Time at each tone of ``lead_in`` [s]."""

    def next_to(self, frequency_hz: float, amplitude_vpp: float | None = None) -> Self:
        """Plan the dwell to which this one leads: the specimen comes through this one, along its branch."""
        passed = LeadIn(frequency_hz=self.frequency_hz, amplitude_vpp=self.amplitude_vpp)
        changed = {
            "lead_in": (*self.lead_in, passed),
            "frequency_hz": frequency_hz,
            "amplitude_vpp": self.amplitude_vpp if amplitude_vpp is None else amplitude_vpp,
        }
        return type(self).model_validate(self.model_dump() | changed)

    @property
    def highest_frequency_hz(self) -> float:
        """The highest frequency on the way, or the dwell's own [Hz]."""
        return max(self.frequency_hz, *(tone.frequency_hz for tone in self.lead_in), 0.0)

    @property
    def highest_amplitude_vpp(self) -> float:
        """The highest setting on the way, or the dwell's own [V]."""
        return max(self.amplitude_vpp, *(tone.amplitude_vpp for tone in self.lead_in), 0.0)

    @property
    def playing_s(self) -> float:
        """Lead-in, settling and recording [s]."""
        return len(self.lead_in) * self.lead_s + self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """List the tones of the lead-in, as one segment, then the dwell."""
        way = Segment(SegmentLabel.LEAD_IN, {"tones": len(self.lead_in)})
        for tone in self.lead_in:
            level = tone.amplitude_vpp / self.amplitude_vpp
            yield Step(Tone(tone.frequency_hz, level), 0.0, self.lead_s, way)
        segment = Segment(SegmentLabel.DWELL, {"frequency_hz": self.frequency_hz})
        yield Step(Tone(self.frequency_hz), self.settle_s, self.duration_s, segment)

    def preview(self, sample_rate_hz: float) -> SignalPreview:
        """Show the sine from the moment the lead-in, or the wait, begins."""
        return signal_preview(
            self.steps(), self.amplitude_vpp, sample_rate_hz, self.highest_frequency_hz, self.playing_s
        )
