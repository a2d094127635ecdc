"""After a crash, journal and folder are brought together: what is true of the point that was running."""

from collections.abc import Sequence
from pathlib import Path

from ..errors import RecordingError
from ..plan import Measurement, Point
from ..recording import RecordingState, open_recording, part_of, recover
from ._attempt_files import complete_attempt, is_made_by
from ._journal import Journal
from ._journal_point import JournalPoint, PointState
from ._reason_code import Why

PROGRAM_ENDED = "its program ended in the middle of it"


def reconcile(journal: Journal, folder: Path) -> None:
    """Bring a journal that is gone on with up to date with the files beside it.

    A point that was running is done when its recording is complete (only the word in the journal was
    missing), and interrupted otherwise; what was left of its recording becomes a readable file. A
    done point whose recording has been taken away is queued again.
    """
    for point in journal.points():
        match point.state:
            case PointState.RUNNING:
                journal.end(point.name, *_ended(point, folder))
            case PointState.DONE if not (folder / point.file).exists():
                journal.requeue(point.name, Why.GONE, f"{point.file} is no longer in the folder")


def found_complete(points: Sequence[Point], folder: Path) -> dict[str, Path]:
    """Find what lies in the folder already, for a campaign whose journal is lost, or older than journals.

    Raises
    ------
    RecordingError
        When a recording is complete, but was made by another plan.

    """
    found = {each.name: complete_attempt(folder, each.name, each.measurement) for each in points}
    return {name: path for name, path in found.items() if path is not None}


def _ended(point: JournalPoint, folder: Path) -> tuple[PointState, Why, str]:
    path = folder / point.file
    try:
        if part_of(path).exists():
            recover(path)
        if path.exists():
            return _judged(path, point.measurement)
    except RecordingError as error:
        return PointState.INTERRUPTED, Why.PROGRAM_ENDED, f"{PROGRAM_ENDED}; {error}"
    return PointState.INTERRUPTED, Why.PROGRAM_ENDED, f"{PROGRAM_ENDED}, before anything was recorded"


def _judged(path: Path, measurement: Measurement) -> tuple[PointState, Why, str]:
    with open_recording(path) as recording:
        state, reason = recording.state, recording.reason
        if state is RecordingState.COMPLETE and is_made_by(recording, measurement):
            return PointState.DONE, Why.CARRIED_OUT, reason
        if state is RecordingState.INTERRUPTED:
            reason = f"{PROGRAM_ENDED}, {recording.duration_s:.1f} s into its recording"
    match state:
        case RecordingState.FAILED:
            return PointState.FAILED, Why.FAULT, reason
        case RecordingState.STOPPED:
            return PointState.INTERRUPTED, Why.STOPPED, reason
        case _:
            return PointState.INTERRUPTED, Why.PROGRAM_ENDED, reason
