"""Parameters from collisions: the gap of each side, m1, c1 and the contact law.

These parameters are found by tracking a motion if possible, otherwise from statistics of chaos.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from math import isnan
from pathlib import Path

from vibench.acquisition import open_recording
from vibench.acquisition.recording import Recording, SegmentLabel
from vibench.sim import Specimen
from vibench.sim.background import Observer, stage

from ..errors import AnalysisError
from ..hidden_motion import FoundParameter, Hidden, HiddenMotion, hidden_motion
from ..overlay.driven_rig import described_shaker
from ..overlay.shaker_fit import FittedShaker, fit_shaker
from ..results.campaign_results import CampaignResults
from ..sine.dwell_analysis import DwellAnalysis
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
        """Return a sentence for each parameter."""
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
        refused = _refusal(motion)
        if refused:
            why.append(f"{each.name}: {refused}")
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


def _refusal(motion: HiddenMotion) -> str:
    """Return the reason why the gaps of a tracked motion are undetermined; empty if both are determined."""
    missing = [each for each in motion.parameters if each.what in _SIDES and not each.is_determined]
    return missing[0].not_determined if missing else ""


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
