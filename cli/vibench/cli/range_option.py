"""Parsing of `--frequency` and `--amplitude`: one value or a range."""

import math
from dataclasses import dataclass

from vibench.analysis import InvalidRequest
from vibench.sim import Parameter
from vibench.sim.study import frequency_range

_EXAMPLES = {
    Parameter.FREQUENCY: {
        1: "one above 0 Hz",
        2: "START:STOP such as 50:600",
        3: "START:STOP:STEP such as 50:600:1",
    },
    Parameter.AMPLITUDE: {
        1: "one above 0 m",
        2: "START:STOP such as 1e-6:50e-6",
        3: "START:STOP:STEP such as 1e-6:50e-6:1e-6",
    },
}
"""Allowed forms, by number of parts."""


@dataclass(frozen=True)
class Range:
    """One value, or two limits with an optional step."""

    start: float
    stop: float | None = None
    step: float | None = None


def range_of(text: str, parameter: Parameter, parts: tuple[int, ...], option: str | None = None) -> Range:
    """Parse ``260``, ``50:600`` or ``50:600:1``; ``parts`` holds the allowed numbers of parts.

    ``option`` is the name of the option if it differs from the parameter's.
    Raises InvalidRequest for other text.
    """
    try:
        return Range(*_rising(text, parts))
    except ValueError as error:
        allowed = " or ".join(_EXAMPLES[parameter][part] for part in parts)
        raise InvalidRequest(
            f"--{option or parameter.value} was given as {text!r}: {error}; give {allowed}"
        ) from error


def _rising(text: str, parts: tuple[int, ...]) -> list[float]:
    numbers = [_number(part) for part in text.split(":")]
    if len(numbers) not in parts:
        raise ValueError(f"{len(numbers)} numbers are not allowed here")
    if min(numbers) <= 0.0:
        raise ValueError(f"{min(numbers):g} is not above 0")
    if len(numbers) > 1 and numbers[0] >= numbers[1]:
        raise ValueError(f"{numbers[0]:g} is not below {numbers[1]:g}")
    return numbers


def _number(part: str) -> float:
    try:
        number = float(part)
    except ValueError as error:
        raise ValueError(f"{part!r} is no number") from error
    if not math.isfinite(number):
        raise ValueError(f"{part!r} is not finite")
    return number


_RANGE_PARTS = 3
_ADVICE = "give one frequency above 0 Hz, or START:STOP:STEP [Hz] such as 10:600:1"


def frequencies(text: str) -> tuple[float, ...]:
    """Parse ``260`` or ``10:600:1``.

    Raises InvalidRequest for other text, an empty list or too many values.
    """
    try:
        numbers = [_number(part) for part in text.split(":")]
    except ValueError as error:
        raise _refusal(text, f"{error}; {_ADVICE}") from error
    if len(numbers) not in (1, _RANGE_PARTS):
        raise _refusal(text, f"{len(numbers)} numbers are neither a frequency nor a range; {_ADVICE}")
    if numbers[0] <= 0.0:
        raise _refusal(text, f"{numbers[0]:g} Hz is not above 0; {_ADVICE}")
    if len(numbers) == 1:
        return (numbers[0],)
    start, stop, step = numbers
    if step <= 0.0:
        raise _refusal(text, f"a step of {step:g} Hz is not above 0; {_ADVICE}")
    if start > stop:
        way = f"give {stop:g}:{start:g}:{step:g}, and --start down to come from above"
        raise _refusal(text, f"the start of {start:g} Hz lies above the stop of {stop:g} Hz; {way}")
    try:
        return frequency_range(start, stop, step)
    except ValueError as error:
        raise _refusal(text, f"{error}; give a larger step") from error


def _refusal(text: str, why: str) -> InvalidRequest:
    return InvalidRequest(f"--frequency was given as {text!r}: {why}")
