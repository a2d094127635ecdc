"""The table under the specimen: whether it weighs what the bench says, from voltage to base."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition import open_recording
from vibench.sim import Specimen

from ..frequency_response.noise_response import NoiseAnalysis
from ..model.driven_rig import described_shaker
from ..model.shaker_fit import fitted_shaker
from ..tables import plus_minus
from .suspects import Assumption, Suspect

_SURELY = 3.3
"""Standard deviations that one right description in a thousand exceeds."""
_LEAST_RELATIVE_SD = 2e-3
"""What coil, filters and held samples leave in a table that is right."""


@dataclass(frozen=True)
class TableFit:
    """The moving mass without the specimen, fitted and described."""

    mass_kg: float
    sd_kg: float
    described_kg: float
    reduced_chi_square: float

    @property
    def z(self) -> float:
        """How far the described mass lies from the fitted one, in standard deviations."""
        return float(np.log(self.mass_kg / self.described_kg) * self.mass_kg / self.sd_kg)

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """What would have to be otherwise; empty where the description holds."""
        if abs(self.z) <= _SURELY:
            return ()
        ratio = self.mass_kg / self.described_kg
        sentence = (
            f"a moving table of {1e3 * self.mass_kg:.4g} g instead of {1e3 * self.described_kg:.4g} "
            f"({100 * (ratio - 1):+.3g} %), or all three masses of the specimen "
            f"{100 * (1 / ratio - 1):+.3g} % at once (motion tells ratios of masses only)"
        )
        return (Suspect(Assumption.TABLE_MASS, sentence, self.reduced_chi_square, mends=True, behind=0.0),)

    @property
    def sentence(self) -> str:
        """The mass with two standard deviations, and what the bench says."""
        mass = plus_minus(1e3 * self.mass_kg, 2e3 * self.sd_kg)
        return (
            f"Fitted mass of the moving table = ({mass}) g; the bench says {1e3 * self.described_kg:.4g} g."
        )


def fitted_table(analysis: NoiseAnalysis, specimen: Specimen) -> TableFit | None:
    """Fit the shaker to weak noise, and hold its mass against the bench's; None where no shaker is described.

    The table's mass shows in how the specimen's resonances pull at the base; the coil's numbers go along.
    Raises UnusableData when no shaker explains how the base follows the voltage.
    """
    with open_recording(analysis.facts.path) as recording:
        described = described_shaker(recording)
        if described is None:
            return None
        found = fitted_shaker(recording, analysis, specimen, described)
    mass = found.shaker.moving_mass_kg
    relative = float(np.hypot(found.relative_sd["moving_mass_kg"], _LEAST_RELATIVE_SD))
    return TableFit(mass, relative * mass, described.moving_mass_kg, found.chi2)
