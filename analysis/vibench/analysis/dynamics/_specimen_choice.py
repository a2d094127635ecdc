"""Which specimen a question is about: the one place where its options become one."""

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


def _at(field: str, error: ValueError) -> ValidationError:
    """Return the error of one field, so that a form shows it there."""
    said = PydanticCustomError("value_error", "{said}", {"said": str(error)})
    return ValidationError.from_exception_data(field, [{"type": said, "loc": (field,), "input": None}])


class SpecimenChoice(FrozenModel):
    """A described specimen, with another contact, damping or gap where one is given."""

    specimen: Annotated[str, ChosenFrom(shipped_specimens)] = USUAL_SPECIMEN
    """gong2025, heavy, asymmetric, hardening, rigid_stops, linear_gap, two_masses (`vibench specimen`
    describes each), or the path of a specimen's file."""
    model: ContactWord = ""
    """Contact law: hertz, linear, linear_gap, hunt_crossley:0.1, rigid:0.8, power:5, power:3+5+7, ...
    (`vibench specimen` describes each); the specimen's own if not given."""
    damping_time_s: DampingTime | None = None
    """Damping over stiffness of every link, c_i = damping time * k_i; the specimen's own if not given."""
    gap_m: PositiveFloat | None = None
    """Clearance at both stops; the specimen's own if not given."""
    described: SpecimenTable | None = None
    """What the specimen is, number by number: read from its file when absent, so that an answer holds it."""

    @model_validator(mode="after")
    def _is_a_specimen(self) -> Self:
        """Read the description, and refuse here, in its own words, what cannot be built of it."""
        found = self.described
        if found is None:
            try:
                found = SpecimenTable.model_validate(load_specimen(self.specimen).model_dump())
            except ValueError as error:
                raise _at("specimen", error) from error
            object.__setattr__(self, "described", found)
        else:
            object.__setattr__(self, "specimen", found.name)
        try:
            self.shaken  # noqa: B018 - making it is the check
        except ValueError as error:
            # With its own law it fails in the same way, unless the law is at fault.
            self.specimen_under(found.contact)
            raise _at("model", error) from error
        return self

    @property
    def shaken(self) -> Specimen:
        """What is shaken."""
        return self.specimen_under(self.law)

    def specimen_under(self, model: str) -> Specimen:
        """Build the same with another contact law."""
        assert self.described is not None, "validation fills it"
        return self.described.specimen(model, self.damping_time_s, self.gap_m)

    @property
    def law(self) -> str:
        """Word of the contact."""
        assert self.described is not None, "validation fills it"
        return self.model.strip() or self.described.contact

    @property
    def specimen_text(self) -> str:
        """The specimen and what of it is replaced, for a caption."""
        said = [f"specimen {Path(self.specimen).stem}, contact {self.law}"]
        if self.gap_m is not None:
            said.append(f"gap {1e6 * self.gap_m:g} µm")
        if self.damping_time_s is not None:
            said.append(f"damping time {self.damping_time_s:g} s")
        return ", ".join(said)

    @property
    def damping_sum_per_s(self) -> float:
        """Rate at which the dampers alone shrink volumes of states: -tr(M^-1 C)."""
        found = self.shaken
        damping, mass = found.damping_matrix.diagonal(), found.mass_matrix.diagonal()
        return -float((damping / mass).sum())
