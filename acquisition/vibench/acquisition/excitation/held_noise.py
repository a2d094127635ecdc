"""Noise with a given spectrum of the base: equalised from the measured response, average by average."""

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat, model_validator

from ..host.toml_file import FrozenModel
from .feedback import BaseLevel
from .multisine import Lines
from .periodic_noise import PeriodicNoise
from .plan import AbstractFeedback, Family, FrequencyHz
from .steps import Samples

Decibels = Annotated[float, Field(gt=0, le=40)]


class SpectrumPoint(FrozenModel):
    """One corner of a spectrum; between corners it is a straight line over the logarithms of both."""

    frequency_hz: FrequencyHz
    density: Annotated[float, Field(ge=1e-30, le=1e10)]
    """Power spectral density, one-sided [unit squared per Hz]."""


Spectrum = Annotated[tuple[SpectrumPoint, ...], Field(min_length=1, max_length=100)]


def density_at(spectrum: Spectrum, frequency_hz: NDArray[np.floating]) -> Samples:
    """Return the densities of a spectrum; constant beyond its first and last corner."""
    corners_hz, densities = zip(*((each.frequency_hz, each.density) for each in spectrum), strict=True)
    return np.asarray(np.exp(np.interp(np.log(frequency_hz), np.log(corners_hz), np.log(densities))))


class HeldNoise(PeriodicNoise, AbstractFeedback):
    """Noise with a given acceleration spectrum at the base, white or shaped.

    Every realisation has its own phases, like those of `WhiteNoise`, and a drive computed from the gains
    measured before. The first ``equalisations`` of them, at levels that rise from ``start_db``, give no
    results. ``amplitude_vpp`` is the largest setting that may be used; limits of the bench are checked
    beforehand for flat noise at that setting.
    """

    family: ClassVar[Family] = Family.NOISE
    kind: Literal["held_noise"] = "held_noise"
    spectrum: Spectrum
    """Density of the base's acceleration [(m/s2)2/Hz], corner by corner."""
    tolerance_db: Decibels = 3.0
    """Allowed deviation of the measured density."""
    abort_db: Decibels = 6.0
    """Deviation above the spectrum that ends the run."""
    response_limits: tuple[SpectrumPoint, ...] = ()
    """Largest density of the velocity of m0 [(m/s)2/Hz]: the base is lowered (notched) where it would be
    exceeded; corner by corner; absent: no limit."""
    resolution_hz: PositiveFloat = 4.0
    """Bandwidth over which densities and gains are averaged [Hz]."""
    equalisations: int = Field(default=4, ge=1, le=100)
    """Realisations for equalisation, before the first that gives results."""
    start_db: float = Field(default=-12.0, ge=-60, le=0)
    """Level of the first equalisation, relative to the spectrum."""

    @model_validator(mode="after")
    def _corners_rise(self) -> Self:
        for name, corners in (("spectrum", self.spectrum), ("response_limits", self.response_limits)):
            places = [each.frequency_hz for each in corners]
            if places != sorted(set(places)):
                raise ValueError(f"{name} has corners at {places} Hz; give them rising, each once")
        if self.abort_db <= self.tolerance_db:
            raise ValueError(
                f"abort_db = {self.abort_db:g} is not above tolerance_db = {self.tolerance_db:g}; raise it"
            )
        return self

    @property
    def lines(self) -> Lines:
        """All harmonics of ``repetition_hz`` in the band."""
        return self.candidates

    @property
    def density(self) -> Samples:
        """The spectrum at each of the lines [(m/s2)2/Hz]."""
        return density_at(self.spectrum, self.lines * self.repetition_hz)

    @property
    def rms_m_per_s2(self) -> float:
        """Rms acceleration of the spectrum over the lines of the band."""
        return float(np.sqrt(np.sum(self.density) * self.repetition_hz))

    @property
    def held_levels(self) -> tuple[BaseLevel, ...]:
        """Empty: feedback holds a spectrum, not the level of a sine."""
        return ()

    @property
    def level_text(self) -> str:
        """The level, and the largest setting."""
        return f"base held at {self.rms_m_per_s2:.3g} m/s² rms, at most {self.amplitude_vpp:g} Vpp"

    @property
    def stretches(self) -> int:
        """One for every realisation, including those that equalise."""
        return self.equalisations + self.realisations

    @property
    def playing_s(self) -> float:
        """Settling and recording of all realisations, including those that equalise [s]."""
        return self.stretches * (self.settle_s + self.periods / self.repetition_hz)
