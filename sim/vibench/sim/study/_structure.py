"""What all specimens of a study share: masses, springs and the stiffness of the sphere on its stops."""

import math

from pydantic import BaseModel, ConfigDict

from ..model import (
    ALUMINIUM,
    PAPER_FREQUENCIES_HZ,
    PAPER_MASSES,
    PAPER_RADIUS_M,
    STEEL,
    Hertz,
    Specimen,
    Triple,
    hertz_stiffness,
    model_named,
)


class Structure(BaseModel):
    """The paper's specimen where nothing else is said (Gong et al. 2025, section 2)."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)

    masses_kg: Triple = PAPER_MASSES
    """m0, m1, m2."""
    single_frequencies_hz: Triple = PAPER_FREQUENCIES_HZ
    """f0, f1, f2 of the single oscillators: k_i = m_i (2 pi f_i)^2."""
    hertz_stiffness: float = hertz_stiffness(STEEL, ALUMINIUM, PAPER_RADIUS_M)
    """k of F = k d^(3/2) at a stop [N/m^1.5]; what other models are fitted to."""

    def specimen(self, model: str, damping_time_s: float, gap_m: float) -> Specimen:
        """Build one specimen; raises ValueError in one sentence when a number or the model is not allowed."""
        stiffnesses = tuple(
            m * (2.0 * math.pi * f) ** 2
            for m, f in zip(self.masses_kg, self.single_frequencies_hz, strict=True)
        )
        k0, k1, k2 = stiffnesses
        return Specimen(
            masses=self.masses_kg,
            stiffnesses=(k0, k1, k2),
            dampings=(damping_time_s * k0, damping_time_s * k1, damping_time_s * k2),
            gap_m=gap_m,
            contact=model_named(model, Hertz(self.hertz_stiffness), gap_m),
        )
