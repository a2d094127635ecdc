"""One sine at a constant frequency, at a fixed setting or at a base level held by feedback."""

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat

from ..recording import SegmentLabel
from .plan import AbstractFeedback, BaseLevel, Family, FixedSine, LeadIn, Settling
from .steps import Segment, Step, Tone

MOST_LEAD_INS = 1000
"""Largest number of tones in the lead-in of one dwell."""


class Dwell(FixedSine):
    """A sine at one frequency, recorded after it has settled.

    An impacting specimen may have several motions at one frequency; which motion occurs depends on the
    earlier motion. The tones of ``lead_in`` are therefore played before the dwell, one after another with
    continuous phase. These tones are recorded as a separate segment, from which no result is computed.
    """

    family: ClassVar[Family] = Family.DWELL
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.DWELL,)
    wishes: ClassVar[tuple[str, ...]] = ("response_i", "response_ii")
    kind: Literal["dwell"] = "dwell"
    settle_s: NonNegativeFloat = 3.0
    """Waiting time before the recording, for the transient to die out [s]."""
    duration_s: PositiveFloat
    """Recording time of the settled motion [s]."""
    lead_in: tuple[LeadIn, ...] = Field(default=(), max_length=MOST_LEAD_INS)
    """Tones played before the dwell, in this order; if empty, the drive starts with the dwell."""
    lead_s: PositiveFloat = 0.5
    """Duration of each tone of ``lead_in`` [s]."""

    def next_to(self, frequency_hz: float, amplitude_vpp: float | None = None) -> Self:
        """Return a dwell at another frequency or setting; its lead-in ends with this dwell's tone."""
        changed = {
            "lead_in": (*self.lead_in, self._tone),
            "frequency_hz": frequency_hz,
            "amplitude_vpp": self.amplitude_vpp if amplitude_vpp is None else amplitude_vpp,
        }
        return type(self).model_validate(self.model_dump() | changed)

    def led(self, way: tuple[LeadIn, ...], lead_s: float) -> tuple[Self, LeadIn]:
        """Return this dwell with the lead-in ``way``; also return its tone, for the next dwell's lead-in."""
        return self.model_copy(update={"lead_in": way, "lead_s": lead_s}), self._tone

    @property
    def _tone(self) -> LeadIn:
        return LeadIn(frequency_hz=self.frequency_hz, amplitude_vpp=self.amplitude_vpp)

    @property
    def lead_in_s(self) -> float:
        """Duration of all tones of the lead-in [s]."""
        return len(self.lead_in) * self.lead_s

    @property
    def highest_frequency_hz(self) -> float:
        """The highest frequency among the tones of lead-in and dwell [Hz]."""
        return max(self.frequency_hz, *(tone.frequency_hz for tone in self.lead_in), 0.0)

    @property
    def highest_amplitude_vpp(self) -> float:
        """The highest amplitude setting of lead-in and dwell [Vpp]."""
        return max(self.amplitude_vpp, *(tone.amplitude_vpp for tone in self.lead_in), 0.0)

    @property
    def playing_s(self) -> float:
        """Duration of lead-in, settling and recording [s]."""
        return self.lead_in_s + self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """Yield the tones of the lead-in as one segment, and then the dwell."""
        way = Segment(SegmentLabel.LEAD_IN, {"tones": len(self.lead_in)})
        for tone in self.lead_in:
            level = tone.amplitude_vpp / self.amplitude_vpp
            yield Step(Tone(tone.frequency_hz, level), 0.0, self.lead_s, way)
        segment = Segment(SegmentLabel.DWELL, {"frequency_hz": self.frequency_hz})
        yield Step(Tone(self.frequency_hz), self.settle_s, self.duration_s, segment)


class HeldDwell(FixedSine, AbstractFeedback):
    """A dwell whose base motion is held at a level by feedback, before and during the recording."""

    family: ClassVar[Family] = Family.DWELL
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.DWELL,)
    kind: Literal["held_dwell"] = "held_dwell"
    base_level: BaseLevel
    """Level of the base that feedback holds."""
    settling: Settling = Settling()
    """Criteria by which the motion counts as settled before the recording."""
    duration_s: PositiveFloat
    """Recording time of the settled motion [s]."""
    update_s: PositiveFloat = 1.0
    """Interval at which the level is measured, and corrected if needed, during the recording [s]."""

    @property
    def playing_s(self) -> float:
        """Longest wait for settling plus recording time [s]."""
        return self.settling.longest_wait_s + self.duration_s

    @property
    def segment(self) -> Segment:
        """Segment of the recording that begins after settling."""
        return Segment(SegmentLabel.DWELL, {"frequency_hz": self.frequency_hz})

    def steps(self) -> Iterator[Step]:
        """Yield one step: the recording at the largest amplitude setting, without the wait before it."""
        yield Step(Tone(self.frequency_hz), 0.0, self.duration_s, self.segment)
