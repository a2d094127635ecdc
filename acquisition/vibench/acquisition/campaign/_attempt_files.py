"""The files of a point: one an attempt, ``NAME.h5``, ``NAME.2.h5``, ..., none of them ever overwritten."""

from pathlib import Path

from pydantic import ValidationError

from ..errors import RecordingError
from ..plan import Measurement
from ..recording import SUFFIX, Recording, RecordingState, open_recording, part_of, tmp_of


def attempts_in(folder: Path, name: str) -> tuple[Path, ...]:
    """Paths that this point's name has been given to, recordings finished or not, in order."""
    attempts: list[Path] = []
    while _is_taken(candidate := _attempt(folder, name, len(attempts) + 1)):
        attempts.append(candidate)
    return tuple(attempts)


def next_attempt(folder: Path, name: str) -> Path:
    """Path of the next recording of a point."""
    return _attempt(folder, name, len(attempts_in(folder, name)) + 1)


def complete_attempt(folder: Path, name: str, measurement: Measurement) -> Path | None:
    """Find a complete recording of a point.

    Raises
    ------
    RecordingError
        When one is complete, but was made by another plan.

    """
    for path in attempts_in(folder, name):
        if not path.exists():
            continue
        with open_recording(path) as recording:
            if recording.state is not RecordingState.COMPLETE:
                continue
            if not is_made_by(recording, measurement):
                raise RecordingError(
                    f"{path} is complete, but was made by another plan than the campaign's {name!r}. "
                    "Nothing was recorded; give the measurement another name, or another folder"
                )
            return path
    return None


def is_made_by(recording: Recording, measurement: Measurement) -> bool:
    """Whether a recording was made by this plan, as this version understands what stands in it."""
    try:
        return Measurement.model_validate(recording.plan) == measurement
    except ValidationError:
        return False


def _attempt(folder: Path, name: str, number: int) -> Path:
    # A measurement's name holds no dot, so that no second attempt takes another one's name.
    return folder / (f"{name}{SUFFIX}" if number == 1 else f"{name}.{number}{SUFFIX}")


def _is_taken(path: Path) -> bool:
    return any(each.exists() for each in (path, part_of(path), tmp_of(path)))
