"""A recording whose program died becomes a finished one, with everything that was committed."""

from pathlib import Path

from ..errors import RecordingError
from . import _layout as layout
from ._disk import sole_use
from ._finalise import discard, finalise
from ._reader import open_recording
from ._seal import SealDepth, SealKey, SealState, seal_key


def recover(path: Path | str) -> Path:
    """Finish what an interrupted recording left; returns the path of ``NAME.h5``.

    ``path`` is ``NAME.h5.part`` or ``NAME.h5``. What a crash left behind is told apart by itself:
    samples that were never compressed, a compressed copy that was never completed, or a complete
    one whose ``.part`` was not yet deleted.

    Raises
    ------
    RecordingError
        When there is nothing to recover, the file is still being recorded, or is not ours.

    """
    path = Path(path)
    final = path.with_suffix("") if path.suffix == layout.PART_SUFFIX else path
    part = layout.part_of(final)
    if not part.exists():
        instead = f"analyse {final.name}, which is there" if final.exists() else "give the path of a .h5.part"
        raise RecordingError(f"{part} does not exist, so there is nothing to recover; {instead}.")
    key = seal_key()
    try:
        _finish(part, final, key)
        discard(part)
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(
            f"{part} cannot be recovered: {error}. Nothing is lost; see that folder and file may be written,"
            " and try again."
        ) from error
    return final


def _finish(part: Path, final: Path, key: SealKey | None) -> None:
    with sole_use(part):
        with open_recording(part) as source:
            if not source.is_growing:
                raise RecordingError(f"{part} is a finished recording; rename it to {final.name}")
            is_done = final.exists() and _holds(final, source.recording_id, part)
        if not is_done:
            # Left by a crash while the copy was made; everything in it is in the .part.
            layout.tmp_of(final).unlink(missing_ok=True)
            finalise(part, key)


def _holds(final: Path, recording_id: str, part: Path) -> bool:
    """Whether the finished file is the copy of this very recording, and whole."""
    with open_recording(final) as copy:
        same, seal = copy.recording_id == recording_id, copy.check_seal(SealDepth.WHOLE)
    if not same:
        raise RecordingError(
            f"{final} is another recording than {part}, and nothing is ever overwritten."
            " Nothing was changed; rename one of the two and try again."
        )
    if seal.state in (SealState.DAMAGED, SealState.SEAL_GONE):
        raise RecordingError(
            f"{final} is damaged ({seal.sentence}), and {part} still holds what it was made of."
            f" Nothing was changed; rename {final.name} and try again."
        )
    return same
