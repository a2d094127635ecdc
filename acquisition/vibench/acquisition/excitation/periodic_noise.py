"""Periodic noise from the generator's memory: equal spectral lines in a band, new phases per realisation."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from ..recording import SegmentLabel
from .multisine import FEWEST_POINTS, MOST_POINTS, USUAL_POINTS, Lines, flat_periods
from .plan import AbstractExcitation, Family, FrequencyHz
from .steps import RmsSetting, Segment, Step, Waveform


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
"""Lowest allowed frequency of a held waveform's first image, divided by the upper edge of the band.
A nearer image could not be removed by an analogue low-pass filter.
"""
MOST_REALISATIONS = 1000
"""Largest number of realisations in one measurement; all are computed together for a common rms value."""


class PeriodicNoise(BandNoise):
    """Whole periods of a multisine with equal amplitudes and random phases; one waveform per realisation."""

    result_labels: ClassVar[tuple[SegmentLabel, ...]] = (SegmentLabel.REALISATION,)
    repetition_hz: PositiveFloat = 1.0
    """Repetition rate of the waveform, equal to the spacing of its spectral lines [Hz]."""
    realisations: Annotated[int, Field(gt=0, le=MOST_REALISATIONS)] = 10
    """Number of waveforms; all have the same spectral lines, each with different phases."""
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
        """The excited harmonics of ``repetition_hz``: all in the band, or a choice made by the plan."""
        return self.candidates

    @property
    def candidates(self) -> Lines:
        """Harmonics in the band that a plan of this kind may excite."""
        # A harmonic within 1e-9 of an edge belongs to the band: 200 times 0.1 Hz may not be exactly 20 Hz.
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
