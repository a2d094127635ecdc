"""Parameters from collisions: the gap of each side, m1, c1 and the contact law.

These parameters are found by tracking a motion if possible, otherwise from statistics of chaos.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import isnan
from pathlib import Path

import numpy as np
from scipy.stats import norm

from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell
from vibench.acquisition.recording import Recording, SegmentLabel
from vibench.sim import Specimen, base_transmissibility
from vibench.sim.background import Observer, stage

from ..errors import AnalysisError, NotEnoughData
from ..hidden_motion import FoundParameter, Hidden, hidden_motion
from ..overlay.driven_rig import FittedShaker, described_shaker, fit_shaker
from ..results.campaign_results import CampaignResults
from ..signals import DEFAULT_CONFIDENCE, Complexes, Reals
from ..sine.dwell_analysis import DwellAnalysis, DwellPlan
from ..sine.sweep_analysis import SweepAnalysis
from .lines import FittedValue, Parameter, parameter_value, with_values
from .specimen_fit import SpecimenFit
from .statistical_numbers import statistical_numbers

CALM, COLLIDING = 1.01, 1.05
"""Ratios of Response I to II (1 for a sine): no collisions below the first, collisions above the second."""
_LENGTH_S = 3.0
"""Length of the tracked part of a recording [s], long enough for four restarts of the search."""
_MOST_RECORDINGS = 3
_JUDGED = (
    Hidden.LOWER_GAP,
    Hidden.UPPER_GAP,
    Hidden.MEAN_GAP,
    Hidden.M1,
    Hidden.C1,
    Hidden.FORCE,
    Hidden.EXPONENT,
    Hidden.LOSS,
)
"""Parameters whose described values are checked against values from the collisions."""
_SIDES = (Hidden.LOWER_GAP, Hidden.UPPER_GAP)


class Way(StrEnum):
    """Method by which parameters are found from collisions."""

    TRACKED = "tracked"
    STATISTICS = "statistics"


@dataclass(frozen=True, eq=False)
class CollisionNumbers:
    """Parameters of a specimen from one colliding recording."""

    way: Way
    recording: str
    parameters: tuple[FoundParameter, ...]
    misfit: float
    """Mean squared innovation of the tracking, or squared distance of the statistics; ideally about 1."""

    @property
    def determined(self) -> tuple[FoundParameter, ...]:
        """Parameters for which the motion gives a value with bounds."""
        return tuple(each for each in self.parameters if each.is_determined)

    @property
    def gaps(self) -> tuple[FoundParameter, ...]:
        """Lower and upper gap; empty unless the motion determines both gaps."""
        found = tuple(each for each in self.determined if each.what in _SIDES)
        return found if len(found) == len(_SIDES) else ()

    def on(self, specimen: Specimen) -> Specimen:
        """Return the specimen with the determined gaps; a mean gap scales both gaps and keeps their ratio."""
        mean = next((each for each in self.determined if each.what is Hidden.MEAN_GAP), None)
        if mean is not None:
            lower, upper = (gap * mean.value / mean.described for gap in specimen.gaps_m)
        elif self.gaps:
            lower, upper = (each.value for each in self.gaps)
        else:
            return specimen
        return replace(specimen, gap_m=upper, lower_gap_m=lower)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Return one sentence on each parameter."""
        how = {Way.TRACKED: "Tracked", Way.STATISTICS: "From statistics,"}[self.way]
        rows = (each.row for each in self.parameters)
        return tuple(f"{how} {label}: {value}; described as {known}." for label, value, known in rows)

    @property
    def gap_fields(self) -> tuple[str, ...]:
        """Names of the determined gaps."""
        return tuple(each.what.value for each in self.determined if each.what in (*_SIDES, Hidden.MEAN_GAP))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Parameters that differ from the description by more than the width of their bounds, worst first."""
        apart = [
            (abs(each.value - each.described) / (each.high - each.low), *each.row)
            for each in self.determined
            if each.what in _JUDGED
        ]
        surely = sorted((each for each in apart if each[0] > 1.0), reverse=True)
        return tuple(f"{label} of {value} instead of {described}" for _, label, value, described in surely)


def peakedness(dwell: DwellAnalysis) -> float:
    """Return the ratio of Response I, without its known noise bias, to Response II; 1 for a sine."""
    found = dwell.response
    lift = 0.0 if isnan(found.noise_bias_i) else found.noise_bias_i
    return (found.response_i - lift) / found.response_ii


def track_recordings(results: CampaignResults, specimen: Specimen) -> tuple[CollisionNumbers | None, str]:
    """Track colliding recordings; return the parameters of the recording with the narrowest gap bounds.

    If no recording can be tracked, return None and the reason; otherwise the reason is empty.
    """
    found: list[CollisionNumbers] = []
    why: list[str] = []
    for each in list(_colliding(results))[:_MOST_RECORDINGS]:
        try:
            with open_recording(each.path) as recording:
                motion = hidden_motion(recording, specimen, *each.clip(recording))
        except AnalysisError as error:
            why.append(f"{each.name}: {error}")
            continue
        missing = [one for one in motion.parameters if one.what in _SIDES and not one.is_determined]
        if missing:
            why.append(f"{each.name}: {missing[0].not_determined}")
        else:
            level = motion.tracked.innovation_level
            found.append(CollisionNumbers(Way.TRACKED, each.name, motion.parameters, level))
    if not found:
        return None, "; ".join(why) or "no recording collides"
    return min(found, key=lambda one: max((gap.high - gap.low) / gap.value for gap in one.gaps)), ""


def numbers_from_statistics(
    results: CampaignResults,
    specimen: Specimen,
    linear: SpecimenFit | None,
    observer: Observer,
) -> tuple[CollisionNumbers | None, str]:
    """Return parameters by comparing statistics of the first suitable recording with simulated specimens.

    If no recording is suitable, return None and the reason; otherwise the reason is empty.
    """
    why: dict[str, list[str]] = {}
    for each in list(_colliding(results))[:_MOST_RECORDINGS]:
        stage(observer, f"{each.name}: comparing its statistics with those of randomly varied specimens")
        try:
            with open_recording(each.path) as recording:
                shaker = _fit_shaker(recording, results, specimen)
                found, distance = statistical_numbers(
                    recording, specimen, each.clip(recording), each.drive_hz, shaker, linear
                )
        except AnalysisError as error:
            why.setdefault(str(error), []).append(each.name)
            continue
        numbers = CollisionNumbers(Way.STATISTICS, each.name, found, distance**2)
        if numbers.determined:
            return numbers, ""
        why.setdefault("the statistics give no narrower bounds than the description", []).append(each.name)
    return None, "; ".join(f"{reason} ({', '.join(names)})" for reason, names in why.items())


def _fit_shaker(recording: Recording, results: CampaignResults, specimen: Specimen) -> FittedShaker | None:
    if described_shaker(recording) is not None or not results.noise:
        return None
    weakest = results.noise[0].analysis
    with open_recording(weakest.facts.path) as noise:
        return fit_shaker(noise, weakest, specimen)


@dataclass(frozen=True)
class _Colliding:
    """Part of a recording with collisions."""

    name: str
    path: Path
    label: SegmentLabel
    middle: float
    """Relative position, 0 to 1, of the part's centre within the longest segment with the part's label."""
    drive_hz: float | None = None

    def clip(self, recording: Recording) -> tuple[float, float]:
        """Return start and end of the part within the recording [s]."""
        rate = recording.sample_rate_hz
        start_s, stop_s = max(
            (
                (each.start / rate, each.stop / rate)
                for each in recording.segments
                if each.label == self.label
            ),
            key=lambda each: each[1] - each[0],
            default=(0.0, recording.samples / rate),
        )
        length_s = min(_LENGTH_S, stop_s - start_s)
        begin_s = start_s + self.middle * (stop_s - start_s) - 0.5 * length_s
        begin_s = min(max(begin_s, start_s), stop_s - length_s)
        return begin_s, begin_s + length_s


def _colliding(results: CampaignResults) -> Iterator[_Colliding]:
    """Yield parts of recordings with collisions: dwells first (stationary), the strongest dwell first."""
    for dwell in sorted(results.dwells, key=lambda each: -each.analysis.excitation.amplitude_vpp):
        if peakedness(dwell.analysis) >= COLLIDING:
            facts, drive = dwell.analysis.facts, dwell.analysis.response.drive
            yield _Colliding(facts.name, facts.path, SegmentLabel.DWELL, 0.5, drive.frequency_hz)
    for sweep in results.sweeps:
        analysis = sweep.analysis
        longest = max(
            analysis.collisions.regions, key=lambda each: each.stop.time_s - each.start.time_s, default=None
        )
        if longest is not None:
            length_s = analysis.response.time_s[-1] or 1.0
            middle = 0.5 * (longest.start.time_s + longest.stop.time_s) / length_s
            yield _Colliding(analysis.facts.name, analysis.facts.path, SegmentLabel.SWEEP, middle)
    for noise in reversed(results.noise[1:]):
        label = SegmentLabel.NOISE if noise.analysis.response.periodic is None else SegmentLabel.REALISATION
        yield _Colliding(noise.analysis.facts.name, noise.analysis.facts.path, label, 0.5)


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
"""Minimum number of intervals before an onset for fitting a line to the base amplitude A0."""


@dataclass(frozen=True)
class Onset:
    """Onset of collisions in a sweep, or among dwells at one frequency, and the gap derived from it."""

    frequency_hz: float
    gap_m: float
    low_m: float
    high_m: float


def onset_gap(
    sweeps: Sequence[SweepAnalysis],
    dwells: Sequence[DwellAnalysis],
    linear: Specimen,
    fit: SpecimenFit | None = None,
) -> FittedValue:
    """Return the gap with the narrowest bounds among the onsets of collisions.

    Raises NotEnoughData when no sweep enters a colliding region, and no frequency has dwells on both sides of
    the onset.

    Parameters
    ----------
    sweeps, dwells
        Measured sweeps and dwells; see `onsets` and `brackets`.
    linear
        Specimen for the linear motion; its own gap serves only as the nominal value of the result.
    fit
        Fit of the linear specimen, for its covariance.
    """
    found = [*(each for sweep in sweeps for each in onsets(sweep, linear, fit)), *brackets(dwells, linear)]
    if not found:
        raise NotEnoughData(
            "no sweep goes from predicted motion without collisions to collisions, so the gap is not "
            "determined; sweep with a stronger drive, or start at a frequency without collisions; "
            "no frequency has dwells both without and with collisions, so dwells do not determine the gap; "
            "add one dwell below and one above the level at which collisions start"
        )
    best = min(found, key=lambda each: each.high_m / each.low_m)
    return FittedValue(
        parameter=Parameter.GAP,
        value=best.gap_m,
        low=best.low_m,
        high=best.high_m,
        sd=float("nan"),
        nominal=min(linear.gaps_m),
    )


def onsets(sweep: SweepAnalysis, linear: Specimen, fit: SpecimenFit | None = None) -> Iterator[Onset]:
    """Yield the gap at the first onset of collisions in a sweep, if linear motion of m0 precedes the onset.

    The bounds of the gap include the bounds of the edge, the uncertainty of drive and linear specimen, and
    twice the difference between measured and linear motion of m0.
    """
    reach = float(norm.ppf(0.5 + 0.5 * DEFAULT_CONFIDENCE))
    motion, rate = sweep.response, sweep.response.sweep_rate_hz_per_s
    # Use only the first region: after this region, collisions may continue but be too smooth to detect.
    for edge in (each.start for each in sweep.collisions.regions[:1] if not each.reaches_start):
        last = int(np.argmin(np.abs(motion.time_s - edge.time_s))) - 1
        before = slice(max(0, last - round(_APPROACH_S / motion.interval_s)), max(0, last))
        hz, a0_m = motion.frequency_hz[before], motion.drive_amplitude_m[before]
        if hz.size < _LEAST_INTERVALS or sweep.collisions.is_unexplained[before].any():
            continue
        apart = _apart(motion.response_ii[before], np.abs(swept_response(linear, hz, rate)[:, _M0]))
        # Collisions disturb the base motion, so extrapolate A0 by a line from before the collisions.
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
"""Largest p during the steps of a ramp, relative to p of the steady motion; usually below 1.2."""


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
