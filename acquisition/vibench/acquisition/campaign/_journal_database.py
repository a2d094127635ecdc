"""The SQLite file of a journal: its tables, how it is opened, and its errors as sentences.

docs/campaigns.md describes the tables for a stranger.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from ..errors import RecordingError
from ..recording import closed_on_error, opened, opened_to_look

VERSION = 2

SEAL_COLUMNS = tuple(
    f"ALTER TABLE {table} ADD COLUMN seal TEXT NOT NULL DEFAULT ''" for table in ("points", "attempts")
)
"""What version 1 lacks."""

SCHEMA = """
CREATE TABLE campaign (
    key TEXT PRIMARY KEY,
    value TEXT NOT NULL
);
CREATE TABLE benches (
    since_utc TEXT NOT NULL,
    identity_json TEXT NOT NULL
);
CREATE TABLE points (
    name TEXT PRIMARY KEY COLLATE NOCASE,
    place INTEGER NOT NULL,
    measurement_json TEXT NOT NULL,
    chain TEXT NOT NULL,
    added_after TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'interrupted')),
    why TEXT NOT NULL,
    reason TEXT NOT NULL,
    file TEXT NOT NULL,
    is_followed_up INTEGER NOT NULL,
    seal TEXT NOT NULL
);
CREATE TABLE attempts (
    name TEXT NOT NULL REFERENCES points (name),
    number INTEGER NOT NULL,
    file TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'interrupted')),
    why TEXT NOT NULL,
    reason TEXT NOT NULL,
    begun_utc TEXT NOT NULL,
    ended_utc TEXT NOT NULL,
    seal TEXT NOT NULL,
    PRIMARY KEY (name, number)
);
"""

POINTS = """
SELECT points.*, (SELECT COUNT(*) FROM attempts WHERE attempts.name = points.name) AS attempts,
    COALESCE((SELECT begun_utc FROM attempts WHERE attempts.name = points.name
        ORDER BY number DESC LIMIT 1), '') AS begun_utc,
    COALESCE((SELECT ended_utc FROM attempts WHERE attempts.name = points.name
        ORDER BY number DESC LIMIT 1), '') AS ended_utc
FROM points ORDER BY place
"""


def is_begun(path: Path) -> bool:
    """Whether a journal stands there; one whose program died before its first commit does not."""
    if not path.is_file():
        return False
    with sentences(path), closing(opened_to_look(path)) as connection:
        return (
            connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'campaign'").fetchone() is not None
        )


def connected(path: Path) -> sqlite3.Connection:
    """Open a database to write, so that what it has committed survives a kill and a power cut."""
    with sentences(path), closed_on_error(opened(path.resolve().as_uri())) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection


def brought_up(connection: sqlite3.Connection) -> None:
    """Give a journal of version 1 what it lacks, in one transaction."""
    connection.execute("BEGIN IMMEDIATE")
    (version,) = connection.execute("SELECT value FROM campaign WHERE key = 'version'").fetchone()
    if int(version) < VERSION:
        for statement in SEAL_COLUMNS:
            connection.execute(statement)
        connection.execute("UPDATE campaign SET value = ? WHERE key = 'version'", (str(VERSION),))
    connection.execute("COMMIT")


def require_version(path: Path, connection: sqlite3.Connection) -> None:
    """Refuse what is no journal, or one of a newer version; raises RecordingError."""
    try:
        row = connection.execute("SELECT value FROM campaign WHERE key = 'version'").fetchone()
    except sqlite3.Error as error:
        raise RecordingError(
            f"{path} is no journal of a campaign ({error}). Nothing was changed; give another folder"
        ) from error
    if row is None or int(row["value"]) > VERSION:
        raise RecordingError(
            f"{path} was written by a newer version of vibench. Nothing was changed; use that version"
        )


@contextmanager
def sentences(path: Path) -> Iterator[None]:
    """Let an error of the database become a sentence, and what stands in it that cannot be."""
    try:
        yield
    except (ValueError, TypeError, LookupError) as error:  # pydantic's; columns gone
        raise RecordingError(
            f"the journal {path} cannot be understood ({str(error).splitlines()[0]}): it is damaged, or of "
            "another version. Nothing was changed; put back a copy, or move it away: what lies there is found"
        ) from error
    except sqlite3.Error as error:
        raise RecordingError(
            f"the journal {path} cannot be read or written ({error}). What was recorded is kept; see that "
            "the disk has room and the folder may be written, and resume"
        ) from error
