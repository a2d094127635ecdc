"""Whether a recording that lies in the folder may be counted on: held against its seal, plan and journal."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import RecordingError
from ..plan import Measurement
from ..recording import Recording, RecordingState, SealDepth, SealState, open_recording


@dataclass(frozen=True)
class KeptRecording:
    """One file of a point, looked at."""

    path: Path
    state: RecordingState | None
    """How it ended; None where the file does not say."""
    reason: str
    duration_s: float
    seal: str
    damage: str
    """A sentence on what is wrong with the file; empty for a sound one, or one without a seal."""
    is_of_this_plan: bool
    rig: Mapping[str, Any] = field(default_factory=dict)
    """The configuration of the bench that made it."""

    @property
    def is_complete(self) -> bool:
        """Whether it is sound, and ended as planned."""
        return self.state is RecordingState.COMPLETE and not self.damage


def looked_at(path: Path, measurement: Measurement, depth: SealDepth) -> KeptRecording:
    """Look at a recording that was made for ``measurement``."""
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
    """Whether a recording was made by this plan, as this version understands what stands in it."""
    try:
        return Measurement.model_validate(recording.plan) == measurement
    except ValidationError:
        return False
