"""Claims on the largest Lyapunov exponent of both models (Figs. 4 and 10)."""

import numpy as np

from .case import BY_ODE45, DAMPINGS, NARROWER_FIT, Case
from .claim import Claim, at_least, at_most
from .evidence import (
    CONTINUOUS,
    MODERATE_M,
    PIECE_WISE,
    SECOND_REGION_HZ,
    STRONG_M,
    WEAK_M,
    Evidence,
    exponents_of,
    level,
    model_study,
    with_exponents,
)
from .options import AMPLITUDES_M
from .responses import Reals, responses

SEVERE_PER_S = 100.0
"""Section 3.1: "more than 100"."""
NEAR_ZERO_PER_S = 10.0
"""A tenth of that. Free motion decays at a few per second, so zero itself is not to be had."""
_MOST = 0.9
_ORDERS = ("power:3", "power:5", "power:7")


def exponents(evidence: Evidence, case: Case, amplitude_m: float, model: str = PIECE_WISE) -> Reals:
    """Give the largest exponent over frequency [1/s]."""
    if model in (PIECE_WISE, CONTINUOUS):
        return level(evidence, case, amplitude_m, model).exponent_per_s
    asked = model_study(case, model, (amplitude_m,), with_exponents(PIECE_WISE))
    return exponents_of(evidence, case, responses(evidence.study(asked)), amplitude_m, model)


def _near_zero(evidence: Evidence, case: Case, model: str) -> tuple[float, ...]:
    return (float(np.nanmax(np.abs(exponents(evidence, case, WEAK_M, model)))),)


def _severe(evidence: Evidence, case: Case, lowest_hz: float, highest_hz: float) -> tuple[float, ...]:
    """Share above 100, and median, of the colliding frequencies between two."""
    curve = level(evidence, case, MODERATE_M)
    within = (curve.frequency_hz > lowest_hz) & (curve.frequency_hz < highest_hz)
    colliding = curve.exponent_per_s[curve.collides & within]
    if not colliding.size:
        return np.nan, np.nan
    return float(np.mean(colliding > SEVERE_PER_S)), float(np.median(colliding))


def _reaches(evidence: Evidence, case: Case) -> tuple[float, ...]:
    return (float(np.nanmax(exponents(evidence, case, MODERATE_M))),)


def _chaotic_shares(evidence: Evidence, case: Case, model: str) -> Reals:
    return np.array(
        [np.mean(exponents(evidence, case, each, model) > NEAR_ZERO_PER_S) for each in AMPLITUDES_M]
    )


def _spread_with_drive(evidence: Evidence, case: Case) -> tuple[float, ...]:
    return tuple(
        float(np.min(np.diff(_chaotic_shares(evidence, case, model)))) for model in (PIECE_WISE, CONTINUOUS)
    )


def _grows_with_drive(evidence: Evidence, case: Case, model: str) -> tuple[float, ...]:
    """Median of the positive exponents at 10 um over that at 5, and at 50 over that at 10."""
    medians = []
    for amplitude_m in AMPLITUDES_M[1:]:
        values = exponents(evidence, case, amplitude_m, model)
        positive = values[values > 0.0]
        medians.append(float(np.median(positive)) if positive.size else np.nan)
    return medians[1] / medians[0], medians[2] / medians[1]


def _stronger_than_continuous(evidence: Evidence, case: Case) -> tuple[float, ...]:
    found = []
    for amplitude_m in AMPLITUDES_M[1:]:
        piece_wise = exponents(evidence, case, amplitude_m)
        apart = piece_wise - exponents(evidence, case, amplitude_m, CONTINUOUS)
        colliding = level(evidence, case, amplitude_m).collides
        found.append(float(np.nanmedian(apart[colliding])) if colliding.any() else np.nan)
    return tuple(found)


def _apart(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Smallest step, from level to level, of the share of frequencies whose exponents differ."""
    shares = []
    for amplitude_m in AMPLITUDES_M:
        differs = exponents(evidence, case, amplitude_m) - exponents(evidence, case, amplitude_m, CONTINUOUS)
        shares.append(float(np.mean(np.abs(differs) > NEAR_ZERO_PER_S)))
    return (float(np.min(np.diff(shares))),)


def _nearer_with_order(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Mean distance from the piece-wise exponents of n = 5 over that of n = 3, and of 7 over 5."""
    of_stops = exponents(evidence, case, MODERATE_M)
    apart = [
        float(np.nanmean(np.abs(of_stops - exponents(evidence, case, MODERATE_M, model))))
        for model in _ORDERS
    ]
    return apart[1] / apart[0], apart[2] / apart[1]


def _peaks_near_terminal(evidence: Evidence, case: Case, model: str) -> tuple[float, ...]:
    """Mean exponent at 50 um within 15 Hz of each terminal resonance over the mean of all frequencies."""
    curve = level(evidence, case, STRONG_M, model)
    whole = float(np.nanmean(curve.exponent_per_s))
    near = [np.abs(curve.frequency_hz - middle) <= _AROUND_HZ for middle in _TERMINAL_HZ]
    return tuple(float(np.nanmean(curve.exponent_per_s[each])) / whole for each in near)


_AROUND_HZ = 15.0
_TERMINAL_HZ = (201.0, 435.0)
_SEVERE = (at_least("share above 100", "%", _MOST), at_least("median", "1/s", SEVERE_PER_S))

EXPONENT_CLAIMS = (
    Claim(
        key="calm-at-1um",
        place="section 4, Fig. 10(a)",
        says="At 1 µm the exponent of the piece-wise model is near zero at all frequencies.",
        measured_by="Largest |exponent| over the grid; near zero is a tenth of what the paper calls severe.",
        wanted=(at_most("largest", "1/s", NEAR_ZERO_PER_S),),
        measure=lambda evidence, case: _near_zero(evidence, case, PIECE_WISE),
        alternatives=DAMPINGS,
    ),
    Claim(
        key="calm-at-1um-continuous",
        place="section 4, Fig. 10(b)",
        says="At 1 µm the exponent of the continuous model n = 5 is near zero at all frequencies.",
        measured_by="As above.",
        wanted=(at_most("largest", "1/s", NEAR_ZERO_PER_S),),
        measure=lambda evidence, case: _near_zero(evidence, case, CONTINUOUS),
        is_scored=False,
    ),
    Claim(
        key="severe-at-5um",
        place="section 3.1, Fig. 4(c)",
        says="At 5 µm the exponent reaches more than 100 per second.",
        measured_by="Largest exponent over the grid.",
        wanted=(at_least("largest", "1/s", SEVERE_PER_S),),
        measure=_reaches,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="severe-where-shown",
        place="section 3.1, Fig. 4(c)",
        says="When they collide, as around 260 Hz, the exponent jumps to more than 100 per second.",
        measured_by="Share of the second region at 5 µm above 100 per second, and its median.",
        wanted=_SEVERE,
        measure=lambda evidence, case: _severe(evidence, case, *SECOND_REGION_HZ),
        alternatives=(*DAMPINGS, BY_ODE45),
    ),
    Claim(
        key="severe-wherever-colliding",
        place="section 3.1, Fig. 4(c)",
        says="Read strictly: wherever they collide, the exponent is more than 100 per second.",
        measured_by="Share of the colliding frequencies at 5 µm above 100 per second, and their median.",
        wanted=_SEVERE,
        measure=lambda evidence, case: _severe(evidence, case, 0.0, np.inf),
        alternatives=(*DAMPINGS, BY_ODE45),
    ),
    Claim(
        key="chaos-spreads",
        place="section 4, Fig. 10(a, b)",
        says="With more drive the exponent is positive at more frequencies, in both models.",
        measured_by="Share of exponents above 10 per second: its smallest step between amplitudes.",
        wanted=(at_least("piece-wise", "%", 0.0), at_least("n = 5", "%", 0.0)),
        measure=_spread_with_drive,
        alternatives=(NARROWER_FIT,),
        is_scored=False,
    ),
    Claim(
        key="chaos-grows",
        place="section 4, Fig. 10(a)",
        says="With more drive the exponent of colliding motion is larger.",
        measured_by="Median positive exponent at 10 µm over that at 5 µm, and at 50 over 10 µm.",
        wanted=(at_least("10 over 5 µm", "", 1.0), at_least("50 over 10 µm", "", 1.0)),
        measure=lambda evidence, case: _grows_with_drive(evidence, case, PIECE_WISE),
        alternatives=DAMPINGS,
    ),
    Claim(
        key="chaos-grows-continuous",
        place="section 4, Fig. 10(b)",
        says="So it is in the continuous model n = 5.",
        measured_by="As above.",
        wanted=(at_least("10 over 5 µm", "", 1.0), at_least("50 over 10 µm", "", 1.0)),
        measure=lambda evidence, case: _grows_with_drive(evidence, case, CONTINUOUS),
        is_scored=False,
    ),
    Claim(
        key="stops-more-chaotic",
        place="section 4, Fig. 10(c), and conclusions",
        says="The piece-wise model is more chaotic than the continuous one.",
        measured_by="Median of its exponent less that of n = 5 over the colliding frequencies.",
        wanted=tuple(at_least(f"{1e6 * each:g} µm", "1/s", 0.0) for each in AMPLITUDES_M[1:]),
        measure=_stronger_than_continuous,
        is_scored=False,
    ),
    Claim(
        key="exponents-part",
        place="section 4, Fig. 10(c)",
        says="With more drive the exponents of the two models differ at more frequencies.",
        measured_by="Smallest step of the share of frequencies at which they differ by 10 per second.",
        wanted=(at_least("smallest step", "%", 0.0),),
        measure=_apart,
        is_scored=False,
    ),
    Claim(
        key="exponents-near-with-order",
        place="section 4, Fig. 10(d)",
        says="With larger n the exponents of the continuous model approach the piece-wise one's.",
        measured_by="Mean |difference| at 5 µm of n = 5 over that of n = 3, and of n = 7 over n = 5.",
        wanted=(at_most("5 over 3", "", 1.0), at_most("7 over 5", "", 1.0)),
        measure=_nearer_with_order,
        alternatives=(NARROWER_FIT,),
        is_scored=False,
    ),
    Claim(
        key="exponents-peak-at-terminal",
        place="section 4, Fig. 10(a, b)",
        says="At 50 µm the exponents have the terminal resonances, 201 and 435 Hz.",
        measured_by="Mean exponent within 15 Hz of each over the mean of all frequencies, piece-wise model.",
        wanted=tuple(at_least(f"at {each:g} Hz", "", 1.0) for each in _TERMINAL_HZ),
        measure=lambda evidence, case: _peaks_near_terminal(evidence, case, PIECE_WISE),
        alternatives=DAMPINGS,
    ),
)
