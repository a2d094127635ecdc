"""Plausibility warnings: what of a prediction is allowed and yet looks like a slip of the pen."""

import math
from collections.abc import Iterable, Iterator

MOST_GAPS = 1000.0
"""A base that moves by more gaps was hardly meant: 45 mm at the paper's gap, past any shaker's stroke."""
WIDEST_M = 0.1
"""A wider clearance was hardly meant: a specimen on a shaker is not much larger."""
_MICRO = 1e-6


def plausibility_warnings(amplitudes_m: Iterable[float], gaps_m: Iterable[float]) -> Iterator[str]:
    """Say what looks wrong; it can be computed all the same.

    Parameters
    ----------
    amplitudes_m
        Of the base displacement [m], in any order.
    gaps_m
        Clearances at stops [m], in any order; infinite where there is no stop.

    """
    gaps_m = tuple(gaps_m)
    largest_m, narrowest_m = max(amplitudes_m, default=0.0), min(gaps_m)
    if largest_m > MOST_GAPS * narrowest_m:
        yield (
            f"an amplitude of {largest_m:g} m is {largest_m / narrowest_m:.2g} times the gap of "
            f"{narrowest_m:g} m and is predicted as given; if {largest_m:g} micrometres were meant, "
            f"give {_MICRO * largest_m:g}"
        )
    widest_m = max((each for each in gaps_m if math.isfinite(each)), default=0.0)
    if widest_m > WIDEST_M:
        yield (
            f"a gap of {widest_m:g} m is wide for a specimen on a shaker and is predicted as given; if "
            f"{widest_m:g} micrometres were meant, give {_MICRO * widest_m:g}"
        )
