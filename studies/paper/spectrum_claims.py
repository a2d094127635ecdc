"""Claims on the motion at 260 Hz: chaos moves energy to the terminal resonances (Figs. 4, 10 and 14)."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ as TERMINAL_HZ
from vibench.sim import Harmonic

from .claim import about, at_least, at_most, claim
from .motion_figures import TimeSignal, time_signal
from .options import AMPLITUDES_M
from .reading import MODERATE_M, STRONG_M, WEAK_M, Reading, Values
from .responses import Reals

SHOWN_HZ = 260.0
_HALF_BAND_HZ = 10.0
_LOOKED_HZ = ((150.0, 245.0), (350.0, 500.0))
"""Search ranges of the two broad peaks: around each terminal resonance, but away from the drive."""
_ABSENT, _PRESENT = 0.01, 0.1
"""Level up to which a line counts as absent, and from which it counts as present, relative to the drive."""
_NEAR_HZ = 20.0
"""Tolerance of the broad peaks, small enough to exclude the linear resonances."""
_STEPS = ("5 over 1 µm", "10 over 5 µm", "50 over 10 µm")


@claim(
    "3.1, Fig. 4(e)",
    "Ratio of the levels within 10 Hz of 201 and 95 Hz, and of 435 and 500 Hz.",
    at_least("level at 201 over 95 Hz", "", 1.0),
    at_least("level at 435 over 500 Hz", "", 1.0),
)
def redistributed(r: Reading) -> Values:
    """At 260 Hz and 5 µm the spectrum has peaks at 201 and 435 Hz, not at 95 and 500 Hz."""
    signal = _signal(r, MODERATE_M)
    outer = (PAPER_RESONANCES_HZ[0], PAPER_RESONANCES_HZ[-1])
    pairs = zip(TERMINAL_HZ, outer, strict=True)
    return tuple(_band(signal, terminal) / _band(signal, linear) for terminal, linear in pairs)


@claim(
    "5, Figs. 10(f) and 14",
    "Levels within 10 Hz of 201 and of 435 Hz, relative to the level within 10 Hz of 260 Hz.",
    *(at_most(f"level, {each:g} over 260 Hz, at 1 µm", "%", _ABSENT) for each in TERMINAL_HZ),
    *(at_least(f"level, {each:g} over 260 Hz, at 50 µm", "%", _PRESENT) for each in TERMINAL_HZ),
)
def lines_emerge(r: Reading) -> Values:
    """With larger A0 at 260 Hz, two more resonances appear in the spectrum."""
    signals = [_signal(r, each) for each in (WEAK_M, STRONG_M)]
    return tuple(_band(signal, each) / _band(signal, SHOWN_HZ) for signal in signals for each in TERMINAL_HZ)


@claim(
    "5, Figs. 10(f) and 14(b)",
    "Highest peaks at 50 µm from 150 to 245 Hz and from 350 to 500 Hz, smoothed over 10 Hz.",
    *(about(f"peak near {each:g} Hz", "Hz", each, _NEAR_HZ) for each in TERMINAL_HZ),
)
def lines_at_terminal(r: Reading) -> Values:
    """These two resonances approach the terminal resonances, 201 and 435 Hz."""
    signal = _signal(r, STRONG_M)
    f = signal.frequency_hz
    width = max(1, round(_HALF_BAND_HZ / float(f[1] - f[0])))
    power: Reals = np.convolve(signal.amplitude**2, np.ones(width) / width, mode="same")
    inside = [np.flatnonzero((f >= low_hz) & (f <= high_hz)) for low_hz, high_hz in _LOOKED_HZ]
    return tuple(f[each[np.argmax(power[each])]] for each in inside)


@claim(
    "4 and 5, Figs. 10(e) and 14(a)",
    "Ratio of Response I at 260 Hz to its value at the next lower amplitude.",
    *(at_most(each, "", 1.0) for each in _STEPS),
)
def transmission_declines(r: Reading) -> Values:
    """At 260 Hz Response I falls with A0."""
    found = _by_level(r, "response_i")
    return tuple(found[1:] / found[:-1])


@claim(
    "4 and 5, Figs. 10(f) and 14(b)",
    "Exponent at 260 Hz minus its value at the next lower amplitude.",
    *(at_least(each.replace("over", "minus"), "1/s", 0.0) for each in _STEPS),
)
def chaos_escalates(r: Reading) -> Values:
    """At 260 Hz the exponent grows with A0."""
    return tuple(np.diff(_by_level(r, "exponent_per_s")))


def _signal(r: Reading, amplitude_m: float) -> TimeSignal:
    key = ("signal", amplitude_m, r.case.specimen(), r.case.accuracy)
    return r.evidence.compute_once(
        key, lambda: time_signal(r.case.specimen(), Harmonic(SHOWN_HZ, amplitude_m), r.case)
    )


def _band(signal: TimeSignal, middle_hz: float) -> float:
    """Return the root sum of squares of the spectral lines around a frequency, relative to A0."""
    inside = np.abs(signal.frequency_hz - middle_hz) <= _HALF_BAND_HZ
    return float(np.sqrt(np.sum(signal.amplitude[inside] ** 2)))


def _by_level(r: Reading, what: str) -> Reals:
    curves = [r.level(each) for each in AMPLITUDES_M]
    return np.array([getattr(each, what)[np.argmin(np.abs(each.frequency_hz - SHOWN_HZ))] for each in curves])
