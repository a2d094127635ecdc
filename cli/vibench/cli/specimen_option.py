"""Which specimen a command is about, and what of it is replaced: options that several commands share."""

from typing import Annotated, TypeVar

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import SpecimenTable, UnknownSpecimenError, load_specimen, usual_specimen
from vibench.sim.study import plausibility_warnings

from .options import RequestOptions, option
from .output import print_warnings

SPECIMEN = ("specimen", "model", "damping_time_s", "gap_m")
"""Fields of a request about a specimen that every command has as options."""
AXES = {"models": "model", "gaps_m": "gap_m", "damping_times_s": "damping_time_s"}
"""Axes of one value that a study has in place of what replaces a part of the specimen."""
SpecimenOption = Annotated[
    str | None, option("A specimen's file, or a name that `vibench specimen` lists.", "NAME|FILE.toml")
]
Choice = TypeVar("Choice", bound=SpecimenChoice)


def read_specimen(specimen: str | None) -> SpecimenTable:
    """Read the specimen that an option names, the paper's where it names none.

    Raises InvalidRequest when there is none, or when the file does not describe one.
    """
    if specimen is None:
        return usual_specimen()
    try:
        return SpecimenTable.model_validate(load_specimen(specimen).model_dump())
    except UnknownSpecimenError as error:
        raise InvalidRequest(str(error)) from error


def specimen_request(
    options: RequestOptions[Choice], specimen: str | None, amplitude: str | None, **others: object
) -> Choice:
    """Make a request about a specimen; warn of amplitudes and gaps that look like a slip.

    ``amplitude`` is what was typed, read before. Raises InvalidRequest with the option that is not allowed.
    """
    request = options.request(described=read_specimen(specimen), **others)
    ends_m = () if amplitude is None else map(float, amplitude.split(":")[:2])
    print_warnings(plausibility_warnings(ends_m, request.shaken.gaps_m))
    return request
