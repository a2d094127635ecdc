"""Fit the gap to the onset of collisions, where the linear relative motion equals the gap."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from vibench.sim import Specimen, base_transmissibility

from ..errors import NotEnoughData
from ..signals.arrays import Complexes, Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..sine.collision_region import Edge
from ..sine.dwell_analysis import DwellAnalysis
from ..sine.sweep import SweepResponse
from ..sine.sweep_analysis import SweepAnalysis
from .collision_numbers import CALM, COLLIDING, peakedness
from .parameters import FittedValue, Parameter, parameter_value, with_values
from .specimen_fit import SpecimenFit

_RELATIVE = 3
"""Column of p in `base_transmissibility`."""
_STEP_HZ = 0.02
"""Frequency step for the curvature of the transmissibility, 1 % of the narrowest resonance [Hz]."""
_STEP = 1e-4
"""Logarithmic step for derivatives of the relative motion with respect to the linear parameters."""
_EDGE_POINTS = 41
_APPROACH_S = 1.0
_LEAST_INTERVALS = 3
"""Minimum number of intervals for fitting a line to A0."""


@dataclass(frozen=True)
class Onset:
    """Onset of collisions in a sweep, or among dwells at one frequency, and the gap that it gives."""

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


def fit_gap(
    sweeps: Sequence[SweepAnalysis],
    linear: Specimen,
    fit: SpecimenFit | None = None,
) -> FittedValue:
    """Return the gap from the onset of collisions with the narrowest bounds.

    Raises NotEnoughData when no sweep enters a colliding region.

    Parameters
    ----------
    sweeps
        Measured sweeps. The onset is the edge at which a sweep enters a colliding region; at the edge where
        it leaves the region, collisions persist.
    linear
        Specimen for the linear motion; its own gap is only the nominal value of the result.
    fit
        Fit of the linear specimen, for its covariance.
    """
    found = [each for sweep in sweeps for each in onsets(sweep, linear, fit)]
    if not found:
        raise NotEnoughData(
            "no sweep goes from motion without collisions to collisions, so the gap is not determined; "
            "sweep with more drive, or start at a frequency without collisions"
        )
    return _narrowest(found, linear)


def onsets(sweep: SweepAnalysis, linear: Specimen, fit: SpecimenFit | None = None) -> Iterator[Onset]:
    """Yield the gap at every onset of collisions in a sweep.

    The bounds of the gap include the bounds of the edge, and the uncertainty of drive and linear specimen.
    """
    reach = float(norm.ppf(0.5 + 0.5 * DEFAULT_CONFIDENCE))
    rate = sweep.response.sweep_rate_hz_per_s
    for region in sweep.collisions.regions:
        if region.reaches_start:
            continue
        edge = region.start
        drive = _approach(sweep.response, edge)
        near = np.linspace(edge.lower_hz, edge.upper_hz, _EDGE_POINTS)
        filled = drive.at(near) * np.abs(swept_relative(linear, near, rate))
        at_edge = np.array([edge.frequency_hz])
        spread = reach * np.hypot(drive.relative_sd, _linear_spread(linear, fit, at_edge, rate))
        yield Onset(
            frequency_hz=edge.frequency_hz,
            gap_m=float(drive.at(at_edge)[0] * np.abs(swept_relative(linear, at_edge, rate))[0]),
            low_m=float(np.min(filled) * np.exp(-spread)),
            high_m=float(np.max(filled) * np.exp(spread)),
        )


@dataclass(frozen=True)
class _Approach:
    """A0 before an onset, fitted as a line over frequency, because collisions disturb the base motion."""

    slope: float
    offset_m: float
    relative_sd: float

    def at(self, frequency_hz: Reals) -> Reals:
        return np.asarray(self.offset_m + self.slope * frequency_hz)


def _approach(measured: SweepResponse, edge: Edge) -> _Approach:
    """Fit A0 to the intervals before an onset, without the last interval."""
    last = int(np.argmin(np.abs(measured.time_s - edge.time_s))) - 1
    first = max(0, last - round(_APPROACH_S / measured.interval_s))
    if last - first < _LEAST_INTERVALS:
        raise NotEnoughData(
            f"the sweep begins {max(last, 0)} intervals before the collisions, but a fit of A0 needs "
            f"{_LEAST_INTERVALS} intervals; begin the sweep further away"
        )
    before = slice(first, last)
    slope, offset = np.polyfit(measured.frequency_hz[before], measured.drive_amplitude_m[before], 1)
    typical = float(np.median(measured.sd_drive_amplitude_m[before] / measured.drive_amplitude_m[before]))
    return _Approach(float(slope), float(offset), typical)


def swept_relative(specimen: Specimen, frequency_hz: Reals, rate_hz_per_s: float) -> Complexes:
    """Return the phasor of p relative to the base in a linear sweep without contact, shape as frequency_hz.

    H - (i / 4 pi) (df/dt) d2H/df2: steady response with its lag in a sweep, to first order in the sweep rate.
    """

    def at(shift_hz: float) -> Complexes:
        return np.asarray(base_transmissibility(specimen, frequency_hz + shift_hz)[:, _RELATIVE])

    curvature = (at(_STEP_HZ) - 2.0 * at(0.0) + at(-_STEP_HZ)) / _STEP_HZ**2
    return np.asarray(at(0.0) - 1j / (4.0 * np.pi) * rate_hz_per_s * curvature)


def _linear_spread(linear: Specimen, fit: SpecimenFit | None, at_hz: Reals, rate_hz_per_s: float) -> float:
    """Return the relative standard deviation of the relative motion due to the linear fit."""
    if fit is None:
        return 0.0
    slopes = []
    for each in fit.values:
        value = parameter_value(linear, each.parameter)
        shifted = [
            abs(
                swept_relative(
                    with_values(linear, {each.parameter: value * np.exp(step)}), at_hz, rate_hz_per_s
                )
            )
            for step in (_STEP, -_STEP)
        ]
        slopes.append(float(np.log(shifted[0] / shifted[1])[0]) / (2.0 * _STEP))
    gradient = np.array(slopes)
    return float(np.sqrt(gradient @ fit.covariance @ gradient))


_SAME_HZ = 0.5
"""Dwells closer than this [Hz] have the same frequency."""


def bracketed_gap(dwells: Sequence[DwellAnalysis], linear: Specimen) -> FittedValue:
    """Return the gap with the narrowest bounds, each from one dwell without and one with collisions.

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

    The lower bound is the largest relative motion without collisions. The upper bound is the smallest linear
    motion with collisions. Collisions disturb the base, so this linear motion is scaled from the largest
    dwell without collisions, in proportion to the generator amplitude.
    """
    rest = list(dwells)
    while rest:
        at_hz = rest[0].response.drive.frequency_hz
        here = [each for each in rest if abs(each.response.drive.frequency_hz - at_hz) < _SAME_HZ]
        rest = [each for each in rest if each not in here]
        calm = [each for each in here if peakedness(each) <= CALM]
        colliding = [each for each in here if peakedness(each) >= COLLIDING]
        if not calm or not colliding:
            continue
        loudest = max(calm, key=lambda each: each.excitation.amplitude_vpp)
        per_m = abs(base_transmissibility(linear, [at_hz])[0, _RELATIVE])
        low_m = float(per_m * loudest.response.drive.amplitude_m)
        volts = min(each.excitation.amplitude_vpp for each in colliding)
        high_m = low_m * volts / loudest.excitation.amplitude_vpp
        if high_m > low_m:
            yield Onset(at_hz, float(np.sqrt(low_m * high_m)), low_m, high_m)
