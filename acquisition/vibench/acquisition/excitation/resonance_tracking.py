"""A sine that finds the phase resonance of a mode and follows it from level to level."""

from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import PhaseReference

from ..recording import SegmentLabel
from .plan import (
    MOST_PERIODS,
    AbstractFeedback,
    BaseLevel,
    Family,
    FrequencyHz,
    HeldMetresPerS2,
    Settling,
    Share,
)
from .steps import Segment, Step, Tone

_MOST_CHANGE = 1.6
"""Largest factor for one change of the amplitude setting; large, as a level has only 150 loop periods."""


class ResonanceTracking(AbstractFeedback):
    """Phase resonance of one mode at rising (or falling) levels of the base: the mode's backbone.

    At resonance the motion of m0, relative or absolute, lags the base by a quarter of a period. At the first
    level, the resonance is searched for in settled motion. A phase-locked loop, which acts every ten periods,
    then follows the resonance from level to level; if the loop loses the resonance, the search is repeated.
    Other modes shift the phase a little. While the motion is linear, measurements on both flanks give the
    natural frequency and the damping without this shift.

    ``harmonic`` n = 2 or 3 tracks a superharmonic resonance: the drive is at 1/n of the mode's frequency.
    Harmonic n of m0 then lags n times the phase of the base by 90 degrees (Volvert and Kerschen, J. Sound
    Vib. 511 (2021) 116324; with a phase-locked loop: Zhou and Kerschen, arXiv 2401.01151). For n = 2 the
    phase is measured from a cosine at twice the drive frequency, as in the square of a sine. This harmonic
    lags if the spring between the masses is stiffer at positive p and p moves in phase with m0 in the mode
    (modes 1 and 3 of the paper). If only one of these holds, it leads instead (``phase_deg = 90``).

    ``subharmonic`` n = 2 or 3 tracks a motion of m0 that repeats every n drive periods: n times its phase
    lags the base by 90 degrees; for n = 2 the phase is again measured from a cosine. Super- and
    subharmonic resonances give no natural frequency and no damping.
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.RESONANCE,)
    kind: Literal["resonance_tracking"] = "resonance_tracking"
    start_hz: FrequencyHz
    """Frequency at which the search starts [Hz]; the tracked mode must be the nearest mode."""
    low_hz: FrequencyHz
    """Lowest frequency of the search [Hz]."""
    high_hz: FrequencyHz
    """Highest frequency of the search [Hz]."""
    phase_deg: float = Field(default=-90.0, gt=-180, lt=180)
    """Phase of m0's displacement relative to the base displacement that defines resonance [degrees]."""
    phase_of: PhaseReference = PhaseReference.RELATIVE
    """Motion of m0 whose phase is used: relative to the base, or absolute."""
    harmonic: Literal[1, 2, 3] = 1
    """Harmonic n of m0 whose phase is used. For n > 1, this is the phase of the absolute motion minus n times
    the phase of the base."""
    subharmonic: Literal[1, 2, 3] = 1
    """Number n of drive periods in one period of m0. For n > 1, n times the phase of the absolute motion is
    used, and the motion must exist at ``start_hz``."""
    phase_tolerance_deg: float = Field(default=1.0, gt=0, le=30)
    """Allowed deviation of the phase of m0 from ``phase_deg`` [degrees]."""
    sensor_phase_deg: float = Field(default=0.3, ge=0, le=30)
    """Standard uncertainty of the phase between accelerometer and vibrometer [degrees]."""
    sensor_gain: Share = 0.01
    """Relative standard uncertainty of the ratio of the two sensors' sensitivities. This uncertainty affects
    the phase of the relative motion."""
    accelerations_m_per_s2: tuple[HeldMetresPerS2, ...] = Field(min_length=1, max_length=100)
    """Peak accelerations of the fundamental of the base motion, in the order played [m/s2]."""
    level_tolerance: float = Field(default=0.025, gt=0, lt=1)
    """Allowed deviation of the measured base level, relative to the planned level."""
    settling: Settling = Settling()
    """Criteria by which the motion counts as settled."""
    widest_step_hz: PositiveFloat = 1.0
    """Largest frequency step of the search [Hz]; smaller than the distance to the next antiresonance."""
    most_tries: int = Field(default=25, ge=3, le=200)
    """Largest number of frequencies at which one level's search may measure."""
    most_periods: int = Field(default=150, ge=30, le=MOST_PERIODS)
    """Largest number of drive periods of the phase-locked loop for one level."""
    flank_pairs: int = Field(default=3, ge=0, le=10)
    """Number of frequency pairs (one on each flank) that measure natural frequency and damping."""
    record_s: PositiveFloat = 1.0
    """Recording time at each resonance [s]."""

    @model_validator(mode="after")
    def _start_lies_inside(self) -> Self:
        if not self.low_hz < self.start_hz < self.high_hz:
            raise ValueError(
                f"start_hz = {self.start_hz:g} is not between low_hz = {self.low_hz:g} and high_hz = "
                f"{self.high_hz:g}; choose low_hz < start_hz < high_hz"
            )
        return self

    @model_validator(mode="after")
    def _super_or_sub(self) -> Self:
        if self.harmonic > 1 and self.subharmonic > 1:
            raise ValueError(
                f"harmonic = {self.harmonic} and subharmonic = {self.subharmonic} were given; at least one "
                "of them must be 1"
            )
        return self

    @property
    def is_fundamental(self) -> bool:
        """Whether the tracked resonance of m0 is at the frequency of the drive."""
        return self.harmonic == self.subharmonic == 1

    def motion(self, harmonics: Sequence[complex]) -> complex:
        """Return the complex motion whose phase is compared with ``phase_deg``.

        The first of ``harmonics`` (m0 over base) has the period of m0, which is longer for a subharmonic.
        """
        if self.is_fundamental:
            return self.phase_of.motion(harmonics[0])
        moved = harmonics[self.harmonic - 1]
        # The cube of a sine contains a sine of triple phase; the square, a cosine of double phase.
        turned = -1j if 2 in (self.harmonic, self.subharmonic) else 1.0
        return turned * moved * (moved / max(abs(moved), 1e-300)) ** (self.subharmonic - 1)

    @property
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency of the search [Hz]."""
        return self.low_hz, self.high_hz

    @property
    def playing_s(self) -> float:
        """Duration of all levels if every search takes the longest time [s]."""
        tries_s = (self.most_tries + 2 * self.flank_pairs) * self.settling.longest_wait_s
        return len(self.accelerations_m_per_s2) * (tries_s + self.record_s)

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """All base levels, in the order played."""
        return tuple(
            BaseLevel(acceleration_m_per_s2=each, tolerance=self.level_tolerance, most_change=_MOST_CHANGE)
            for each in self.accelerations_m_per_s2
        )

    def segment(self, number: int, frequency_hz: float) -> Segment:
        """Return the segment recorded at the resonance of level ``number``."""
        return Segment(
            SegmentLabel.RESONANCE,
            {
                "level": number,
                "frequency_hz": frequency_hz,
                "asked_m_per_s2": self.accelerations_m_per_s2[number],
            },
        )

    def steps(self) -> Iterator[Step]:
        """Yield one step per level, at the search's first frequency and the largest amplitude setting."""
        for number in range(len(self.accelerations_m_per_s2)):
            yield Step(Tone(self.start_hz), 0.0, self.record_s, self.segment(number, self.start_hz))

    def loudest_steps(self) -> Iterator[Step]:
        """Yield steps of 1 Hz or less over the range of the search, at the largest amplitude setting."""
        count = int(self.high_hz - self.low_hz) + 2
        for number in range(count):
            frequency_hz = self.low_hz + (self.high_hz - self.low_hz) * number / (count - 1)
            yield Step(Tone(frequency_hz), 0.0, self.record_s, Segment(SegmentLabel.RESONANCE))
