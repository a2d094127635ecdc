"""What `--frequency` means: one frequency, or a range of them."""

import math

from vibench.analysis import InvalidRequest
from vibench.sim.study import frequency_range

_RANGE_PARTS = 3
_ADVICE = "give one frequency above 0 Hz, or START:STOP:STEP [Hz] such as 10:600:1"


def frequencies(text: str) -> tuple[float, ...]:
    """Read ``260`` or ``10:600:1``.

    Raises InvalidRequest when it is neither, or lists nothing, or too much.
    """
    numbers = [_number(text, part) for part in text.split(":")]
    if len(numbers) not in (1, _RANGE_PARTS):
        raise _refused(text, f"{len(numbers)} numbers are neither a frequency nor a range; {_ADVICE}")
    if numbers[0] <= 0.0:
        raise _refused(text, f"{numbers[0]:g} Hz is not above 0; {_ADVICE}")
    if len(numbers) == 1:
        return (numbers[0],)
    start, stop, step = numbers
    if step <= 0.0:
        raise _refused(text, f"a step of {step:g} Hz is not above 0; {_ADVICE}")
    if start > stop:
        way = f"give {stop:g}:{start:g}:{step:g}, and --start down to come from above"
        raise _refused(text, f"the start of {start:g} Hz lies above the stop of {stop:g} Hz; {way}")
    try:
        return frequency_range(start, stop, step)
    except ValueError as error:
        raise _refused(text, f"{error}; give a larger step") from error


def _number(text: str, part: str) -> float:
    try:
        number = float(part)
    except ValueError as error:
        raise _refused(text, f"{part!r} is not a number; {_ADVICE}") from error
    if not math.isfinite(number):
        raise _refused(text, f"{part!r} is not finite; {_ADVICE}")
    return number


def _refused(text: str, why: str) -> InvalidRequest:
    return InvalidRequest(f"--frequency was given as {text!r}: {why}")
