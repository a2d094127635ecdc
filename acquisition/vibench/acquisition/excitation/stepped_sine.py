"""Stepped sines: frequencies or levels one after another, after a fixed wait or as feedback decides."""

from collections.abc import Iterator
from itertools import pairwise
from math import floor
from typing import ClassVar, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from vibench.sim import PhaseReference

from ..host.toml_file import FrozenModel
from ..recording import SegmentLabel
from .plan import (
    AbstractExcitation,
    AbstractFeedback,
    AmplitudeVpp,
    BaseLevel,
    Family,
    FixedSine,
    FrequencyHz,
    HeldMetres,
    JumpSearch,
    Settling,
    Share,
    band_around,
)
from .steps import Approach, Direction, Segment, Step, Tone

MOST_STEPS = 4000
"""Largest number of steps in one recording; the table of segments also needs rows for ramps and check."""


class FrequencyGrid(FrozenModel):
    """Equally spaced frequencies of a stepped sine."""

    start_hz: FrequencyHz
    stop_hz: FrequencyHz
    """Upper bound of the frequencies [Hz]; included if whole steps reach it."""
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
            # Check the number before building the list: a mistyped step could mean millions of values.
            raise ValueError(
                f"the grid has {steps:.6g} steps; one recording holds at most {MOST_STEPS}: raise step_hz or "
                "split the measurement"
            )
        return self

    @property
    def values_hz(self) -> tuple[float, ...]:
        """Frequencies in ascending order [Hz]."""
        # With the tolerance 1e-9, the stop frequency is included if the steps miss it only by rounding.
        count = floor((self.stop_hz - self.start_hz) / self.step_hz + 1e-9) + 1
        return tuple(self.start_hz + number * self.step_hz for number in range(count))


class FrequencySteps(AbstractExcitation):
    """A list of frequencies, their order, and a recording time for each frequency; each step is a segment."""

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    most_steps: ClassVar[int] = MOST_STEPS
    frequencies_hz: tuple[FrequencyHz, ...] = ()
    """Frequencies in ascending order [Hz]; give either this key or ``grid``."""
    grid: FrequencyGrid | None = None
    """Equally spaced frequencies; give either this key or ``frequencies_hz``."""
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
    """A list of frequencies; at each frequency the motion settles, then is recorded as a separate segment.

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


GLIDE_TONE_S = 0.1
"""Duration of each intermediate tone between two frequencies of the list [s]."""


class SettledSine(FrequencySteps, AbstractFeedback):
    """A stepped sine that waits for settled motion, stays on its branch and locates jumps.

    The phase is continuous from one frequency to the next. The recording contains the result of each step:
    period, waiting time, level of the base, and how the branch was reached.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP, SegmentLabel.SEARCH)
    most_steps: ClassVar[int] = 600
    """Largest number of steps: the event table must hold four events per step and the events of searches."""
    kind: Literal["settled_sine"] = "settled_sine"
    settling: Settling = Settling()
    base_level: BaseLevel | None = None
    """Level of the base to be held; if absent, ``amplitude_vpp`` stays constant."""
    jumps: JumpSearch | None = None
    """Criteria to locate jumps between steps; if absent, jumps are not searched for."""
    glide_step_hz: PositiveFloat = 0.5
    """Largest frequency step while the tone moves between two frequencies of the list [Hz]."""
    search_s: float = Field(default=120.0, gt=0, le=7200)
    """Longest search for one jump [s]; after this time, the last frequency interval is the result."""

    @property
    def playing_s(self) -> float:
        """Duration of all steps and searches if each wait takes its longest time [s]."""
        passes = sum(1 for _ in self.passes())
        steps_s = len(self.rising_hz) * (self.settling.longest_wait_s + self.record_s)
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        searches = 0 if self.jumps is None else self.jumps.most_searches
        return passes * (steps_s + glides * GLIDE_TONE_S + searches * self.search_s)


class HeldResponse(FrequencySteps, AbstractFeedback):
    """A stepped sine whose setting is corrected until m0 has a given amplitude, at every frequency.

    A level of the base may allow several responses, but each response belongs to only one level of the base.
    Curves at constant response are therefore single-valued. A set of them yields the curves at constant
    level, including unstable parts (Karaagacli and Ozguven, Vibration 3 (2020) 19). Feedback can hold motions
    that are stable at constant voltage, and unstable motions that diverge more slowly than feedback acts.
    """

    kind: Literal["held_response"] = "held_response"
    response_m: HeldMetres
    """Amplitude of the fundamental of m0's motion, to be held [m]."""
    response_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0 that is held: relative to the base, or absolute."""
    tolerance: Share = 0.01
    """Allowed relative deviation from ``response_m``; two measurements in a row must be within it."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """Largest factor by which one correction changes the amplitude setting."""
    start_share: Share = 0.02
    """Initial setting at the first frequency, as a fraction of ``amplitude_vpp``."""
    longest_wait_s: PositiveFloat = 20.0
    """Longest wait for ``response_m`` at a frequency [s]; the step's note states whether m0 reached it."""
    glide_step_hz: PositiveFloat = 0.5
    """Largest frequency step while the tone moves between two frequencies of the list [Hz]."""

    @property
    def level_text(self) -> str:
        """Display text for the held response and the largest amplitude setting."""
        words = f"{self.response_of.value} motion of m0 held at {1e6 * self.response_m:g} µm"
        return f"{words}, at most {self.amplitude_vpp:g} Vpp"

    @property
    def playing_s(self) -> float:
        """Duration of all steps if each wait takes its longest time [s]."""
        passes = sum(1 for _ in self.passes())
        glides = (self.rising_hz[-1] - self.rising_hz[0]) / self.glide_step_hz + len(self.rising_hz)
        steps_s = len(self.rising_hz) * (self.longest_wait_s + self.record_s)
        return passes * (steps_s + glides * GLIDE_TONE_S)


class SteppedLevel(FixedSine):
    """A sine whose level rises and falls in steps; each step is recorded after it has settled.

    The phase is continuous from one level to the next, so that the specimen stays on its branch. The motion
    jumps up at one level and falls back at a lower level; between these levels both motions exist.
    ``amplitude_vpp`` is the highest level.
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    kind: Literal["stepped_level"] = "stepped_level"
    lowest_vpp: AmplitudeVpp
    """Lower bound of the levels, included if whole steps down from ``amplitude_vpp`` reach it [Vpp]."""
    step_vpp: PositiveFloat
    """Difference of neighbouring levels [Vpp]; keep it small, because each change disturbs the motion."""
    direction: Direction = Direction.UP_THEN_DOWN
    settle_s: NonNegativeFloat = 3.0
    """Waiting time at every level, for the transient to die out [s]."""
    record_s: PositiveFloat = 1.0
    """Recording time at every level [s]."""

    @model_validator(mode="after")
    def _has_levels(self) -> Self:
        if self.lowest_vpp + self.step_vpp > self.amplitude_vpp * (1 + 1e-9):
            raise ValueError(
                f"lowest_vpp = {self.lowest_vpp:g} and step_vpp = {self.step_vpp:g} give fewer than two "
                f"levels up to amplitude_vpp = {self.amplitude_vpp:g}; lower lowest_vpp or step_vpp"
            )
        count = self._steps()
        if count > MOST_STEPS:
            raise ValueError(
                f"the plan has {count} steps; one recording holds at most {MOST_STEPS}: raise step_vpp or "
                "split the measurement"
            )
        return self

    @property
    def lowest_amplitude_vpp(self) -> float:
        """Lowest amplitude setting of the plan [Vpp]."""
        return self.rising_vpp[0]

    @property
    def rising_vpp(self) -> tuple[float, ...]:
        """All amplitude settings in ascending order, up to ``amplitude_vpp`` [Vpp]."""
        return tuple(
            round(self.amplitude_vpp - number * self.step_vpp, 9) for number in reversed(range(self._count()))
        )

    @property
    def playing_s(self) -> float:
        """Duration of settling and recording of all levels [s]."""
        return self._steps() * (self.settle_s + self.record_s)

    def passes(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each pass: its direction, and its levels in the order played [Vpp]."""
        return self.direction.passes(self.rising_vpp)

    def steps(self) -> Iterator[Step]:
        """Yield one step for every level, in the order played."""
        for direction, levels_vpp in self.passes():
            for level_vpp in levels_vpp:
                numbers: dict[str, int | float | str] = {
                    "frequency_hz": self.frequency_hz,
                    "amplitude_vpp": level_vpp,
                    "direction": direction,
                }
                tone = Tone(self.frequency_hz, level_vpp / self.amplitude_vpp)
                yield Step(tone, self.settle_s, self.record_s, Segment(SegmentLabel.STEP, numbers))

    def _steps(self) -> int:
        # Count without building the list: a mistyped step could mean millions of levels.
        ways = sum(1 for _ in self.direction.passes(()))
        return ways * self._count()

    def _count(self) -> int:
        # With the tolerance 1e-9, the lowest level is included if the steps miss it only by rounding.
        return floor((self.amplitude_vpp - self.lowest_vpp) / self.step_vpp + 1e-9) + 1
