"""The gap between two dwells: one whose relative motion does not fill it yet, and one whose motion does."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vibench.sim import Specimen, base_transmissibility

from ..errors import NotEnoughData
from ..sine.dwell_analysis import DwellAnalysis
from .collision_numbers import CALM, COLLIDING, peakedness
from .parameters import FittedValue, Parameter

_RELATIVE = 3
"""Column of p in `base_transmissibility`."""
_SAME_HZ = 0.5
"""Dwells whose frequencies differ by less were played at one frequency."""


@dataclass(frozen=True)
class Bracket:
    """Bounds of the gap from the dwells at one frequency."""

    frequency_hz: float
    low_m: float
    """Largest relative motion without collisions."""
    high_m: float
    """Smallest relative motion, had there been no stops, that collided."""


def bracketed_gap(dwells: Sequence[DwellAnalysis], linear: Specimen) -> FittedValue:
    """Return the gap from the narrowest bracket; its value is the geometric mean of the bounds.

    Raises NotEnoughData when no frequency has a dwell on either side of the onset.
    """
    found = list(brackets(dwells, linear))
    if not found:
        raise NotEnoughData(
            "no frequency has both a dwell that does not collide and one that does, so the gap cannot be "
            "told from dwells; add one below and one above the onset"
        )
    best = min(found, key=lambda each: each.high_m / each.low_m)
    return FittedValue(
        parameter=Parameter.GAP,
        value=float(np.sqrt(best.low_m * best.high_m)),
        low=best.low_m,
        high=best.high_m,
        sd=float("nan"),
        nominal=min(linear.gaps_m),
    )


def brackets(dwells: Sequence[DwellAnalysis], linear: Specimen) -> Iterator[Bracket]:
    """Yield a bracket for every frequency with dwells on both sides.

    Collisions push the base off its course, so the motion that a colliding dwell would have without them is
    taken from the generator's setting and from what a volt did to the base in the largest calm dwell.
    """
    rest = list(dwells)
    while rest:
        at_hz = rest[0].response.drive.frequency_hz
        here = [each for each in rest if abs(each.response.drive.frequency_hz - at_hz) < _SAME_HZ]
        rest = [each for each in rest if each not in here]
        calm = [each for each in here if peakedness(each) <= CALM]
        colliding = [each for each in here if peakedness(each) >= COLLIDING]
        if not calm or not colliding:
            continue
        loudest = max(calm, key=lambda each: each.excitation.amplitude_vpp)
        per_m = abs(base_transmissibility(linear, [at_hz])[0, _RELATIVE])
        low_m = float(per_m * loudest.response.drive.amplitude_m)
        volts = min(each.excitation.amplitude_vpp for each in colliding)
        high_m = low_m * volts / loudest.excitation.amplitude_vpp
        if high_m > low_m:
            yield Bracket(at_hz, low_m, high_m)
