"""What `--frequency` and `--amplitude` of branches and spectra mean: one value, or a range of one of them."""

import math
from dataclasses import dataclass

from vibench.analysis import InvalidRequest
from vibench.sim import Parameter

_ADVICE = {
    Parameter.FREQUENCY: "give one above 0 Hz, or START:STOP such as 50:600",
    Parameter.AMPLITUDE: "give one above 0 m, or START:STOP such as 1e-6:50e-6",
}


@dataclass(frozen=True)
class Range:
    """One value, or two ends and perhaps a step between points."""

    start: float
    stop: float | None = None
    step: float | None = None


def range_of(text: str, parameter: Parameter, parts: tuple[int, ...]) -> Range:
    """Read ``260``, ``50:600`` or ``50:600:1``, whichever numbers of parts are allowed.

    Raises
    ------
    InvalidRequest
        When it is none of them.

    """
    numbers = [_number(text, part, parameter) for part in text.split(":")]
    if len(numbers) not in parts:
        raise _refused(text, parameter, f"{len(numbers)} numbers are not allowed here")
    if min(numbers) <= 0.0:
        raise _refused(text, parameter, f"{min(numbers):g} is not above 0")
    if len(numbers) > 1 and numbers[0] >= numbers[1]:
        raise _refused(text, parameter, f"{numbers[0]:g} does not lie below {numbers[1]:g}")
    return Range(*numbers)


def _number(text: str, part: str, parameter: Parameter) -> float:
    try:
        number = float(part)
    except ValueError as error:
        raise _refused(text, parameter, f"{part!r} is no number") from error
    if not math.isfinite(number):
        raise _refused(text, parameter, f"{part!r} is not finite")
    return number


def _refused(text: str, parameter: Parameter, why: str) -> InvalidRequest:
    return InvalidRequest(f"--{parameter.value} was given as {text!r}: {why}; {_ADVICE[parameter]}")
