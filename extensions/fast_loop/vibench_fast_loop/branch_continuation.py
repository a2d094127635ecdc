"""Excitation that follows a branch of periodic motions, stable or not, with a fast loop."""

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.acquisition.excitation.feedback import BaseLevel, Share
from vibench.acquisition.excitation.plan import AbstractFeedback, Family, FrequencyHz
from vibench.acquisition.excitation.steps import LoopTone, Segment, Step
from vibench.acquisition.recording import SegmentLabel
from vibench.acquisition.rig import Rig

_NO_TRIES = 12
"""Most cycles of settling and measuring per point."""
_BEFORE = 60
"""Periods played before the evaluated perturbations, to find their size and as a lead-in."""


class BranchContinuation(AbstractFeedback):
    """Control-based continuation: the motions at one base level, along frequency, through folds.

    A real-time controller damps the motion between m1 and m2 and plays a Fourier series. Pseudo-arclength
    continuation uses the frequency and the first coefficient. The other coefficients make the base move as a
    sine, so that the motion is one of the specimen under that sine, without influence of the control (Sieber
    and Krauskopf, Nonlinear Dyn. 51 (2008) 365; Renson and others, J. Sound Vib. 367 (2016) 145).
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.BRANCH,)
    kind: Literal["branch_continuation"] = "branch_continuation"
    base_level: BaseLevel
    """Base level at every point."""
    start_hz: FrequencyHz
    """Frequency at which the branch starts [Hz]."""
    low_hz: FrequencyHz
    """Lower end of the frequency range [Hz]."""
    high_hz: FrequencyHz
    """Upper end of the frequency range [Hz]."""
    begin: Literal["up", "down"] = "up"
    """Direction of frequency at the start."""
    begin_from: Literal["rest", "above"] = "rest"
    """Approach to the base level at the start: from rest, or from three times the drive predicted by the
    model without stops, where motions with impacts are found."""
    step_hz: PositiveFloat = 1.0
    """Longest step between points [Hz]; shorter in folds and where points are difficult to find."""
    most_points: int = Field(default=60, ge=1, le=1000)
    """Largest number of points."""
    harmonics: int = Field(default=5, ge=3, le=15)
    """Highest base harmonic that is controlled to zero."""
    tolerance: Share = 0.004
    """Largest deviation of the base from a sine of its level, relative to that level: of the fundamental and
    of each harmonic of its displacement."""
    settle_s: PositiveFloat = 0.3
    """Settling time after a change of the drive [s]."""
    look_periods: int = Field(default=20, ge=10, le=1000)
    """Periods of one measurement."""
    record_s: PositiveFloat = 0.5
    """Time recorded at each point [s]."""
    perturbation: float = Field(default=0.0, ge=0, le=0.1)
    """Relative rms change of the fundamentals of base and m0 (the larger) used to measure the stability of
    each point: 0.02 if noise is low; 0 for none."""
    perturbed_periods: int = Field(default=200, ge=100, le=5000)
    """Periods of these changes at each point; a few more precede them to find their size."""

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
        """Frequency range of the branch [Hz]."""
        return self.low_hz, self.high_hz

    @property
    def playing_s(self) -> float:
        """Duration of all points with the longest search for each [s]."""
        look_s = self.settle_s + self.look_periods / self.low_hz
        perturbed = self.perturbed_periods + _BEFORE if self.perturbation else 0
        return self.most_points * (_NO_TRIES * look_s + self.record_s + perturbed / self.low_hz)

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """Base level of the branch, the only one."""
        return (self.base_level,)

    def segment(self, number: int, frequency_hz: float) -> Segment:
        """Return the segment of a point's recording."""
        return Segment(SegmentLabel.BRANCH, {"point": number, "frequency_hz": frequency_hz})

    def perturbed(self, number: int, frequency_hz: float, size_v: float) -> Segment:
        """Return the segment recorded while the drive is perturbed."""
        numbers = {"point": number, "frequency_hz": frequency_hz, "size_v": size_v}
        return Segment(SegmentLabel.PERTURBED, numbers)

    def require_holdable(self, rig: Rig) -> None:
        """Refuse the branch if the rig's fast loop does not hold it according to the model."""
        from .fast_loop import fast_loop, require_held  # noqa: PLC0415 - plans are read without the model

        require_held(fast_loop(rig), self)

    def steps(self) -> Iterator[Step]:
        """Yield both ends of the range, at the largest setting."""
        for number, frequency_hz in enumerate((self.low_hz, self.high_hz)):
            yield Step(LoopTone(frequency_hz), 0.0, self.record_s, self.segment(number, frequency_hz))
