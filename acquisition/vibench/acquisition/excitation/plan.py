"""Base classes of all excitations: frozen plans that list the steps to play, and settings of feedback."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import pi
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from ..errors import ConfigurationError
from ..host.toml_file import FrozenModel
from ..instruments import Samples, Sweep
from ..recording import SegmentLabel
from ..rig import Rig
from .steps import (
    Approach,
    Direction,
    HeldAcceleration,
    LevelAtBase,
    Play,
    RelativeSetting,
    Step,
    Stream,
    Tone,
    Waveform,
)

MOST_PERIODS = 100_000
Share = Annotated[float, Field(gt=0, lt=1)]
HeldMetres = Annotated[float, Field(ge=1e-15, le=1)]
"""Displacement to be held [m]. The bounds only catch wrong units; no sensor or shaker reaches them."""
HeldMetresPerS2 = Annotated[float, Field(ge=1e-9, le=1e5)]
"""Acceleration to be held [m/s2]. The bounds only catch wrong units; no shaker reaches 10 000 g."""


class Settling(FrozenModel):
    """Criteria by which the motion of the specimen counts as settled.

    Amplitude and phase of the first four harmonics are measured once per drive period. The motion is settled
    with period k if these values repeat after k drive periods. A motion that does not repeat is settled if
    its statistics are constant.
    """

    tolerance: Share = 0.01
    """Largest deviation between repetitions of the motion, relative to the motion's rms value."""
    periods: int = Field(default=80, ge=12, le=MOST_PERIODS)
    """Number of drive periods over which the motion must repeat."""
    longest_period: int = Field(default=8, ge=1, le=32)
    """Longest motion period that is searched for, in drive periods."""
    aperiodic_periods: int = Field(default=400, ge=100, le=MOST_PERIODS)
    """Number of drive periods over which a non-repeating motion must have constant statistics."""
    shortest_wait_s: float = Field(default=0.2, ge=0, le=600)
    """Shortest wait for settling at every frequency [s]."""
    longest_wait_s: float = Field(default=15.0, gt=0, le=3600)
    """Longest wait at every frequency [s]; after it, the motion is recorded, marked as not settled."""

    @model_validator(mode="after")
    def _waits_in_order(self) -> Self:
        if self.shortest_wait_s > self.longest_wait_s:
            raise ValueError(
                f"shortest_wait_s = {self.shortest_wait_s:g} is longer than longest_wait_s = "
                f"{self.longest_wait_s:g}; lower the first or raise the second"
            )
        return self


class BaseLevel(FrozenModel):
    """Level of the base's motion that feedback holds by adjusting the generator's amplitude.

    Only the fundamental of the base motion is held; impacts add motion at other frequencies.
    ``amplitude_vpp`` of the plan is then the largest setting that feedback may use.
    """

    acceleration_m_per_s2: HeldMetresPerS2 | None = None
    """Peak acceleration of the fundamental [m/s2]; give either this key or ``displacement_m``."""
    displacement_m: HeldMetres | None = None
    """Peak displacement of the fundamental at every frequency [m]; give this or ``acceleration_m_per_s2``."""
    tolerance: Share = 0.025
    """Allowed deviation of the measured level from the level to be held, relative to the latter."""
    most_change: float = Field(default=1.25, gt=1, le=4)
    """Largest factor by which one correction changes the amplitude setting."""

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        if (self.acceleration_m_per_s2 is None) == (self.displacement_m is None):
            raise ValueError("give either acceleration_m_per_s2 or displacement_m, and not both")
        return self

    @property
    def quantity(self) -> str:
        """The quantity of the base motion that is held: ``"acceleration"`` or ``"displacement"``."""
        return "acceleration" if self.displacement_m is None else "displacement"

    @property
    def text(self) -> str:
        """The held level as text with its unit."""
        if self.displacement_m is not None:
            return f"{1e6 * self.displacement_m:g} µm"
        return f"{self.acceleration_m_per_s2:g} m/s²"

    def acceleration_at(self, frequency_hz: float) -> float:
        """Return the peak base acceleration to be held at ``frequency_hz`` [m/s2]."""
        if self.displacement_m is not None:
            return self.displacement_m * (2 * pi * frequency_hz) ** 2
        assert self.acceleration_m_per_s2 is not None, "the validator requires one of the two"
        return self.acceleration_m_per_s2


class JumpSearch(FrozenModel):
    """Criterion by which a change between two steps counts as a jump, and how precisely a jump is located."""

    factor: float = Field(default=1.5, gt=1, le=100)
    """A change of Response II (fundamental of m0 over base) by more than this factor counts as a jump."""
    resolution_hz: PositiveFloat = 0.25
    """Largest allowed spacing of the two frequencies that enclose a located jump [Hz]."""
    most_searches: int = Field(default=6, ge=1, le=50)
    """Largest number of searches for jumps in one pass, including searches that find only a steep slope."""


@dataclass(frozen=True, eq=False)
class SignalPreview:
    """Preview of a signal, in volts as set on the generator's panel: samples, spectrum and key figures."""

    time_s: Samples
    """Times of the samples, shape (samples,) [s]."""
    volts: Samples
    """Voltages of the signal, shape (samples,) [V]."""
    frequency_hz: Samples
    """Frequencies of the spectrum, shape (samples // 2 + 1,) [Hz]."""
    spectrum_v: Samples
    """Peak amplitude of the spectral line at each frequency of ``frequency_hz``, same shape [V]."""
    rms_v: float
    peak_v: float
    duration_s: float
    """Duration of the whole excitation, including settling but not ramps [s]."""


def _sample(steps: Iterable[Step], sample_rate_hz: float) -> Samples:
    """Return the samples of consecutive steps; a tone continues the phase of the preceding step."""
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
            # A sample on the edge between two held values takes the later value. The small shift keeps
            # rounding errors from selecting the earlier value.
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
"""Amplitude setting [Vpp]. The bound only catches wrong units; the generator's own limits are narrower."""
HIGHEST_FREQUENCY_HZ = 1e5
"""Upper bound on every frequency of a plan [Hz], above the range of any shaker."""
FrequencyHz = Annotated[float, Field(gt=0, le=HIGHEST_FREQUENCY_HZ)]


class Family(StrEnum):
    """Families of kinds of excitation; all kinds of one family have the same analysis and figures."""

    NOISE = "noise"
    """Noise or a multisine, which excites the whole band at once."""
    SWEEP = "sweep"
    """A sine whose frequency moves through a band."""
    DWELL = "dwell"
    """A sine of constant frequency."""
    STEPPED = "stepped"
    """A sequence of sines, each recorded separately."""


class LeadIn(FrozenModel):
    """A tone played before a dwell, to bring the specimen to a particular motion."""

    frequency_hz: FrequencyHz
    amplitude_vpp: AmplitudeVpp


def band_around(frequency_hz: float) -> tuple[float, float]:
    """Return the band of a single sine: from an octave below its frequency to an octave above [Hz]."""
    return 0.5 * frequency_hz, 2 * frequency_hz


class AbstractExcitation(FrozenModel, ABC):
    """Plan of the signal that the generator plays in one measurement, at one amplitude setting."""

    family: ClassVar[Family]
    result_labels: ClassVar[tuple[SegmentLabel, ...]]
    """Labels of the segments of the recording from which results are computed."""
    wishes: ClassVar[tuple[str, ...]] = ()
    """Names of results whose uncertainty can end the recording, see `vibench.acquisition.plan.Until`."""

    amplitude_vpp: AmplitudeVpp
    """Amplitude setting as shown on the generator's panel [Vpp]."""

    @abstractmethod
    def steps(self) -> Iterator[Step]:
        """Yield the steps that the generator plays, in chronological order."""

    def loudest_steps(self) -> Iterator[Step]:
        """Yield the steps with which limits are checked. These steps are the planned steps, or larger signals
        that feedback may reach.
        """
        return self.steps()

    @property
    def highest_amplitude_vpp(self) -> float:
        """Highest amplitude setting, including lead-ins, peak to peak [V]."""
        return self.amplitude_vpp

    @property
    def period_points(self) -> int | None:
        """Number of points of the waveform in the generator's memory; None if no waveform is used."""
        return None

    @property
    def lowest_amplitude_vpp(self) -> float:
        """Lowest amplitude setting except during ramps, peak to peak [V]."""
        return self.amplitude_vpp

    @property
    def level_text(self) -> str:
        """Display text for the level of the drive or of the base."""
        return f"{self.amplitude_vpp:g} Vpp"

    def level_at(self, frequency_hz: float) -> LevelAtBase:
        """Return how the level at a frequency of the band is specified; here by the amplitude setting."""
        del frequency_hz
        return RelativeSetting(1.0)

    def held_accelerations(self) -> Iterator[tuple[float, float]]:
        """Yield each frequency [Hz] and the peak base acceleration [m/s2] that feedback holds there."""
        return iter(())

    def require_holdable(self, rig: Rig) -> None:
        """Check that feedback can hold the planned motions on ``rig``; plans without feedback pass.

        Raises ConfigurationError or LimitExceeded, before anything is played.
        """

    @property
    @abstractmethod
    def band_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency; for a single sine, an octave below and above it [Hz]."""

    @property
    def approach(self) -> Approach:
        """Initial state: rest, or the motion at the previous frequency if the drive moves through a band."""
        return Approach.REST

    @property
    def glide_step_s(self) -> float | None:
        """Time at each frequency [s], if the drive changes frequency without a pause; otherwise None."""
        return None

    @property
    def own_sweep_s(self) -> float | None:
        """Duration of a sweep that the generator performs by itself [s]; None without such a sweep."""
        return None

    @property
    def lead_in_s(self) -> float:
        """Duration of the lead-in [s]; 0 if there is no lead-in."""
        return 0.0

    def turned(self, direction: Direction) -> Self | None:
        """Return the same excitation in ``direction``; None if its kind has no such direction."""
        if "direction" not in type(self).model_fields:
            return None
        return type(self).model_validate({**self.model_dump(exclude_unset=True), "direction": direction})

    def led(self, way: tuple[LeadIn, ...], lead_s: float) -> tuple[Self, LeadIn] | None:
        """Return this excitation with lead-in ``way``, and its own tone; None if lead-ins are not allowed."""
        del way, lead_s
        return None

    @property
    @abstractmethod
    def playing_s(self) -> float:
        """Duration of all steps, with settling, without ramps [s]; with feedback, the longest duration."""

    @property
    def stretches(self) -> int:
        """Number of times the drive starts from silence: once for sines, once per waveform for noise."""
        return 1

    @property
    def highest_frequency_hz(self) -> float:
        """Highest frequency of the plan, which the converter's sample rate must allow [Hz]."""
        return self.band_hz[1]

    def shown_steps(self) -> Iterator[Step]:
        """Yield the steps shown in a preview: all steps, or a representative part."""
        return self.steps()

    def preview(self, sample_rate_hz: float) -> SignalPreview:
        """Compute the signal without playing it.

        Raises ConfigurationError when ``sample_rate_hz`` is too low to show the highest frequency.
        """
        highest_hz = self.highest_frequency_hz
        if sample_rate_hz <= 2 * highest_hz:
            raise ConfigurationError(
                f"a preview at {sample_rate_hz:g} samples/s cannot show {highest_hz:g} Hz; "
                f"use more than {2 * highest_hz:g} samples/s"
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
        """Band from an octave below the sine to an octave above it [Hz]."""
        return band_around(self.frequency_hz)

    @property
    def highest_frequency_hz(self) -> float:
        """Frequency of the sine [Hz]."""
        return self.frequency_hz


class AbstractFeedback(AbstractExcitation):
    """An excitation whose next step depends on measured values; run by `vibench.acquisition.control`.

    ``steps`` lists the expected steps without waits, for previews and for lists of segments.
    ``amplitude_vpp`` is the largest setting that feedback may use.
    """

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """Levels of the base to be held, in the order played; empty if feedback holds no level of a sine.

        Here: the field ``base_level``, if the excitation has this field.
        """
        level: BaseLevel | None = getattr(self, "base_level", None)
        return () if level is None else (level,)

    @property
    def level_text(self) -> str:
        """Display text for the held levels and the largest amplitude setting."""
        most = super().level_text
        words = [level.text for level in self.held_levels]
        return f"base held at {', '.join(words)}, at most {most}" if words else most

    def level_at(self, frequency_hz: float) -> LevelAtBase:
        """Return the highest base level that is held, or the amplitude setting if no level is held."""
        accelerations = [level.acceleration_at(frequency_hz) for level in self.held_levels]
        return HeldAcceleration(max(accelerations)) if accelerations else RelativeSetting(1.0)

    def held_accelerations(self) -> Iterator[tuple[float, float]]:
        """Yield the frequency [Hz] and highest held acceleration [m/s2] of every expected sine."""
        for step in self.steps():
            match step.play:
                case Tone(frequency_hz):
                    match self.level_at(frequency_hz):
                        case HeldAcceleration(acceleration):
                            yield frequency_hz, acceleration
