"""A sine whose frequency moves slowly through a band, in very small steps."""

from collections.abc import Iterator
from enum import StrEnum
from math import ceil
from typing import ClassVar, Literal, Self

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from ..instruments import Spacing, Sweep
from ..recording import SegmentLabel
from .plan import AbstractExcitation, AbstractFeedback, BaseLevel, Family, FrequencyHz, Settling
from .steps import Approach, Direction, RelativeSetting, Segment, Step, Tone


class Hold(StrEnum):
    """Quantity of the base motion whose amplitude stays about constant along a sweep, without feedback.

    Above the suspension resonance, a shaker's acceleration is proportional to its voltage. The motion is only
    as constant as this proportionality is exact; the recording contains the real motion of the base.
    """

    ACCELERATION = "acceleration"
    """The amplitude setting is constant."""
    VELOCITY = "velocity"
    """The amplitude setting grows in proportion to frequency."""
    DISPLACEMENT = "displacement"
    """The amplitude setting grows with the square of the frequency, as for the model in the paper."""

    @property
    def power(self) -> int:
        """Exponent n of the amplitude setting, which is proportional to (frequency)^n."""
        return {Hold.ACCELERATION: 0, Hold.VELOCITY: 1, Hold.DISPLACEMENT: 2}[self]


class SweptBy(StrEnum):
    """Device that changes the frequency during a sweep."""

    COMPUTER = "computer"
    """The computer changes the frequency in steps; possible with any generator."""
    GENERATOR = "generator"
    """The generator changes the frequency without steps, by a sweep function that a trigger starts."""


MOST_SWEEP_STEPS = 1_000_000
"""Largest number of steps in one sweep: 28 hours at the usual 0.1 s per step."""


class MovingSine(AbstractExcitation):
    """A sine sweep, up or down, whose frequency the computer changes in steps.

    Each step plays the mean frequency of the ideal sweep during that step. The phase at the end of every step
    therefore equals the phase of the ideal sweep. The recorded drive shows what the generator really played.
    """

    family: ClassVar[Family] = Family.SWEEP
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.SWEEP,)
    start_hz: FrequencyHz
    """Frequency at the beginning [Hz]; above ``stop_hz`` for a sweep downwards."""
    stop_hz: FrequencyHz
    """Frequency at the end of the sweep [Hz]."""
    duration_s: PositiveFloat
    """Duration of the sweep from ``start_hz`` to ``stop_hz`` [s]."""
    spacing: Spacing = Spacing.LINEAR
    """Change of the frequency over time: linear or logarithmic."""
    step_s: PositiveFloat = 0.1
    """Time at one frequency [s]. The last step may be shorter."""

    @model_validator(mode="after")
    def _sweep_moves(self) -> Self:
        if self.start_hz == self.stop_hz:
            raise ValueError(
                f"start_hz and stop_hz are both {self.start_hz:g}, but a sweep needs two frequencies; "
                "use a dwell for one frequency"
            )
        if self.step_s > self.duration_s:
            raise ValueError(
                f"step_s = {self.step_s:g} is longer than the whole sweep of {self.duration_s:g} s; "
                "give a shorter step"
            )
        if self.duration_s / self.step_s > MOST_SWEEP_STEPS:
            raise ValueError(
                f"a sweep of {self.duration_s:g} s with step_s = {self.step_s:g} has "
                f"{self.duration_s / self.step_s:.3g} steps (at most {MOST_SWEEP_STEPS} are allowed); give a "
                "longer step_s"
            )
        return self

    @property
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency of the sweep [Hz]."""
        return min(self.start_hz, self.stop_hz), max(self.start_hz, self.stop_hz)

    @property
    def glide_step_s(self) -> float | None:
        """Time that the sweep spends at one frequency [s]."""
        return self.step_s

    @property
    def approach(self) -> Approach:
        """Direction from which the motion reaches each frequency: the direction of the sweep."""
        return Approach.UP if self.start_hz < self.stop_hz else Approach.DOWN

    def turned(self, direction: Direction) -> Self | None:
        """Return the sweep upwards or downwards; None if ``direction`` has two passes."""
        low_hz, high_hz = self.band_hz
        match direction:
            case Direction.UP:
                return self.model_copy(update={"start_hz": low_hz, "stop_hz": high_hz})
            case Direction.DOWN:
                return self.model_copy(update={"start_hz": high_hz, "stop_hz": low_hz})
            case _:
                return None

    def cycles(self, time_s: float) -> float:
        """Return the number of cycles of the ideal sweep from its start to ``time_s``, in closed form."""
        return self.course.cycles(time_s)

    @property
    def course(self) -> Sweep:
        """The ideal sweep, which the steps approximate."""
        return Sweep(self.start_hz, self.stop_hz, self.duration_s, self.spacing)

    def mean_steps(self) -> Iterator[tuple[float, float]]:
        """Yield mean frequency [Hz] and duration [s] of each step, in chronological order."""
        # If rounding errors make the number of steps slightly larger than a whole number, the factor 1 - 1e-9
        # prevents an extra tiny step.
        count = ceil(self.duration_s / self.step_s * (1 - 1e-9))
        for number in range(count):
            begin_s = number * self.step_s
            end_s = min(begin_s + self.step_s, self.duration_s)
            yield (self.cycles(end_s) - self.cycles(begin_s)) / (end_s - begin_s), end_s - begin_s

    def segment_with(self, held: str) -> Segment:
        """Return the segment of the sweep; ``held`` names the quantity that is kept constant."""
        numbers = self.model_dump(include={"start_hz", "stop_hz", "duration_s", "step_s"})
        return Segment(SegmentLabel.SWEEP, {**numbers, "spacing": self.spacing.value, "hold": held})


class SineSweep(MovingSine):
    """A sine sweep whose amplitude setting is constant or follows a power of the frequency."""

    kind: Literal["sine_sweep"] = "sine_sweep"
    hold: Hold = Hold.ACCELERATION
    """Base quantity that stays about constant; ``amplitude_vpp`` is the setting at the highest frequency."""
    settle_s: NonNegativeFloat = 3.0
    """Waiting time near ``start_hz`` before the sweep, for the transient to die out [s]."""
    swept_by: SweptBy = SweptBy.COMPUTER
    """Device that changes the frequency; ``step_s`` is used only by the computer."""

    @model_validator(mode="after")
    def _generator_holds_its_setting(self) -> Self:
        if self.swept_by is SweptBy.GENERATOR and self.hold is not Hold.ACCELERATION:
            raise ValueError(
                f"hold = {self.hold.value!r} changes the amplitude during the sweep, but the generator's own "
                "sweep keeps the amplitude constant; use swept_by = 'computer', or hold = 'acceleration'"
            )
        return self

    @property
    def own_sweep_s(self) -> float | None:
        """Duration of the generator's internal sweep [s]; None if the computer changes the frequency."""
        return self.duration_s if self.swept_by is SweptBy.GENERATOR else None

    @property
    def glide_step_s(self) -> float | None:
        """Time at one frequency [s]; None for the generator's internal sweep."""
        return self.step_s if self.swept_by is SweptBy.COMPUTER else None

    @property
    def lowest_amplitude_vpp(self) -> float:
        """Amplitude setting at the lowest frequency of the sweep [Vpp]."""
        return self.amplitude_vpp * self.level(self.band_hz[0])

    def level(self, frequency_hz: float) -> float:
        """Return the amplitude setting at ``frequency_hz``, as a fraction of ``amplitude_vpp``."""
        return float((frequency_hz / self.highest_frequency_hz) ** self.hold.power)

    def level_at(self, frequency_hz: float) -> RelativeSetting:
        """Return the relative amplitude setting at ``frequency_hz``."""
        return RelativeSetting(self.level(frequency_hz))

    @property
    def playing_s(self) -> float:
        """Duration of settling and sweep [s]."""
        return self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """Return one step per ``step_s``, all in one segment; the generator's internal sweep is one step."""
        if self.swept_by is SweptBy.GENERATOR:
            segment = self.segment_with(self.hold.value)
            return iter((Step(self.course, self.settle_s, self.duration_s, segment),))
        return self.loudest_steps()

    def loudest_steps(self) -> Iterator[Step]:
        """Yield one step per ``step_s``, even for the generator's internal sweep."""
        segment = self.segment_with(self.hold.value)
        settle_s = self.settle_s
        for mean_hz, duration_s in self.mean_steps():
            yield Step(Tone(mean_hz, self.level(mean_hz)), settle_s, duration_s, segment)
            settle_s = 0.0

    def shown_steps(self) -> Iterator[Step]:
        """Yield the whole sweep, without the wait before it."""
        return (Step(step.play, 0.0, step.record_s, step.segment) for step in self.steps())


class HeldSweep(MovingSine, AbstractFeedback):
    """A sweep whose amplitude setting is corrected after every step from the measured base motion.

    A sweep does not wait for the level to settle. If the gain from the setting to the base motion changes
    within a few steps, the level is wrong during these steps; the recording states where.
    """

    kind: Literal["held_sweep"] = "held_sweep"
    base_level: BaseLevel
    """Level of the base that feedback holds."""
    average_s: PositiveFloat = 0.5
    """Averaging time of the level, to reduce random errors [s]; a lasting change is tracked faster."""
    settling: Settling = Settling()
    """Criteria by which the motion counts as settled before the sweep."""

    @property
    def playing_s(self) -> float:
        """Longest wait at the start plus duration of the sweep [s]."""
        return self.settling.longest_wait_s + self.duration_s

    @property
    def segment(self) -> Segment:
        """The segment of the sweep."""
        return self.segment_with(f"measured {self.base_level.quantity}")

    def steps(self) -> Iterator[Step]:
        """Yield one step for every ``step_s``, all in one segment and at the largest amplitude setting."""
        segment = self.segment
        for mean_hz, duration_s in self.mean_steps():
            yield Step(Tone(mean_hz), 0.0, duration_s, segment)
