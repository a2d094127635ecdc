"""Journal of a campaign on disk: the state of every point, committed before and after each step.

SQLite in WAL mode with full synchronisation is used: a finished transaction survives a kill and a power cut,
and an unfinished one leaves no trace. After a kill the journal is correct, with one exception: the point that
was being measured is still ``running``.
"""

import re
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from ..bench import Bench
from ..errors import (
    AcquisitionError,
    CheckFailed,
    ConfigurationError,
    DataLost,
    DriveLate,
    InstrumentError,
    InstrumentLost,
    LimitExceeded,
    RecordingError,
)
from ..host.beside import ClosedOnLeaving
from ..host.toml_file import FrozenModel
from ..plan import Campaign, Measurement, Point
from ..recording import JOURNAL_SUFFIX, Recording, close_on_error, open_database, open_read_only
from ..rig import Rig
from ..run.ending import Progress


class BenchIdentity(FrozenModel):
    """Properties of a bench that must not change during a campaign unless the change is confirmed."""

    rig: Rig
    instruments: dict[str, dict[str, str]]
    """Identity of each instrument: maker, model, serial number and firmware."""
    knobs: dict[str, str]
    """Confirmed manual settings (knobs), without time of confirmation and name of the operator."""

    @classmethod
    def of(cls, bench: Bench) -> Self:
        """Return configuration, instruments and manual settings of an open bench."""
        instruments = {
            part: {name: getattr(each, name) for name in ("maker", "model", "serial", "firmware")}
            for part, each in bench.identities.items()
        }
        return cls(rig=bench.rig, instruments=instruments, knobs=bench.confirmations.values)

    def differences(self, now: "BenchIdentity") -> tuple[str, ...]:
        """Return one clause of text for each difference between this bench and a later one, ``now``."""
        return differences(self.model_dump(mode="json"), now.model_dump(mode="json"))


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> tuple[str, ...]:
    """Return one clause of text for each difference between two nested descriptions."""
    return tuple(_differences("", before, now))


def _differences(place: str, before: Any, now: Any) -> Iterator[str]:
    match before, now:
        case Mapping(), Mapping():
            for key in dict.fromkeys((*before, *now)):
                yield from _differences(
                    f"{place}.{key}".removeprefix("."), before.get(key, _ABSENT), now.get(key, _ABSENT)
                )
        case list(), list() if len(before) == len(now):
            for number, (one, other) in enumerate(zip(before, now, strict=True)):
                yield from _differences(f"{place}.{number}", one, other)
        case _ if before != now:
            yield f"{place} was {before!r} and is now {now!r}"


class _Absent:
    def __repr__(self) -> str:
        return "absent"


_ABSENT = _Absent()


class ReasonCode(StrEnum):
    """Reason for the state of a point; all values of `plan.Retryable` are included."""

    NOT_YET = "not_yet"
    """The measurement of the point has not started yet."""
    RUNNING = "running"
    CARRIED_OUT = "carried_out"
    OVER_RANGE = "over_range"
    """The point was measured, but an input was near its full scale in a recorded segment."""
    FOUND = "found"
    """A complete recording of the same plan was already in the folder."""
    GONE = "gone"
    """The point was measured, but its recording is missing."""
    DAMAGED = "damaged"
    """The point was measured, but its recording differs from its seal (checksum). The file is kept, and the
    point is measured again."""
    STOPPED = "stopped"
    """A stop was requested; the text of the reason names who requested it."""
    PROGRAM_ENDED = "program_ended"
    """The program was killed or crashed, or the computer lost power."""
    DATA_LOST = "data_lost"
    INSTRUMENT_LOST = "instrument_lost"
    INSTRUMENT_FAULT = "instrument_fault"
    CHECK_FAILED = "check_failed"
    LIMIT = "limit"
    DISK = "disk"
    PLAN = "plan"
    """The bench cannot play the plan of the measurement."""
    FAULT = "fault"
    """Any other fault during the measurement."""


_CODE_BY_ERROR: tuple[tuple[type[AcquisitionError], ReasonCode], ...] = (
    (DataLost, ReasonCode.DATA_LOST),
    (InstrumentLost, ReasonCode.INSTRUMENT_LOST),
    (InstrumentError, ReasonCode.INSTRUMENT_FAULT),
    (CheckFailed, ReasonCode.CHECK_FAILED),
    (LimitExceeded, ReasonCode.LIMIT),
    (RecordingError, ReasonCode.DISK),
    (ConfigurationError, ReasonCode.PLAN),
    (DriveLate, ReasonCode.PLAN),
)


def reason_code_of(error: AcquisitionError) -> ReasonCode:
    """Return the code with which the journal names the reason for an error."""
    return next(
        (reason_code for kind, reason_code in _CODE_BY_ERROR if isinstance(error, kind)), ReasonCode.FAULT
    )


class ExistingRecordings(StrEnum):
    """What to do with recordings that are already in the folder."""

    REFUSE = "refuse"
    """Refuse to start a campaign in a folder that already has recordings of this campaign."""
    RESUME = "resume"
    """Keep complete recordings; measure all other points again, in new files beside the old files."""


class AfterFailure(StrEnum):
    """What to do when all attempts at a measurement have failed."""

    STOP = "stop"
    GO_ON = "go_on"
    """Continue with the next measurement, unless an instrument is lost or the disk cannot be written to."""


class ChangedBench(StrEnum):
    """What to do when a campaign is resumed on a bench other than the one on which it was started."""

    REFUSE = "refuse"
    ACCEPT = "accept"
    """Continue the campaign, and record both benches in the journal."""


class PointOutcome(StrEnum):
    """Result of one recording of a campaign."""

    RECORDED = "recorded"
    KEPT = "kept"
    """The recording was already complete before this run of the campaign."""
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class PointResult:
    """Result of one recording of a campaign, and the reason for this result."""

    name: str
    outcome: PointOutcome
    path: Path
    reason: str
    reason_code: ReasonCode


@dataclass(frozen=True, eq=False)
class CampaignProgress:
    """Progress of a campaign, reported after each block of samples."""

    name: str
    number: int
    """Number of the current recording, from 1."""
    count: int
    """Total number of recordings in the campaign."""
    path: Path
    """Path of the current recording."""
    run: Progress


@dataclass(frozen=True)
class PlannedRecording:
    """One planned recording of a campaign, with its path."""

    name: str
    measurement: Measurement
    path: Path
    is_complete: bool = False
    """Whether a complete recording of the same plan already exists."""


@dataclass(frozen=True)
class FinishedPoint:
    """Argument of the ``after`` callback: the point that was just measured, and all completed points."""

    point: PlannedRecording
    done: tuple[PlannedRecording, ...]
    """All completed points of this and earlier sessions in the order of the campaign, including ``point``."""


After = Callable[[FinishedPoint, Recording], Iterable[Measurement]]
"""Function called with the open recording after every point; it may return measurements to make next."""


def ignore_result(result: object) -> None:
    """Ignore a ``result``, an event or progress; the default of every listener."""


# SQLite file of a journal: tables (see docs/campaigns.md), connections, and errors.

VERSION = 2

SEAL_COLUMNS = tuple(
    f"ALTER TABLE {table} ADD COLUMN seal TEXT NOT NULL DEFAULT ''" for table in ("points", "attempts")
)
"""SQL statements that add the columns missing in journals of version 1."""

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


def journal_exists(path: Path) -> bool:
    """Return whether ``path`` is a journal; a database without a committed transaction is no journal."""
    if not path.is_file():
        return False
    with sentences(path), closing(open_read_only(path)) as connection:
        return (
            connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'campaign'").fetchone() is not None
        )


def connect(path: Path) -> sqlite3.Connection:
    """Return a database connection for writing; its commits survive a kill and a power cut."""
    with sentences(path), close_on_error(open_database(path.resolve().as_uri())) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection


def require_version(path: Path, connection: sqlite3.Connection) -> None:
    """Refuse a file that is not a journal, or a journal of a newer version; raises RecordingError."""
    try:
        row = connection.execute("SELECT value FROM campaign WHERE key = 'version'").fetchone()
    except sqlite3.Error as error:
        raise RecordingError(
            f"{path} is not a campaign's journal ({error}). Nothing was changed; give another folder"
        ) from error
    if row is None or int(row["value"]) > VERSION:
        raise RecordingError(
            f"{path} was written by a newer version of vibench. Nothing was changed; use that version"
        )


@contextmanager
def sentences(path: Path) -> Iterator[None]:
    """Convert database errors and invalid contents to a RecordingError."""
    try:
        yield
    except (ValueError, TypeError, LookupError) as error:  # invalid contents or missing columns
        raise RecordingError(
            f"the journal {path} has invalid contents ({str(error).splitlines()[0]}): it is damaged, or from "
            "another version. Nothing was changed; restore a copy, or move the journal away and resume"
        ) from error
    except sqlite3.Error as error:
        raise RecordingError(
            f"the journal {path} cannot be read or written ({error}). The recordings are kept; check that "
            "the disk has space and that the folder is writable, then resume"
        ) from error


class JournalPointState(StrEnum):
    """State of a point of a campaign."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    """The measurement was stopped by a person, or by the end of the program."""


@dataclass(frozen=True)
class JournalPoint:
    """One point of a campaign, as stored in the journal."""

    name: str
    measurement: Measurement
    chain: str
    added_after: str
    """Name of the point whose result requested this point; empty for points of the plan."""
    state: JournalPointState
    reason_code: ReasonCode
    reason: str
    file: str
    """File name of the last attempt, in the journal's folder; empty before the first attempt."""
    attempts: int
    is_followed_up: bool
    """Whether ``after`` was called for this point and the measurements it returned are in the journal."""
    begun_utc: str
    ended_utc: str
    """End time of the last attempt (UTC)."""
    seal: str
    """Seal (checksums) of the recording; empty if there is no recording or no seal."""


def read_journal(path: Path) -> tuple[JournalPoint, ...]:
    """Return the points in a journal without changing it; the campaign may be running.

    Raises RecordingError when the file does not exist or is not a journal.
    """
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist, or is not a file"
        raise RecordingError(f"{path} {what}; give the path of a campaign's journal.")
    with sentences(path), closing(open_read_only(path)) as connection:
        require_version(path, connection)
        return points_of(connection)


def _own_name(file: str) -> str:
    """Return ``file`` if it is a plain file name, else raise ValueError: a path may leave the folder."""
    if not re.fullmatch(r"([^/\\\0]{1,250}\.h5)?", file):
        raise ValueError(f"{file[:80]!r} is not the file name of a recording")
    return file


def points_of(connection: sqlite3.Connection) -> tuple[JournalPoint, ...]:
    """Return all points of the campaign, in the order of measurement."""
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


def journal_path(folder: Path, campaign: str) -> Path:
    """Return the path of a campaign's journal."""
    return folder / f"{campaign}{JOURNAL_SUFFIX}"


class Journal(ClosedOnLeaving):
    """Journal of one campaign, open for writing in one thread. Use it in a ``with`` statement."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    @classmethod
    def begin(cls, path: Path, campaign: Campaign, bench: BenchIdentity) -> Self:
        """Create a journal with the whole plan, in one transaction, before anything else happens."""
        points = campaign.points()
        journal = cls(path, connect(path))
        with close_on_error(journal._connection), journal._transaction() as connection:
            for statement in filter(str.strip, SCHEMA.split(";")):
                connection.execute(statement)
            facts = {
                "version": str(VERSION),
                "name": campaign.name,
                "plan_json": campaign.model_dump_json(),
                "begun_utc": _now(),
            }
            connection.executemany("INSERT INTO campaign VALUES (?, ?)", facts.items())
            connection.execute("INSERT INTO benches VALUES (?, ?)", (_now(), bench.model_dump_json()))
            journal._insert(connection, points, place=0, added_after="")
        return journal

    @classmethod
    def open(cls, path: Path) -> Self:
        """Open a journal to continue it.

        Raises RecordingError when the file is not a journal, or is of a newer version.
        """
        with close_on_error(connect(path)) as connection:
            with sentences(path):
                require_version(path, connection)
                # Add the columns that are missing in a journal of version 1, in one transaction.
                connection.execute("BEGIN IMMEDIATE")
                (version,) = connection.execute("SELECT value FROM campaign WHERE key = 'version'").fetchone()
                if int(version) < VERSION:
                    for statement in SEAL_COLUMNS:
                        connection.execute(statement)
                    connection.execute("UPDATE campaign SET value = ? WHERE key = 'version'", (str(VERSION),))
                connection.execute("COMMIT")
            return cls(path, connection)

    @property
    def campaign(self) -> Campaign:
        """The campaign's plan at the start of the campaign."""
        with sentences(self.path):
            command = "SELECT value FROM campaign WHERE key = 'plan_json'"
            (plan,) = self._connection.execute(command).fetchone()
            return Campaign.model_validate_json(plan)

    @property
    def bench(self) -> BenchIdentity:
        """The bench at the start of the campaign, or the last changed bench that was accepted."""
        command = "SELECT identity_json FROM benches ORDER BY rowid DESC"
        with sentences(self.path):
            (identity,) = self._connection.execute(command).fetchone()
            return BenchIdentity.model_validate_json(identity)

    def points(self) -> tuple[JournalPoint, ...]:
        """Return all points of the campaign, in the order of measurement."""
        with sentences(self.path):
            return points_of(self._connection)

    def accept_bench(self, bench: BenchIdentity) -> None:
        """Record that the campaign continues on another bench; earlier benches stay in the journal."""
        with self._transaction() as connection:
            connection.execute("INSERT INTO benches VALUES (?, ?)", (_now(), bench.model_dump_json()))

    def start(self, name: str, file: str) -> None:
        """Record the start of an attempt at a point, before any signal is played."""
        with self._transaction() as connection:
            code = ReasonCode.RUNNING
            _set(connection, name, state=JournalPointState.RUNNING, why=code, reason="", file=file, seal="")
            connection.execute(
                "INSERT INTO attempts SELECT ?, COUNT(*) + 1, ?, 'running', ?, '', ?, '', '' FROM attempts "
                "WHERE name = ?",
                (name, file, code, _now(), name),
            )

    def end(
        self, name: str, state: JournalPointState, reason_code: ReasonCode, reason: str, seal: str = ""
    ) -> None:
        """Record the result of the running attempt, and the seal of its recording."""
        with self._transaction() as connection:
            _set(connection, name, state=state, why=reason_code, reason=reason, seal=seal)
            connection.execute(
                "UPDATE attempts SET state = ?, why = ?, reason = ?, ended_utc = ?, seal = ? "
                "WHERE name = ? AND state = 'running'",
                (state, reason_code, reason, _now(), seal, name),
            )

    def requeue(self, name: str, reason_code: ReasonCode, reason: str) -> None:
        """Queue a point again because its recording is missing or damaged."""
        with self._transaction() as connection:
            _set(connection, name, state=JournalPointState.QUEUED, why=reason_code, reason=reason)

    def keep(self, name: str, file: str, seal: str) -> None:
        """Mark a point as done because its complete recording ``file`` is already in the folder."""
        with self._transaction() as connection:
            done, code = JournalPointState.DONE, ReasonCode.FOUND
            _set(connection, name, state=done, why=code, reason="complete before", file=file, seal=seal)

    def follow_up(self, name: str, further: Sequence[Point] = ()) -> None:
        """In one transaction, add measurements requested after a point, and mark the point as followed up."""
        with self._transaction() as connection:
            (place,) = connection.execute("SELECT place FROM points WHERE name = ?", (name,)).fetchone()
            connection.execute("UPDATE points SET place = place + ? WHERE place > ?", (len(further), place))
            self._insert(connection, further, place + 1, added_after=name)
            _set(connection, name, is_followed_up=1)

    def close(self) -> None:
        """Close the journal. May be called at any time."""
        self._connection.close()

    def _insert(
        self, connection: sqlite3.Connection, points: Sequence[Point], place: int, added_after: str
    ) -> None:
        try:
            connection.executemany(
                "INSERT INTO points VALUES (?, ?, ?, ?, ?, 'queued', ?, '', '', 0, '')",
                (
                    (
                        each.name,
                        number,
                        each.measurement.model_dump_json(),
                        each.chain,
                        added_after,
                        ReasonCode.NOT_YET,
                    )
                    for number, each in enumerate(points, start=place)
                ),
            )
        except sqlite3.IntegrityError as error:
            names = ", ".join(repr(each.name) for each in points)
            raise RecordingError(
                f"{added_after!r} adds {names}, but the campaign already has a point of that name. "
                "Nothing was overwritten; give every added measurement a new name"
            ) from error

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with sentences(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:  # SQLite itself rolls back after a disk error
                    self._connection.execute("ROLLBACK")
                raise


def _set(connection: sqlite3.Connection, name: str, **columns: str | int) -> None:
    assigned = ", ".join(f"{column} = ?" for column in columns)
    command = f"UPDATE points SET {assigned} WHERE name = ?"  # noqa: S608 - names of columns
    connection.execute(command, (*columns.values(), name))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
