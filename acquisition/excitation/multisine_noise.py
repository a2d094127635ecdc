"""Band-limited white noise out of the generator's memory: a random-phase multisine, new for every average."""

from collections.abc import Iterator
from typing import Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from .multisine import Lines, band_lines, flat_periods, require_playable
from .plan import AbstractExcitation, FrequencyHz
from .preview import Preview, preview_of
from .steps import Segment, Step, Waveform


class MultisineNoise(AbstractExcitation):
    """White noise between two frequencies, as whole periods of flat lines with random phases.

    A periodic signal needs no window and has no leakage, but averaging its periods averages the
    sensors' noise only. Every realisation therefore has its own phases: it is the average over
    realisations that stands for noise (Pintelon and Schoukens, System Identification, 2nd ed.,
    section 4.3).
    """

    kind: Literal["multisine_noise"] = "multisine_noise"
    band_start_hz: FrequencyHz
    """Lowest line [Hz]."""
    band_stop_hz: FrequencyHz
    """Highest line [Hz]."""
    repetition_hz: PositiveFloat = 1.0
    """Periods per second, and the distance of the lines [Hz]."""
    realisations: PositiveInt = 10
    """Waveforms with phases of their own."""
    periods: PositiveInt = 2
    """Periods recorded of each realisation; two or more show the noise of the sensors."""
    settle_s: NonNegativeFloat = 3.0
    """Wait after each change of waveform until the transient has died out [s]."""
    seed: int = Field(default=1, ge=0)
    """The same seed gives the same waveforms, on any machine."""

    @model_validator(mode="after")
    def _band_fits_the_memory(self) -> Self:
        if self.band_stop_hz <= self.band_start_hz:
            raise ValueError(
                f"band_stop_hz = {self.band_stop_hz:g} is not above band_start_hz = {self.band_start_hz:g}; "
                "give the band from low to high"
            )
        require_playable(self.lines, self.band_stop_hz, self.repetition_hz)
        return self

    @property
    def lines(self) -> Lines:
        """The excited harmonics of ``repetition_hz``."""
        return band_lines(self.band_start_hz, self.band_stop_hz, self.repetition_hz)

    @property
    def highest_frequency_hz(self) -> float:
        """The highest line [Hz]."""
        return self.band_stop_hz

    @property
    def playing_s(self) -> float:
        """Settling and recording of all realisations [s]."""
        return self.realisations * (self.settle_s + self.periods / self.repetition_hz)

    def steps(self) -> Iterator[Step]:
        """Yield one step for every realisation."""
        waveforms = flat_periods(self.lines, self.realisations, self.seed)
        for realisation, values in enumerate(waveforms):
            yield Step(
                play=Waveform(values, self.repetition_hz),
                settle_s=self.settle_s,
                record_s=self.periods / self.repetition_hz,
                segment=Segment(
                    "realisation",
                    {
                        "realisation": realisation,
                        "repetition_hz": self.repetition_hz,
                        "periods": self.periods,
                        "band_start_hz": self.band_start_hz,
                        "band_stop_hz": self.band_stop_hz,
                    },
                ),
            )

    def preview(self, sample_rate_hz: float) -> Preview:
        """Show one period of the first realisation."""
        first = next(self.steps())
        period = Step(first.play, settle_s=0.0, record_s=1 / self.repetition_hz, segment=first.segment)
        return preview_of(
            [period], self.amplitude_vpp, sample_rate_hz, self.highest_frequency_hz, self.playing_s
        )
