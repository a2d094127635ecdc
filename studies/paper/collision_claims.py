"""Claims on the frequencies at which m1 and m2 collide, and the influence of damping and drive."""

import numpy as np

from vibench.sim import LinearSweep, Outcome, Sampled, integrate

from .claim import about, at_least, at_most, claim
from .options import AMPLITUDES_M, DAMPINGS, Case, Direction, change
from .reading import MODERATE_M, SECOND_REGION_HZ, Reading, Values
from .responses import Responses

_HIGHER_M = 7e-6
"""The second amplitude of Fig. 5."""
SWEEP_START_HZ, SWEEP_STOP_HZ, SWEEP_S = 150.0, 350.0, 200.0
"""Sweep of the paper's section 5."""
_SAMPLED_HZ = 8192.0
"""Sample rate of the drive [Hz]; with over 20 samples per cycle, the drive's spline is accurate to 1e-4."""
_AMPLITUDE_AT_HZ = 266.0
_SWEEP_COLLIDES_HZ = (240.0, 290.0)
"""Ends of the colliding region [Hz]; section 5 of the paper gives them as "about"."""
_ABOUT_HZ, _ROUGHLY_HZ = 5.0, 10.0
"""Tolerances of the ends of a colliding region: in a sweep, and on a grid with steps of 5 Hz [Hz]."""


@claim(
    "3.1, Fig. 3",
    "Share of frequencies with collisions at 1, 5, 10 and 50 µm, and the smallest increase of this share.",
    at_most("frequencies colliding at 1 µm", "%", 0.05),
    at_least("at 5 µm", "%", 0.0),
    at_least("at 10 µm", "%", 0.0),
    at_least("at 50 µm", "%", 0.5),
    at_least("smallest increase", "%", 0.0),
)
def regions_grow(r: Reading) -> Values:
    """With larger A0, m1 and m2 collide at more frequencies."""
    shares = [np.mean(r.level(each).collides) for each in AMPLITUDES_M]
    return (*shares, np.min(np.diff(shares)))


@claim(
    "3.1, Fig. 4(b)",
    "Largest ratio of |p| to the gap at 5 µm, among the colliding frequencies.",
    at_most("largest |p| over the gap", "", 1.1),
)
def p_saturates(r: Reading) -> Values:
    """While colliding, p barely exceeds the gap."""
    curve = r.level(MODERATE_M)
    largest = curve.relative_i[curve.collides] * MODERATE_M / r.case.gap_m
    return (np.max(largest) if largest.size else np.nan,)


@claim(
    "2, Fig. 2(c)",
    "Largest and smallest ratio of Response II to I at 5 µm, among the colliding frequencies.",
    at_most("largest II / I", "", 1.0),
    at_most("smallest II / I", "", 0.7),
)
def ii_below_i(r: Reading) -> Values:
    """With collisions, Response II may be much lower than Response I."""
    curve = r.level(MODERATE_M)
    ratio = (curve.response_ii / curve.response_i)[curve.collides]
    return (np.max(ratio), np.min(ratio)) if ratio.size else (np.nan, np.nan)


@claim(
    "3.1, Fig. 5(a)",
    "Share of the frequencies at which Response I is larger without damping, at 5 µm.",
    at_least("frequencies with larger response", "%", 1.0),
)
def damping_lowers_i(r: Reading) -> Values:
    """Without damping, Response I is larger at all frequencies."""
    damped, undamped, _ = _fig_5(r)
    return (np.mean(undamped.response_i > damped.response_i),)


@claim(
    "3.1, Fig. 5(a, c)",
    "Increase of the share of colliding frequencies: without damping, and at 7 µm.",
    at_least("more frequencies without damping", "%", 0.01),
    at_least("at 7 µm", "%", 0.01),
)
def damping_shrinks_regions(r: Reading) -> Values:
    """Damping, or an A0 of 5 instead of 7 µm, reduces the frequencies with collisions."""
    share, undamped, higher = (float(np.mean(each.collides)) for each in _fig_5(r))
    return undamped - share, higher - share


@claim(
    "3.1, Fig. 5(b, d)",
    "Median ratio of Response II without damping, and at 7 µm, to Response II at 5 µm with damping, over the "
    "frequencies from 220 to 320 Hz at which the masses collide in the numerator's case.",
    at_most("Response II, undamped over damped", "", 1.0),
    at_most("7 over 5 µm", "", 1.0),
)
def contrary_ii(r: Reading) -> Values:
    """In the second range of collisions, less damping or larger A0 lowers Response II."""
    damped, *stronger = _fig_5(r)
    ratios = [
        (each.response_ii / damped.response_ii)[each.collides_within(*SECOND_REGION_HZ)] for each in stronger
    ]
    return tuple(np.median(each) if each.size else np.nan for each in ratios)


@claim(
    "5, Fig. 13(d)",
    "First and last colliding frequency around 266 Hz at 5 µm, with every run from rest.",
    about("lowest frequency", "Hz", _SWEEP_COLLIDES_HZ[0], _ROUGHLY_HZ),
    about("highest frequency", "Hz", _SWEEP_COLLIDES_HZ[1], _ROUGHLY_HZ),
)
def second_region(r: Reading) -> Values:
    """The second range of collisions extends from about 240 to 290 Hz."""
    curve = r.level(MODERATE_M)
    found = curve.frequency_hz[curve.collides_within(*SECOND_REGION_HZ)]
    return (found[0], found[-1]) if found.size else (np.nan, np.nan)


@claim(
    "5, Fig. 13(d)",
    "Lowest and highest drive frequency at an impact of the sweep, at A0 = 5 µm.",
    about("lowest frequency", "Hz", _SWEEP_COLLIDES_HZ[0], _ABOUT_HZ),
    about("highest frequency", "Hz", _SWEEP_COLLIDES_HZ[1], _ABOUT_HZ),
    tried=(
        *(change("sweep-amplitude", each) for each in (3e-6, 4e-6, 6e-6, 7e-6, 8e-6)),
        change("gap", 30e-6),
        change("gap", 60e-6),
        *(change("sweep-falls", each) for each in (1.0, 2.0, 3.0)),
        change("sweep", Direction.DOWN),
        *DAMPINGS,
    ),
    draws=16,  # a sweep's last impact depends on when chaos ends
    remark=(
        "The paper does not state the sweep's base amplitude, or its change with frequency. Once started, "
        "collisions continue at frequencies where they would not start, so collisions end at random."
    ),
)
def sweep(r: Reading) -> Values:
    """In a sweep from 150 to 350 Hz within 200 s, m1 and m2 collide from about 240 to 290 Hz."""
    case, specimen = r.case, r.case.specimen()

    def run() -> Values:
        even, drive = sweep_of(case)
        motion = integrate(specimen, drive, SWEEP_S, case.accuracy, case.start)
        times_s = motion.impacts.times_s
        if motion.outcome is not Outcome.REACHED_END or times_s.size == 0:
            return np.nan, np.nan
        first, last = sorted(even.frequency_hz(times_s[[0, -1]]))
        return first, last

    swept_as = (case.sweep_amplitude_m, case.sweep_falls, case.sweep_goes)
    return r.evidence.compute_once(("sweep", swept_as, specimen, case.accuracy, case.start), run)


def sweep_of(case: Case) -> tuple[LinearSweep, LinearSweep | Sampled]:
    """Return the sweep of Fig. 13(d) at constant amplitude, and with the case's amplitude ~ f^-k."""
    ends_hz = (SWEEP_START_HZ, SWEEP_STOP_HZ)
    start_hz, stop_hz = ends_hz if case.sweep_goes is Direction.UP else ends_hz[::-1]
    even = LinearSweep(start_hz, stop_hz, SWEEP_S, case.sweep_amplitude_m)
    if case.sweep_falls == 0.0:
        return even, even
    time_s = np.arange(round(SWEEP_S * _SAMPLED_HZ) + 1) / _SAMPLED_HZ
    amplitude_m = case.sweep_amplitude_m * (_AMPLITUDE_AT_HZ / even.frequency_hz(time_s)) ** case.sweep_falls
    return even, Sampled(amplitude_m * np.sin(2.0 * np.pi * even.turns(time_s)), _SAMPLED_HZ)


def _fig_5(r: Reading) -> tuple[Responses, Responses, Responses]:
    """Return the curves at 5 um, at 5 um without damping, and at 7 um."""
    return r.level(MODERATE_M), r.curve(MODERATE_M, damping_times_s=(0.0,)), r.curve(_HIGHER_M)
