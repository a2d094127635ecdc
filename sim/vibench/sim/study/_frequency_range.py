"""Frequencies as people write them: numbers, ranges, or a mixture, turned into one ascending list."""

import math

LONGEST = 1_000_000
"""Values of all ranges together; more is a slip of the pen."""
WHOLE = 1e-9
"""A range this close to a whole number of steps includes its stop."""


def frequency_range(start: float, stop: float, step: float) -> tuple[float, ...]:
    """List start, start + step, ... up to stop, which is included when it is hit.

    Raises ValueError when nothing, or too much, would be listed.

    Parameters
    ----------
    start, stop, step
        All in the same unit, Hz by habit.

    Returns
    -------
    tuple of float
        Ascending.

    """
    if not (0.0 < step < math.inf and math.isfinite(start) and math.isfinite(stop) and start <= stop):
        raise ValueError(
            f"a range from {start:g} to {stop:g} in steps of {step:g} is not allowed:"
            " start must not lie above stop, and the step must be positive"
        )
    steps = (stop - start) / step
    if steps >= LONGEST:
        raise ValueError(f"a range of {steps:.3g} values is too long: at most {LONGEST}")
    return tuple(start + step * k for k in range(math.floor(steps * (1.0 + WHOLE) + WHOLE) + 1))


def listed(given: object) -> object:
    """Replace tables with start, stop and step by their values; anything else is left to its validator."""
    match given:
        case {
            "start": float() | int() as start,
            "stop": float() | int() as stop,
            "step": float() | int() as step,
            **rest,
        } if not rest:
            return frequency_range(_number(start), _number(stop), _number(step))
        case {"start": start, "stop": stop, "step": step, **rest} if not rest:
            raise ValueError(
                f"a range from {start!r} to {stop!r} in steps of {step!r} is not allowed: give three numbers"
            )
        case list() | tuple():
            return _flattened(given)
        case _:
            return given


def _number(given: float) -> float:
    """Take a number of a file; whole ones may have hundreds of digits."""
    try:
        return float(given)
    except OverflowError as error:
        raise ValueError(
            "a range has a number of more than 300 digits; give one that can be a frequency"
        ) from error


def _flattened(given: list[object] | tuple[object, ...]) -> object:
    values: list[object] = []
    for each in given:
        match listed(each):
            case tuple() as some:
                values.extend(some)
            case one:
                values.append(one)
        if len(values) > LONGEST:
            raise ValueError(f"ranges of more than {LONGEST} values together are too long; widen their steps")
    if all(isinstance(value, (int, float)) for value in values):
        return sorted(set(values))  # type: ignore[type-var]
    return values
