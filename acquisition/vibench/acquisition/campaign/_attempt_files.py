"""The files of a point: one an attempt, ``NAME.h5``, ``NAME.2.h5``, ..., none of them ever overwritten."""

from pathlib import Path

from ..errors import RecordingError
from ..plan import Measurement
from ..recording import SUFFIX, SealDepth, part_of, tmp_of
from ._kept_recording import KeptRecording, looked_at


def attempts_in(folder: Path, name: str) -> tuple[Path, ...]:
    """Paths that this point's name has been given to, recordings finished or not, in order."""
    attempts: list[Path] = []
    while _is_taken(candidate := _attempt(folder, name, len(attempts) + 1)):
        attempts.append(candidate)
    return tuple(attempts)


def next_attempt(folder: Path, name: str) -> Path:
    """Path of the next recording of a point."""
    return _attempt(folder, name, len(attempts_in(folder, name)) + 1)


def complete_attempt(
    folder: Path, name: str, measurement: Measurement, depth: SealDepth
) -> KeptRecording | None:
    """Find a complete recording of a point; the last damaged one where there is no sound one, or None.

    Raises RecordingError when one is complete but was measured with another plan.
    """
    damaged: KeptRecording | None = None
    for path in attempts_in(folder, name):
        if not path.exists():
            continue
        found = looked_at(path, measurement, depth)
        if found.damage:
            damaged = found
        if not found.is_complete:
            continue
        if not found.is_of_this_plan:
            raise RecordingError(
                f"{path} is complete, but was made by another plan than the campaign's {name!r}. "
                "Nothing was recorded; give the measurement another name, or another folder"
            )
        return found
    return damaged


def _attempt(folder: Path, name: str, number: int) -> Path:
    # A measurement's name holds no dot, so that no second attempt takes another one's name.
    return folder / (f"{name}{SUFFIX}" if number == 1 else f"{name}.{number}{SUFFIX}")


def _is_taken(path: Path) -> bool:
    return any(each.exists() for each in (path, part_of(path), tmp_of(path)))
