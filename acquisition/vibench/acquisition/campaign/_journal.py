"""A campaign's journal on disk: every point's state, committed before and after each thing that is done.

SQLite in WAL mode with full synchronisation: a transaction that has returned survives a kill and a power
cut, and one that has not leaves no trace. So at any moment the journal is right, or says ``running``
of the one point that was under way.
"""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from ..errors import RecordingError
from ..host.closed_on_leaving import ClosedOnLeaving
from ..plan import Campaign, Point
from ..recording import JOURNAL_SUFFIX, closed_on_error
from ._bench_identity import BenchIdentity
from ._journal_database import (
    SCHEMA,
    VERSION,
    brought_up,
    connected,
    require_version,
    sentences,
)
from ._journal_point import JournalPoint, JournalPointState, points_of
from ._point_outcome import ReasonCode


def journal_path(folder: Path, campaign: str) -> Path:
    """Where the journal of a campaign lies."""
    return folder / f"{campaign}{JOURNAL_SUFFIX}"


class Journal(ClosedOnLeaving):
    """The journal of one campaign, open for writing; belongs to one thread. Use it in a ``with``."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    @classmethod
    def begin(cls, path: Path, campaign: Campaign, bench: BenchIdentity) -> Self:
        """Write down the whole plan, in one transaction, before anything is done."""
        points = campaign.points()
        journal = cls(path, connected(path))
        with closed_on_error(journal._connection), journal._transaction() as connection:
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
        """Open a journal to go on with it.

        Raises RecordingError when the file is no journal, or of a newer version.
        """
        with closed_on_error(connected(path)) as connection:
            with sentences(path):
                require_version(path, connection)
                brought_up(connection)
            return cls(path, connection)

    @property
    def campaign(self) -> Campaign:
        """The plan it was begun with."""
        with sentences(self.path):
            return Campaign.model_validate_json(self._fact("plan_json"))

    @property
    def bench(self) -> BenchIdentity:
        """The bench it was begun on, or the one accepted since."""
        command = "SELECT identity_json FROM benches ORDER BY rowid DESC"
        with sentences(self.path):
            (identity,) = self._connection.execute(command).fetchone()
            return BenchIdentity.model_validate_json(identity)

    def points(self) -> tuple[JournalPoint, ...]:
        """Every point, in the order in which they are made."""
        with sentences(self.path):
            return points_of(self._connection)

    def accept_bench(self, bench: BenchIdentity) -> None:
        """Go on with another bench; the earlier ones stay on record."""
        with self._transaction() as connection:
            connection.execute("INSERT INTO benches VALUES (?, ?)", (_now(), bench.model_dump_json()))

    def start(self, name: str, file: str) -> None:
        """Say that an attempt begins, before anything plays."""
        with self._transaction() as connection:
            _set(connection, name, JournalPointState.RUNNING, ReasonCode.RUNNING, "")
            connection.execute("UPDATE points SET file = ?, seal = '' WHERE name = ?", (file, name))
            connection.execute(
                "INSERT INTO attempts SELECT ?, COUNT(*) + 1, ?, 'running', ?, '', ?, '', '' FROM attempts "
                "WHERE name = ?",
                (name, file, ReasonCode.RUNNING, _now(), name),
            )

    def end(
        self, name: str, state: JournalPointState, reason_code: ReasonCode, reason: str, seal: str = ""
    ) -> None:
        """Say how the running attempt came out, and how its recording is sealed."""
        with self._transaction() as connection:
            _set(connection, name, state, reason_code, reason)
            connection.execute("UPDATE points SET seal = ? WHERE name = ?", (seal, name))
            connection.execute(
                "UPDATE attempts SET state = ?, why = ?, reason = ?, ended_utc = ?, seal = ? "
                "WHERE name = ? AND state = 'running'",
                (state, reason_code, reason, _now(), seal, name),
            )

    def requeue(self, name: str, reason_code: ReasonCode, reason: str) -> None:
        """Put a point back, whose recording is not there after all."""
        with self._transaction() as connection:
            _set(connection, name, JournalPointState.QUEUED, reason_code, reason)

    def keep(self, name: str, file: str, seal: str) -> None:
        """Count a recording that lies in the folder already."""
        with self._transaction() as connection:
            _set(connection, name, JournalPointState.DONE, ReasonCode.FOUND, "complete before")
            connection.execute("UPDATE points SET file = ?, seal = ? WHERE name = ?", (file, seal, name))

    def follow_up(self, name: str, further: Sequence[Point] = ()) -> None:
        """Put what a result asks for behind it, and note that it has been asked; both or neither."""
        with self._transaction() as connection:
            (place,) = connection.execute("SELECT place FROM points WHERE name = ?", (name,)).fetchone()
            connection.execute("UPDATE points SET place = place + ? WHERE place > ?", (len(further), place))
            self._insert(connection, further, place + 1, added_after=name)
            connection.execute("UPDATE points SET is_followed_up = 1 WHERE name = ?", (name,))

    def close(self) -> None:
        """Let go of the file. Legal at any time."""
        self._connection.close()

    def _fact(self, key: str) -> str:
        (value,) = self._connection.execute("SELECT value FROM campaign WHERE key = ?", (key,)).fetchone()
        return str(value)

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
                f"{added_after!r} asks for {names}, and such a point stands in the campaign already. "
                "Nothing was recorded over it; give every further measurement a name of its own"
            ) from error

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with sentences(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield self._connection
            except BaseException:
                self._connection.execute("ROLLBACK")
                raise
            self._connection.execute("COMMIT")


def _set(
    connection: sqlite3.Connection, name: str, state: JournalPointState, code: ReasonCode, reason: str
) -> None:
    command = "UPDATE points SET state = ?, why = ?, reason = ? WHERE name = ?"
    connection.execute(command, (state, code, reason, name))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
