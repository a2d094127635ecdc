"""Base classes of all excitations: a frozen plan with an amplitude setting that lists the generator's
steps.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field

from ..errors import ConfigurationError
from ..host.toml_file import FrozenModel
from ..instruments import Sweep
from ..recording import SegmentLabel
from ..rig import Rig
from .feedback import BaseLevel
from .steps import (
    Approach,
    Direction,
    HeldAcceleration,
    LevelAtBase,
    Play,
    RelativeSetting,
    Samples,
    Step,
    Stream,
    Tone,
    Waveform,
)


@dataclass(frozen=True, eq=False)
class SignalPreview:
    """The voltage according to the generator's panel, as samples and as numbers."""

    time_s: Samples
    """Shape (samples,) [s]."""
    volts: Samples
    """Shape (samples,) [V]."""
    frequency_hz: Samples
    """Shape (samples // 2 + 1,) [Hz]."""
    spectrum_v: Samples
    """Amplitude of the sine at each frequency, peak [V]; shape of ``frequency_hz``."""
    rms_v: float
    peak_v: float
    duration_s: float
    """Duration of the whole excitation, including settling, without ramps [s]."""

    @property
    def crest_factor(self) -> float:
        """Peak over rms."""
        return self.peak_v / self.rms_v


def _sample(steps: Iterable[Step], sample_rate_hz: float) -> Samples:
    """Sample steps one after the other; a tone continues the phase of the one before it."""
    pieces: list[Samples] = []
    elapsed_s = 0.0
    first = 0
    cycles = 0.0
    for step in steps:
        end_s = elapsed_s + step.duration_s
        last = round(end_s * sample_rate_hz)
        since_s = np.arange(first, last) / sample_rate_hz - elapsed_s
        pieces.append(_values(step.play, since_s, first, sample_rate_hz, cycles))
        cycles = (cycles + _cycles_of(step.play) * step.duration_s) % 1.0
        elapsed_s, first = end_s, last
    return np.concatenate(pieces)


def _values(play: Play, since_s: Samples, first: int, sample_rate_hz: float, cycles: float) -> Samples:
    match play:
        case Sweep():
            return np.asarray(np.sin(2 * np.pi * (play.cycles(since_s) + cycles)))
        case Tone(frequency_hz, level):
            return np.asarray(level * np.sin(2 * np.pi * (frequency_hz * since_s + cycles)))
        case Waveform(values, repetition_hz):
            # A sample on the edge between two held values belongs to the later one: the small shift prevents
            # rounding to the earlier one.
            edge = 1e-9
            position = np.floor(since_s * repetition_hz * len(values) + edge).astype(np.int64)
            return np.asarray(values[position % len(values)])
        case Stream(source):
            return source.samples(first, len(since_s), sample_rate_hz)


def _cycles_of(play: Play) -> float:
    match play:
        case Tone(frequency_hz, _):
            return frequency_hz
        case Sweep():
            return play.cycles(play.duration_s) / play.duration_s
        case Waveform() | Stream():
            return 0.0


AmplitudeVpp = Annotated[float, Field(gt=0, le=1000)]
"""The generator's description gives its limits; a value above the upper bound is a wrong unit."""
HIGHEST_FREQUENCY_HZ = 1e5
"""Higher than any shaker can follow [Hz]."""
FrequencyHz = Annotated[float, Field(gt=0, le=HIGHEST_FREQUENCY_HZ)]


class Family(StrEnum):
    """Families of kinds with the same analysis and pictures."""

    NOISE = "noise"
    """A whole band at once."""
    SWEEP = "sweep"
    """A sine that moves through a band."""
    DWELL = "dwell"
    """A sine of constant frequency."""
    STEPPED = "stepped"
    """Sines one after the other, each recorded separately."""


class LeadIn(FrozenModel):
    """A tone before a dwell."""

    frequency_hz: FrequencyHz
    amplitude_vpp: AmplitudeVpp


def around(frequency_hz: float) -> tuple[float, float]:
    """Return the band for a single sine: an octave to either side [Hz]."""
    return 0.5 * frequency_hz, 2 * frequency_hz


class AbstractExcitation(FrozenModel, ABC):
    """What the generator plays, from the first waveform to the last, at one amplitude setting."""

    family: ClassVar[Family]
    result_labels: ClassVar[tuple[SegmentLabel, ...]]
    """Segments of the recording that give results."""
    wishes: ClassVar[tuple[str, ...]] = ()
    """Results that a recording can wait for, see `vibench.acquisition.plan.Until`."""

    amplitude_vpp: AmplitudeVpp
    """Setting of the generator, peak to peak [V], as its panel shows it."""

    @abstractmethod
    def steps(self) -> Iterator[Step]:
        """Yield the steps of the generator, in the order of time."""

    def loudest_steps(self) -> Iterator[Step]:
        """Yield the steps that limits are checked with: the steps themselves, unless feedback may be
        louder.
        """
        return self.steps()

    @property
    def highest_amplitude_vpp(self) -> float:
        """The highest setting, including lead-ins, peak to peak [V]."""
        return self.amplitude_vpp

    @property
    def period_points(self) -> int | None:
        """Points of a waveform in the generator's memory; None without a waveform."""
        return None

    @property
    def lowest_amplitude_vpp(self) -> float:
        """The lowest setting, without ramps, peak to peak [V]."""
        return self.amplitude_vpp

    @property
    def level_text(self) -> str:
        """Level of the drive or of the base, in words."""
        return f"{self.amplitude_vpp:g} Vpp"

    def level_at(self, frequency_hz: float) -> LevelAtBase:
        """Return what determines the motion of the base at a frequency of the band: the setting."""
        del frequency_hz
        return RelativeSetting(1.0)

    def held_accelerations(self) -> Iterator[tuple[float, float]]:
        """Yield frequencies [Hz] and amplitudes of the base's acceleration [m/s2] that feedback will hold."""
        return iter(())

    def require_holdable(self, rig: Rig) -> None:
        """Refuse motions that feedback on a rig could not hold; plans without feedback accept every rig.

        Raises ConfigurationError or LimitExceeded. Nothing was played.
        """

    @property
    @abstractmethod
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency; for a single one an octave to either side [Hz]."""

    @property
    def approach(self) -> Approach:
        """Start of the motion at each frequency: from the neighbour for moving frequencies, otherwise from
        rest.
        """
        return Approach.REST

    @property
    def glide_step_s(self) -> float | None:
        """Time at one frequency, if the drive continues without a pause [s]; otherwise None."""
        return None

    @property
    def own_sweep_s(self) -> float | None:
        """Time of a sweep that the generator makes by itself [s]; otherwise None."""
        return None

    @property
    def lead_in_s(self) -> float:
        """Time of the lead-in along a branch [s]."""
        return 0.0

    def turned(self, direction: Direction) -> Self | None:
        """Return the same excitation in this direction; None if its kind does not have it."""
        del direction
        return None

    def led(self, way: tuple[LeadIn, ...], lead_s: float) -> tuple[Self, LeadIn] | None:
        """Return the same after a lead-in, and its own tone for the next; None if its kind has no lead-in."""
        del way, lead_s
        return None

    @property
    @abstractmethod
    def playing_s(self) -> float:
        """Time of all steps, including settling, without ramps [s]; with feedback the longest possible."""

    @property
    def stretches(self) -> int:
        """How often the drive starts from silence: once for sines, once for every waveform of noise."""
        return 1

    @property
    def highest_frequency_hz(self) -> float:
        """The highest intended frequency, which the converter must be able to follow [Hz]."""
        return self.band_hz[1]

    def shown_steps(self) -> Iterator[Step]:
        """Yield the steps for a preview: all of them, or a part that represents the signal."""
        return self.steps()

    def preview(self, sample_rate_hz: float) -> SignalPreview:
        """Compute the signal, before anything moves.

        Raises ConfigurationError when ``sample_rate_hz`` is too low to show the highest frequency.
        """
        highest_hz = self.highest_frequency_hz
        if sample_rate_hz <= 2 * highest_hz:
            raise ConfigurationError(
                f"a preview at {sample_rate_hz:g} samples/s cannot show {highest_hz:g} Hz; "
                f"ask for more than {2 * highest_hz:g} samples/s"
            )
        volts = 0.5 * self.amplitude_vpp * _sample(self.shown_steps(), sample_rate_hz)
        one_sided = np.abs(np.fft.rfft(volts)) * 2 / len(volts)
        one_sided[0] /= 2
        if len(volts) % 2 == 0:
            one_sided[-1] /= 2
        return SignalPreview(
            time_s=np.arange(len(volts)) / sample_rate_hz,
            volts=volts,
            frequency_hz=np.asarray(np.arange(len(one_sided)) * sample_rate_hz / len(volts), np.float64),
            spectrum_v=one_sided,
            rms_v=float(np.sqrt(np.mean(volts**2))),
            peak_v=float(np.max(np.abs(volts))),
            duration_s=self.playing_s,
        )


class FixedSine(AbstractExcitation):
    """A sine of constant frequency."""

    frequency_hz: FrequencyHz
    """Frequency of the sine [Hz]."""

    @property
    def band_hz(self) -> tuple[float, float]:
        """An octave to either side [Hz]."""
        return around(self.frequency_hz)

    @property
    def highest_frequency_hz(self) -> float:
        """The frequency itself [Hz]."""
        return self.frequency_hz


class AbstractFeedback(AbstractExcitation):
    """An excitation whose next step depends on measured values; `vibench.acquisition.control` carries it out.

    Its ``steps`` are the expected ones, without waits: for previews and for lists of the segments.
    ``amplitude_vpp`` is the largest setting that it may use.
    """

    @property
    @abstractmethod
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """Levels of the base to be held, in the order played; none to play ``amplitude_vpp`` unchanged."""

    @property
    def level_text(self) -> str:
        """The levels, and the largest setting."""
        most = super().level_text
        words = [level.text for level in self.held_levels]
        return f"base held at {', '.join(words)}, at most {most}" if words else most

    def level_at(self, frequency_hz: float) -> LevelAtBase:
        """Return the highest level that is held; without one, the setting."""
        accelerations = [level.acceleration_at(frequency_hz) for level in self.held_levels]
        return HeldAcceleration(max(accelerations)) if accelerations else RelativeSetting(1.0)

    def held_accelerations(self) -> Iterator[tuple[float, float]]:
        """Yield the highest level for every expected sine."""
        for step in self.steps():
            match step.play:
                case Tone(frequency_hz):
                    match self.level_at(frequency_hz):
                        case HeldAcceleration(acceleration):
                            yield frequency_hz, acceleration
