"""Numbers of an answer in a JSON document, where what is not finite is null."""

import math
from collections.abc import Iterable


def number(value: float) -> float | None:
    """Give a number, or None for one that is not finite."""
    return float(value) if math.isfinite(value) else None


def numbers(values: Iterable[float]) -> list[float | None]:
    """Give a list of them."""
    return [number(each) for each in values]
