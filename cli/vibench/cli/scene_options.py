"""Options of commands that simulate: specimen, drive, workers; and messages about failed points."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import (
    Parameter,
    SpecimenTable,
    UnknownSpecimenError,
    load_specimen,
    number_of,
    usual_specimen,
)
from vibench.sim.study import frequency_range, plausibility_warnings

from .options import RequestOptions, option
from .output import ExitCode, errors, print_warnings

if TYPE_CHECKING:
    from vibench.sim.study import GridPlan


SPECIMEN = ("specimen", "model", "damping_time_s", "gap_m")
"""Fields that are options of every command with a specimen."""
AXES = {"models": "model", "gaps_m": "gap_m", "damping_times_s": "damping_time_s"}
"""Study axes with a single value in these commands, each with its field of `SpecimenChoice`."""
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
    Raises InvalidRequest if another option is invalid.
    """
    # Import here: `vibench predict` also imports this module, but needs no recordings.
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


_RANGE_FORMS = {
    Parameter.FREQUENCY: ("one above 0 Hz", "START:STOP such as 50:600", "START:STOP:STEP such as 50:600:1"),
    Parameter.AMPLITUDE: (
        "one above 0 m",
        "START:STOP such as 1e-6:50e-6",
        "START:STOP:STEP such as 1e-6:50e-6:1e-6",
    ),
}
"""Allowed forms of the text with one, two and three parts, in words; keyed by parameter."""


@dataclass(frozen=True)
class Range:
    """Text of an option as numbers: one value, or two limits with or without a step."""

    start: float
    stop: float | None = None
    step: float | None = None


def range_of(text: str, parameter: Parameter, parts: tuple[int, ...], option: str | None = None) -> Range:
    """Read ``260``, ``50:600`` or ``50:600:1``; ``parts`` lists the allowed numbers of parts.

    ``option`` is the name of the option if it differs from the parameter's name.
    Raises InvalidRequest for other text.
    """
    try:
        return Range(*_rising(text, parts))
    except ValueError as error:
        allowed = " or ".join(_RANGE_FORMS[parameter][part - 1] for part in parts)
        raise InvalidRequest(
            f"--{option or parameter.value} was given as {text!r}: {error}; give {allowed}"
        ) from error


def axis_fields(amplitude: Range, frequency: Range) -> dict[str, object]:
    """Return a request's fields for the axis with its limits, and for the fixed level or frequency.

    The axis is the frequency, even for a single frequency, unless the amplitude is given as a range.
    """
    fixed: dict[str, object] = {"along": Parameter.FREQUENCY, "amplitude_m": amplitude.start}
    swept = frequency
    if amplitude.stop is not None:
        fixed, swept = {"along": Parameter.AMPLITUDE, "frequency_hz": frequency.start}, amplitude
    return {**fixed, "start": swept.start, "stop": swept.stop or swept.start}


def _rising(text: str, parts: tuple[int, ...]) -> list[float]:
    numbers = [_number(part) for part in text.split(":")]
    if len(numbers) not in parts:
        raise ValueError(f"{len(numbers)} numbers are not allowed here")
    if min(numbers) <= 0.0:
        raise ValueError(f"{min(numbers):g} is not above 0")
    start, *others = numbers
    if others and (start > others[0] or others == [start]):  # a range with a step may contain one value
        raise ValueError(f"{start:g} is not below {others[0]:g}")
    return numbers


def _number(part: str) -> float:
    number = number_of(part)
    if not math.isfinite(number):
        raise ValueError(f"{part!r} is not finite")
    return number


def frequencies(text: str) -> tuple[float, ...]:
    """Read ``260`` or ``10:600:1`` as frequencies [Hz].

    Raises InvalidRequest for other text, or for too many values.
    """
    requested = range_of(text, Parameter.FREQUENCY, (1, 3))
    if requested.stop is None or requested.step is None:
        return (requested.start,)
    try:
        return frequency_range(requested.start, requested.stop, requested.step)
    except ValueError as error:
        raise InvalidRequest(f"--frequency was given as {text!r}: {error}; give a larger step") from error


SHOWN_FAILURES = 5

Workers = Annotated[int | None, option("Number of threads; by default one per processor.", "N", min=1)]
Cluster = Annotated[str | None, option("Compute on the workers of this Dask scheduler.", "ADDRESS")]
Failures = Sequence[tuple[Mapping[str, float | str], str]]
"""Axis values of each failed point, and the reason for the failure."""


def complain_about_points(plan: "GridPlan", failures: Failures, kept: int) -> None:
    """Print failed points or, after a stop, the number of finished points; exit with an error code."""
    if print_failures(plan, failures) > 0:
        raise typer.Exit(ExitCode.FAILED)
    if kept < plan.grid.size:
        errors.print(f"stopped after {kept} of {plan.grid.size} points; continue a stored file with --resume")
        raise typer.Exit(ExitCode.STOPPED)


def print_failures(plan: "GridPlan", failures: Failures) -> int:
    """Print each failed point with the reason on standard error; return the number of failed points."""
    for where, why in failures[:SHOWN_FAILURES]:
        # Name only axes with several values.
        axes = [axis for axis in plan.axes if len(axis.values) > 1] or [plan.axes[-1]]
        place = ", ".join(f"{axis.name} {where[axis.name]} {axis.units}".strip() for axis in axes)
        errors.print(f"error: {place}: {why}")
    if len(failures) > SHOWN_FAILURES:
        more = len(failures) - SHOWN_FAILURES
        errors.print(f"error: {more} more points have no result: see `failures` with --json")
    return len(failures)
