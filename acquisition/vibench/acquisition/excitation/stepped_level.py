"""One frequency, level after level, up and down: where impacts begin, and where they end."""

from collections.abc import Iterator
from math import floor
from typing import ClassVar, Literal, Self

from pydantic import NonNegativeFloat, PositiveFloat, model_validator

from ..recording import SegmentLabel
from .plan import AmplitudeVpp, Family, FixedSine
from .stepped_sine import MOST_STEPS
from .steps import Direction, Segment, Step, Tone


class SteppedLevel(FixedSine):
    """A sine whose level goes up and down in steps; each is played until it has settled, then recorded.

    The phase continues from one level to the next, so that the specimen stays on its branch: it jumps up at
    one level and falls back at another, and between them both motions are possible. ``amplitude_vpp`` is the
    highest level.
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.STEP,)
    kind: Literal["stepped_level"] = "stepped_level"
    lowest_vpp: AmplitudeVpp
    """The lowest level, if whole steps down from ``amplitude_vpp`` reach it [V]."""
    step_vpp: PositiveFloat
    """Difference of neighbouring levels; small, because each change also disturbs the motion [V]."""
    direction: Direction = Direction.UP_THEN_DOWN
    settle_s: NonNegativeFloat = 3.0
    """Wait at every level until the transient has died out [s]."""
    record_s: PositiveFloat = 1.0
    """Time recorded at every level [s]."""

    @model_validator(mode="after")
    def _has_levels(self) -> Self:
        if self.lowest_vpp + self.step_vpp > self.amplitude_vpp * (1 + 1e-9):
            raise ValueError(
                f"lowest_vpp = {self.lowest_vpp:g} and step_vpp = {self.step_vpp:g} leave no two levels up "
                f"to amplitude_vpp = {self.amplitude_vpp:g}; give a lower level or a smaller step"
            )
        count = self._steps()
        if count > MOST_STEPS:
            raise ValueError(
                f"the plan has {count} steps; one recording holds at most {MOST_STEPS}: widen step_vpp or "
                "split the measurement"
            )
        return self

    @property
    def lowest_amplitude_vpp(self) -> float:
        """The lowest level [V]."""
        return self.rising_vpp[0]

    @property
    def rising_vpp(self) -> tuple[float, ...]:
        """All levels, rising, up to ``amplitude_vpp`` [V]."""
        return tuple(
            round(self.amplitude_vpp - number * self.step_vpp, 9) for number in reversed(range(self._count()))
        )

    def turned(self, direction: Direction) -> Self:
        """Return the same levels in a direction."""
        return type(self).model_validate({**self.model_dump(exclude_unset=True), "direction": direction})

    @property
    def playing_s(self) -> float:
        """Settling and recording of all levels [s]."""
        return self._steps() * (self.settle_s + self.record_s)

    def passes(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each pass through the levels: its direction, and its levels in the order played [V]."""
        return self.direction.ways(self.rising_vpp)

    def steps(self) -> Iterator[Step]:
        """Yield one step for every level, in the order of time."""
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
        # Count without building the list: a mistyped step could give millions of levels.
        ways = sum(1 for _ in self.direction.ways(()))
        return ways * self._count()

    def _count(self) -> int:
        # 1e-9: a lowest level that the steps reach except for rounding is included.
        return floor((self.amplitude_vpp - self.lowest_vpp) / self.step_vpp + 1e-9) + 1
