"""Claims on the motion at 260 Hz: chaos moves it towards the terminal resonances (Figs. 4, 10 and 14)."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ, PAPER_TERMINAL_RESONANCES_HZ

from .case import DAMPINGS, Case
from .claim import Claim, about, at_least, at_most
from .evidence import MODERATE_M, STRONG_M, WEAK_M, Evidence, level, specimen_under
from .options import AMPLITUDES_M
from .responses import Reals, drive_at
from .time_signal import TimeSignal, time_signal

SHOWN_HZ = 260.0
_HALF_BAND_HZ = 10.0
_LOOKED_HZ = ((150.0, 245.0), (350.0, 500.0))
"""Where the two humps are looked for: around each terminal resonance, clear of the drive."""
_ABSENT, _PRESENT = 0.01, 0.1
"""Of the level at the drive's frequency."""
_NEAR_HZ = 20.0
"""Chaos makes broad humps; so near is at a terminal resonance and at none of the linear ones."""


def signal_at(evidence: Evidence, case: Case, amplitude_m: float) -> TimeSignal:
    """Give the motion of m0 at 260 Hz."""
    options = case.options
    key = ("signal", amplitude_m, specimen_under(case), options.accuracy)
    return evidence.remembered(
        key, lambda: time_signal(specimen_under(case), drive_at(SHOWN_HZ, amplitude_m), options)
    )


def _band(signal: TimeSignal, middle_hz: float) -> float:
    """Root sum of squares of the lines around a frequency, over A0."""
    inside = np.abs(signal.frequency_hz - middle_hz) <= _HALF_BAND_HZ
    return float(np.sqrt(np.sum(signal.amplitude[inside] ** 2)))


def _hump_hz(signal: TimeSignal, low_hz: float, high_hz: float) -> float:
    """Where the spectrum, smoothed over 10 Hz, is largest between two frequencies."""
    spacing = float(signal.frequency_hz[1] - signal.frequency_hz[0])
    width = max(1, round(_HALF_BAND_HZ / spacing))
    power: Reals = np.convolve(signal.amplitude**2, np.ones(width) / width, mode="same")
    inside = np.flatnonzero((signal.frequency_hz >= low_hz) & (signal.frequency_hz <= high_hz))
    return float(signal.frequency_hz[inside[np.argmax(power[inside])]])


def _humps(evidence: Evidence, case: Case, amplitude_m: float) -> tuple[float, ...]:
    signal = signal_at(evidence, case, amplitude_m)
    return tuple(_hump_hz(signal, *band) for band in _LOOKED_HZ)


def _redistributed(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Level around each terminal resonance over that around the outer linear one beside it, at 5 um."""
    signal = signal_at(evidence, case, MODERATE_M)
    outer = (PAPER_RESONANCES_HZ[0], PAPER_RESONANCES_HZ[-1])
    pairs = zip(PAPER_TERMINAL_RESONANCES_HZ, outer, strict=True)
    return tuple(_band(signal, terminal) / _band(signal, linear) for terminal, linear in pairs)


def _emerging(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Level around each terminal resonance over that around the drive's frequency, at 1 and at 50 um."""
    found = []
    for amplitude_m in (WEAK_M, STRONG_M):
        signal = signal_at(evidence, case, amplitude_m)
        found += [_band(signal, each) / _band(signal, SHOWN_HZ) for each in PAPER_TERMINAL_RESONANCES_HZ]
    return tuple(found)


def _at_260(evidence: Evidence, case: Case, what: str) -> Reals:
    values = []
    for amplitude_m in AMPLITUDES_M:
        curve = level(evidence, case, amplitude_m)
        values.append(getattr(curve, what)[np.argmin(np.abs(curve.frequency_hz - SHOWN_HZ))])
    return np.array(values)


def _declining(evidence: Evidence, case: Case) -> tuple[float, ...]:
    found = _at_260(evidence, case, "response_i")
    return tuple(float(each) for each in found[1:] / found[:-1])


def _chaos_rising(evidence: Evidence, case: Case) -> tuple[float, ...]:
    return tuple(float(each) for each in np.diff(_at_260(evidence, case, "exponent_per_s")))


_STEPS = ("5 over 1 µm", "10 over 5 µm", "50 over 10 µm")

SPECTRUM_CLAIMS = (
    Claim(
        key="redistributed",
        place="section 3.1, Fig. 4(e)",
        says="At 260 Hz and 5 µm the motion shows at 201 and 435 Hz, and not at 95 and 500 Hz.",
        measured_by="Level within 10 Hz of 201 over that of 95 Hz, and of 435 over that of 500 Hz.",
        wanted=(at_least("201 over 95 Hz", "", 1.0), at_least("435 over 500 Hz", "", 1.0)),
        measure=_redistributed,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="lines-emerge",
        place="section 5, Figs. 10(f) and 14",
        says="At 260 Hz two more resonances emerge with more drive.",
        measured_by="Level within 10 Hz of 201 and of 435 Hz over that within 10 Hz of 260 Hz.",
        wanted=(
            *(at_most(f"1 µm, {each:g} Hz", "%", _ABSENT) for each in PAPER_TERMINAL_RESONANCES_HZ),
            *(at_least(f"50 µm, {each:g} Hz", "%", _PRESENT) for each in PAPER_TERMINAL_RESONANCES_HZ),
        ),
        measure=_emerging,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="lines-at-terminal",
        place="section 5, Figs. 10(f) and 14(b)",
        says="Those lines approach the terminal resonances, 201 and 435 Hz.",
        measured_by="Largest of the spectrum at 50 µm, smoothed over 10 Hz, in 150-245 and in 350-500 Hz.",
        wanted=tuple(
            about(f"near {each:g} Hz", "Hz", each, _NEAR_HZ) for each in PAPER_TERMINAL_RESONANCES_HZ
        ),
        measure=lambda evidence, case: _humps(evidence, case, STRONG_M),
        alternatives=DAMPINGS,
    ),
    Claim(
        key="transmission-declines",
        place="sections 4 and 5, Figs. 10(e) and 14(a)",
        says="At 260 Hz the transmission in the time domain declines with drive.",
        measured_by="Response I at 260 Hz over that at the next lower amplitude.",
        wanted=tuple(at_most(each, "", 1.0) for each in _STEPS),
        measure=_declining,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="chaos-escalates",
        place="sections 4 and 5, Figs. 10(f) and 14(b)",
        says="At 260 Hz chaos escalates with drive.",
        measured_by="Exponent at 260 Hz less that at the next lower amplitude.",
        wanted=tuple(at_least(each.replace("over", "less"), "1/s", 0.0) for each in _STEPS),
        measure=_chaos_rising,
        alternatives=DAMPINGS,
    ),
)
