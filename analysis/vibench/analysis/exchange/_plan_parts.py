"""Where in a file the parts of a plan lie: told by the mapping, or one after the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from vibench.acquisition.plan import AbstractExcitation, Segment, Step

from ..errors import InvalidRequest
from ._mapping import ImportMapping


@dataclass(frozen=True)
class LaidPart:
    """A part of the plan as a range of samples."""

    segment: Segment
    start: int
    stop: int
    """One past the last sample."""


@dataclass(frozen=True)
class _Planned:
    segment: Segment
    settle_s: float
    record_s: float


def laid_parts(mapping: ImportMapping, sample_rate_hz: float, samples: int) -> tuple[LaidPart, ...]:
    """Lay the plan's parts over the samples; parts past their end are left out, one across it is cut by it.

    Raises
    ------
    InvalidRequest
        When more parts are given than are planned, they overlap, or none lies inside the file.

    """
    planned = list(_planned(mapping.measurement.excitation))
    stretches = _told(mapping, planned) if mapping.parts else _in_turn(mapping.begins_s, planned)
    laid = [
        LaidPart(each.segment, round(start_s * sample_rate_hz), round(stop_s * sample_rate_hz))
        for each, (start_s, stop_s) in zip(planned, stretches, strict=False)
        if round(start_s * sample_rate_hz) < samples
    ]
    if not laid:
        raise InvalidRequest(
            f"no part of the plan begins within the {samples / sample_rate_hz:.3g} s of the file; "
            "correct begins_s or parts"
        )
    return tuple(laid)


def _planned(excitation: AbstractExcitation) -> Iterator[_Planned]:
    """Join the steps that are recorded as one, as a run does."""
    joined = 0

    def part(step: Step) -> int:
        nonlocal joined
        joined += step.settle_s > 0
        return joined

    for (segment, _), steps in groupby(excitation.steps(), key=lambda step: (step.segment, part(step))):
        together = list(steps)
        yield _Planned(segment, together[0].settle_s, sum(each.record_s for each in together))


def _in_turn(begins_s: float, planned: Sequence[_Planned]) -> Iterator[tuple[float, float]]:
    now_s = begins_s
    for each in planned:
        start_s = now_s + each.settle_s
        now_s = start_s + each.record_s
        yield start_s, now_s


def _told(mapping: ImportMapping, planned: Sequence[_Planned]) -> Iterator[tuple[float, float]]:
    parts = mapping.parts
    if len(parts) > len(planned):
        raise InvalidRequest(
            f"{len(parts)} parts are given, and the plan of {mapping.measurement.name} has {len(planned)}; "
            "give one for each part that was recorded"
        )
    for before, after in pairwise(parts):
        if after.start_s < before.stop_s:
            raise InvalidRequest(
                f"a part begins at {after.start_s:g} s, before the one in front of it has ended at "
                f"{before.stop_s:g} s; give them in the order of time"
            )
    return ((each.start_s, each.stop_s) for each in parts)
