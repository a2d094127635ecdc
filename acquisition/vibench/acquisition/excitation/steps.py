"""Steps of the generator: an excitation lists them, and a run plays them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, TypeAlias

from ..instruments import Samples, Sweep
from ..recording import SegmentLabel
from .gaussian_band import GaussianBand


@dataclass(frozen=True)
class Tone:
    """A sine at one frequency."""

    frequency_hz: float
    level: float = 1.0
    """Level as a fraction of the amplitude setting: above 0, and at most 1 except in a lead-in."""


@dataclass(frozen=True)
class LoopTone(Tone):
    """A sine played by a real-time controller, whose control law holds the motion."""


@dataclass(frozen=True, eq=False)
class Waveform:
    """One period that repeats, as in a generator's memory; each value is held until the next."""

    values: Samples
    """Values from -1 to 1; the full range is the amplitude setting. The peak may be below 1: the realisations
    of a noise have equal rms values, and only the realisation with the highest peak reaches 1."""
    repetition_hz: float


@dataclass(frozen=True, eq=False)
class Stream:
    """A signal that does not repeat, for an analogue output: the full range is the amplitude setting."""

    source: GaussianBand


Play: TypeAlias = Tone | Waveform | Stream | Sweep


def full_level(play: Play | None) -> float:
    """Return the level that a signal reaches after its ramp, as a fraction of the amplitude setting."""
    return play.level if isinstance(play, Tone) else 1.0


@dataclass(frozen=True)
class Segment:
    """A named range of the recording, for the analysis."""

    label: SegmentLabel
    numbers: Mapping[str, int | float | str] = field(default_factory=dict)
    """Values for the analysis: ``realisation``, ``repetition_hz``, ``frequency_hz``, ``start_hz`` ..."""


@dataclass(frozen=True)
class Step:
    """One signal to play: first the motion settles, then it is recorded.

    Consecutive steps with equal segments and no settling time are recorded as one segment.
    """

    play: Play
    settle_s: float
    record_s: float
    segment: Segment

    @property
    def duration_s(self) -> float:
        """Total time for settling and recording [s]."""
        return self.settle_s + self.record_s


class Direction(StrEnum):
    """Order of the steps. An impacting specimen may respond differently to rising and falling values."""

    UP = "up"
    DOWN = "down"
    UP_THEN_DOWN = "up_then_down"
    DOWN_THEN_UP = "down_then_up"

    def passes(self, rising: tuple[float, ...]) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield each pass: ``"up"`` or ``"down"``, and the values in the order played.
        ``rising`` lists the values in ascending order.
        """
        up = (Direction.UP.value, rising)
        down = (Direction.DOWN.value, rising[::-1])
        match self:
            case Direction.UP:
                yield up
            case Direction.DOWN:
                yield down
            case Direction.UP_THEN_DOWN:
                yield from (up, down)
            case Direction.DOWN_THEN_UP:
                yield from (down, up)


class Approach(StrEnum):
    """Initial state at each frequency, which selects one of several possible motions."""

    REST = "from rest"
    UP = "swept upwards"
    """The motion continues from the final state and phase at the next lower frequency."""
    DOWN = "swept downwards"


@dataclass(frozen=True)
class HeldAcceleration:
    """Feedback holds the fundamental of the base motion, with any drive voltage up to the largest allowed."""

    amplitude_m_per_s2: float
    """Peak acceleration of the base's fundamental [m/s2]."""
    basis: ClassVar[str] = "the level that feedback holds"


@dataclass(frozen=True)
class RelativeSetting:
    """A sine at a fixed amplitude setting; the base motion results from the shaker's response."""

    share: float
    """Amplitude setting as a fraction of the plan's ``amplitude_vpp``."""
    basis: ClassVar[str] = "the rig's linear model"


@dataclass(frozen=True)
class RmsSetting:
    """Noise at the plan's amplitude setting, represented by a sine of the same rms value."""

    basis: ClassVar[str] = "a sine of the same rms base displacement"


LevelAtBase: TypeAlias = HeldAcceleration | RelativeSetting | RmsSetting
