"""All recordings of a folder and the folders in it, found without opening the ones that are known already.

The catalogue is a copy of what the files say, kept in ``catalogue.sqlite`` beside them: it can be deleted
and made again at any time.
"""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import astuple, fields
from enum import StrEnum
from pathlib import Path

from ..errors import RecordingError
from ..host.chosen import chosen
from ..recording import PART_SUFFIX, SUFFIX
from ._catalogue_entry import CatalogueEntry, place_below, read_entry

CATALOGUE_NAME = "catalogue.sqlite"
VERSION = 3
"""Raised whenever an entry changes; an older catalogue is then made again."""
WAIT_S = 10.0
"""For another program that is writing the same catalogue."""

_COLUMNS = tuple(field.name for field in fields(CatalogueEntry))
_TYPES = {"size_bytes": "INTEGER"} | dict.fromkeys(
    ("amplitude_vpp", "frequency_low_hz", "frequency_high_hz", "duration_s"), "REAL"
)


class Refresh(StrEnum):
    """Which recordings are read again."""

    CHANGED = "changed"
    """Those that anybody has written to since, and those that are not finished."""
    ALL = "all"


def list_recordings(folder: Path, refresh: Refresh | str = Refresh.CHANGED) -> tuple[CatalogueEntry, ...]:
    """List the recordings of a folder, the oldest first, and bring its catalogue up to date.

    In a folder that may not be written the list is made anew each time.

    Raises
    ------
    RecordingError
        When there is no such folder, or ``catalogue.sqlite`` is something else.

    """
    if not folder.is_dir():
        raise RecordingError(f"{folder} is no folder; give the folder that the recordings are in.")
    try:
        with closing(_opened(folder, chosen(Refresh, refresh))) as connection:
            _update(folder, connection)
            return _entries(connection)
    except (sqlite3.OperationalError, PermissionError):
        with closing(_prepared(sqlite3.connect(":memory:", isolation_level=None))) as connection:
            _update(folder, connection)
            return _entries(connection)
    except sqlite3.DatabaseError as error:
        raise RecordingError(
            f"{folder / CATALOGUE_NAME} is no catalogue ({error}). Nothing was changed; rebuild it, or move "
            "it away if it is something else"
        ) from error


def _opened(folder: Path, refresh: Refresh) -> sqlite3.Connection:
    path = folder / CATALOGUE_NAME
    if refresh is Refresh.ALL:
        for each in (path, *(path.with_name(path.name + end) for end in ("-wal", "-shm", "-journal"))):
            each.unlink(missing_ok=True)
    connection = sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)
    try:
        return _prepared(connection)
    except sqlite3.Error:
        connection.close()
        raise


def _prepared(connection: sqlite3.Connection) -> sqlite3.Connection:
    connection.execute("BEGIN IMMEDIATE")
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != VERSION:
        columns = ", ".join(f"{name} {_TYPES.get(name, 'TEXT')}" for name in _COLUMNS)
        connection.execute("DROP TABLE IF EXISTS recordings")
        connection.execute(f"CREATE TABLE recordings ({columns}, stamp TEXT, PRIMARY KEY (path))")
        connection.execute(f"PRAGMA user_version = {VERSION}")
    return connection


def _update(folder: Path, connection: sqlite3.Connection) -> None:
    """Read what is new or changed, and forget what is gone; all in one transaction."""
    known = dict(connection.execute("SELECT path, stamp FROM recordings").fetchall())
    for path in recordings_below(folder):
        try:
            found = path.stat()
            size_bytes, stamp = found.st_size, _stamp(found)
        except FileNotFoundError:  # it got its final name while we looked
            continue
        except OSError:  # a link that leads to itself: its entry says that it cannot be read
            size_bytes, stamp = 0, ""
        where = place_below(folder, path)
        # A .part says "interrupted" when its program is dead, and no byte of it changes for that.
        if known.pop(where, None) != stamp or path.suffix == PART_SUFFIX:
            entry = read_entry(where, path, size_bytes)
            marks = ", ".join("?" * (len(_COLUMNS) + 1))
            connection.execute(
                f"INSERT OR REPLACE INTO recordings VALUES ({marks})",  # noqa: S608 - question marks alone
                (*astuple(entry), stamp),
            )
    connection.executemany("DELETE FROM recordings WHERE path = ?", ((path,) for path in known))
    connection.execute("COMMIT")


def _stamp(found: os.stat_result) -> str:
    """Give what differs after any write: no program sets back the time that the file system noted."""
    return f"{found.st_ino} {found.st_size} {found.st_mtime_ns} {found.st_ctime_ns}"


def recordings_below(folder: Path) -> Iterator[Path]:
    """Give every recording of a folder and the folders in it, finished or not."""
    yield from sorted(folder.rglob(f"*{SUFFIX}"))
    yield from sorted(folder.rglob(f"*{SUFFIX}{PART_SUFFIX}"))


def _entries(connection: sqlite3.Connection) -> tuple[CatalogueEntry, ...]:
    columns = ", ".join(_COLUMNS)
    rows = connection.execute(
        f"SELECT {columns} FROM recordings ORDER BY started_utc, path"  # noqa: S608 - names of fields
    )
    return tuple(CatalogueEntry(*row) for row in rows)
