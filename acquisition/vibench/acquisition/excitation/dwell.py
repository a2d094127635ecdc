"""One sine at a constant frequency and level."""

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat

from ..recording import SegmentLabel
from .plan import Family, FixedSine, LeadIn
from .steps import Segment, Step, Tone

MOST_LEAD_INS = 1000
"""Largest number of tones in the lead-in of one dwell."""


class Dwell(FixedSine):
    """A sine at one frequency, recorded after it has settled.

    An impacting specimen may have several motions at one frequency; the earlier motion decides which one it
    takes. ``lead_in`` leads to it along a path: tone after tone, without a break in phase, recorded as a
    separate segment that gives no result.
    """

    family: ClassVar[Family] = Family.DWELL
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.DWELL,)
    wishes: ClassVar[tuple[str, ...]] = ("response_i", "response_ii")
    kind: Literal["dwell"] = "dwell"
    settle_s: NonNegativeFloat = 3.0
    """Wait until the transient has died out [s]."""
    duration_s: PositiveFloat
    """Time recorded after settling [s]."""
    lead_in: tuple[LeadIn, ...] = Field(default=(), max_length=MOST_LEAD_INS)
    """Earlier tones in order of time; empty to start with the dwell."""
    lead_s: PositiveFloat = 0.5
    """Time at each tone of ``lead_in`` [s]."""

    def next_to(self, frequency_hz: float, amplitude_vpp: float | None = None) -> Self:
        """Return a dwell at another tone, with the tone of this one at the end of its lead-in."""
        changed = {
            "lead_in": (*self.lead_in, self._tone),
            "frequency_hz": frequency_hz,
            "amplitude_vpp": self.amplitude_vpp if amplitude_vpp is None else amplitude_vpp,
        }
        return type(self).model_validate(self.model_dump() | changed)

    def led(self, way: tuple[LeadIn, ...], lead_s: float) -> tuple[Self, LeadIn]:
        """Return this dwell with the lead-in ``way``, and its tone for the lead-in of the next dwell."""
        return self.model_copy(update={"lead_in": way, "lead_s": lead_s}), self._tone

    @property
    def _tone(self) -> LeadIn:
        return LeadIn(frequency_hz=self.frequency_hz, amplitude_vpp=self.amplitude_vpp)

    @property
    def lead_in_s(self) -> float:
        """Time of all tones of the lead-in [s]."""
        return len(self.lead_in) * self.lead_s

    @property
    def highest_frequency_hz(self) -> float:
        """The highest frequency of lead-in and dwell [Hz]."""
        return max(self.frequency_hz, *(tone.frequency_hz for tone in self.lead_in), 0.0)

    @property
    def highest_amplitude_vpp(self) -> float:
        """The highest setting of lead-in and dwell [V]."""
        return max(self.amplitude_vpp, *(tone.amplitude_vpp for tone in self.lead_in), 0.0)

    @property
    def playing_s(self) -> float:
        """Lead-in, settling and recording [s]."""
        return self.lead_in_s + self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """Yield the tones of the lead-in, as one segment, then the dwell."""
        way = Segment(SegmentLabel.LEAD_IN, {"tones": len(self.lead_in)})
        for tone in self.lead_in:
            level = tone.amplitude_vpp / self.amplitude_vpp
            yield Step(Tone(tone.frequency_hz, level), 0.0, self.lead_s, way)
        segment = Segment(SegmentLabel.DWELL, {"frequency_hz": self.frequency_hz})
        yield Step(Tone(self.frequency_hz), self.settle_s, self.duration_s, segment)
