"""Find the gap from the onset of collisions, where the linear relative motion equals the gap."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from vibench.acquisition.plan import Dwell
from vibench.sim import Specimen, base_transmissibility

from ..errors import NotEnoughData
from ..signals.arrays import Complexes, Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..sine.dwell_analysis import DwellAnalysis, DwellPlan
from ..sine.sweep_analysis import SweepAnalysis
from .collision_numbers import CALM, COLLIDING, peakedness
from .parameters import FittedValue, Parameter, parameter_value, with_values
from .specimen_fit import SpecimenFit

_M0, _RELATIVE = 0, 3
"""Columns of m0 and p in `base_transmissibility`."""
_MOST_APART = 0.03
"""Largest |ln(measured / linear motion of m0)| without contact; smooth motion with contact exceeds it."""
_STEP_HZ = 0.02
"""Frequency step [Hz] for the curvature of the transmissibility: 1 % of the narrowest resonance."""
_STEP = 1e-4
"""Logarithmic step for derivatives of the relative motion with respect to the linear parameters."""
_EDGE_POINTS = 41
_APPROACH_S = 1.0
_LEAST_INTERVALS = 3
"""Minimum number of intervals before an onset for fitting a line to A0."""


@dataclass(frozen=True)
class Onset:
    """Onset of collisions in a sweep, or among dwells at one frequency, and the gap derived from it."""

    frequency_hz: float
    gap_m: float
    low_m: float
    high_m: float


def _narrowest(found: Sequence[Onset], linear: Specimen) -> FittedValue:
    """Return the gap of the onset with the narrowest bounds."""
    best = min(found, key=lambda each: each.high_m / each.low_m)
    return FittedValue(
        parameter=Parameter.GAP,
        value=best.gap_m,
        low=best.low_m,
        high=best.high_m,
        sd=float("nan"),
        nominal=min(linear.gaps_m),
    )


def fit_gap(sweeps: Sequence[SweepAnalysis], linear: Specimen, fit: SpecimenFit | None = None) -> FittedValue:
    """Return the gap with the narrowest bounds among the onsets of collisions.

    Raises NotEnoughData when no sweep enters a colliding region.

    Parameters
    ----------
    sweeps
        Measured sweeps; the onset is the edge at which a sweep enters its first colliding region.
    linear
        Specimen for the linear motion; its own gap serves only as the nominal value of the result.
    fit
        Fit of the linear specimen, for its covariance.
    """
    found = [each for sweep in sweeps for each in onsets(sweep, linear, fit)]
    if not found:
        raise NotEnoughData(
            "no sweep goes from predicted motion without collisions to collisions, so "
            "the gap is not determined; sweep with more drive, or start at a frequency without collisions"
        )
    return _narrowest(found, linear)


def onsets(sweep: SweepAnalysis, linear: Specimen, fit: SpecimenFit | None = None) -> Iterator[Onset]:
    """Yield the gap at the first onset of collisions in a sweep, if linear motion of m0 precedes it.

    The bounds of the gap include the bounds of the edge, the uncertainty of drive and linear specimen, and
    twice the difference between measured and linear motion of m0.
    """
    reach = float(norm.ppf(0.5 + 0.5 * DEFAULT_CONFIDENCE))
    motion, rate = sweep.response, sweep.response.sweep_rate_hz_per_s
    # Use only the first region: after it, collisions too smooth to detect may continue.
    for edge in (each.start for each in sweep.collisions.regions[:1] if not each.reaches_start):
        last = int(np.argmin(np.abs(motion.time_s - edge.time_s))) - 1
        before = slice(max(0, last - round(_APPROACH_S / motion.interval_s)), max(0, last))
        hz, a0_m = motion.frequency_hz[before], motion.drive_amplitude_m[before]
        if hz.size < _LEAST_INTERVALS or sweep.collisions.is_unexplained[before].any():
            continue
        apart = _apart(motion.response_ii[before], np.abs(swept_response(linear, hz, rate)[:, _M0]))
        # Fit a line to A0 over frequency before the collisions, because collisions disturb the base motion.
        line = np.polynomial.Polynomial.fit(hz, a0_m, 1)
        drive_sd = float(np.median(motion.sd_drive_amplitude_m[before] / a0_m))
        near = np.append(edge.frequency_hz, np.linspace(edge.lower_hz, edge.upper_hz, _EDGE_POINTS))
        filled = line(near) * np.abs(swept_response(linear, near, rate)[:, _RELATIVE])
        spread = reach * np.hypot(drive_sd, _linear_spread(linear, fit, near[:1], rate)) + 2 * apart
        low_m, high_m = np.min(filled) * np.exp(-spread), np.max(filled) * np.exp(spread)
        if apart < _MOST_APART:
            yield Onset(edge.frequency_hz, float(filled[0]), float(low_m), float(high_m))


def _apart(measured: Reals | float, linear: Reals) -> float:
    """Return the largest relative difference between measured and linear motion of m0."""
    return float(np.max(np.abs(np.log(measured / linear))))


def swept_response(specimen: Specimen, frequency_hz: Reals, rate_hz_per_s: float) -> Complexes:
    """Return the columns of `base_transmissibility` in a linear sweep without contact.

    H - (i / 4 pi) (df/dt) d2H/df2: steady response with its lag in a sweep, to first order in the sweep rate.
    """

    def at(shift_hz: float) -> Complexes:
        return np.asarray(base_transmissibility(specimen, frequency_hz + shift_hz))

    curvature = (at(_STEP_HZ) - 2.0 * at(0.0) + at(-_STEP_HZ)) / _STEP_HZ**2
    return np.asarray(at(0.0) - 1j / (4.0 * np.pi) * rate_hz_per_s * curvature)


def _linear_spread(linear: Specimen, fit: SpecimenFit | None, at_hz: Reals, rate_hz_per_s: float) -> float:
    """Return the relative standard deviation of p due to the uncertainty of the linear fit."""
    if fit is None:
        return 0.0
    slopes = []
    for each in fit.values:
        value = parameter_value(linear, each.parameter)
        up, down = (
            swept_response(with_values(linear, {each.parameter: value * np.exp(step)}), at_hz, rate_hz_per_s)
            for step in (_STEP, -_STEP)
        )
        slopes.append(float(np.log(np.abs(up / down))[0, _RELATIVE]) / (2.0 * _STEP))
    gradient = np.array(slopes)
    return float(np.sqrt(gradient @ fit.covariance @ gradient))


_SAME_HZ = 0.5
"""Dwells whose frequencies differ by less than this [Hz] count as dwells at one frequency."""
_OVERSHOOT = 1.5
"""Largest p during the steps of a ramp, relative to steady motion; usually below 1.2."""


def bracketed_gap(dwells: Sequence[DwellAnalysis], linear: Specimen) -> FittedValue:
    """Return the gap with the narrowest bounds, found from a dwell without and a dwell with collisions.

    Raises NotEnoughData when no frequency has dwells on both sides of the onset.
    """
    found = list(brackets(dwells, linear))
    if not found:
        raise NotEnoughData(
            "no frequency has dwells both without and with collisions, so dwells do not determine the gap; "
            "add one dwell below and one above the level at which collisions start"
        )
    return _narrowest(found, linear)


def brackets(dwells: Sequence[DwellAnalysis], linear: Specimen) -> Iterator[Onset]:
    """Yield the onset at every frequency that has dwells with and without collisions.

    The lower bound is the largest relative motion without collisions at which m0 moves as predicted, because
    masses may also collide smoothly. The upper bound is the smallest linear motion of a colliding dwell,
    unless its collisions may persist from a higher level or another frequency. Collisions disturb the base,
    so this motion is scaled from the largest dwell without collisions by the generator amplitude.
    """
    rest = list(dwells)
    while rest:
        at_hz = rest[0].response.drive.frequency_hz
        here = [each for each in rest if abs(each.response.drive.frequency_hz - at_hz) < _SAME_HZ]
        rest = [each for each in rest if each not in here]
        moved, per_m = np.abs(base_transmissibility(linear, [at_hz])[0, [_M0, _RELATIVE]])
        calm = [
            each
            for each in here
            if peakedness(each) <= CALM and _apart(each.response.response_ii, moved) < _MOST_APART
        ]
        colliding = [each for each in here if peakedness(each) >= COLLIDING and _is_raised(each.excitation)]
        if not calm or not colliding:
            continue
        loudest = max(calm, key=lambda each: each.excitation.amplitude_vpp)
        steady_m = float(per_m * loudest.response.drive.amplitude_m)
        low_m = steady_m * (1 - _apart(loudest.response.response_ii, moved))
        volts = min(each.excitation.amplitude_vpp for each in colliding)
        high_m = _OVERSHOOT * steady_m * volts / loudest.excitation.amplitude_vpp
        if volts > loudest.excitation.amplitude_vpp:
            yield Onset(at_hz, float(np.sqrt(low_m * high_m)), low_m, high_m)


def _is_raised(plan: DwellPlan) -> bool:
    """Return whether a dwell was reached from silence by rising levels at the same frequency."""
    return isinstance(plan, Dwell) and all(
        abs(each.frequency_hz - plan.frequency_hz) < _SAME_HZ and each.amplitude_vpp <= plan.amplitude_vpp
        for each in plan.lead_in
    )
