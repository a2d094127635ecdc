"""Claims on the continuous model n = 5 and its analytical solution (Fig. 6)."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ
from vibench.sim import PowerSpring, first_order_states, spring_of, structure_of

from .case import ALIKE, DAMPINGS, NARROWER_FIT, Case
from .claim import Claim, about, at_least, at_most
from .curve_peaks import nearest, response_peaks, two_highest
from .evidence import CONTINUOUS, STRONG_M, WEAK_M, Evidence, level, specimen_under
from .responses import Reals

AGREES = 0.1
"""Relative: the paper's own measure of similar (its eq. 6) is looser."""
_MOST, _MAJORITY = 0.8, 0.5
_SMOOTH_PROMINENCE = 1.1
"""Of a peak of a curve without chaos."""
_GRID_HZ, _ROUGH_HZ = 5.0, 10.0


def balanced(evidence: Evidence, case: Case, amplitude_m: float) -> tuple[Reals, ...]:
    """Give |x| / A0 of every first-order solution that an amplitude can rest on, at each grid frequency."""
    options = case.options

    def solve() -> tuple[Reals, ...]:
        specimen = specimen_under(case, CONTINUOUS)
        structure, spring = structure_of(specimen), spring_of(specimen)
        assert isinstance(spring, PowerSpring)
        return tuple(
            np.array(
                [
                    abs(state.displacements[0]) / amplitude_m
                    for state in first_order_states(structure, spring, frequency_hz, amplitude_m)
                    if state.is_stable_to_amplitude
                ]
            )
            for frequency_hz in options.frequencies_hz
        )

    key = ("balance", specimen_under(case, CONTINUOUS), options.frequencies_hz, amplitude_m)
    return evidence.remembered(key, solve)


def _lowest(solutions: tuple[Reals, ...]) -> Reals:
    return np.array([float(np.min(each)) if each.size else np.nan for each in solutions])


def _weak_balance(evidence: Evidence, case: Case) -> tuple[float, ...]:
    frequency_hz = np.asarray(case.options.frequencies_hz)
    lowest = _lowest(balanced(evidence, case, WEAK_M))
    return nearest(response_peaks(frequency_hz, lowest, _SMOOTH_PROMINENCE), PAPER_RESONANCES_HZ)


def _weak_response(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, WEAK_M, CONTINUOUS)
    found = response_peaks(curve.frequency_hz, curve.response_i, _SMOOTH_PROMINENCE)
    return nearest(found, PAPER_RESONANCES_HZ)


def _weak_count(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """How many peaks the lowest stable solution has, and how many Response I."""
    curve = level(evidence, case, WEAK_M, CONTINUOUS)
    found = (_lowest(balanced(evidence, case, WEAK_M)), curve.response_i)
    return tuple(float(len(response_peaks(curve.frequency_hz, each, _SMOOTH_PROMINENCE))) for each in found)


def _strong(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, STRONG_M, CONTINUOUS)
    by_balance = _lowest(balanced(evidence, case, STRONG_M))
    return (
        *two_highest(curve.frequency_hz, by_balance),
        *two_highest(curve.frequency_hz, curve.response_i),
    )


def _agreeing(evidence: Evidence, case: Case, amplitude_m: float) -> tuple[float, ...]:
    """Share of the frequencies at which a solution of the balance lies within 10 % of each response."""
    curve = level(evidence, case, amplitude_m, CONTINUOUS)
    solutions = balanced(evidence, case, amplitude_m)
    return tuple(
        float(np.mean([_is_near(each, value) for each, value in zip(solutions, response, strict=True)]))
        for response in (curve.response_i, curve.response_ii)
    )


def _is_near(solutions: Reals, response: float) -> bool:
    return bool(np.any(np.abs(solutions / response - 1.0) <= AGREES))


_AT_RESONANCES = tuple(about(f"peak at {each:g} Hz", "Hz", each, _GRID_HZ) for each in PAPER_RESONANCES_HZ)
_BENT = "The force of n = 5 acts at every p, so that a resonance at which p nears the gap is bent upwards."
_NO_THIRD = at_most("next peak over the second", "", 0.5)
BALANCE_CLAIMS = (
    Claim(
        key="continuous-weak-three",
        place="section 3.2, Fig. 6(a)",
        says="At 1 µm the analytical response and Response I of n = 5 both show three resonances.",
        measured_by="Number of peaks of the lowest stable first-order solution, and of Response I.",
        wanted=tuple(about(each, "", 3.0, 0.0) for each in ("analytical", "Response I")),
        measure=_weak_count,
        alternatives=DAMPINGS,
        is_scored=False,
    ),
    Claim(
        key="continuous-weak-balance",
        place="section 3.2, Fig. 6(a)",
        says="Read strictly: the analytical ones are those of the piece-wise model, 95, 266 and 500 Hz.",
        measured_by="Peaks of the lowest stable first-order solution on the grid, nearest to each.",
        wanted=_AT_RESONANCES,
        measure=_weak_balance,
        alternatives=(NARROWER_FIT, *DAMPINGS),
        remark=_BENT,
        is_scored=False,
    ),
    Claim(
        key="continuous-weak-i",
        place="section 3.2, Fig. 6(a)",
        says="Read strictly: so are those of Response I.",
        measured_by="Peaks of Response I of n = 5 at 1 µm on the grid, nearest to each.",
        wanted=_AT_RESONANCES,
        measure=_weak_response,
        alternatives=(NARROWER_FIT, ALIKE),
        remark=_BENT,
        is_scored=False,
    ),
    Claim(
        key="continuous-strong",
        place="section 3.2, Fig. 6(d)",
        says="At 50 µm both have two resonances, as the piece-wise model has.",
        measured_by="The two highest peaks of each, and how high the next one is.",
        wanted=tuple(
            each
            for what in ("balance", "Response I")
            for each in (
                *(about(f"{what} at {f:g} Hz", "Hz", f, _ROUGH_HZ) for f in PAPER_TERMINAL_RESONANCES_HZ),
                _NO_THIRD,
            )
        ),
        measure=_strong,
        is_scored=False,
    ),
    Claim(
        key="balance-weak",
        place="section 3.2, Fig. 6(a)",
        says="At 1 µm the analytical solution of n = 5 agrees with integration.",
        measured_by="Share of the frequencies at which a stable solution lies within 10 %.",
        wanted=(at_least("Response I", "%", _MOST), at_least("Response II", "%", _MOST)),
        measure=lambda evidence, case: _agreeing(evidence, case, WEAK_M),
        is_scored=False,
    ),
    Claim(
        key="balance-strong",
        place="section 3.2, Fig. 6(d)",
        says="At 50 µm the analytical solution predicts Response I's major behaviour.",
        measured_by="Share of the frequencies at which a stable solution lies within 10 %: most of them.",
        wanted=(at_least("Response I", "%", _MAJORITY), at_least("Response II", "%", _MAJORITY)),
        measure=lambda evidence, case: _agreeing(evidence, case, STRONG_M),
        is_scored=False,
    ),
)
