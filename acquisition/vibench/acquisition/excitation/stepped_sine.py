"""A stepped sine: a list of frequencies, each recorded after a fixed settling time."""

from collections.abc import Iterator
from itertools import pairwise
from math import floor
from typing import ClassVar, Literal, Self

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from ..host.toml_file import FrozenModel
from ..recording import SegmentLabel
from .plan import AbstractExcitation, Family, FrequencyHz, band_around
from .steps import Approach, Direction, Segment, Step, Tone

MOST_STEPS = 4000
"""Largest number of steps in one recording, whose table of segments must also list ramps and check."""


class FrequencyGrid(FrozenModel):
    """Equally spaced frequencies of a stepped sine."""

    start_hz: FrequencyHz
    stop_hz: FrequencyHz
    """Upper bound of the frequencies, included if whole steps reach it [Hz]."""
    step_hz: PositiveFloat

    @model_validator(mode="after")
    def _grid_rises(self) -> Self:
        if self.stop_hz < self.start_hz:
            raise ValueError(
                f"stop_hz = {self.stop_hz:g} is below start_hz = {self.start_hz:g}; "
                "give the grid from low to high and choose the order of its steps with direction"
            )
        steps = (self.stop_hz - self.start_hz) / self.step_hz + 1
        if steps > 2 * MOST_STEPS:
            # Check before building the list: a typing error in the step could mean millions of values.
            raise ValueError(
                f"the grid has {steps:.6g} steps; one recording holds at most {MOST_STEPS}: raise step_hz or "
                "split the measurement"
            )
        return self

    @property
    def values_hz(self) -> tuple[float, ...]:
        """Frequencies in ascending order [Hz]."""
        # The tolerance 1e-9 keeps a stop frequency that the steps miss only by rounding.
        count = floor((self.stop_hz - self.start_hz) / self.step_hz + 1e-9) + 1
        return tuple(self.start_hz + number * self.step_hz for number in range(count))


class FrequencySteps(AbstractExcitation):
    """A list of frequencies, their order, and a recording time for each; each step is a separate segment."""

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    most_steps: ClassVar[int] = MOST_STEPS
    frequencies_hz: tuple[FrequencyHz, ...] = ()
    """Frequencies in ascending order [Hz]; give either this or ``grid``."""
    grid: FrequencyGrid | None = None
    """Equally spaced frequencies; give either this or ``frequencies_hz``."""
    direction: Direction = Direction.UP
    record_s: PositiveFloat = 1.0
    """Recording time at every frequency [s]."""

    @model_validator(mode="after")
    def _one_rising_list(self) -> Self:
        if bool(self.frequencies_hz) == (self.grid is not None):
            raise ValueError("give either frequencies_hz or grid, and not both")
        for low, high in pairwise(self.frequencies_hz):
            if high <= low:
                raise ValueError(
                    f"frequencies_hz has {high:g} after {low:g}; "
                    "list each frequency once, in rising order, and choose the order of steps with direction"
                )
        count = sum(len(frequencies_hz) for _, frequencies_hz in self.passes())
        if count > self.most_steps:
            raise ValueError(
                f"the plan has {count} steps; one recording holds at most {self.most_steps}: "
                "use a coarser grid or split the measurement"
            )
        return self

    @property
    def rising_hz(self) -> tuple[float, ...]:
        """All frequencies in ascending order [Hz]."""
        return self.frequencies_hz if self.grid is None else self.grid.values_hz

    @property
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency; for a single frequency, an octave below and above it [Hz]."""
        low_hz, *_, high_hz = (*self.rising_hz, self.rising_hz[-1])
        return (low_hz, high_hz) if low_hz < high_hz else band_around(high_hz)

    @property
    def approach(self) -> Approach:
        """Direction of the first pass through the list of frequencies."""
        first, _ = next(self.passes())
        return Approach.UP if first == Direction.UP.value else Approach.DOWN

    @property
    def highest_frequency_hz(self) -> float:
        """The highest frequency of the list [Hz]."""
        return self.rising_hz[-1]

    def passes(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each pass: its direction, and its frequencies in the order played [Hz]."""
        return self.direction.passes(self.rising_hz)

    @property
    def planned_wait_s(self) -> float:
        """Planned wait before the recording of each step [s]; 0 if feedback decides how long to wait."""
        return 0.0

    def segment(self, frequency_hz: float, direction: str) -> Segment:
        """Return the segment of a step; ``direction`` distinguishes two steps at the same frequency."""
        return Segment(SegmentLabel.STEP, {"frequency_hz": frequency_hz, "direction": direction})

    def steps(self) -> Iterator[Step]:
        """Yield one step for every frequency, in the order played, with the planned wait."""
        for direction, frequencies_hz in self.passes():
            for each_hz in frequencies_hz:
                segment = self.segment(each_hz, direction)
                yield Step(Tone(each_hz), self.planned_wait_s, self.record_s, segment)


class SteppedSine(FrequencySteps):
    """A list of frequencies; at each, the motion settles and is then recorded as a separate segment.

    The phase is continuous from one frequency to the next and the amplitude is constant. The specimen
    therefore stays on its branch.
    """

    wishes: ClassVar[tuple[str, ...]] = ("response_i", "response_ii")
    kind: Literal["stepped_sine"] = "stepped_sine"
    settle_s: NonNegativeFloat = 3.0
    """Waiting time at every frequency, for the transient to die out [s]."""

    @property
    def playing_s(self) -> float:
        """Duration of settling and recording of all steps [s]."""
        passes = sum(1 for _ in self.passes())
        return passes * len(self.rising_hz) * (self.settle_s + self.record_s)

    @property
    def planned_wait_s(self) -> float:
        """Settling time before each recording [s]."""
        return self.settle_s
