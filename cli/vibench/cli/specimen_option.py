"""Options of several commands: the specimen, and parameters that replace its values."""

from pathlib import Path
from typing import Annotated, TypeVar

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import SpecimenTable, UnknownSpecimenError, load_specimen, usual_specimen
from vibench.sim.study import plausibility_warnings

from .options import RequestOptions, option
from .output import print_warnings

SPECIMEN = ("specimen", "model", "damping_time_s", "gap_m")
"""Fields that are options of every command with a specimen."""
AXES = {"models": "model", "gaps_m": "gap_m", "damping_times_s": "damping_time_s"}
"""Study axes with a single value in these commands, each with the field of `SpecimenChoice` for it."""
SpecimenOption = Annotated[
    str | None, option("Specimen file, or a name listed by `vibench specimen`.", "NAME|FILE.toml")
]
Choice = TypeVar("Choice", bound=SpecimenChoice)


def read_specimen(specimen: str | None) -> SpecimenTable:
    """Return the specimen with this name or file, by default the paper's; raise InvalidRequest if unknown."""
    if specimen is None:
        return usual_specimen()
    try:
        return SpecimenTable.model_validate(load_specimen(specimen).model_dump())
    except UnknownSpecimenError as error:
        raise InvalidRequest(str(error)) from error


def specimen_request(
    options: RequestOptions[Choice],
    specimen: str | None,
    amplitude: str | None,
    measured: Path | None,
    **others: object,
) -> Choice:
    """Return a request with a specimen, by default the recording's or the paper's specimen.

    Print warnings of implausible amplitudes and gaps, and of differences from the recording's specimen.
    ``amplitude`` is the checked text of the option; ``measured`` is the recording whose drive is simulated.
    Raises InvalidRequest for other invalid options.
    """
    # Not at the top: `vibench predict` imports this module, and needs no recordings.
    from vibench.analysis import recorded_specimen
    from vibench.analysis.dynamics import specimen_difference

    recorded = None if measured is None else recorded_specimen(measured)
    described = read_specimen(specimen) if specimen is not None or recorded is None else recorded
    request = options.request(described=described, **others)
    ends_m = () if amplitude is None else map(float, amplitude.split(":")[:2])
    print_warnings(plausibility_warnings(ends_m, request.chosen_specimen.gaps_m))
    if measured is not None:
        known = None if recorded is None else recorded.specimen()
        print_warnings([specimen_difference(request.chosen_specimen, known, measured.name)])
    return request
