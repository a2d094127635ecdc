"""An excerpt of a recording becomes a file that other programs read."""

from enum import Enum, StrEnum, auto
from pathlib import Path

from ._csv import write_csv_samples
from ._excerpt import Excerpt, TransferObserver, unobserved
from ._facts_document import facts_path, write_facts
from ._mat import require_small, write_mat
from ._new_file import new_file, require_unused
from ._result_export import matlab_results, result_paths, write_result_tables
from ._uff import write_uff
from ._wav import require_sound, write_wav


class Format(StrEnum):
    """What an excerpt can become; the word is the file's suffix too."""

    CSV = "csv"
    """Text with units in its headings."""
    UFF = "uff"
    """Universal file, dataset 58, binary."""
    MAT = "mat"
    """MATLAB 5: a struct for each channel."""
    WAV = "wav"
    """Sound: 32 bits, full scale is 1."""


class Results(Enum):
    """Whether saved results go out with the samples."""

    LEFT_OUT = auto()
    INCLUDED = auto()


def export_samples(
    excerpt: Excerpt,
    to: Format,
    path: Path,
    results: Results = Results.LEFT_OUT,
    observer: TransferObserver = unobserved,
) -> tuple[Path, ...]:
    """Write the excerpt as ``path``, and what its format has no place for as ``PATH.facts.json`` beside it.

    Results become structs in a MATLAB file, and beside the others ``NAME.RESULT.AXIS.csv``. Gives the
    files that were written. Nothing is ever overwritten.

    Raises
    ------
    InvalidRequest
        When a name is taken, the disk refuses, or the format cannot hold so much; nothing is left of it.
    NotEnoughData
        When results are asked for and none is saved.

    """
    recording = excerpt.recording
    are_included = results is Results.INCLUDED
    if to is Format.MAT:
        require_small(excerpt)
        structs = matlab_results(recording) if are_included else {}
        with new_file(path) as unfinished:
            write_mat(excerpt, unfinished, structs, observer)
        return (path,)
    facts = facts_path(path)
    require_unused(facts)
    if to is Format.WAV:
        require_sound(excerpt)
    if are_included:
        result_paths(recording, path)
    with new_file(path) as unfinished:
        match to:
            case Format.CSV:
                write_csv_samples(excerpt, unfinished, observer)
            case Format.UFF:
                write_uff(excerpt, unfinished, observer)
            case Format.WAV:
                write_wav(excerpt, unfinished, observer)
    with new_file(facts) as unfinished:
        write_facts(excerpt, unfinished)
    tables = write_result_tables(recording, path) if are_included else ()
    return path, facts, *tables
