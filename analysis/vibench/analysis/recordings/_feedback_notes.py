"""What a measurement with feedback found and decided while it ran, as it noted it in its recording."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from vibench.acquisition.recording import Recording

FEEDBACK_KINDS = ("settled", "achieved", "level", "jump", "resonance")
"""Events whose text is JSON: one object of numbers and words."""


@dataclass(frozen=True)
class FeedbackNote:
    """One thing that was found or decided."""

    kind: str
    time_s: float
    """From the beginning of the recording [s]."""
    numbers: Mapping[str, int | float | str | None]


def feedback_notes(recording: Recording) -> tuple[FeedbackNote, ...]:
    """Read all notes, in the order of time; one that was cut short in the file is left out."""
    return tuple(_notes(recording))


def _notes(recording: Recording) -> Iterator[FeedbackNote]:
    for event in recording.events:
        if event.kind not in FEEDBACK_KINDS:
            continue
        try:
            numbers = json.loads(event.text)
        except json.JSONDecodeError:
            continue
        if isinstance(numbers, dict):
            yield FeedbackNote(event.kind, event.sample / recording.sample_rate_hz, numbers)
