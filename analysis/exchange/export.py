"""An excerpt of a recording becomes a file that other programs read."""

from enum import StrEnum
from pathlib import Path

from .csv_export import write_csv_samples
from .excerpt import Excerpt, Watcher, unwatched
from .facts_document import facts_path, write_facts
from .mat_export import require_small, write_mat
from .new_file import new_file, require_unused
from .uff_export import write_uff


class Format(StrEnum):
    """What an excerpt can become; the word is the file's suffix too."""

    CSV = "csv"
    """Text with units in its headings."""
    UFF = "uff"
    """Universal file, dataset 58, binary."""
    MAT = "mat"
    """MATLAB 5: a struct for each channel."""


def export_samples(
    excerpt: Excerpt, to: Format, path: Path, watcher: Watcher = unwatched
) -> tuple[Path, ...]:
    """Write the excerpt as ``path``, and what its format has no place for as ``PATH.facts.json`` beside it.

    Gives the files that were written. Nothing is ever overwritten.

    Raises
    ------
    InvalidRequest
        When a name is taken, the disk refuses, or the format cannot hold so much; nothing is left of it.

    """
    if to is Format.MAT:
        require_small(excerpt)
        with new_file(path) as unfinished:
            write_mat(excerpt, unfinished, watcher)
        return (path,)
    facts = facts_path(path)
    require_unused(facts)
    with new_file(path) as unfinished:
        match to:
            case Format.CSV:
                write_csv_samples(excerpt, unfinished, watcher)
            case Format.UFF:
                write_uff(excerpt, unfinished, watcher)
    with new_file(facts) as unfinished:
        write_facts(excerpt, unfinished)
    return path, facts
