"""Reading of `--frequency` and `--amplitude`: one value or a range."""

import math
from dataclasses import dataclass

from vibench.analysis import InvalidRequest
from vibench.sim import Parameter, number_of
from vibench.sim.study import frequency_range

_EXAMPLES = {
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
        allowed = " or ".join(_EXAMPLES[parameter][part - 1] for part in parts)
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

    Raises InvalidRequest for other text, or too many values.
    """
    requested = range_of(text, Parameter.FREQUENCY, (1, 3))
    if requested.stop is None or requested.step is None:
        return (requested.start,)
    try:
        return frequency_range(requested.start, requested.stop, requested.step)
    except ValueError as error:
        raise InvalidRequest(f"--frequency was given as {text!r}: {error}; give a larger step") from error
