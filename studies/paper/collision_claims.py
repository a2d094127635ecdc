"""Claims on where m1 and m2 collide, and on what damping and drive do to it."""

import numpy as np

from vibench.analysis import PAPER_RESONANCES_HZ
from vibench.sim import LinearSweep, Observable, Outcome, Sampled, integrate

from .case import DAMPINGS, Case, Direction, gapped, sweep_falling, swept, swept_at
from .claim import Claim, about, at_least, at_most
from .evidence import MODERATE_M, PIECE_WISE, SECOND_REGION_HZ, Evidence, level, model_study, specimen_under
from .options import AMPLITUDES_M
from .responses import Flags, Reals, Responses, responses

FIG_5_HIGHER_M = 7e-6
SWEEP_START_HZ, SWEEP_STOP_HZ, SWEEP_S = 150.0, 350.0, 200.0
"""Section 5."""
_SAMPLED_HZ = 8192.0
"""Over 20 samples a cycle, for the spline through them to be true to 1e-4."""
_AMPLITUDE_AT_HZ = PAPER_RESONANCES_HZ[1]
SWEEP_DRAWS = 16
"""The last impact of a sweep is when chaos died out."""
SWEEP_COLLIDES_HZ = (240.0, 290.0)
"""Same place: "about"."""
_ABOUT_HZ, _ROUGHLY_HZ = 5.0, 10.0
"""Of a sweep, and of a region read off a grid of 5 Hz."""
_MUCH_LOWER = 0.7
_UNDAMPED = 0.0


def fig_5_curve(
    evidence: Evidence, case: Case, amplitude_m: float, damping_time_s: float | None = None
) -> Responses:
    """Give one curve of Fig. 5, at the case's damping unless another is given."""
    asked = model_study(case, PIECE_WISE, (amplitude_m,), (Observable.RESPONSE,), damping_time_s)
    return responses(evidence.study(asked))


def _pairs(evidence: Evidence, case: Case) -> tuple[Responses, Responses, Responses]:
    """Curves at 5 um, at 5 um without damping, and at 7 um."""
    return (
        level(evidence, case, MODERATE_M),
        fig_5_curve(evidence, case, MODERATE_M, _UNDAMPED),
        fig_5_curve(evidence, case, FIG_5_HIGHER_M),
    )


def _shares(evidence: Evidence, case: Case) -> tuple[float, ...]:
    shares = [float(np.mean(level(evidence, case, each).collides)) for each in AMPLITUDES_M]
    return (*shares, float(np.min(np.diff(shares))))


def _saturated(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, MODERATE_M)
    largest = curve.relative_i[curve.collides] * MODERATE_M / case.options.gap_m
    return (float(np.max(largest)) if largest.size else np.nan,)


def _second_below_first(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, MODERATE_M)
    ratio = (curve.response_ii / curve.response_i)[curve.collides]
    return (float(np.max(ratio)), float(np.min(ratio))) if ratio.size else (np.nan, np.nan)


def _louder_without_damping(evidence: Evidence, case: Case) -> tuple[float, ...]:
    damped, undamped, _ = _pairs(evidence, case)
    return (float(np.mean(undamped.response_i > damped.response_i)),)


def _regions_grow(evidence: Evidence, case: Case) -> tuple[float, ...]:
    damped, undamped, higher = _pairs(evidence, case)
    share = float(np.mean(damped.collides))
    return float(np.mean(undamped.collides)) - share, float(np.mean(higher.collides)) - share


def _second_region(curve: Responses) -> Flags:
    low, high = SECOND_REGION_HZ
    return np.asarray(curve.collides & (curve.frequency_hz > low) & (curve.frequency_hz < high))


def _second_span(evidence: Evidence, case: Case) -> tuple[float, ...]:
    curve = level(evidence, case, MODERATE_M)
    found = curve.frequency_hz[_second_region(curve)]
    return (float(found[0]), float(found[-1])) if found.size else (np.nan, np.nan)


def _contrary(evidence: Evidence, case: Case) -> tuple[float, ...]:
    """Median of Response II where more motion makes it collide: over that with less motion."""
    damped, undamped, higher = _pairs(evidence, case)
    found = []
    for stronger in (undamped, higher):
        inside = _second_region(stronger)
        ratio: Reals = stronger.response_ii[inside] / damped.response_ii[inside]
        found.append(float(np.median(ratio)) if ratio.size else np.nan)
    return tuple(found)


def sweep_of(case: Case) -> tuple[LinearSweep, LinearSweep | Sampled]:
    """Give the sweep of Fig. 13(d), and the same with the amplitude that goes with a power of frequency."""
    ends_hz = (SWEEP_START_HZ, SWEEP_STOP_HZ)
    start_hz, stop_hz = ends_hz if case.sweep_goes is Direction.UP else ends_hz[::-1]
    even = LinearSweep(start_hz, stop_hz, SWEEP_S, case.sweep_amplitude_m)
    if case.sweep_falls == 0.0:
        return even, even
    time_s = np.arange(round(SWEEP_S * _SAMPLED_HZ) + 1) / _SAMPLED_HZ
    amplitude_m = case.sweep_amplitude_m * (_AMPLITUDE_AT_HZ / even.frequency_hz(time_s)) ** case.sweep_falls
    return even, Sampled(amplitude_m * np.sin(2.0 * np.pi * even.turns(time_s)), _SAMPLED_HZ)


def sweep_region(evidence: Evidence, case: Case) -> tuple[float, float]:
    """Lowest and highest frequency at an impact of the sweep of Fig. 13(d) [Hz]; NaN without impacts."""
    options, specimen = case.options, specimen_under(case)

    def run() -> tuple[float, float]:
        even, drive = sweep_of(case)
        motion = integrate(specimen, drive, SWEEP_S, options.accuracy, case.start)
        times_s = motion.impacts.times_s
        if motion.outcome is not Outcome.REACHED_END or times_s.size == 0:
            return np.nan, np.nan
        first, last = sorted(even.frequency_hz(times_s[[0, -1]]))
        return float(first), float(last)

    sweep = (case.sweep_amplitude_m, case.sweep_falls, case.sweep_goes)
    return evidence.remembered(("sweep", sweep, specimen, options.accuracy, case.start), run)


COLLISION_CLAIMS = (
    Claim(
        key="regions-grow",
        place="section 3.1, Fig. 3",
        says="With more drive the colliding frequencies take over from the others.",
        measured_by="Share of the frequencies that collide at 1, 5, 10 and 50 µm, and its smallest step.",
        wanted=(
            at_most("1 µm", "%", 0.05),
            at_least("5 µm", "%", 0.0),
            at_least("10 µm", "%", 0.0),
            at_least("50 µm", "%", 0.5),
            at_least("smallest step", "%", 0.0),
        ),
        measure=_shares,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="p-saturates",
        place="section 3.1, Fig. 4(b)",
        says="While colliding, p barely exceeds the gap.",
        measured_by="Largest |p| over the gap at 5 µm, over the colliding frequencies.",
        wanted=(at_most("largest |p| over the gap", "", 1.1),),
        measure=_saturated,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="ii-below-i",
        place="section 2, Fig. 2(c)",
        says="Where they collide, Response II may be much lower than Response I.",
        measured_by="Largest and smallest of II over I over the colliding frequencies at 5 µm.",
        wanted=(at_most("largest", "", 1.0), at_most("smallest", "", _MUCH_LOWER)),
        measure=_second_below_first,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="damping-lowers-i",
        place="section 3.1, Fig. 5(a)",
        says="Without damping Response I is larger at all frequencies.",
        measured_by="Share of the frequencies at which it is, at 5 µm.",
        wanted=(at_least("share", "%", 1.0),),
        measure=_louder_without_damping,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="damping-shrinks-regions",
        place="section 3.1, Fig. 5(a, c)",
        says="Damping shrinks the colliding regions, and so does 5 instead of 7 µm.",
        measured_by="Share of colliding frequencies without damping, and at 7 µm, less that at 5 µm.",
        wanted=(at_least("without damping", "%", 0.01), at_least("at 7 µm", "%", 0.01)),
        measure=_regions_grow,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="contrary-ii",
        place="section 3.1, Fig. 5(b, d)",
        says="In the second colliding region less damping, or more drive, lowers Response II.",
        measured_by=(
            "Median ratio of Response II without damping, and at 7 µm, to that at 5 µm, where the former "
            "collides between 220 and 320 Hz."
        ),
        wanted=(at_most("without damping", "", 1.0), at_most("at 7 µm", "", 1.0)),
        measure=_contrary,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="second-region",
        place="section 5, Fig. 13(d)",
        says="The second colliding region reaches from about 240 to 290 Hz.",
        measured_by="First and last frequency of the region around 266 Hz at 5 µm, each from rest.",
        wanted=tuple(
            about(name, "Hz", each, _ROUGHLY_HZ)
            for name, each in zip(("first", "last"), SWEEP_COLLIDES_HZ, strict=True)
        ),
        measure=_second_span,
        alternatives=DAMPINGS,
    ),
    Claim(
        key="sweep",
        place="section 5, Fig. 13(d)",
        says="In a sweep from 150 to 350 Hz within 200 s they collide at about 240 to 290 Hz.",
        measured_by="Lowest and highest drive frequency at an impact of that sweep, at A0 = 5 µm.",
        wanted=tuple(
            about(name, "Hz", each, _ABOUT_HZ)
            for name, each in zip(("first impact", "last impact"), SWEEP_COLLIDES_HZ, strict=True)
        ),
        measure=sweep_region,
        draws=SWEEP_DRAWS,
        alternatives=(
            *(swept_at(each) for each in (3e-6, 4e-6, 6e-6, 7e-6, 8e-6)),
            gapped(30e-6),
            gapped(60e-6),
            *(sweep_falling(each) for each in (1.0, 2.0, 3.0)),
            swept(Direction.DOWN),
            *DAMPINGS,
        ),
        remark=(
            "The paper does not give the sweep's base amplitude, nor how it changed with frequency. Motion "
            "that collides goes on colliding beyond where it would begin, so the end depends on the sweep."
        ),
    ),
)
