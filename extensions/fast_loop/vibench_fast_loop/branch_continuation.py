"""A branch of periodic motions, stable or not, followed by a fast loop that holds each of them."""

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.acquisition.excitation.feedback import BaseLevel, Share
from vibench.acquisition.excitation.plan import AbstractFeedback, Family, FrequencyHz
from vibench.acquisition.excitation.steps import LoopTone, Segment, Step
from vibench.acquisition.recording import SegmentLabel
from vibench.acquisition.rig import Rig

_NO_TRIES = 12
"""Stretches of settling and looking that a point takes at most."""
_BEFORE = 60
"""Periods that go before those whose changes tell stability: of their size, and of a lead-in."""


class BranchContinuation(AbstractFeedback):
    """Control-based continuation: the motions under one level of the base, along frequency, through folds.

    A real-time controller damps the motion between m1 and m2 by what it samples; it also plays a
    Fourier series. Pseudo-arclength goes along the frequency and the first coefficient; the others are such
    that the base moves as a sine, so that the motion is one of the specimen under that sine, and the control
    takes no part in it (Sieber and Krauskopf, Nonlinear Dyn. 51 (2008) 365; Renson and others, J. Sound Vib.
    367 (2016) 145).
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.BRANCH,)
    kind: Literal["branch_continuation"] = "branch_continuation"
    base_level: BaseLevel
    """Level of the base, at every point."""
    start_hz: FrequencyHz
    """Where the branch is started, from rest [Hz]."""
    low_hz: FrequencyHz
    """The branch is left where its frequency falls below [Hz]."""
    high_hz: FrequencyHz
    """The branch is left where its frequency rises above [Hz]."""
    begin: Literal["up", "down"] = "up"
    """Which way it is started."""
    begin_from: Literal["rest", "above"] = "rest"
    """From which side the level is met at the start: from rest, or from three times what the model without
    stops asks for, which is where motions with impacts are found."""
    step_hz: PositiveFloat = 1.0
    """Longest step from point to point [Hz]; shorter in folds and where points are hard to find."""
    most_points: int = Field(default=60, ge=1, le=1000)
    """It ends after this many."""
    harmonics: int = Field(default=5, ge=3, le=15)
    """Up to this harmonic the base is made a sine."""
    tolerance: Share = 0.004
    """How far the base may be from a sine of its level, over that: fundamental and each harmonic of its
    displacement."""
    settle_s: PositiveFloat = 0.3
    """Time from a change of the drive to the first look [s]."""
    look_periods: int = Field(default=20, ge=10, le=1000)
    """Periods of a look."""
    record_s: PositiveFloat = 0.5
    """Time recorded at each point [s]."""
    perturbation: float = Field(default=0.0, ge=0, le=0.1)
    """Rms change of the fundamentals of base and m0, over themselves, the larger of both, by which the
    stability of each point is measured: 0.02 where noise is low; 0 for none."""
    perturbed_periods: int = Field(default=200, ge=100, le=5000)
    """Periods of those changes at each point; a few more go before, to find their size."""

    @model_validator(mode="after")
    def _start_lies_inside(self) -> Self:
        if not self.low_hz <= self.start_hz <= self.high_hz or self.low_hz == self.high_hz:
            raise ValueError(
                f"start_hz = {self.start_hz:g} is not between low_hz = {self.low_hz:g} and high_hz = "
                f"{self.high_hz:g}; give the three in this order: low, start, high"
            )
        return self

    @property
    def band_hz(self) -> tuple[float, float]:
        """The range of the branch [Hz]."""
        return self.low_hz, self.high_hz

    @property
    def playing_s(self) -> float:
        """All points with the longest search for each [s]."""
        look_s = self.settle_s + self.look_periods / self.low_hz
        perturbed = self.perturbed_periods + _BEFORE if self.perturbation else 0
        return self.most_points * (_NO_TRIES * look_s + self.record_s + perturbed / self.low_hz)

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """The one level."""
        return (self.base_level,)

    def segment(self, number: int, frequency_hz: float) -> Segment:
        """Name the recording of a point."""
        return Segment(SegmentLabel.BRANCH, {"point": number, "frequency_hz": frequency_hz})

    def perturbed(self, number: int, frequency_hz: float, size_v: float) -> Segment:
        """Name the recording of a point while what is played is changed."""
        numbers = {"point": number, "frequency_hz": frequency_hz, "size_v": size_v}
        return Segment(SegmentLabel.PERTURBED, numbers)

    def require_holdable(self, rig: Rig) -> None:
        """Refuse the branch where the rig's fast loop does not hold it, by the model."""
        from .fast_loop import fast_loop, require_held  # noqa: PLC0415 - plans are read without the model

        require_held(fast_loop(rig), self)

    def steps(self) -> Iterator[Step]:
        """Both ends of the range, at the largest setting."""
        for number, frequency_hz in enumerate((self.low_hz, self.high_hz)):
            yield Step(LoopTone(frequency_hz), 0.0, self.record_s, self.segment(number, frequency_hz))
