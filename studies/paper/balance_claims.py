"""Claims on the continuous model n = 5 and its analytical solution (Fig. 6)."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ
from vibench.sim import PowerSpring, first_order_states, spring_of, structure_of

from .claim import NO_THIRD, Expectation, about, at_least, costly_claim, peaks_at
from .options import ALIKE, DAMPINGS, NARROWER_FIT
from .reading import CONTINUOUS, STRONG_M, WEAK_M, Reading, Values
from .responses import Reals, nearest, response_peaks, two_highest

_AGREES = 0.1
"""Largest relative difference that counts as agreement; the paper's similarity criterion, eq. 6, is wider."""
_MOST, _MAJORITY = 0.8, 0.5
_SMOOTH_PROMINENCE = 1.1
"""Smallest prominence of a peak in a curve without chaos."""
_GRID_HZ, _ROUGH_HZ = 5.0, 10.0
_BENT = "The force of n = 5 acts at every p and raises resonances at which p approaches the gap."


@costly_claim(
    "3.2, Fig. 6(a)",
    "Number of peaks of the lowest stable first-order solution, and of Response I.",
    about("analytical peaks", "", 3.0, 0.0),
    about("peaks of Response I", "", 3.0, 0.0),
    tried=DAMPINGS,
)
def continuous_weak_three(r: Reading) -> Values:
    """At 1 µm the analytical response and Response I of n = 5 both show three resonances."""
    curve = r.level(WEAK_M, CONTINUOUS)
    found = (_lowest(r, WEAK_M), curve.response_i)
    return tuple(len(response_peaks(curve.frequency_hz, each, _SMOOTH_PROMINENCE)) for each in found)


@costly_claim(
    "3.2, Fig. 6(a)",
    "Peak of the lowest stable first-order solution nearest to each resonance, on the frequency grid.",
    *peaks_at(PAPER_RESONANCES_HZ, _GRID_HZ),
    tried=(NARROWER_FIT, *DAMPINGS),
    remark=_BENT,
)
def continuous_weak_balance(r: Reading) -> Values:
    """At 1 µm the analytical resonances of n = 5 are at 95, 266 and 500 Hz (strict reading)."""
    found = response_peaks(np.asarray(r.case.frequencies_hz), _lowest(r, WEAK_M), _SMOOTH_PROMINENCE)
    return nearest(found, PAPER_RESONANCES_HZ)


@costly_claim(
    "3.2, Fig. 6(a)",
    "Peak of Response I of n = 5 at 1 µm nearest to each resonance, on the frequency grid.",
    *peaks_at(PAPER_RESONANCES_HZ, _GRID_HZ),
    tried=(NARROWER_FIT, ALIKE),
)
def continuous_weak_i(r: Reading) -> Values:
    """At 1 µm the resonances of Response I of n = 5 are at 95, 266 and 500 Hz (strict reading)."""
    curve = r.level(WEAK_M, CONTINUOUS)
    found = response_peaks(curve.frequency_hz, curve.response_i, _SMOOTH_PROMINENCE)
    return nearest(found, PAPER_RESONANCES_HZ)


def _two_of(what: str) -> tuple[Expectation, ...]:
    peaks = (about(f"{what}, {f:g} Hz", "Hz", f, _ROUGH_HZ) for f in PAPER_TERMINAL_RESONANCES_HZ)
    return (*peaks, NO_THIRD)


@costly_claim(
    "3.2, Fig. 6(d)",
    "The two highest peaks of each response, and the relative height of the next peak.",
    *_two_of("analytical"),
    *_two_of("Response I"),
)
def continuous_strong(r: Reading) -> Values:
    """At 50 µm the analytical response and Response I of n = 5 have two resonances."""
    curve = r.level(STRONG_M, CONTINUOUS)
    return (
        *two_highest(curve.frequency_hz, _lowest(r, STRONG_M)),
        *two_highest(curve.frequency_hz, curve.response_i),
    )


@costly_claim(
    "3.2, Fig. 6(a)",
    "Share of the frequencies at which a stable solution is within 10 % of the response.",
    at_least("frequencies agreeing with Response I", "%", _MOST),
    at_least("with Response II", "%", _MOST),
)
def balance_weak(r: Reading) -> Values:
    """At 1 µm the analytical solution of n = 5 agrees with integration."""
    return _agreement(r, WEAK_M)


@costly_claim(
    "3.2, Fig. 6(d)",
    "Share of the frequencies at which a stable solution is within 10 %; at least half is required.",
    at_least("frequencies agreeing with Response I", "%", _MAJORITY),
    at_least("with Response II", "%", _MAJORITY),
)
def balance_strong(r: Reading) -> Values:
    """At 50 µm the analytical solution of n = 5 predicts the main behaviour of Response I."""
    return _agreement(r, STRONG_M)


def _solutions(r: Reading, amplitude_m: float) -> list[Reals]:
    """Return |x| / A0 of every stable first-order solution, at each frequency of the grid."""
    specimen = r.case.specimen(CONTINUOUS)

    def solve() -> list[Reals]:
        structure, spring = structure_of(specimen), spring_of(specimen)
        assert isinstance(spring, PowerSpring)
        states = [first_order_states(structure, spring, f, amplitude_m) for f in r.case.frequencies_hz]
        return [
            np.array([abs(one.displacements[0]) / amplitude_m for one in each if one.is_stable_to_amplitude])
            for each in states
        ]

    return r.evidence.compute_once(("balance", specimen, r.case.frequencies_hz, amplitude_m), solve)


def _lowest(r: Reading, amplitude_m: float) -> Reals:
    return np.array([np.min(each) if each.size else np.nan for each in _solutions(r, amplitude_m)])


def _agreement(r: Reading, amplitude_m: float) -> Values:
    """For each response, return the fraction of frequencies with a first-order solution within 10 %."""
    curve, solutions = r.level(amplitude_m, CONTINUOUS), _solutions(r, amplitude_m)
    return tuple(
        np.mean(
            [
                np.any(np.abs(each / value - 1.0) <= _AGREES)
                for each, value in zip(solutions, seen, strict=True)
            ]
        )
        for seen in (curve.response_i, curve.response_ii)
    )
