"""Recordings of a point: one file for each attempt (``NAME.h5``, ``NAME.2.h5``, ...), never overwritten."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import RecordingError
from ..plan import Measurement
from ..recording import (
    SUFFIX,
    Recording,
    RecordingState,
    SealDepth,
    SealState,
    open_recording,
    part_of,
    tmp_of,
)


@dataclass(frozen=True)
class KeptRecording:
    """State of the recording of one attempt at a point, as read from its file."""

    path: Path
    state: RecordingState | None
    """State of the recording; None if the file cannot be read."""
    reason: str
    duration_s: float
    seal: str
    damage: str
    """Description of the damage; empty if the file is sound or has no seal."""
    is_of_this_plan: bool
    rig: Mapping[str, Any] = field(default_factory=dict)
    """Configuration of the bench on which the recording was made."""

    @property
    def is_complete(self) -> bool:
        """Whether the recording is undamaged and its run ended as planned."""
        return self.state is RecordingState.COMPLETE and not self.damage


def read_attempt(path: Path, measurement: Measurement, depth: SealDepth) -> KeptRecording:
    """Return the state of the recording at ``path``, and whether its plan equals ``measurement``."""
    try:
        with open_recording(path) as recording:
            found = recording.check_seal(depth)
            is_made = is_made_by(recording, measurement)
            is_damaged = found.state in (SealState.DAMAGED, SealState.SEAL_GONE)
            damage = f"{path.name} is damaged ({found.sentence})" if is_damaged else ""
            return KeptRecording(
                path,
                recording.state,
                recording.reason,
                recording.duration_s,
                found.seal,
                damage,
                is_made,
                recording.bench,
            )
    except RecordingError as error:
        return KeptRecording(path, None, "", 0.0, "", str(error), is_of_this_plan=False)


def is_made_by(recording: Recording, measurement: Measurement) -> bool:
    """Return whether the plan of a recording, as read by this version of vibench, equals ``measurement``."""
    try:
        return Measurement.model_validate(recording.plan) == measurement
    except ValidationError:
        return False


def attempts_in(folder: Path, name: str) -> tuple[Path, ...]:
    """Return the paths of all recordings of the point ``name``, finished or not, in order of the attempts."""
    attempts: list[Path] = []
    while _is_taken(candidate := _attempt(folder, name, len(attempts) + 1)):
        attempts.append(candidate)
    return tuple(attempts)


def next_attempt(folder: Path, name: str) -> Path:
    """Return the path for the next recording of the point ``name``."""
    return _attempt(folder, name, len(attempts_in(folder, name)) + 1)


def complete_attempt(
    folder: Path, name: str, measurement: Measurement, depth: SealDepth
) -> KeptRecording | None:
    """Return the complete recording of a point; if there is none, the last damaged one, or None.

    Raises RecordingError when a recording is complete but was measured with another plan.
    """
    damaged: KeptRecording | None = None
    for path in attempts_in(folder, name):
        if not path.exists():
            continue
        found = read_attempt(path, measurement, depth)
        if found.damage:
            damaged = found
        if not found.is_complete:
            continue
        if not found.is_of_this_plan:
            raise RecordingError(
                f"{path} is complete, but the campaign has another plan for {name!r}. "
                "Nothing was recorded; give the measurement another name, or choose another folder"
            )
        return found
    return damaged


def _attempt(folder: Path, name: str, number: int) -> Path:
    # Attempts are numbered after a dot. Names contain no dot, so no other point can have the same file.
    return folder / (f"{name}{SUFFIX}" if number == 1 else f"{name}.{number}{SUFFIX}")


def _is_taken(path: Path) -> bool:
    return any(each.exists() or each.is_symlink() for each in (path, part_of(path), tmp_of(path)))
