"""Claims on resonances: three without contact, two when m1 and m2 are bound together."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ

from .claim import NO_THIRD, at_most, claim, costly_claim, peaks_at
from .reading import STRONG_M, WEAK_M, Reading, Values
from .response_figures import GAPS_M, clearance
from .responses import (
    bound_peaks,
    linear_peaks,
    linear_transmissibility,
    nearest,
    response_peaks,
    responses,
    two_highest,
)

_WHOLE_HZ = 1.0
"""Tolerance of resonances that the paper gives in whole hertz."""
_GRID_HZ = 5.0
"""Tolerance of a peak on a grid of 5 Hz."""
_ROUGH_HZ = 10.0
"""Tolerance of a peak of Response I in chaos: two steps of the coarse grid."""
_AT_GAPS = f"The two highest peaks for {len(GAPS_M)} gaps, 5 to 60 µm, with A0 = gap; the worst case counts."


@claim("3.1", "Peaks of the exact linear |x / U|, to 0.01 Hz.", *peaks_at(PAPER_RESONANCES_HZ, _WHOLE_HZ))
def linear_resonances(r: Reading) -> Values:
    """Without collisions m0 resonates at 95, 266 and 500 Hz."""
    found = linear_peaks(r.case.specimen(), r.case.frequencies_hz[0], r.case.highest_hz)
    return nearest(found, PAPER_RESONANCES_HZ)


@claim(
    "3.1, Fig. 3(d)",
    "Peaks of the exact |x / U| of the two masses m0 and m1 + m2, to 0.01 Hz.",
    *peaks_at(PAPER_TERMINAL_RESONANCES_HZ, _WHOLE_HZ),
)
def bound_resonances(r: Reading) -> Values:
    """With m1 and m2 bound together two resonances remain, at 201 and 435 Hz."""
    found = bound_peaks(r.case.specimen(), r.case.frequencies_hz[0], r.case.highest_hz)
    return nearest(found, PAPER_TERMINAL_RESONANCES_HZ)


@claim(
    "3.1, Fig. 3(a)",
    "Peak of Response I at 1 µm nearest to each resonance, on the frequency grid.",
    *peaks_at(PAPER_RESONANCES_HZ, _GRID_HZ),
)
def weak_peaks(r: Reading) -> Values:
    """At 1 µm Response I peaks at 95, 266 and 500 Hz."""
    curve = r.level(WEAK_M)
    return nearest(response_peaks(curve.frequency_hz, curve.response_i), PAPER_RESONANCES_HZ)


@claim(
    "3.1, Fig. 3(a)",
    "Largest distance between the three peaks near each resonance; at most one grid step is required.",
    *(at_most(f"spread near {each:g} Hz", "Hz", _GRID_HZ) for each in PAPER_RESONANCES_HZ),
)
def weak_identical(r: Reading) -> Values:
    """At 1 µm Responses I, II and the linear response have identical resonance peaks."""
    curve = r.level(WEAK_M)
    linear = linear_transmissibility(r.case.specimen(), curve.frequency_hz)
    found = [
        nearest(response_peaks(curve.frequency_hz, each), PAPER_RESONANCES_HZ)
        for each in (curve.response_i, curve.response_ii, linear)
    ]
    return tuple(np.ptp(found, axis=0))


@claim(
    "3.1, Fig. 3(a)",
    "Largest difference between Response I and Response II over the grid.",
    at_most("largest difference", "%", 0.02),
)
def weak_equal(r: Reading) -> Values:
    """At 1 µm Responses I and II are equal (strict reading)."""
    curve = r.level(WEAK_M)
    return (np.nanmax(np.abs(curve.response_i / curve.response_ii - 1.0)),)


@claim(
    "Figs. 2(c), 3 and 13",
    "Ratio of Response I at 50 µm to Response I at 1 µm, at each linear resonance.",
    *(at_most(each, "%", 1.0) for each in ("50 over 1 µm, at 95 Hz", "at 266 Hz", "at 500 Hz")),
)
def suppressed(r: Reading) -> Values:
    """A larger A0 lowers Response I at all three resonances."""
    weak, strong = r.level(WEAK_M), r.level(STRONG_M)
    at = [int(np.argmin(np.abs(weak.frequency_hz - middle))) for middle in linear_resonances.measure(r)]
    return tuple(strong.response_i[at] / weak.response_i[at])


@claim(
    "3.1, Fig. 3(d)",
    "The two highest peaks of Response I at 50 µm, and the relative height of the next peak.",
    *peaks_at(PAPER_TERMINAL_RESONANCES_HZ, _ROUGH_HZ),
    NO_THIRD,
)
def strong_two_i(r: Reading) -> Values:
    """At 50 µm Response I has two resonances at 201 and 435 Hz."""
    curve = r.level(STRONG_M)
    return two_highest(curve.frequency_hz, curve.response_i)


@claim(
    "3.1, Fig. 3(d)",
    "The two highest peaks of Response II at 50 µm, and the relative height of the next peak.",
    *peaks_at(PAPER_TERMINAL_RESONANCES_HZ, _GRID_HZ),
    NO_THIRD,
)
def strong_two_ii(r: Reading) -> Values:
    """At 50 µm Response II has two resonances at 201 and 435 Hz."""
    curve = r.level(STRONG_M)
    return two_highest(curve.frequency_hz, curve.response_ii)


@costly_claim(
    "3.1",
    "The two highest peaks of Response II at 100 µm, and the relative height of the next peak.",
    *peaks_at(PAPER_TERMINAL_RESONANCES_HZ, _GRID_HZ),
    NO_THIRD,
)
def terminal_stay(r: Reading) -> Values:
    """At larger A0 the two resonances stay at 201 and 435 Hz."""
    curve = r.curve(100e-6)
    return two_highest(curve.frequency_hz, curve.response_ii)


@costly_claim("4, Fig. 11(a)", _AT_GAPS, at_most("deviation from 201 and 435 Hz", "Hz", _ROUGH_HZ), NO_THIRD)
def any_gap_i(r: Reading) -> Values:
    """If A0 equals the gap, Response I has two resonances for any gap."""
    return _worst_gap(r, "response_i")


@costly_claim("4, Fig. 11(b)", _AT_GAPS, at_most("deviation from 201 and 435 Hz", "Hz", _GRID_HZ), NO_THIRD)
def any_gap_ii(r: Reading) -> Values:
    """If A0 equals the gap, Response II has two resonances for any gap."""
    return _worst_gap(r, "response_ii")


def _worst_gap(r: Reading, what: str) -> Values:
    """Return the largest deviation from the terminal resonances, and the largest ratio peak 3 / peak 2."""
    furthest, following = 0.0, 0.0
    for study in clearance.studies(r.case):
        curve = responses(r.evidence.study(study))
        *near, next_over_second = two_highest(curve.frequency_hz, getattr(curve, what))
        furthest = max(furthest, float(np.max(np.abs(np.array(near) - PAPER_TERMINAL_RESONANCES_HZ))))
        following = max(following, next_over_second)
    return furthest, following
