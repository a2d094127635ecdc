"""A sine of one frequency in steps of level, up and down, to find where impacts begin and end."""

from collections.abc import Iterator
from math import floor
from typing import ClassVar, Literal, Self

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from ..recording import SegmentLabel
from .plan import AmplitudeVpp, Family, FixedSine
from .stepped_sine import MOST_STEPS
from .steps import Direction, Segment, Step, Tone


class SteppedLevel(FixedSine):
    """A sine whose level rises and falls in steps; each step is recorded after it has settled.

    The phase is continuous from one level to the next, so that the specimen stays on its branch. The motion
    jumps up at one level and falls back at a lower one; between these levels both motions exist.
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
        # Count without building the list: a typing error in the step could mean millions of levels.
        ways = sum(1 for _ in self.direction.passes(()))
        return ways * self._count()

    def _count(self) -> int:
        # The tolerance 1e-9 keeps a lowest level that the steps miss only by rounding.
        return floor((self.amplitude_vpp - self.lowest_vpp) / self.step_vpp + 1e-9) + 1
