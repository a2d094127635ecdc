"""A point as a campaign's journal knows it, for the campaign itself and for whoever looks."""

import re
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from ..errors import RecordingError
from ..plan import Measurement
from ..recording import opened_to_look
from ._journal_database import POINTS, require_version, sentences
from ._point_outcome import ReasonCode


class JournalPointState(StrEnum):
    """Where a point stands."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    """Stopped by somebody, or by the end of its program."""


@dataclass(frozen=True)
class JournalPoint:
    """One point as the journal knows it."""

    name: str
    measurement: Measurement
    chain: str
    added_after: str
    """The point whose result asked for this one; empty when it stood in the plan."""
    state: JournalPointState
    reason_code: ReasonCode
    reason: str
    file: str
    """Of the last attempt; a name in the journal's folder, empty before the first."""
    attempts: int
    is_followed_up: bool
    """Whether what its result asks for is in the journal."""
    begun_utc: str
    ended_utc: str
    """Of the last attempt."""
    seal: str
    """Of its recording; empty before there is one, and of recordings that had none."""


def read_journal(path: Path) -> tuple[JournalPoint, ...]:
    """Look at a journal, also while its campaign runs; changes nothing.

    Raises
    ------
    RecordingError
        When there is no journal, or it is not one.

    """
    if not path.is_file():
        raise RecordingError(f"{path} does not exist, or is no file; give the path of a campaign's journal.")
    with sentences(path), closing(opened_to_look(path)) as connection:
        require_version(path, connection)
        return points_of(connection)


def _own_name(file: str) -> str:
    """Refuse a file outside the journal's folder: what lies there is recovered, and cleared of copies."""
    if not re.fullmatch(r"([^/\\\0]{1,250}\.h5)?", file):
        raise ValueError(f"{file[:80]!r} is no name of a recording")
    return file


def points_of(connection: sqlite3.Connection) -> tuple[JournalPoint, ...]:
    """Every point, in the order in which they are made."""
    return tuple(
        JournalPoint(
            name=row["name"],
            measurement=Measurement.model_validate_json(row["measurement_json"]),
            chain=row["chain"],
            added_after=row["added_after"],
            state=JournalPointState(row["state"]),
            reason_code=ReasonCode(row["why"]),
            reason=row["reason"],
            file=_own_name(row["file"]),
            attempts=row["attempts"],
            is_followed_up=bool(row["is_followed_up"]),
            begun_utc=row["begun_utc"],
            ended_utc=row["ended_utc"],
            seal=row["seal"] if "seal" in row.keys() else "",  # noqa: SIM118 - a row iterates over its values
        )
        for row in connection.execute(POINTS)
    )
