"""Plausibility warnings: what of a study is allowed and yet looks like a slip of the pen."""

from collections.abc import Iterator

from ._study import Study

MOST_GAPS = 1000.0
"""A base that moves by more gaps was hardly meant: 45 mm at the paper's gap, past any shaker's stroke."""
_MICRO = 1e-6


def plausibility_warnings(study: Study) -> Iterator[str]:
    """Say what looks wrong; the study can be solved all the same."""
    largest_m, narrowest_m = study.amplitudes_m[-1], _narrowest_m(study)
    if largest_m > MOST_GAPS * narrowest_m:
        yield (
            f"an amplitude of {largest_m:g} m is {largest_m / narrowest_m:.2g} times the gap of "
            f"{narrowest_m:g} m and is predicted as given; if {largest_m:g} micrometres were meant, "
            f"give {_MICRO * largest_m:g}"
        )


def _narrowest_m(study: Study) -> float:
    return min(study.specimen.specimen().gaps_m) if study.gaps_m is None else study.gaps_m[0]
