"""Noise with a given acceleration spectrum at the base; the drive is equalised after every realisation."""

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat, model_validator

from ..host.toml_file import FrozenModel
from ..instruments import Samples
from .periodic_noise import PeriodicNoise
from .plan import AbstractFeedback, Family, FrequencyHz

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
    ``amplitude_vpp`` is the largest setting that may be used. Limits of the bench are checked beforehand,
    for flat noise at that setting.
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
    spectrum is lowered (notched) where m0 would exceed it; if empty, there is no limit."""
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
