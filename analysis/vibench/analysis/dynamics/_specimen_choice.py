"""Options that select a specimen."""

from pathlib import Path
from typing import Annotated, Self

from pydantic import PositiveFloat, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from vibench.acquisition import ChosenFrom
from vibench.sim import (
    CONTACT_LAWS,
    USUAL_SPECIMEN,
    DampingTime,
    FrozenModel,
    Specimen,
    SpecimenTable,
    load_specimen,
    shipped_specimens,
)

ContactWord = Annotated[str, ChosenFrom(lambda: ["", *(law.example for law in CONTACT_LAWS.values())])]


def _field_error(field: str, error: ValueError) -> ValidationError:
    """Return a validation error located at one field, so that a form shows it beside the field."""
    kind = PydanticCustomError("value_error", "{said}", {"said": str(error)})
    return ValidationError.from_exception_data(field, [{"type": kind, "loc": (field,), "input": None}])


class SpecimenChoice(FrozenModel):
    """A specimen, optionally with another contact, damping or gap."""

    specimen: Annotated[str, ChosenFrom(shipped_specimens)] = USUAL_SPECIMEN
    """gong2025, heavy, asymmetric, hardening, rigid_stops, linear_gap, two_masses (`vibench specimen`
    describes each), or the path of a specimen's file."""
    model: ContactWord = ""
    """Contact law: hertz, linear, linear_gap, hunt_crossley:0.1, rigid:0.8, power:5, power:3+5+7, ...
    (`vibench specimen` describes each); the specimen's own if not given."""
    damping_time_s: DampingTime | None = None
    """Ratio of damping to stiffness of every link, c_i / k_i; the specimen's own values if not given."""
    gap_m: PositiveFloat | None = None
    """Clearance at both stops; the specimen's own if not given."""
    described: SpecimenTable | None = None
    """All values of the specimen, stored with the result; read from the specimen's file by default."""

    @model_validator(mode="after")
    def _is_a_specimen(self) -> Self:
        """Read the specimen's description; report an invalid specimen at the field that causes the error."""
        found = self.described
        if found is None:
            try:
                found = SpecimenTable.model_validate(load_specimen(self.specimen).model_dump())
            except ValueError as error:
                raise _field_error("specimen", error) from error
            object.__setattr__(self, "described", found)
        else:
            object.__setattr__(self, "specimen", found.name)
        try:
            self.chosen_specimen  # noqa: B018 - making it is the check
        except ValueError as error:
            # If the specimen's own law also fails, that error is raised: the chosen law is not the cause.
            self.specimen_under(found.contact)
            raise _field_error("model", error) from error
        return self

    @property
    def chosen_specimen(self) -> Specimen:
        """The specimen with the chosen contact law, damping and gap."""
        return self.specimen_under(self.law)

    def specimen_under(self, model: str) -> Specimen:
        """Build the specimen with another contact law."""
        assert self.described is not None, "validation fills it"
        return self.described.specimen(model, self.damping_time_s, self.gap_m)

    @property
    def law(self) -> str:
        """Name of the contact law."""
        assert self.described is not None, "validation fills it"
        return self.model.strip() or self.described.contact

    @property
    def specimen_text(self) -> str:
        """Text for a caption: the specimen, its contact law, and its changed values."""
        parts = [f"specimen {Path(self.specimen).stem}, contact {self.law}"]
        if self.gap_m is not None:
            parts.append(f"gap {1e6 * self.gap_m:g} µm")
        if self.damping_time_s is not None:
            parts.append(f"damping time {self.damping_time_s:g} s")
        return ", ".join(parts)

    @property
    def damping_sum_per_s(self) -> float:
        """Rate at which the dampers contract phase-space volume: -tr(M^-1 C)."""
        found = self.chosen_specimen
        damping, mass = found.damping_matrix.diagonal(), found.mass_matrix.diagonal()
        return -float((damping / mass).sum())
