"""Every recording of a folder held against its seal, and against the campaigns' journals beside it."""

from dataclasses import dataclass
from pathlib import Path

from ..errors import RecordingError
from ..recording import JOURNAL_SUFFIX, SUFFIX, SealDepth, SealKey, SealState, forget_checks, open_recording
from ._catalogue import UNREADABLE, place_below, recordings_below
from ._journal import JournalPoint, JournalPointState, is_begun, read_journal

MISSING = "missing"
"""Verdict on a recording that a journal counts on, and that is not there."""
BAD = frozenset(
    {SealState.DAMAGED.value, SealState.SEAL_GONE.value, SealState.OTHER_KEY.value, UNREADABLE, MISSING}
)


@dataclass(frozen=True)
class VerifiedRecording:
    """What was found of one file."""

    path: str
    """Below the folder, with ``/``; the name of a single file."""
    verdict: str
    """As in `recording.SealState`, ``unreadable`` or ``missing``."""
    sentence: str
    seal: str
    results: dict[str, str]
    """Verdict on each result that was saved in it."""

    @property
    def is_bad(self) -> bool:
        """Whether the file, or a result in it, is not as it was made."""
        return self.verdict in BAD or not BAD.isdisjoint(self.results.values())


def verify_recordings(
    place: Path,
    depth: SealDepth | str = SealDepth.WHOLE,
    key: SealKey | None = None,
) -> tuple[VerifiedRecording, ...]:
    """Hold a recording, or all of a folder and of those in it, against seals and journals; changes nothing.

    Parameters
    ----------
    place
        A recording or a folder.
    depth
        ``"quick"`` reads attributes, texts and tables, ``"whole"`` every sample too.
    key
        What they should be signed with, as `vibench.acquisition.recording.seal_key` reads it.

    Raises
    ------
    RecordingError
        When there is no such place, or the key cannot be read.

    """
    forget_checks()
    if not place.exists():
        raise RecordingError(f"{place} does not exist; give a recording, or a folder of recordings.")
    is_folder = place.is_dir() and not place.name.endswith(SUFFIX)
    paths = tuple(recordings_below(place)) if is_folder else (place,)
    root = place if is_folder else place.parent
    known: dict[Path, JournalPoint] = {}
    broken = []
    for journal in sorted(root.rglob(f"*{JOURNAL_SUFFIX}") if is_folder else root.glob(f"*{JOURNAL_SUFFIX}")):
        try:
            points = read_journal(journal) if is_begun(journal) else ()
        except RecordingError as error:
            broken.append(VerifiedRecording(place_below(root, journal), UNREADABLE, str(error), "", {}))
            continue
        known |= {
            journal.parent / point.file: point for point in points if point.state is JournalPointState.DONE
        }
    found = [_verified(path, root, SealDepth(depth), key) for path in paths]
    if is_folder:
        found += [_missing(path, root, point) for path, point in known.items() if not path.exists()]
    return (*found, *broken)


def _verified(path: Path, root: Path, depth: SealDepth, key: SealKey | None) -> VerifiedRecording:
    where = place_below(root, path)
    try:
        with open_recording(path) as recording:
            found = recording.check_seal(depth, key)
            results = {name: each.state.value for name, each in recording.check_result_seals(key).items()}
    except RecordingError as error:
        return VerifiedRecording(where, UNREADABLE, str(error), "", {})
    sentence = found.sentence
    bad = [name for name, each in results.items() if each in BAD]
    if bad:
        sentence += f"; not as they were saved: results {', '.join(bad)}"
    return VerifiedRecording(where, found.state.value, sentence, found.seal, results)


def _missing(path: Path, root: Path, point: JournalPoint) -> VerifiedRecording:
    return VerifiedRecording(
        place_below(root, path), MISSING, f"the campaign made it for {point.name}", point.seal, {}
    )
