"""A multisine that shows where nonlinearity goes: odd lines only, and some of them left out on purpose."""

from collections.abc import Iterator
from typing import Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from .multisine import Lines, band_lines, flat_periods, require_playable
from .plan import AbstractExcitation, FrequencyHz
from .preview import Preview, preview_of
from .steps import Segment, Step, Waveform

GROUP = 4
"""Of every four odd lines one, chosen at random, is left out as a detection line."""
DETECTION_KEY = 0x0DD
"""Keeps the choice of detection lines independent of the phases, which use the same seed."""


class OddMultisine(AbstractExcitation):
    """An odd random-phase multisine with random detection lines.

    Even nonlinearity answers on even lines, odd nonlinearity on the odd lines that were left out;
    both are empty in the drive (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["odd_multisine"] = "odd_multisine"
    band_start_hz: FrequencyHz
    """Lowest frequency of the band [Hz]."""
    band_stop_hz: FrequencyHz
    """Highest frequency of the band [Hz]."""
    repetition_hz: PositiveFloat = 1.0
    """Periods per second; the odd lines lie twice as far apart [Hz]."""
    realisations: PositiveInt = 7
    """Waveforms with phases of their own, all on the same lines."""
    periods: PositiveInt = 2
    """Periods recorded of each realisation."""
    settle_s: NonNegativeFloat = 3.0
    """Wait after each change of waveform until the transient has died out [s]."""
    seed: int = Field(default=1, ge=0)
    """The same seed gives the same lines and waveforms, on any machine."""
    excited_lines: tuple[PositiveInt, ...] = ()
    """Harmonics of ``repetition_hz`` that are played; left empty, they are drawn from the seed."""
    detection_lines: tuple[PositiveInt, ...] = ()
    """Odd harmonics left out; left empty, all odd lines of the band that are not played."""

    @model_validator(mode="after")
    def _lines_fit_the_band(self) -> Self:
        if self.band_stop_hz <= self.band_start_hz:
            raise ValueError(
                f"band_stop_hz = {self.band_stop_hz:g} is not above band_start_hz = {self.band_start_hz:g}; "
                "give the band from low to high"
            )
        require_playable(self._odd_lines, self.band_stop_hz, self.repetition_hz)
        odd = [int(line) for line in self._odd_lines]
        excited = self.excited_lines or tuple(line for line in odd if line not in self._drawn())
        strangers = sorted(set(excited) - set(odd))
        if strangers:
            raise ValueError(
                f"excited_lines has {strangers[0]}, which is not an odd harmonic in the band; "
                f"odd lines from {odd[0]} to {odd[-1]} are allowed, or none at all to have them drawn"
            )
        silent = tuple(sorted(set(odd) - set(excited)))
        if self.detection_lines not in ((), silent):
            raise ValueError(
                "detection_lines must be the odd lines of the band that are not excited; "
                "leave them out to have them filled in"
            )
        # The drawn lines are part of the plan, so that its file says them without our code.
        object.__setattr__(self, "excited_lines", tuple(sorted(excited)))
        object.__setattr__(self, "detection_lines", silent)
        return self

    @property
    def _odd_lines(self) -> Lines:
        lines = band_lines(self.band_start_hz, self.band_stop_hz, self.repetition_hz)
        return np.asarray(lines[lines % 2 == 1], dtype=np.int64)

    def _drawn(self) -> set[int]:
        random = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=(DETECTION_KEY,)))
        )
        lines = self._odd_lines
        whole_groups = lines[: len(lines) // GROUP * GROUP].reshape(-1, GROUP)
        chosen = np.floor(random.random(len(whole_groups)) * GROUP).astype(np.int64)
        return {int(group[place]) for group, place in zip(whole_groups, chosen, strict=True)}

    @property
    def highest_frequency_hz(self) -> float:
        """The upper edge of the band [Hz]."""
        return self.band_stop_hz

    @property
    def playing_s(self) -> float:
        """Settling and recording of all realisations [s]."""
        return self.realisations * (self.settle_s + self.periods / self.repetition_hz)

    def steps(self) -> Iterator[Step]:
        """Yield one step for every realisation."""
        lines = np.array(self.excited_lines, dtype=np.int64)
        for realisation, values in enumerate(flat_periods(lines, self.realisations, self.seed)):
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
