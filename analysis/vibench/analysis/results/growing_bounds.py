"""Process that computes the bounds of a recording's results while it is being recorded.

It runs as ``python -m vibench.analysis.results.growing_bounds``. The first output line means that the process
is ready. Then each input line requests bounds and is answered by one output line. All lines are JSON objects.
A run that lasts until a bound is small enough starts this process (`vibench.acquisition.run.until`).
"""

import json
import re
import sys
import time
from dataclasses import dataclass
from itertools import accumulate
from math import hypot
from pathlib import Path

from vibench.acquisition import RecordingError
from vibench.acquisition.recording import Recording, SegmentLabel, open_recording

from ..errors import AnalysisError
from ..frequency_response.noise_response import DEFAULT_REQUEST
from ..kinds import ANALYSES, AnyResult, Result
from ..recordings.channels import RecordedChannels, Stretch, scanned_role
from ..recordings.facts import RecordingFacts, plan_of, recording_facts
from ..uncertainty.budget import COVERAGE, RESULT_PATTERNS, Budget, Cause
from .campaign_results import CONTRADICTIONS, budgets_of

PATIENCE_S = 20.0
"""Maximum waiting time until the file contains the requested samples [s]."""
_PAUSE_S = 0.05


@dataclass(frozen=True, eq=False)
class _ChannelsSoFar(RecordedChannels):
    """Channels of a recording up to a given time: complete realisations, or one stretch cut at this time."""

    stretch: int = 1
    samples_so_far: int = 0
    """Number of samples of the stretch, or of all realisations together, up to the requested time."""

    def stretches(self, label: str) -> tuple[Stretch, ...]:
        """Return the stretches up to the requested time."""
        found = super().stretches(label)
        if label == SegmentLabel.REALISATION:
            whole = [each for each in found if each.is_complete]
            total = accumulate(each.samples for each in whole)
            return tuple(
                each for each, so_far in zip(whole, total, strict=True) if so_far <= self.samples_so_far
            )
        return tuple(
            Stretch(each.start, each.start + self.samples_so_far, each.numbers, is_complete=True)
            for each in found[self.stretch - 1 : self.stretch]
        )


def bounds_of(result: AnyResult) -> dict[str, float | None]:
    """For each result for which a plan can wait, return the largest relative 95 % random bound.

    An undetermined bound is None; results that were not found are left out.
    """
    found: dict[str, float | None] = {}
    for name, pattern in RESULT_PATTERNS.items():
        bounds = [random_bound(each) for each in budgets_of(result) if re.search(pattern, each.quantity)]
        if bounds:
            known = [each for each in bounds if each is not None]
            found[name] = max(known) if len(known) == len(bounds) else None
    return found


def random_bound(budget: Budget) -> float | None:
    """Return the relative 95 % random bound of one quantity; None if its budget states no bound."""
    parts = [budget.share(cause) for cause in (Cause.NOISE, Cause.CHANCE)]
    stated = [each for each in parts if each is not None]
    return COVERAGE * hypot(*stated) if len(stated) == len(parts) else None


def result_so_far(recording: Recording, facts: RecordingFacts, stretch: int, recorded_s: float) -> AnyResult:
    """Return the result of a recording up to a time [s] within a stretch.

    ``stretch`` is the number of the step; 1 for recordings without steps. For noise, only complete
    realisations are analysed. Raises AnalysisError when nothing can be analysed.
    """
    plan = facts.measurement.excitation
    samples = round(recorded_s * recording.sample_rate_hz)
    channels = _ChannelsSoFar(
        recording, response=scanned_role(recording), stretch=stretch, samples_so_far=samples
    )
    return Result(ANALYSES[plan.kind].analyse(facts, channels, plan, DEFAULT_REQUEST), None)


def _open_when_there(path: Path, stretch: int, recorded_s: float) -> Recording:
    """Open a recording as soon as it contains the requested samples; raises RecordingError after 20 s."""
    give_up_s = time.monotonic() + PATIENCE_S
    while True:
        recording = open_recording(path.with_name(f"{path.name}.part"))
        labels = plan_of(recording).excitation.result_labels
        found = [each for each in recording.segments if each.label in labels]
        is_noise = SegmentLabel.REALISATION in labels
        counted = [each for each in found if each.is_complete] if is_noise else found[stretch - 1 : stretch]
        held = sum(each.stop - each.start for each in counted)
        if held / recording.sample_rate_hz > recorded_s * (1 - 1e-6):
            return recording
        recording.close()
        if time.monotonic() > give_up_s:
            raise RecordingError(f"{recorded_s:g} s of this part were not written to the file in time")
        time.sleep(_PAUSE_S)


def main() -> None:
    """Answer requests until standard input ends."""
    facts: dict[str, RecordingFacts] = {}
    sys.stdout.write("{}\n")
    sys.stdout.flush()
    for line in sys.stdin:
        query = json.loads(line)
        bounds: dict[str, float | None] = {}
        hindrance = ""
        try:
            with _open_when_there(Path(query["path"]), query["stretch"], query["recorded_s"]) as recording:
                if query["path"] not in facts:
                    facts[query["path"]] = recording_facts(recording, response=scanned_role(recording))
                known = facts[query["path"]]
                bounds = bounds_of(result_so_far(recording, known, query["stretch"], query["recorded_s"]))
        except (AnalysisError, RecordingError, *CONTRADICTIONS) as error:
            hindrance = str(error)
        sys.stdout.write(json.dumps({"bounds": bounds, "hindrance": hindrance}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
