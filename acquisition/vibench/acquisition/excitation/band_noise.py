"""What all noise shares: a band between two frequencies."""

from typing import ClassVar, Self

from pydantic import model_validator

from .plan import AbstractExcitation, Family, FrequencyHz
from .steps import RmsSetting


class BandNoise(AbstractExcitation):
    """Noise between two frequencies."""

    family: ClassVar[Family] = Family.NOISE
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
        """Give the setting of the whole band."""
        del frequency_hz
        return RmsSetting()

    @property
    def band_hz(self) -> tuple[float, float]:
        """The edges of the band [Hz]."""
        return self.band_start_hz, self.band_stop_hz
