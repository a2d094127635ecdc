"""Claims on the largest Lyapunov exponent of both models (Figs. 4 and 10)."""

import numpy as np

from vibench.analysis import PAPER_TERMINAL_RESONANCES_HZ

from .claim import at_least, at_most, claim, costly_claim
from .options import AMPLITUDES_M, BY_ODE45, DAMPINGS, NARROWER_FIT
from .reading import CONTINUOUS, MODERATE_M, PIECE_WISE, SECOND_REGION_HZ, STRONG_M, WEAK_M, Reading, Values

SEVERE_PER_S = 100.0
"""Exponent that counts as severe; section 3.1 of the paper says "more than 100"."""
NEAR_ZERO_PER_S = 10.0
"""Exponent that counts as near zero [1/s]: a tenth of the severe value; free motion decays at a few 1/s."""
_AROUND_HZ = 15.0
_SEVERE = (at_least("exponents above 100", "%", 0.9), at_least("median exponent", "1/s", SEVERE_PER_S))
_GROWS = (at_least("exponent, 10 over 5 µm", "", 1.0), at_least("50 over 10 µm", "", 1.0))


@claim(
    "4, Fig. 10(a)",
    "Largest |exponent| on the grid; near zero means at most a tenth of what the paper calls severe.",
    at_most("largest |exponent|", "1/s", NEAR_ZERO_PER_S),
)
def calm_at_1um(r: Reading) -> Values:
    """At 1 µm the piece-wise model's exponent is near zero at all frequencies."""
    return (np.nanmax(np.abs(r.exponents(WEAK_M))),)


@costly_claim("4, Fig. 10(b)", "As above.", at_most("largest |exponent|", "1/s", NEAR_ZERO_PER_S))
def calm_at_1um_continuous(r: Reading) -> Values:
    """At 1 µm the exponent of n = 5 is near zero at all frequencies."""
    return (np.nanmax(np.abs(r.exponents(WEAK_M, CONTINUOUS))),)


@claim("3.1, Fig. 4(c)", "Maximum over the grid.", at_least("largest exponent", "1/s", SEVERE_PER_S))
def severe_at_5um(r: Reading) -> Values:
    """At 5 µm the largest exponent exceeds 100 per second."""
    return (np.nanmax(r.exponents(MODERATE_M)),)


@claim(
    "3.1, Fig. 4(c)",
    "Exponents in the second colliding region at 5 µm: share above 100 per second, and median.",
    *_SEVERE,
    tried=(*DAMPINGS, BY_ODE45),
)
def severe_where_shown(r: Reading) -> Values:
    """With collisions around 260 Hz, the exponent jumps to more than 100 per second."""
    return _severe(r, *SECOND_REGION_HZ)


@claim(
    "3.1, Fig. 4(c)",
    "Exponents at all colliding frequencies at 5 µm: share above 100 per second, and median.",
    *_SEVERE,
    tried=(*DAMPINGS, BY_ODE45),
)
def severe_wherever_colliding(r: Reading) -> Values:
    """At every frequency with collisions, the exponent exceeds 100 per second (strict reading)."""
    return _severe(r, 0.0, np.inf)


def _severe(r: Reading, lowest_hz: float, highest_hz: float) -> Values:
    curve = r.level(MODERATE_M)
    colliding = curve.exponent_per_s[curve.collides_within(lowest_hz, highest_hz)]
    if not colliding.size:
        return np.nan, np.nan
    return float(np.mean(colliding > SEVERE_PER_S)), float(np.median(colliding))


@costly_claim(
    "4, Fig. 10(a, b)",
    "Smallest increase of the share of exponents above 10 per second, from one amplitude to the next.",
    at_least("smallest increase of frequencies, piece-wise", "%", 0.0),
    at_least("n = 5", "%", 0.0),
    tried=(NARROWER_FIT,),
)
def chaos_spreads(r: Reading) -> Values:
    """With larger A0 the exponent is positive at more frequencies, in both models."""
    shares = [
        [np.mean(r.exponents(each, model) > NEAR_ZERO_PER_S) for each in AMPLITUDES_M]
        for model in (PIECE_WISE, CONTINUOUS)
    ]
    return tuple(np.min(np.diff(each)) for each in shares)


@claim(
    "4, Fig. 10(a)",
    "Ratio of the median positive exponents: 10 µm to 5 µm, and 50 µm to 10 µm.",
    *_GROWS,
)
def chaos_grows(r: Reading) -> Values:
    """With larger A0 the exponent of motions with collisions is larger."""
    return _grows(r, PIECE_WISE)


@costly_claim("4, Fig. 10(b)", "As above.", *_GROWS)
def chaos_grows_continuous(r: Reading) -> Values:
    """With larger A0 the exponent of n = 5 is larger."""
    return _grows(r, CONTINUOUS)


def _grows(r: Reading, model: str) -> Values:
    exponents = [r.exponents(each, model) for each in AMPLITUDES_M[1:]]
    positive = [each[each > 0.0] for each in exponents]
    low, middle, high = (float(np.median(each)) if each.size else np.nan for each in positive)
    return middle / low, high / middle


@costly_claim(
    "4, Fig. 10(c), and conclusions",
    "Median of the exponent minus the exponent of n = 5, over the colliding frequencies.",
    *(at_least(each, "1/s", 0.0) for each in ("difference at 5 µm", "at 10 µm", "at 50 µm")),
)
def stops_more_chaotic(r: Reading) -> Values:
    """The piece-wise model is more chaotic than the continuous one."""
    found = []
    for amplitude_m in AMPLITUDES_M[1:]:
        apart = r.exponents(amplitude_m) - r.exponents(amplitude_m, CONTINUOUS)
        colliding = r.level(amplitude_m).collides
        found.append(np.nanmedian(apart[colliding]) if colliding.any() else np.nan)
    return tuple(found)


@costly_claim(
    "4, Fig. 10(c)",
    "Smallest increase of the share of frequencies at which the two exponents differ by over 10 per second.",
    at_least("smallest increase of frequencies", "%", 0.0),
)
def exponents_part(r: Reading) -> Values:
    """With larger A0 the exponents of the two models differ at more frequencies."""
    apart = [r.exponents(each) - r.exponents(each, CONTINUOUS) for each in AMPLITUDES_M]
    return (np.min(np.diff([np.mean(np.abs(each) > NEAR_ZERO_PER_S) for each in apart])),)


@costly_claim(
    "4, Fig. 10(d)",
    "Mean |difference from the piece-wise model| at 5 µm: ratio of n = 5 to 3, and of n = 7 to 5.",
    at_most("difference ratio, n = 5 to 3", "", 1.0),
    at_most("n = 7 to 5", "", 1.0),
    tried=(NARROWER_FIT,),
)
def exponents_near_with_order(r: Reading) -> Values:
    """With larger n the continuous model's exponents approach the piece-wise model's."""
    stops = r.exponents(MODERATE_M)
    cubic, fifth, seventh = (
        float(np.nanmean(np.abs(stops - r.exponents(MODERATE_M, model))))
        for model in ("power:3", "power:5", "power:7")
    )
    return fifth / cubic, seventh / fifth


@claim(
    "4, Fig. 10(a, b)",
    "Piece-wise model: mean exponent within 15 Hz of each resonance, relative to the overall mean.",
    *(at_least(f"exponent at {each:g} Hz over mean", "", 1.0) for each in PAPER_TERMINAL_RESONANCES_HZ),
)
def exponents_peak_at_terminal(r: Reading) -> Values:
    """At 50 µm the exponents peak at the terminal resonances, 201 and 435 Hz."""
    curve = r.level(STRONG_M)
    whole = np.nanmean(curve.exponent_per_s)
    near = [np.abs(curve.frequency_hz - middle) <= _AROUND_HZ for middle in PAPER_TERMINAL_RESONANCES_HZ]
    return tuple(np.nanmean(curve.exponent_per_s[each]) / whole for each in near)
