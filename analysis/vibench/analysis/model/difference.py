"""How far a measurement lies from its simulation: in dB, and in standard errors of both."""

from dataclasses import dataclass

import numpy as np

from ..signals.arrays import Flags, Reals
from ..tables import Labelled

_PER_NEPER_DB = 20 / np.log(10)


@dataclass(frozen=True)
class CurveDifference(Labelled):
    """Measured over simulated magnitude; arrays of shape (points,)."""

    frequency_hz: Reals
    decibel: Reals
    standard_errors: Reals
    """ln(measured / simulated) over the standard deviation of both; infinite where neither has any."""

    def where(self, kept: Flags) -> "CurveDifference":
        """Keep some of the points."""
        return CurveDifference(self.frequency_hz[kept], self.decibel[kept], self.standard_errors[kept])

    @property
    def median_abs_db(self) -> float:
        """Half of the points differ by less."""
        return float(np.nanmedian(np.abs(self.decibel)))

    @property
    def rms_db(self) -> float:
        """Root mean square of the difference."""
        return float(np.sqrt(np.nanmean(self.decibel**2)))

    @property
    def share_within_two(self) -> float:
        """Part of the points within two standard errors; 0.95 when nothing but the stated scatter differs."""
        known = self.standard_errors[~np.isnan(self.standard_errors)]
        return float(np.mean(np.abs(known) <= 2)) if known.size else np.nan


def logarithmic_difference(
    frequency_hz: Reals, measured: tuple[Reals, Reals], simulated: tuple[Reals, Reals]
) -> CurveDifference:
    """Compare magnitudes; each pair is (magnitude, relative standard deviation)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        nepers = np.log(measured[0] / simulated[0])
        spread = np.hypot(measured[1], simulated[1])
        return CurveDifference(frequency_hz, _PER_NEPER_DB * nepers, np.asarray(nepers / spread))
