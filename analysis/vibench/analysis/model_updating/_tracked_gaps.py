"""What collisions tell of a specimen, tracked: the gap of each side, m1, c1 and the contact law."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from vibench.acquisition import open_recording
from vibench.acquisition.recording import Recording, SegmentLabel
from vibench.sim import Specimen

from ..errors import AnalysisError
from ..hidden_motion import FoundParameter, Hidden, HiddenMotion, hidden_motion, parameter_rows
from ..results import CampaignResults
from ..sine import DwellAnalysis

CALM, COLLIDING = 1.01, 1.05
"""Response I over Response II: 1 for a sine; between the two nothing is said."""
_LENGTH_S = 3.0
"""Of a tracked stretch: the bounds of what is found are those of four restarts over it."""
_MOST_RECORDINGS = 3
_LEAST_FOLLOWED = 0.95
"""A track begins within 60 ms."""
_HIGHEST_LEVEL = 1.25
"""Mean squared innovation in flight above which the specimen is another than the filter's; 0.8 to 1.1 with
the right one."""
_JUDGED = (Hidden.LOWER_GAP, Hidden.UPPER_GAP, Hidden.M1, Hidden.C1, Hidden.FORCE, Hidden.EXPONENT)
"""What noise does not tell."""
_GAPS = (Hidden.LOWER_GAP, Hidden.UPPER_GAP)


@dataclass(frozen=True, eq=False)
class TrackedNumbers:
    """Numbers of a specimen from one tracked recording."""

    recording: str
    parameters: tuple[FoundParameter, ...]
    rows: tuple[tuple[str, str, str], ...]
    """The same to read: name, value with its bounds or why there is none, as described."""
    innovation_level: float

    @property
    def told(self) -> tuple[FoundParameter, ...]:
        """Those that the motion determines."""
        return tuple(each for each in self.parameters if each.is_determined)

    @property
    def gaps(self) -> tuple[FoundParameter, ...]:
        """Of the lower and the upper side; empty unless both are told."""
        found = tuple(each for each in self.told if each.what in _GAPS)
        return found if len(found) == len(_GAPS) else ()

    @property
    def contradicted(self) -> tuple[str, ...]:
        """What of the description lies outside of its bounds by more than they are wide, worst first."""
        apart = [
            (abs(each.value - each.described) / (each.high - each.low), label, said, described)
            for each, (label, said, described) in zip(self.parameters, self.rows, strict=True)
            if each.is_determined and each.what in _JUDGED
        ]
        surely = sorted((each for each in apart if each[0] > 1.0), reverse=True)
        return tuple(f"{label} of {said} instead of {described}" for _, label, said, described in surely)


def peakedness(dwell: DwellAnalysis) -> float:
    """Response I without its noise over Response II: 1 for a sine."""
    found = dwell.response
    return (found.response_i - found.noise_bias_i) / found.response_ii


def tracked_numbers(results: CampaignResults, specimen: Specimen) -> tuple[TrackedNumbers | None, str]:
    """Track the colliding recordings, and give the numbers of the one that tells the gaps best.

    Returns
    -------
    The numbers, or None and a sentence that says why no recording tells them.

    """
    found: list[TrackedNumbers] = []
    why: list[str] = []
    for name, stretch, path in list(_colliding(results))[:_MOST_RECORDINGS]:
        try:
            with open_recording(path) as recording:
                motion = hidden_motion(recording, specimen, *stretch(recording))
        except AnalysisError as error:
            why.append(f"{name}: {error}")
            continue
        refused = _refused(motion)
        if refused:
            why.append(f"{name}: {refused}")
        else:
            found.append(
                TrackedNumbers(
                    name, motion.parameters, parameter_rows(motion), motion.tracked.innovation_level
                )
            )
    if not found:
        return None, "; ".join(why) or "no recording collides"
    return min(found, key=_width), ""


def _width(found: TrackedNumbers) -> float:
    return max((each.high - each.low) / each.value for each in found.gaps)


def _refused(motion: HiddenMotion) -> str:
    """Say why a motion's numbers are none, or nothing."""
    tracked = motion.tracked
    if tracked.share_followed < _LEAST_FOLLOWED:
        return f"only {100 * tracked.share_followed:.3g} % of the motion were followed"
    if not isfinite(tracked.innovation_level) or tracked.innovation_level > _HIGHEST_LEVEL:
        return (
            f"the tracked motion leaves {tracked.innovation_level:.3g} times the noise, so the specimen is "
            "not the one it was tracked with"
        )
    missing = [each for each in motion.parameters if each.what in _GAPS and not each.is_determined]
    return missing[0].not_determined if missing else ""


_Stretch = Callable[[Recording], tuple[float, float]]


def _colliding(results: CampaignResults) -> Iterator[tuple[str, _Stretch, Path]]:
    """Give what collides: dwells first, which stay where they are; the strongest of them first."""
    for dwell in sorted(results.dwells, key=lambda each: -each.analysis.excitation.amplitude_vpp):
        if peakedness(dwell.analysis) >= COLLIDING:
            yield dwell.analysis.facts.name, _within(SegmentLabel.DWELL, 0.5), dwell.analysis.facts.path
    for sweep in results.sweeps:
        analysis = sweep.analysis
        longest = max(
            analysis.collisions.regions, key=lambda each: each.stop.time_s - each.start.time_s, default=None
        )
        if longest is not None:
            length_s = analysis.response.time_s[-1] or 1.0
            middle = 0.5 * (longest.start.time_s + longest.stop.time_s) / length_s
            yield analysis.facts.name, _within(SegmentLabel.SWEEP, middle), analysis.facts.path
    for noise in reversed(results.noise[1:]):
        label = SegmentLabel.NOISE if noise.analysis.response.periodic is None else SegmentLabel.REALISATION
        yield noise.analysis.facts.name, _within(label, 0.5), noise.analysis.facts.path


def _within(label: SegmentLabel, middle: float) -> _Stretch:
    """Take a stretch around a part of the longest segment of that name."""

    def stretch(recording: Recording) -> tuple[float, float]:
        rate = recording.sample_rate_hz
        start_s, stop_s = max(
            ((each.start / rate, each.stop / rate) for each in recording.segments if each.label == label),
            key=lambda each: each[1] - each[0],
            default=(0.0, recording.samples / rate),
        )
        length_s = min(_LENGTH_S, stop_s - start_s)
        begin_s = start_s + middle * (stop_s - start_s) - 0.5 * length_s
        begin_s = min(max(begin_s, start_s), stop_s - length_s)
        return begin_s, begin_s + length_s

    return stretch
