"""Claims on resonances: three without contact, two when m1 and m2 are bound together."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ
from vibench.sim import Observable

from .case import DAMPINGS, Case
from .claim import Claim, Expectation, about, at_most
from .curve_peaks import bound_peaks, linear_peaks, nearest, response_peaks, two_highest
from .evidence import PIECE_WISE, STRONG_M, WEAK_M, Evidence, level, model_study, specimen_under
from .figure_11_clearance import GAPS_M, clearance_studies
from .responses import linear_transmissibility, responses

_STRONGER_M = 100e-6
_WHOLE_HZ = 1.0
"""The paper gives whole hertz."""


def _within_a_step(case_step_hz: float, wanted_hz: tuple[float, ...], what: str) -> tuple[Expectation, ...]:
    return tuple(about(f"{what} at {each:g} Hz", "Hz", each, case_step_hz) for each in wanted_hz)


def _linear(_: Evidence, case: Case) -> tuple[float, ...]:
    found = linear_peaks(specimen_under(case), case.options.frequencies_hz[0], case.options.highest_hz)
    return nearest(found, PAPER_RESONANCES_HZ)


def _bound(_: Evidence, case: Case) -> tuple[float, ...]:
    options = case.options
    found = bound_peaks(specimen_under(case), options.frequencies_hz[0], options.highest_hz)
    return nearest(found, PAPER_TERMINAL_RESONANCES_HZ)


def _weak_peaks(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, WEAK_M)
    return nearest(response_peaks(curve.frequency_hz, curve.response_i), PAPER_RESONANCES_HZ)


def _weak_peaks_apart(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Distance of the peaks of Responses I and II, and of the linear response, near each resonance."""
    curve = level(evidence, case, WEAK_M)
    linear = linear_transmissibility(specimen_under(case), curve.frequency_hz)
    found = [
        nearest(response_peaks(curve.frequency_hz, each), PAPER_RESONANCES_HZ)
        for each in (curve.response_i, curve.response_ii, linear)
    ]
    return tuple(float(each) for each in np.ptp(found, axis=0))


def _weak_apart(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, WEAK_M)
    return (float(np.nanmax(np.abs(curve.response_i / curve.response_ii - 1.0))),)


def _strong(evidence: Evidence, case: Case, what: str) -> tuple[float, ...]:
    curve = level(evidence, case, STRONG_M)
    return two_highest(curve.frequency_hz, getattr(curve, what))


def _stronger_still(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = responses(evidence.study(model_study(case, PIECE_WISE, (_STRONGER_M,), (Observable.RESPONSE,))))
    return two_highest(curve.frequency_hz, curve.response_ii)


def _suppressed(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Response I at 50 um over that at 1 um, at each linear resonance."""
    weak, strong = (level(evidence, case, each) for each in (WEAK_M, STRONG_M))
    at = [int(np.argmin(np.abs(weak.frequency_hz - middle))) for middle in _linear(evidence, case)]
    return tuple(float(each) for each in strong.response_i[at] / weak.response_i[at])


def _gaps(evidence: Evidence, case: Case, what: str) -> tuple[float, ...]:
    """Furthest that the two highest peaks lie from the terminal ones over all gaps, and the highest next."""
    furthest, following = 0.0, 0.0
    for study in clearance_studies(case.options):
        curve = responses(evidence.study(study))
        *near, next_over_second = two_highest(curve.frequency_hz, getattr(curve, what))
        furthest = max(furthest, float(np.max(np.abs(np.array(near) - PAPER_TERMINAL_RESONANCES_HZ))))
        following = max(following, next_over_second)
    return furthest, following


_GRID_HZ = 5.0
"""Of a peak read off a curve every 5 Hz."""
_ROUGH_HZ = 10.0
"""Of a peak of Response I in chaos: two steps of the coarse grid."""
_AT_GAPS = f"The two highest peaks at {len(GAPS_M)} gaps, 5 to 60 µm, each at that A0; the worst of them."
_NO_THIRD = at_most("next peak over the second", "", 0.5)

RESONANCE_CLAIMS = (
    Claim(
        key="linear-resonances",
        place="section 3.1",
        says="Without collisions m0 resonates at 95, 266 and 500 Hz.",
        measured_by="Peaks of the exact linear |x / U|, to 0.01 Hz.",
        wanted=_within_a_step(_WHOLE_HZ, PAPER_RESONANCES_HZ, "peak"),
        measure=_linear,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="bound-resonances",
        place="section 3.1, Fig. 3(d)",
        says="With m1 and m2 bound together two resonances remain, 201 and 435 Hz.",
        measured_by="Peaks of the exact |x / U| of the two masses m0 and m1 + m2, to 0.01 Hz.",
        wanted=_within_a_step(_WHOLE_HZ, PAPER_TERMINAL_RESONANCES_HZ, "peak"),
        measure=_bound,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="weak-peaks",
        place="section 3.1, Fig. 3(a)",
        says="At 1 µm Response I peaks at 95, 266 and 500 Hz.",
        measured_by="Peaks of Response I at 1 µm on the grid, nearest to each.",
        wanted=_within_a_step(_GRID_HZ, PAPER_RESONANCES_HZ, "peak"),
        measure=_weak_peaks,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="weak-identical",
        place="section 3.1, Fig. 3(a)",
        says="At 1 µm Responses I, II and the linear response have identical resonance peaks.",
        measured_by="How far the three peaks near each resonance lie apart on the grid: a step at most.",
        wanted=tuple(at_most(f"at {each:g} Hz", "Hz", _GRID_HZ) for each in PAPER_RESONANCES_HZ),
        measure=_weak_peaks_apart,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="weak-equal",
        place="section 3.1, Fig. 3(a)",
        says="Read strictly: at 1 µm Responses I and II are the same.",
        measured_by="Largest difference of Response I from Response II over the grid.",
        wanted=(at_most("largest difference", "%", 0.02),),
        measure=_weak_apart,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="suppressed",
        place="Figs. 2(c), 3 and 13",
        says="More drive lowers the response at all three resonances.",
        measured_by="Response I at each linear resonance: at 50 µm over that at 1 µm.",
        wanted=tuple(at_most(f"at {each:g} Hz", "%", 1.0) for each in PAPER_RESONANCES_HZ),
        measure=_suppressed,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="strong-two-i",
        place="section 3.1, Fig. 3(d)",
        says="At 50 µm Response I has two resonances, 201 and 435 Hz.",
        measured_by="The two highest peaks of Response I at 50 µm, and how high the next one is.",
        wanted=(*_within_a_step(_ROUGH_HZ, PAPER_TERMINAL_RESONANCES_HZ, "peak"), _NO_THIRD),
        measure=lambda evidence, case: _strong(evidence, case, "response_i"),
        alternatives=DAMPINGS,
    ),
    Claim(
        key="strong-two-ii",
        place="section 3.1, Fig. 3(d)",
        says="At 50 µm Response II has two resonances, 201 and 435 Hz.",
        measured_by="The two highest peaks of Response II at 50 µm, and how high the next one is.",
        wanted=(*_within_a_step(_GRID_HZ, PAPER_TERMINAL_RESONANCES_HZ, "peak"), _NO_THIRD),
        measure=lambda evidence, case: _strong(evidence, case, "response_ii"),
        alternatives=DAMPINGS,
    ),
    Claim(
        key="terminal-stay",
        place="section 3.1",
        says="At larger amplitudes these two resonances stay where they are.",
        measured_by="The two highest peaks of Response II at 100 µm, and how high the next one is.",
        wanted=(*_within_a_step(_GRID_HZ, PAPER_TERMINAL_RESONANCES_HZ, "peak"), _NO_THIRD),
        measure=_stronger_still,
        is_scored=False,
    ),
    Claim(
        key="any-gap-i",
        place="section 4, Fig. 11(a)",
        says="Where A0 equals the gap, Response I has two resonances, whatever the gap.",
        measured_by=_AT_GAPS,
        wanted=(
            at_most("furthest from 201 and 435 Hz", "Hz", _ROUGH_HZ),
            _NO_THIRD,
        ),
        measure=lambda evidence, case: _gaps(evidence, case, "response_i"),
        is_scored=False,
    ),
    Claim(
        key="any-gap-ii",
        place="section 4, Fig. 11(b)",
        says="Where A0 equals the gap, Response II has two resonances, whatever the gap.",
        measured_by=_AT_GAPS,
        wanted=(
            at_most("furthest from 201 and 435 Hz", "Hz", _GRID_HZ),
            _NO_THIRD,
        ),
        measure=lambda evidence, case: _gaps(evidence, case, "response_ii"),
        is_scored=False,
    ),
)
