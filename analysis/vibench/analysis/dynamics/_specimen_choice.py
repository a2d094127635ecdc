"""Which specimen a question is about: the one place where its options become one."""

from typing import Annotated

from pydantic import Field, PositiveFloat, model_validator

from vibench.acquisition import FrozenModel
from vibench.sim import Specimen, gong2025


class SpecimenChoice(FrozenModel):
    """The paper's specimen with another contact, damping or gap."""

    model: str = "hertz"
    """Contact: hertz, linear, linear_gap, hunt_crossley:0.1, rigid:0.8, power:5, power:3+5+7, ..."""
    damping_time_s: Annotated[float, Field(ge=0.0)] = 2e-5
    """Damping over stiffness of every link: c = damping time times k."""
    gap_m: PositiveFloat = 45e-6
    """Clearance at both stops."""

    @model_validator(mode="after")
    def _is_a_specimen(self) -> "SpecimenChoice":
        """Refuse here, in its own words, a model that nobody knows."""
        self.specimen  # noqa: B018 - making it is the check
        return self

    @property
    def specimen(self) -> Specimen:
        """What is shaken."""
        return gong2025(self.damping_time_s, self.gap_m, self.model)

    @property
    def damping_sum_per_s(self) -> float:
        """Rate at which the dampers alone shrink volumes of states: -tr(M^-1 C)."""
        found = self.specimen
        damping, mass = found.damping_matrix.diagonal(), found.mass_matrix.diagonal()
        return -float((damping / mass).sum())
