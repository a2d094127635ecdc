"""A sine that finds the phase resonance of a mode and follows it, level after level."""

from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import PhaseReference

from ..recording import SegmentLabel
from .feedback import MOST_PERIODS, BaseLevel, HeldMetresPerS2, Settling, Share
from .plan import AbstractFeedback, Family, FrequencyHz
from .steps import Segment, Step, Tone

_MOST_CHANGE = 1.6
"""Largest change of the setting at once: levels are close, and a loop of 150 periods has no time to spare."""


class ResonanceTracking(AbstractFeedback):
    """Phase resonance of one mode at rising (or falling) levels of the base: its backbone.

    At the resonance the phase of m0, relative to the base or absolute, is a quarter of a period behind the
    base. The first level is searched in settled motion; then a phase-locked loop, which acts every ten
    periods, follows the resonance from level to level. If it loses the resonance, the search begins again.
    Other modes shift the phase a little; the flanks give the natural frequency and the damping without them,
    as long as the motion is linear.

    With ``harmonic = 3`` or 2 a superharmonic resonance is tracked: the drive is at a third or half of the
    mode's frequency, and that harmonic of m0 lags this many times the phase of the base by a quarter of its
    own period (Volvert and Kerschen, J. Sound Vib. 511 (2021) 116324; with a phase-locked loop: Zhou and
    Kerschen, arXiv 2401.01151). The phase of the second one counts from the cosine of twice the base's, like
    the phase of a square. It lags where the spring between the masses is stiffer at positive p and the
    mode's p moves with m0 (the paper's first and third), and leads by as much (``phase_deg = 90``) where one
    of both is opposite.

    With ``subharmonic = 2`` or 3 m0 repeats every this many drive periods: this many times its phase lags
    the base by a quarter of a period; for 2 the phase counts like that of a square. Super- and subharmonics
    give no natural frequency and damping.
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.RESONANCE,)
    kind: Literal["resonance_tracking"] = "resonance_tracking"
    start_hz: FrequencyHz
    """Start of the search; closer to this mode than to any other [Hz]."""
    low_hz: FrequencyHz
    """Lowest frequency [Hz]."""
    high_hz: FrequencyHz
    """Highest frequency [Hz]."""
    phase_deg: float = Field(default=-90.0, gt=-180, lt=180)
    """Phase of m0 over the base at the resonance, both as displacements [degrees]."""
    phase_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0: relative to the base, or absolute."""
    harmonic: Literal[1, 2, 3] = 1
    """Harmonic of m0 whose phase counts; above 1 the absolute phase, relative to this many times the
    base's."""
    subharmonic: Literal[1, 2, 3] = 1
    """Drive periods in a period of m0; its absolute phase counts this many times. The motion must exist at
    ``start_hz``."""
    phase_tolerance_deg: float = Field(default=1.0, gt=0, le=30)
    """Allowed deviation of the phase [degrees]."""
    sensor_phase_deg: float = Field(default=0.3, ge=0, le=30)
    """Standard uncertainty of the phase between accelerometer and vibrometer [degrees]."""
    sensor_gain: Share = 0.01
    """Standard uncertainty of the ratio of their sensitivities; it affects the phase of the relative
    motion."""
    accelerations_m_per_s2: tuple[HeldMetresPerS2, ...] = Field(min_length=1, max_length=100)
    """Levels of the base's fundamental, peak, in the order played [m/s2]."""
    level_tolerance: float = Field(default=0.025, gt=0, lt=1)
    """Allowed relative deviation of the measured level."""
    settling: Settling = Settling()
    """Criteria for settled motion."""
    widest_step_hz: PositiveFloat = 1.0
    """Longest step of the search; shorter than the distance to the next antiresonance [Hz]."""
    most_tries: int = Field(default=25, ge=3, le=200)
    """Largest number of frequencies tried for one level."""
    most_periods: int = Field(default=150, ge=30, le=MOST_PERIODS)
    """Largest number of drive periods of the phase-locked loop for one level."""
    flank_pairs: int = Field(default=3, ge=0, le=10)
    """Pairs of frequencies measured on both flanks, for the mode's natural frequency and damping."""
    record_s: PositiveFloat = 1.0
    """Time recorded on each resonance [s]."""

    @model_validator(mode="after")
    def _start_lies_inside(self) -> Self:
        if not self.low_hz < self.start_hz < self.high_hz:
            raise ValueError(
                f"start_hz = {self.start_hz:g} is not between low_hz = {self.low_hz:g} and high_hz = "
                f"{self.high_hz:g}; give the three in this order: low, start, high"
            )
        return self

    @model_validator(mode="after")
    def _super_or_sub(self) -> Self:
        if self.harmonic > 1 and self.subharmonic > 1:
            raise ValueError(
                f"harmonic = {self.harmonic} and subharmonic = {self.subharmonic} were given; one of them "
                "must be 1"
            )
        return self

    @property
    def is_fundamental(self) -> bool:
        """Whether m0 resonates at the frequency of the drive."""
        return self.harmonic == self.subharmonic == 1

    def motion(self, harmonics: Sequence[complex]) -> complex:
        """Return the motion whose phase counts, from harmonics of m0 over the base, the first one first.

        The first one is that of m0's own period, which has several drive periods for a subharmonic.
        """
        if self.is_fundamental:
            return self.phase_of.motion(harmonics[0])
        moved = harmonics[self.harmonic - 1]
        # The cube of a sine has a sine at three times its phase, its square a cosine at twice.
        turned = -1j if 2 in (self.harmonic, self.subharmonic) else 1.0
        return turned * moved * (moved / max(abs(moved), 1e-300)) ** (self.subharmonic - 1)

    @property
    def band_hz(self) -> tuple[float, float]:
        """The range of the search [Hz]."""
        return self.low_hz, self.high_hz

    @property
    def playing_s(self) -> float:
        """All levels with the longest searches [s]."""
        tries_s = (self.most_tries + 2 * self.flank_pairs) * self.settling.longest_wait_s
        return len(self.accelerations_m_per_s2) * (tries_s + self.record_s)

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """All levels, in the order played."""
        return tuple(
            BaseLevel(acceleration_m_per_s2=each, tolerance=self.level_tolerance, most_change=_MOST_CHANGE)
            for each in self.accelerations_m_per_s2
        )

    def segment(self, number: int, frequency_hz: float) -> Segment:
        """Return the segment of the recording on the resonance of a level."""
        return Segment(
            SegmentLabel.RESONANCE,
            {
                "level": number,
                "frequency_hz": frequency_hz,
                "asked_m_per_s2": self.accelerations_m_per_s2[number],
            },
        )

    def steps(self) -> Iterator[Step]:
        """One step for each level, at the start of the search, at the largest setting."""
        for number in range(len(self.accelerations_m_per_s2)):
            yield Step(Tone(self.start_hz), 0.0, self.record_s, self.segment(number, self.start_hz))

    def loudest_steps(self) -> Iterator[Step]:
        """Yield the largest setting over the range, in steps of a hertz or less."""
        count = int(self.high_hz - self.low_hz) + 2
        for number in range(count):
            frequency_hz = self.low_hz + (self.high_hz - self.low_hz) * number / (count - 1)
            yield Step(Tone(frequency_hz), 0.0, self.record_s, Segment(SegmentLabel.RESONANCE))
