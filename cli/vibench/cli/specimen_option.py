"""Which specimen a command is about, and what of it is replaced: options that several commands share."""

import re
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import ValidationError

from vibench.analysis import InvalidRequest
from vibench.sim import (
    CONTACT_LAWS,
    SpecimenTable,
    UnknownSpecimenError,
    load_specimen,
    shipped_specimens,
    usual_specimen,
)
from vibench.sim.study import plausibility_warnings

from .options import option
from .output import print_warnings

if TYPE_CHECKING:
    from vibench.analysis.dynamics import SpecimenChoice

SPECIMENS_HELP = "A specimen's file, or one of these: " + "; ".join(
    f"{name} ({each.about})" for name, each in shipped_specimens().items()
)
LAWS_HELP = "Contact law instead of the specimen's own: " + "; ".join(
    f"{law.form} ({law.about})" for law in CONTACT_LAWS.values()
)
SpecimenOption = Annotated[str | None, option(SPECIMENS_HELP, "NAME|FILE.toml", name="--specimen")]
LawOption = Annotated[str | None, option(LAWS_HELP, name="--model")]
DampingTime = Annotated[float | None, option("c_i = damping time * k_i.", "S", name="--damping-time")]
Gap = Annotated[float | None, option("Clearance at both stops.", "M", name="--gap")]
Asked = TypeVar("Asked", bound="SpecimenChoice")
_UNIT = re.compile("_(s|m|hz)$")
_OTHER_NAMES = {"lengths": "cells", "described": "specimen"}
"""Options that are not called as their field."""


def described(specimen: str | None) -> SpecimenTable:
    """Read the specimen that an option names, the paper's where it names none.

    Raises InvalidRequest when there is none, or when the file does not describe one.
    """
    if specimen is None:
        return usual_specimen()
    try:
        return SpecimenTable.model_validate(load_specimen(specimen).model_dump())
    except UnknownSpecimenError as error:
        raise InvalidRequest(str(error)) from error


def given_options(**options: object) -> dict[str, object]:
    """Keep what was typed, each as an axis of one value; what was not is left to the specimen."""
    return {name: (value,) for name, value in options.items() if value is not None}


def option_of(field: int | str = "", *_: int | str) -> str:
    """Name the option that a field of a question was typed as: ``duration_s`` is ``--duration``."""
    name = str(field)
    return f"--{_OTHER_NAMES.get(name, _UNIT.sub('', name).replace('_', '-'))}" if name else ""


def asked_of_specimen(
    kind: type[Asked],
    specimen: str | None,
    model: str | None,
    damping_time: float | None,
    gap: float | None,
    amplitude: str | None,
    **options: Any,
) -> Asked:
    """Make a question about a specimen, or say in one sentence which option is not allowed.

    Warns of amplitudes and gaps that look like a slip; ``amplitude`` is what was typed, read before.

    Raises InvalidRequest with what was given.
    """
    replaced = {"model": model, "damping_time_s": damping_time, "gap_m": gap}
    given = {name: value for name, value in replaced.items() if value is not None}
    try:
        made = kind.model_validate({"described": described(specimen), **given, **options})
    except ValidationError as error:
        first = error.errors()[0]
        said = first["msg"].removeprefix("Value error, ")
        place = option_of(*first["loc"])
        raise InvalidRequest(f"{place} was given as {first['input']!r}: {said}" if place else said) from error
    ends_m = () if amplitude is None else map(float, amplitude.split(":")[:2])
    print_warnings(plausibility_warnings(ends_m, made.shaken.gaps_m))
    return made
