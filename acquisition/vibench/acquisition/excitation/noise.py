"""Noise in a band: periodic in the generator's memory, streamed, or with a spectrum held at the base."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, field_validator, model_validator

from ..host.toml_file import FrozenModel
from ..instruments import Samples
from ..recording import SegmentLabel
from .plan import AbstractExcitation, AbstractFeedback, Family, FrequencyHz
from .steps import GaussianBand, RmsSetting, Segment, Step, Stream, Waveform

USUAL_POINTS = 8192
"""Default number of points in one period of a waveform."""
FEWEST_POINTS, MOST_POINTS = 64, 65_536
"""Bounds on the number of points in a plan; the generator's memory may set narrower bounds."""
CANDIDATES = 20
"""Number of sets of random phases that are tried; the set with the lowest crest factor is played. 20 sets
lower the crest factor of 1000 lines from about 3.8 to about 3.3; more sets hardly lower it further.
"""

MOST_TRIED = CANDIDATES * 1000 * USUAL_POINTS
"""Largest number of values of all tried sets; more realisations of more points try fewer sets."""

Lines = NDArray[np.int64]


def hold_droop(lines: NDArray[np.integer], points: int) -> Samples:
    """Return the gain of a hold of N = ``points`` values at harmonics k: sin(pi k/N) / (pi k/N)."""
    return np.sinc(np.asarray(lines, dtype=np.float64) / points)


def held_lines(values: Samples, spans: int) -> NDArray[np.complex128]:
    """Return complex peak amplitudes of the held waveform at harmonics 0 to ``spans`` * N/2 - 1.

    The spectrum of the sampled ``values`` repeats in frequency and is multiplied by the spectrum of the hold:
    c_m = X_(m mod N) / N * sinc(m/N) * exp(-i pi m/N); the one-sided amplitudes are 2 c_m; the mean is c_0.
    """
    points = len(values)
    harmonics = np.arange(spans * points // 2)
    sampled = np.fft.fft(values) / points
    held = sampled[harmonics % points] * hold_droop(harmonics, points)
    amplitudes = 2 * held * np.exp(-1j * np.pi * harmonics / points)
    amplitudes[0] /= 2
    return np.asarray(amplitudes)


def flat_periods(
    lines: Lines, realisations: int, seed: int, points: int = USUAL_POINTS
) -> tuple[Samples, ...]:
    """Return one period for every realisation: lines of equal amplitude with random phases.

    Every line is divided by the droop of the hold, so that the played spectrum is flat. Each realisation uses
    the best of ``CANDIDATES`` sets of phases, by crest factor. All realisations have the same rms value,
    because the level matters for a nonlinear specimen. Only the realisation with the highest peak reaches 1.

    Returns
    -------
    tuple of arrays
        ``realisations`` arrays of shape (points,), read-only; equal arguments return the same arrays.
    """
    return _flat_periods(tuple(lines.tolist()), realisations, seed, points)


# The check of limits, the preview, the run and all levels of a plan need the same waveforms.
@lru_cache(maxsize=1)
def _flat_periods(lines: tuple[int, ...], realisations: int, seed: int, points: int) -> tuple[Samples, ...]:
    excited = np.array(lines, dtype=np.int64)
    sets = max(1, min(CANDIDATES, MOST_TRIED // (realisations * points)))
    keys = ([(realisation, each) for each in range(sets)] for realisation in range(realisations))
    periods = [_smoothest(excited, each, seed, points) for each in keys]
    highest = max(float(np.max(np.abs(period))) for period in periods)
    scaled = tuple(period / highest for period in periods)
    for period in scaled:
        period.flags.writeable = False
    return scaled


def shaped_period(lines: Lines, peaks: Samples, points: int, seed: int, realisation: int) -> Samples:
    """Return one period whose lines, after the hold, have the peak amplitudes ``peaks``. Of several random
    sets of phases, the set with the lowest crest factor is used.

    Returns
    -------
    Samples
        Shape (points,), in the unit of ``peaks``.
    """
    keys = [(realisation, each) for each in range(CANDIDATES)]
    return _smoothest(lines, keys, seed, points, peaks) * (points / 2)


def _smoothest(
    lines: Lines, keys: Sequence[tuple[int, int]], seed: int, points: int, peaks: Samples | float = 1.0
) -> Samples:
    candidates = [_period(lines, seed, key, points, peaks) for key in keys]
    return min(candidates, key=lambda period: float(np.max(np.abs(period))))


def _period(lines: Lines, seed: int, key: tuple[int, ...], points: int, peaks: Samples | float) -> Samples:
    random = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
    spectrum = np.zeros(points // 2 + 1, dtype=np.complex128)
    spectrum[lines] = peaks * np.exp(2j * np.pi * random.random(len(lines))) / hold_droop(lines, points)
    return np.fft.irfft(spectrum, points)


class BandNoise(AbstractExcitation):
    """Noise in a band between two frequencies."""

    family: ClassVar[Family] = Family.NOISE
    wishes: ClassVar[tuple[str, ...]] = ("resonance_hz", "transmissibility")
    band_start_hz: FrequencyHz
    """Lower edge of the band [Hz]."""
    band_stop_hz: FrequencyHz
    """Upper edge of the band [Hz]."""

    @model_validator(mode="after")
    def _band_rises(self) -> Self:
        if self.band_stop_hz <= self.band_start_hz:
            raise ValueError(
                f"band_stop_hz = {self.band_stop_hz:g} is not above band_start_hz = {self.band_start_hz:g}; "
                "give the band from low to high"
            )
        return self

    def level_at(self, frequency_hz: float) -> RmsSetting:
        """Return the specification of the level: one amplitude setting for the whole band."""
        del frequency_hz
        return RmsSetting()

    @property
    def band_hz(self) -> tuple[float, float]:
        """The edges of the band [Hz]."""
        return self.band_start_hz, self.band_stop_hz


NEAREST_IMAGE_RATIO = 2.0
"""Lowest allowed frequency of a held waveform's first image, divided by the upper edge of the band. An
analogue low-pass filter could not remove an image nearer to the band.
"""
MOST_REALISATIONS = 1000
"""Largest number of realisations in one measurement; all are computed together to have the same rms value."""


class PeriodicNoise(BandNoise):
    """Whole periods of a multisine with equal amplitudes and random phases; one waveform per realisation."""

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.REALISATION,)
    repetition_hz: PositiveFloat = 1.0
    """Repetition rate of the waveform, equal to the spacing of its spectral lines [Hz]."""
    realisations: Annotated[int, Field(gt=0, le=MOST_REALISATIONS)] = 10
    """Number of waveforms; all waveforms have the same spectral lines, with different phases."""
    periods: PositiveInt = 2
    """Number of periods recorded per realisation; two or more allow an estimate of the sensor noise."""
    points: Annotated[int, Field(ge=FEWEST_POINTS, le=MOST_POINTS)] = USUAL_POINTS
    """Number of points of one period in the generator's memory; the memory size is checked before the run."""
    settle_s: NonNegativeFloat = 3.0
    """Waiting time after each change of waveform, for the transient to die out [s]."""
    seed: int = Field(default=1, ge=0)
    """Seed of the random phases; the same seed gives the same waveforms on any machine."""

    @property
    def lines(self) -> Lines:
        """The excited harmonics of ``repetition_hz``: all those in the band, or a choice of the plan."""
        return self.candidates

    @property
    def candidates(self) -> Lines:
        """Harmonics in the band that a plan of this kind may excite."""
        # Include a harmonic within 1e-9 of a band edge: 200 times 0.1 Hz may not be exactly 20 Hz.
        first = int(np.ceil(self.band_start_hz / self.repetition_hz * (1 - 1e-9)))
        last = int(np.floor(self.band_stop_hz / self.repetition_hz * (1 + 1e-9)))
        return np.arange(max(first, 1), last + 1, dtype=np.int64)

    @model_validator(mode="after")
    def _band_fits_the_memory(self) -> Self:
        stop_hz, repetition_hz = self.band_stop_hz, self.repetition_hz
        image_hz = self.points * repetition_hz - stop_hz
        if image_hz < NEAREST_IMAGE_RATIO * stop_hz:
            lowest_hz = (1 + NEAREST_IMAGE_RATIO) * stop_hz / self.points
            raise ValueError(
                f"repetition_hz = {repetition_hz:g} puts the first image of {stop_hz:g} Hz at {image_hz:g} "
                f"Hz, too near the band; repetition_hz must be at least {lowest_hz:.4g} with {self.points} "
                "points"
            )
        if len(self.candidates) == 0:
            raise ValueError(
                f"no harmonic of {repetition_hz:g} Hz is in the band up to {stop_hz:g} Hz; "
                "lower repetition_hz or widen the band"
            )
        return self

    @property
    def period_points(self) -> int:
        """Number of points in one period of the waveform."""
        return self.points

    @property
    def playing_s(self) -> float:
        """Duration of settling and recording of all realisations [s]."""
        return self.stretches * (self.settle_s + self.periods / self.repetition_hz)

    @property
    def stretches(self) -> int:
        """Number of noise realisations."""
        return self.realisations

    def steps(self) -> Iterator[Step]:
        """Yield one step for every noise realisation."""
        periods = flat_periods(self.lines, self.realisations, self.seed, self.points)
        for realisation, values in enumerate(periods):
            yield Step(
                play=Waveform(values, self.repetition_hz),
                settle_s=self.settle_s,
                record_s=self.periods / self.repetition_hz,
                segment=Segment(
                    SegmentLabel.REALISATION,
                    {
                        "realisation": realisation,
                        "repetition_hz": self.repetition_hz,
                        "periods": self.periods,
                        "band_start_hz": self.band_start_hz,
                        "band_stop_hz": self.band_stop_hz,
                    },
                ),
            )

    def shown_steps(self) -> Iterator[Step]:
        """Yield one step for a preview: one period of the first realisation."""
        first = next(self.steps())
        yield Step(first.play, settle_s=0.0, record_s=1 / self.repetition_hz, segment=first.segment)


class WhiteNoise(PeriodicNoise):
    """White noise between two frequencies: periods of a multisine with equal amplitudes and random phases.

    A periodic signal needs no window and has no leakage, but averaging over its periods reduces only the
    sensor noise. Every realisation therefore has new phases; averaging over realisations acts like averaging
    of noise (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["white_noise", "multisine_noise"] = "white_noise"
    """``multisine_noise``, the name of this kind in version 0.1, is read as ``white_noise``."""

    @field_validator("kind")
    @classmethod
    def _present_name(cls, _: str) -> Literal["white_noise"]:
        return "white_noise"


GROUP = 4
"""Number of adjacent odd lines in a group; one line of each group, chosen at random, is a detection line."""
DETECTION_KEY = 0x0DD
"""Key of the random numbers for the detection lines, which are independent of the random phases."""


class OddMultisine(PeriodicNoise):
    """An odd random-phase multisine with random detection lines.

    Even nonlinearities appear on the even lines, odd nonlinearities on the odd detection lines. The drive has
    no power on any of these lines (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["odd_multisine"] = "odd_multisine"
    realisations: Annotated[int, Field(gt=0, le=MOST_REALISATIONS)] = 7
    """Number of waveforms; all waveforms have the same spectral lines, with different phases."""
    excited_lines: tuple[PositiveInt, ...] = ()
    """Harmonics of ``repetition_hz`` that are excited; if empty, the seed determines a random choice."""
    detection_lines: tuple[PositiveInt, ...] = ()
    """Odd harmonics that are left out; if empty, all odd lines of the band that are not excited."""

    @model_validator(mode="after")
    def _lines_fit_the_band(self) -> Self:
        odd = [int(line) for line in self.candidates]
        left_out = self._detection_lines()
        excited = self.excited_lines or tuple(line for line in odd if line not in left_out)
        strangers = sorted(set(excited) - set(odd))
        if strangers:
            raise ValueError(
                f"excited_lines contains {strangers[0]}, which is not an odd harmonic in the band; "
                f"give odd lines from {odd[0]} to {odd[-1]}, or leave excited_lines out for a random choice"
            )
        silent = tuple(sorted(set(odd) - set(excited)))
        if self.detection_lines not in ((), silent):
            raise ValueError(
                "detection_lines must be the odd lines of the band that are not excited; "
                "leave detection_lines out to use all of these"
            )
        # Store the chosen lines in the plan, so that other programs can read the lines from the plan's file.
        object.__setattr__(self, "excited_lines", tuple(sorted(excited)))
        object.__setattr__(self, "detection_lines", silent)
        return self

    @property
    def candidates(self) -> Lines:
        """The odd harmonics of ``repetition_hz`` in the band."""
        lines = super().candidates
        return np.asarray(lines[lines % 2 == 1], dtype=np.int64)

    @property
    def lines(self) -> Lines:
        """The odd harmonics of ``repetition_hz`` that are excited."""
        return np.array(self.excited_lines, dtype=np.int64)

    def _detection_lines(self) -> set[int]:
        random = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=(DETECTION_KEY,)))
        )
        lines = self.candidates
        whole_groups = lines[: len(lines) // GROUP * GROUP].reshape(-1, GROUP)
        chosen = np.floor(random.random(len(whole_groups)) * GROUP).astype(np.int64)
        return {int(group[place]) for group, place in zip(whole_groups, chosen, strict=True)}


PREVIEW_S = 10.0
"""Duration of the preview if the noise is longer [s]."""


class StreamedNoise(BandNoise):
    """Band-limited Gaussian noise of any length, on an analogue output.

    The rms value is half the setting divided by the crest factor of 4.5. The band edges are -6 dB points.
    """

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.NOISE,)
    kind: Literal["streamed_noise"] = "streamed_noise"
    settle_s: NonNegativeFloat = 3.0
    """Waiting time before the recording, for the transient to die out [s]."""
    duration_s: PositiveFloat
    """Recording time of the noise, after settling [s]."""
    seed: int = Field(default=1, ge=0)
    """Seed; the same seed gives the same noise on any machine with the same version of numpy."""

    @property
    def source(self) -> GaussianBand:
        """The noise signal that the plan describes."""
        return GaussianBand(self.band_start_hz, self.band_stop_hz, self.seed)

    @property
    def playing_s(self) -> float:
        """Duration of settling and recording [s]."""
        return self.settle_s + self.duration_s

    def steps(self) -> Iterator[Step]:
        """Yield the only step: the whole noise."""
        band = {"band_start_hz": self.band_start_hz, "band_stop_hz": self.band_stop_hz}
        yield Step(Stream(self.source), self.settle_s, self.duration_s, Segment(SegmentLabel.NOISE, band))

    def shown_steps(self) -> Iterator[Step]:
        """Yield a step with the first ``PREVIEW_S`` seconds of the noise."""
        for step in self.steps():
            yield Step(step.play, 0.0, min(self.duration_s, PREVIEW_S), step.segment)


Decibels = Annotated[float, Field(gt=0, le=40)]


class SpectrumPoint(FrozenModel):
    """One corner of a spectrum. Between corners, the spectrum is a straight line in log-log axes."""

    frequency_hz: FrequencyHz
    density: Annotated[float, Field(ge=1e-30, le=1e10)]
    """Power spectral density at this corner, one-sided [unit squared per Hz]."""


Spectrum = Annotated[tuple[SpectrumPoint, ...], Field(min_length=1, max_length=100)]


def density_at(spectrum: Spectrum, frequency_hz: NDArray[np.floating]) -> Samples:
    """Return the spectral densities of ``spectrum`` at ``frequency_hz``; constant beyond its end corners."""
    corners_hz, densities = zip(*((each.frequency_hz, each.density) for each in spectrum), strict=True)
    return np.asarray(np.exp(np.interp(np.log(frequency_hz), np.log(corners_hz), np.log(densities))))


class HeldNoise(PeriodicNoise, AbstractFeedback):
    """Noise with a given acceleration spectrum at the base, white or shaped.

    Every realisation has new phases, as in `WhiteNoise`, and a drive computed from the gains measured so far.
    The first ``equalisations`` realisations, at levels that rise from ``start_db``, give no results.
    ``amplitude_vpp`` is the largest setting that may be used. The limits of the bench are checked before the
    run, for flat noise at this setting.
    """

    family: ClassVar[Family] = Family.NOISE
    kind: Literal["held_noise"] = "held_noise"
    spectrum: Spectrum
    """Power spectral density of the base acceleration at the spectrum's corners [(m/s2)2/Hz]."""
    tolerance_db: Decibels = 3.0
    """Allowed deviation of the measured power spectral density from ``spectrum`` [dB]."""
    abort_db: Decibels = 6.0
    """Excess of the measured power spectral density over ``spectrum`` at which the run ends [dB]."""
    response_limits: tuple[SpectrumPoint, ...] = ()
    """Largest allowed power spectral density of m0's velocity, given at corners [(m/s)2/Hz]. The base
    spectrum is lowered (notched) where m0 would exceed this limit; if empty, there is no limit."""
    resolution_hz: PositiveFloat = 4.0
    """Bandwidth over which spectral densities and gains are averaged [Hz]."""
    equalisations: int = Field(default=4, ge=1, le=100)
    """Number of realisations that only equalise the drive, before the first realisation with results."""
    start_db: float = Field(default=-12.0, ge=-60, le=0)
    """Level of the first equalisation relative to ``spectrum`` [dB]."""

    @model_validator(mode="after")
    def _corners_rise(self) -> Self:
        for name, corners in (("spectrum", self.spectrum), ("response_limits", self.response_limits)):
            places = [each.frequency_hz for each in corners]
            if places != sorted(set(places)):
                raise ValueError(f"{name} has corners at {places} Hz; list each once, from low to high")
        if self.abort_db <= self.tolerance_db:
            raise ValueError(
                f"abort_db = {self.abort_db:g} must be above tolerance_db = {self.tolerance_db:g}; raise it"
            )
        return self

    @property
    def density(self) -> Samples:
        """Requested power spectral density at each spectral line [(m/s2)2/Hz]."""
        return density_at(self.spectrum, self.lines * self.repetition_hz)

    @property
    def rms_m_per_s2(self) -> float:
        """Rms base acceleration of all spectral lines of the band [m/s2]."""
        return float(np.sqrt(np.sum(self.density) * self.repetition_hz))

    @property
    def level_text(self) -> str:
        """Display text for the held rms level and the largest amplitude setting."""
        return f"base held at {self.rms_m_per_s2:.3g} m/s² rms, at most {self.amplitude_vpp:g} Vpp"

    @property
    def stretches(self) -> int:
        """Number of noise realisations, including those for equalisation."""
        return self.equalisations + self.realisations
