"""A sine that seeks the phase resonance of a mode and stays on it, level after level."""

from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import PhaseReference

from ..recording import SegmentLabel
from .feedback import MOST_PERIODS, BaseLevel, HeldMetresPerS2, Settling, Share
from .plan import AbstractFeedback, Family, FrequencyHz
from .steps import Segment, Step, Tone

_MOST_CHANGE = 1.6
"""Of the setting at once: levels are close together, and a loop of 150 periods has none to spare."""


class ResonanceTracking(AbstractFeedback):
    """Phase resonance of one mode at rising (or falling) levels of the base: its backbone.

    At the resonance m0 moves a quarter of a period behind the base, seen from the base or in space. The
    first level is searched for in settled motion; from there a phase-locked loop, which acts every ten
    periods, follows the resonance from level to level, and where it loses it, the search begins again. Other
    modes shift the phase a little; the flanks tell the natural frequency and the damping apart from them, as
    long as the motion is linear.

    With ``harmonic = 3`` or 2 a superharmonic resonance is tracked: the drive lies at a third or at half of
    the mode's frequency, and that harmonic of m0 lags this many times the phase of the base by a quarter of
    its own period (Volvert and Kerschen, J. Sound Vib. 511 (2021) 116324; with a phase-locked loop: Zhou and
    Kerschen, arXiv 2401.01151). The phase of the second one counts from the cosine of twice the base's,
    as its square does. It lags where the spring between the masses is the stiffer at positive p and the
    mode's p goes with m0 (the paper's first and third), and leads by as much (``phase_deg = 90``) where one
    of both is the other way round. With ``subharmonic = 2`` or 3 m0 repeats every this many drives, at half
    or a third of their frequency: this many times its phase there lags the base by a quarter of a period, and
    for 2 counts as the phase of its square does. Neither gives natural frequency and damping.
    """

    family: ClassVar[Family] = Family.STEPPED
    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.RESONANCE,)
    kind: Literal["resonance_tracking"] = "resonance_tracking"
    start_hz: FrequencyHz
    """Where the search begins; closer to this mode than to any other [Hz]."""
    low_hz: FrequencyHz
    """The frequency never goes below [Hz]."""
    high_hz: FrequencyHz
    """The frequency never goes above [Hz]."""
    phase_deg: float = Field(default=-90.0, gt=-180, lt=180)
    """Phase of m0 over the base at the resonance, both as displacements [degrees]."""
    phase_of: PhaseReference = PhaseReference.RELATIVE
    """Which motion of m0 has it: the one against the base, or the absolute one."""
    harmonic: Literal[1, 2, 3] = 1
    """Of m0, whose phase counts; above 1 that of m0 in space, against as many times the base's phase."""
    subharmonic: Literal[1, 2, 3] = 1
    """Drives in a period of m0, whose phase in space counts as many times; the motion must be there at
    ``start_hz`` by itself."""
    phase_tolerance_deg: float = Field(default=1.0, gt=0, le=30)
    """How closely the phase must be met [degrees]."""
    sensor_phase_deg: float = Field(default=0.3, ge=0, le=30)
    """Standard uncertainty of the phase between accelerometer and vibrometer [degrees]."""
    sensor_gain: Share = 0.01
    """Standard uncertainty of the ratio of their sensitivities; it turns the difference of their motions."""
    accelerations_m_per_s2: tuple[HeldMetresPerS2, ...] = Field(min_length=1, max_length=100)
    """Levels of the base's fundamental, peak, in the order played [m/s2]."""
    level_tolerance: float = Field(default=0.025, gt=0, lt=1)
    """How far the measured level may lie from its own, as a share."""
    settling: Settling = Settling()
    """When a motion counts as settled."""
    widest_step_hz: PositiveFloat = 1.0
    """Longest step of the search; shorter than from the resonance to the antiresonance beside it [Hz]."""
    most_tries: int = Field(default=25, ge=3, le=200)
    """How many frequencies are tried for one level."""
    most_periods: int = Field(default=150, ge=30, le=MOST_PERIODS)
    """Drive periods within which the phase-locked loop must be on the resonance of the next level."""
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

        The first one is that of m0's own period, which a subharmonic motion has several drives long.
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
        """Name the recording on the resonance of a level."""
        return Segment(
            SegmentLabel.RESONANCE,
            {
                "level": number,
                "frequency_hz": frequency_hz,
                "asked_m_per_s2": self.accelerations_m_per_s2[number],
            },
        )

    def steps(self) -> Iterator[Step]:
        """One step for each level, where the search begins, at the largest setting."""
        for number in range(len(self.accelerations_m_per_s2)):
            yield Step(Tone(self.start_hz), 0.0, self.record_s, self.segment(number, self.start_hz))

    def loudest_steps(self) -> Iterator[Step]:
        """List the largest setting at both ends of the range and inside it, a hertz apart or less."""
        count = int(self.high_hz - self.low_hz) + 2
        for number in range(count):
            frequency_hz = self.low_hz + (self.high_hz - self.low_hz) * number / (count - 1)
            yield Step(Tone(frequency_hz), 0.0, self.record_s, Segment(SegmentLabel.RESONANCE))
