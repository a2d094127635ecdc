"""Catalogue of all recordings in a folder and its subfolders; only new or changed files are opened.

The catalogue ``catalogue.sqlite`` in the folder only repeats information from the files. A deleted catalogue
is created again.
"""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import astuple, dataclass, fields, replace
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any

from vibench.sim import count_text

from ..errors import RecordingError
from ..host.toml_file import member
from ..plan import present_word
from ..recording import (
    JOURNAL_SUFFIX,
    PART_SUFFIX,
    SUFFIX,
    Recording,
    RecordingState,
    SealCheck,
    SealDepth,
    SealKey,
    SealState,
    close_on_error,
    copy_sentence,
    first_copies,
    forget_checks,
    noted_seals,
    open_recording,
)
from ._journal import JournalPoint, JournalPointState, journal_exists, read_journal

UNREADABLE = "unreadable"
"""State of a file that is damaged or not a recording; the entry's ``reason`` states what is wrong."""
DAMAGED = "damaged"
"""State of a recording that can be opened but differs from its seal (checksum)."""
UNCHECKED = "samples not checked"
_FREQUENCIES = ("frequency_hz", "start_hz", "stop_hz", "low_hz", "high_hz", "band_start_hz", "band_stop_hz")


@dataclass(frozen=True)
class CatalogueEntry:
    """Catalogue entry of one recording. Unknown values are empty or None."""

    path: str
    """Path of the recording relative to the folder, with ``/`` as separator."""
    name: str
    """Name of the measurement."""
    state: str
    """State of the recording: value of `recording.RecordingState`, or ``damaged`` or ``unreadable``."""
    reason: str
    verdict: str
    """Either ``samples not checked``, or the problems found: ended early, near full scale, samples lost."""
    started_utc: str = ""
    origin: str = ""
    kind: str = ""
    """Kind of the excitation."""
    amplitude_vpp: float | None = None
    frequency_low_hz: float | None = None
    frequency_high_hz: float | None = None
    duration_s: float | None = None
    size_bytes: int = 0
    bench_check: str = ""
    """Verdict of the bench check before the recording."""
    results: str = ""
    """Names of the analysis results saved in the recording, separated by commas."""
    operator: str = ""
    notes: str = ""
    recording_id: str = ""
    samples_id: str = ""
    """Identifier of the samples, equal in all copies; see `vibench.acquisition.recording.Recording`."""
    seal: str = ""
    """State of the seal: value of `recording.SealState` after a quick check; empty if unknown."""

    @property
    def is_bad(self) -> bool:
        """Whether the recording is damaged or cannot be read."""
        return self.state in (UNREADABLE, DAMAGED)


def place_below(folder: Path, path: Path) -> str:
    """Return ``path`` relative to ``folder``; characters that cannot be decoded are replaced."""
    return os.fsencode(path.relative_to(folder).as_posix()).decode(errors="replace")


def read_entry(where: str, path: Path, size_bytes: int) -> CatalogueEntry:
    """Return the entry of a recording; if the file cannot be read, the entry contains the reason."""
    try:
        with open_recording(path) as recording:
            return _entry(recording, where, size_bytes)
    except RecordingError as error:
        stem, reason = Path(where).name.split(".")[0], str(error).encode(errors="replace").decode()
        return CatalogueEntry(where, stem, UNREADABLE, reason, "cannot be read", size_bytes=size_bytes)


def _entry(recording: Recording, where: str, size_bytes: int) -> CatalogueEntry:
    value = recording.plan.get("excitation")
    excitation = value if isinstance(value, dict) else {}
    low_hz, high_hz = _band(excitation)
    seal = recording.check_seal(SealDepth.QUICK)
    is_damaged = seal.state is SealState.DAMAGED
    return CatalogueEntry(
        path=where,
        name=str(recording.plan.get("name", Path(where).name.split(".")[0])),
        state=DAMAGED if is_damaged else recording.state.value,
        reason=seal.sentence if is_damaged else recording.reason,
        verdict=_verdict(recording, seal),
        started_utc=recording.started_utc,
        origin=recording.origin.value,
        kind=present_word(str(excitation.get("kind", ""))),
        amplitude_vpp=_number(excitation.get("amplitude_vpp")),
        frequency_low_hz=low_hz,
        frequency_high_hz=high_hz,
        duration_s=recording.duration_s,
        # The file of a running recording contains reserved space without samples; do not count this space.
        size_bytes=min(size_bytes, recording.stored_bytes) if recording.is_growing else size_bytes,
        bench_check=recording.check_text,
        results=", ".join(recording.result_names),
        operator=str(recording.confirmations.get("operator", "")),
        notes=str(recording.plan.get("notes", "")),
        recording_id=recording.recording_id,
        samples_id=recording.samples_id,
        seal=seal.state.value,
    )


def _band(excitation: dict[str, Any]) -> tuple[float | None, float | None]:
    grid, listed = excitation.get("grid"), excitation.get("frequencies_hz")
    tables = (excitation, grid) if isinstance(grid, dict) else (excitation,)
    named = [table.get(key) for table in tables for key in _FREQUENCIES]
    found = [
        number
        for each in (*named, *(listed if isinstance(listed, list) else ()))
        if (number := _number(each)) is not None
    ]
    return (min(found), max(found)) if found else (None, None)


def _number(value: object) -> float | None:
    """Return a value of a plan as a number; None if the value is not a number."""
    try:
        return float(value) if isinstance(value, int | float) else None
    except OverflowError:
        return None


def _verdict(recording: Recording, seal: SealCheck) -> str:
    concerns = [f"damaged: {seal.sentence}"] if seal.state is SealState.DAMAGED else []
    if recording.state is not RecordingState.COMPLETE:
        concerns.append(recording.state.value)
    if seal.state in (SealState.UNSEALED, SealState.SEAL_GONE):
        concerns.append("no seal" if seal.state is SealState.UNSEALED else "seal gone")
    if seal.state is SealState.OTHER_KEY:
        concerns.append("not signed with the given key")
    roles = ", ".join(dict.fromkeys(each.channel for each in recording.overloads))
    if roles:
        concerns.append(f"near full scale: {roles}")
    lost = sum(each.last_sample - each.first_sample + 1 for each in recording.gaps)
    if lost:
        concerns.append(f"{count_text(lost, 'sample')} lost")
    return "; ".join(concerns) or UNCHECKED


CATALOGUE_NAME = "catalogue.sqlite"
VERSION = 5
"""Version of the catalogue; increase it when the fields change. Catalogues of other versions are rebuilt."""
WAIT_S = 10.0
"""Longest wait for another program that writes the same catalogue [s]."""

_COLUMNS = tuple(field.name for field in fields(CatalogueEntry))
_TYPES = {"size_bytes": "INTEGER"} | dict.fromkeys(
    ("amplitude_vpp", "frequency_low_hz", "frequency_high_hz", "duration_s"), "REAL"
)


class Refresh(StrEnum):
    """Which recordings are read again when a folder is listed."""

    CHANGED = "changed"
    """Recordings that have changed since the last listing, and unfinished recordings."""
    ALL = "all"


def list_recordings(folder: Path, refresh: Refresh | str = Refresh.CHANGED) -> tuple[CatalogueEntry, ...]:
    """Return the recordings of a folder, oldest first, and update its catalogue.

    In a read-only folder, all files are read each time. Raises RecordingError when the folder does not exist,
    or when ``catalogue.sqlite`` is not a catalogue.
    """
    if not folder.is_dir():
        raise RecordingError(f"{folder} is not a folder; give the folder that contains the recordings.")
    try:
        with closing(_open_catalogue(folder, member(Refresh, refresh))) as connection:
            return _update(folder, connection)
    except (sqlite3.OperationalError, OSError):  # the disk is full or read-only
        with closing(_prepare(sqlite3.connect(":memory:", isolation_level=None))) as connection:
            return _update(folder, connection)
    except sqlite3.DatabaseError as error:
        raise RecordingError(
            f"{folder / CATALOGUE_NAME} is not a catalogue ({error}). Nothing was changed; rebuild the "
            "catalogue (vibench catalogue --rebuild) or, if this file is something else, move it away"
        ) from error


def _open_catalogue(folder: Path, refresh: Refresh) -> sqlite3.Connection:
    path = folder / CATALOGUE_NAME
    if refresh is Refresh.ALL:
        for each in (path, *(path.with_name(path.name + end) for end in ("-wal", "-shm", "-journal"))):
            each.unlink(missing_ok=True)
    with close_on_error(sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)) as connection:
        return _prepare(connection)


def _prepare(connection: sqlite3.Connection) -> sqlite3.Connection:
    connection.execute("BEGIN IMMEDIATE")
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != VERSION:
        columns = ", ".join(f"{name} {_TYPES.get(name, 'TEXT')}" for name in _COLUMNS)
        connection.execute("DROP TABLE IF EXISTS recordings")
        connection.execute(f"CREATE TABLE recordings ({columns}, stamp TEXT, PRIMARY KEY (path))")
        connection.execute(f"PRAGMA user_version = {VERSION}")
    return connection


def _update(folder: Path, connection: sqlite3.Connection) -> tuple[CatalogueEntry, ...]:
    """In one transaction, read new or changed files and drop entries of missing files; return all entries."""
    known = dict(connection.execute("SELECT path, stamp FROM recordings").fetchall())
    noted = cache(noted_seals)
    for path in recordings_below(folder):
        try:
            found = path.stat()
            size_bytes = found.st_size
            # The stamp changes when the file is written, or when its seal in a journal changes. It contains
            # the file system's time of change, which programs cannot set back.
            seals = "".join(
                f" {each.seal} {each.attempt_seal}" for each in noted(path.parent).get(path.name, ())
            )
            stamp = f"{found.st_ino} {found.st_size} {found.st_mtime_ns} {found.st_ctime_ns}{seals}"
        except FileNotFoundError:  # the recording was finished meanwhile and has its final name
            continue
        except OSError:  # for example a link to itself; its entry says "unreadable"
            size_bytes, stamp = 0, ""
        where = place_below(folder, path)
        # When the program that writes a .part file ends, the recording becomes "interrupted", although the
        # file stays the same.
        if known.pop(where, None) != stamp or path.suffix == PART_SUFFIX:
            entry = read_entry(where, path, size_bytes)
            marks = ", ".join("?" * (len(_COLUMNS) + 1))
            connection.execute(
                f"INSERT OR REPLACE INTO recordings VALUES ({marks})",  # noqa: S608 - only question marks
                # A disk error may be temporary: an empty stamp makes the next update read the file again.
                (*astuple(entry), "" if entry.state == UNREADABLE else stamp),
            )
    connection.executemany("DELETE FROM recordings WHERE path = ?", ((path,) for path in known))
    connection.execute("COMMIT")
    columns = ", ".join(_COLUMNS)
    rows = connection.execute(
        f"SELECT {columns} FROM recordings ORDER BY started_utc, path"  # noqa: S608 - names of fields
    )
    entries = [CatalogueEntry(*row) for row in rows]
    firsts = [entries[first] for first in first_copies(entries)]
    return tuple(
        each
        if each is first
        else replace(each, verdict=f"{each.verdict}; {copy_sentence(first, first.path, each)}")
        for each, first in zip(entries, firsts, strict=True)
    )


def recordings_below(folder: Path) -> Iterator[Path]:
    """Yield every recording of a folder and its subfolders, finished or not."""
    yield from sorted(folder.rglob(f"*{SUFFIX}"))
    yield from sorted(folder.rglob(f"*{SUFFIX}{PART_SUFFIX}"))


MISSING = "missing"
"""Verdict on a recording that a journal lists but that does not exist."""
BAD = frozenset(
    {SealState.DAMAGED.value, SealState.SEAL_GONE.value, SealState.OTHER_KEY.value, UNREADABLE, MISSING}
)


@dataclass(frozen=True)
class VerifiedRecording:
    """Result of comparing one file with its seal."""

    path: str
    """Path relative to the folder, with ``/`` as separator; for a single file, its name."""
    verdict: str
    """State of the seal: value of `recording.SealState`, or ``unreadable`` or ``missing``."""
    sentence: str
    seal: str
    results: dict[str, str]
    """Verdict on each saved result, keyed by the name of the result."""

    @property
    def is_bad(self) -> bool:
        """Whether the verdict on the file, or on a result saved in it, is listed in `BAD`."""
        return self.verdict in BAD or not BAD.isdisjoint(self.results.values())


def verify_recordings(
    place: Path,
    depth: SealDepth | str = SealDepth.WHOLE,
    key: SealKey | None = None,
) -> tuple[VerifiedRecording, ...]:
    """Compare recordings with their seals and journals; return one result per file. No file is changed.

    Raises RecordingError when ``place`` does not exist, or when the key cannot be read.

    Parameters
    ----------
    place
        A recording, or a folder whose recordings are all verified, including those in subfolders.
    depth
        ``"quick"`` reads attributes, texts and tables; ``"whole"`` also reads every sample.
    key
        Key with which the seals were signed, from `vibench.acquisition.recording.seal_key`.
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
            points = read_journal(journal) if journal_exists(journal) else ()
        except RecordingError as error:
            broken.append(VerifiedRecording(place_below(root, journal), UNREADABLE, str(error), "", {}))
            continue
        known |= {
            journal.parent / point.file: point for point in points if point.state is JournalPointState.DONE
        }
    found = [_verify(path, root, SealDepth(depth), key) for path in paths]
    if is_folder:
        found += [_missing(path, root, point) for path, point in known.items() if not path.exists()]
    return (*found, *broken)


def _verify(path: Path, root: Path, depth: SealDepth, key: SealKey | None) -> VerifiedRecording:
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
        sentence += f"; results that were changed after they had been saved: {', '.join(bad)}"
    return VerifiedRecording(where, found.state.value, sentence, found.seal, results)


def _missing(path: Path, root: Path, point: JournalPoint) -> VerifiedRecording:
    return VerifiedRecording(
        place_below(root, path), MISSING, f"the campaign recorded {point.name} here", point.seal, {}
    )
