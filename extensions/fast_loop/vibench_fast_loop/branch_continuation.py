"""Excitation that follows a branch of periodic motions, stable or not, with a fast loop."""

from collections.abc import Iterator
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.acquisition.excitation.plan import AbstractFeedback, BaseLevel, Family, FrequencyHz, Share
from vibench.acquisition.excitation.steps import LoopTone, Segment, Step
from vibench.acquisition.recording import SegmentLabel
from vibench.acquisition.rig import Rig

_NO_TRIES = 12
"""Maximum number of attempts per point; in each attempt, the motion settles and is measured."""
_BEFORE = 60
"""Number of periods before the evaluated perturbations: a trial to find their size, and a lead-in."""


class BranchContinuation(AbstractFeedback):
    """Control-based continuation: follow the motions at one base level along frequency, through folds.

    A real-time controller damps the motion between m1 and m2 and plays a Fourier series. Pseudo-arclength
    continuation uses the frequency and the first coefficient. The other coefficients make the base move as a
    sine, so the specimen moves as under a sine without control (Sieber and
    Krauskopf, Nonlinear Dyn. 51 (2008) 365; Renson and others, J. Sound Vib. 367 (2016) 145).
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.BRANCH,)
    kind: Literal["branch_continuation"] = "branch_continuation"
    base_level: BaseLevel
    """Level of the base motion, the same at every point of the branch."""
    start_hz: FrequencyHz
    """Frequency at the start of the branch [Hz]."""
    low_hz: FrequencyHz
    """Lower end of the frequency range [Hz]."""
    high_hz: FrequencyHz
    """Upper end of the frequency range [Hz]."""
    begin: Literal["up", "down"] = "up"
    """Direction in which the frequency changes at the start of the branch."""
    begin_from: Literal["rest", "above"] = "rest"
    """Approach to the base level at the start: from rest, or from three times the drive that the model
    without stops predicts. The second choice finds motions with impacts."""
    step_hz: PositiveFloat = 1.0
    """Longest step between points [Hz]; steps are shorter in folds and where points are difficult to find."""
    most_points: int = Field(default=60, ge=1, le=1000)
    """Maximum number of points on the branch."""
    harmonics: int = Field(default=5, ge=3, le=15)
    """Highest base harmonic that is controlled to zero."""
    tolerance: Share = 0.004
    """Largest deviation of the base displacement from a sine of the required level, relative to this level.
    It applies to the fundamental and to each harmonic."""
    settle_s: PositiveFloat = 0.3
    """Settling time after each change of the drive [s]."""
    look_periods: int = Field(default=20, ge=10, le=1000)
    """Number of periods in one measurement."""
    record_s: PositiveFloat = 0.5
    """Recording time of each point [s]."""
    perturbation: float = Field(default=0.0, ge=0, le=0.1)
    """Size of the drive changes that measure the stability of each point: relative rms change of the
    fundamental of base or m0, whichever is larger. Use 0.02 if noise is low, 0 to skip the measurement."""
    perturbed_periods: int = Field(default=200, ge=100, le=5000)
    """Number of evaluated periods with small drive changes per point; other periods find the needed size."""

    @model_validator(mode="after")
    def _start_lies_inside(self) -> Self:
        if not self.low_hz <= self.start_hz <= self.high_hz or self.low_hz == self.high_hz:
            raise ValueError(
                f"start_hz = {self.start_hz:g} is not between low_hz = {self.low_hz:g} and high_hz = "
                f"{self.high_hz:g}; give low_hz <= start_hz <= high_hz, and low_hz below high_hz"
            )
        return self

    @property
    def band_hz(self) -> tuple[float, float]:
        """Frequency range of the branch [Hz]."""
        return self.low_hz, self.high_hz

    @property
    def playing_s(self) -> float:
        """Total duration if every point needs the maximum number of attempts [s]."""
        look_s = self.settle_s + self.look_periods / self.low_hz
        perturbed = self.perturbed_periods + _BEFORE if self.perturbation else 0
        return self.most_points * (_NO_TRIES * look_s + self.record_s + perturbed / self.low_hz)

    def segment(self, number: int, frequency_hz: float) -> Segment:
        """Return the segment in which a point is recorded."""
        return Segment(SegmentLabel.BRANCH, {"point": number, "frequency_hz": frequency_hz})

    def perturbation_segment(self, number: int, frequency_hz: float, size_v: float) -> Segment:
        """Return the segment in which the drive of a point is perturbed."""
        numbers = {"point": number, "frequency_hz": frequency_hz, "size_v": size_v}
        return Segment(SegmentLabel.PERTURBED, numbers)

    def require_holdable(self, rig: Rig) -> None:
        """Refuse the branch if the model predicts that the rig's fast loop would not hold it."""
        from .fast_loop import fast_loop, require_held  # noqa: PLC0415 - plans are read without the model

        require_held(fast_loop(rig), self)

    def steps(self) -> Iterator[Step]:
        """Yield a step at each end of the frequency range, at the largest amplitude of the plan."""
        for number, frequency_hz in enumerate((self.low_hz, self.high_hz)):
            yield Step(LoopTone(frequency_hz), 0.0, self.record_s, self.segment(number, frequency_hz))
